//! Stability of equilibria of rubber: number of growing modes, and the lowest eigenvalue.

use membrane_forces::{DiscreteMembrane, Material, MembraneError, Tangent};

use crate::border::{Border, dot};
use crate::constraint::Control;
use crate::equilibrium::Equilibrium;
use crate::error::{NewtonError, Result};
use crate::factors::Factors;
use crate::inertia;
use crate::options::NewtonOptions;
use crate::solver::Solver;

/// Stability of an equilibrium of rubber against axisymmetric, mirror-symmetric changes of its shape.
///
/// Eigenvalues lambda are those of K x = lambda M x, with K the second derivative of the energy by the nodes and M the mass matrix at
/// density 1: squares of the angular frequencies of free vibrations, times the density; negative for a mode that grows.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Stability {
    /// At constant pressure. Past the limit point of the pressure one mode grows.
    pub at_pressure: Modes,
    /// At constant volume. A growing mode is a bulge.
    pub at_volume: Modes,
}

/// Modes of an equilibrium at a constant pressure or volume.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Modes {
    /// Number of negative eigenvalues; exact, except that eigenvalues nearer to zero than 1e-9 of the shear modulus over the square of the
    /// curve's length count as zero.
    pub unstable: usize,
    /// Lowest eigenvalue, to some 1e-10 of itself, or to rounding of K where that is more.
    pub lowest: f64,
}

/// The quantity that is constant while the membrane moves.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Constant {
    Pressure,
    Volume,
}

impl Equilibrium {
    /// Computes the stability. The signs of pivots give the counts (Sylvester's law of inertia); counts bracket the lowest eigenvalue, and
    /// inverse iteration from below computes it, so that no lower one is missed. Cost about 40 factorisations.
    ///
    /// ```
    /// use membrane_newton::{Control, Discretisation, Membrane, NewtonOptions, ReferenceShape, Solver};
    /// use membrane_newton::{Rubber, StrainEnergy, Thickness};
    /// let rubber = Rubber::new(StrainEnergy::NeoHookean { mu: 1.0 }, Thickness::UNIT)?;
    /// let disc = Membrane::new(ReferenceShape::disc(1.0)?).with_rubber(rubber);
    /// let solver = Solver::new(&disc, Discretisation::Spectral { degree: 16, per_piece: 1 })?;
    /// // past its limit point a disc is unstable at constant pressure, but stable at constant volume
    /// let past = solver.solve(Control::Volume(8.0), &NewtonOptions::default())?.stability()?;
    /// assert_eq!((past.at_pressure.unstable, past.at_volume.unstable), (1, 0));
    /// assert!(past.at_pressure.lowest < 0.0 && past.at_volume.lowest > 0.0);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`MembraneError::OtherMaterial`] for springs; [`NewtonError::Unsettled`] if the eigenvalue is within rounding.
    pub fn stability(&self) -> Result<Stability> {
        // the smallest states of a slack sheet have no strains; strains and eigenvalues scale with the square of the volume
        let (smallest, volume) = (self.resolution.smallest_volume(), self.measures.volume);
        if volume != 0.0 && volume.abs() < smallest {
            let resolution = self.resolution.clone();
            let larger = Control::Volume(2.0 * smallest);
            let larger = Solver { resolution }.solve(larger, &NewtonOptions::default())?;
            let mut larger = larger.stability()?;
            for modes in [&mut larger.at_pressure, &mut larger.at_volume] {
                modes.lowest *= (0.5 * volume / smallest).powi(2);
            }
            return Ok(larger);
        }
        let mut pencil = Pencil::new(self)?;
        Ok(Stability {
            at_pressure: pencil.modes(Constant::Pressure)?,
            at_volume: pencil.modes(Constant::Volume)?,
        })
    }
}

/// K and M of an equilibrium.
struct Pencil<'a> {
    discrete: &'a dyn DiscreteMembrane,
    /// -K.
    tangent: Tangent,
    mass: Tangent,
    /// -(K - shift M), then its factors.
    shifted: Tangent,
    factors: Factors,
    /// The gradient of the volume.
    border: Border,
    /// Order of magnitude of the eigenvalues.
    scale: f64,
}

/// Widths of the bracket, over its eigenvalue, at which inverse iteration starts; the next one if it does not converge.
const WIDTHS: [f64; 3] = [1e-2, 1e-4, 1e-6];
/// Eigenvalues below this fraction of the scale count as zero.
const ZERO: f64 = 1e-10;
/// Relative change of the eigenvalue at which inverse iteration ends.
const SETTLED: f64 = 1e-12;

impl<'a> Pencil<'a> {
    fn new(equilibrium: &'a Equilibrium) -> Result<Self> {
        let discrete = &*equilibrium.resolution.discrete;
        let modulus = match equilibrium.membrane().material() {
            Material::Rubber(rubber) => rubber.energy().shear_modulus(),
            Material::Springs { .. } => {
                let (what, needs) = ("stability", "rubber");
                return Err(MembraneError::OtherMaterial { what, needs }.into());
            }
        };
        let (nodes, pressure) = (equilibrium.nodes(), equilibrium.intensity);
        let (mut tangent, mut mass) = (discrete.tangent(), discrete.tangent());
        discrete.add_mass_into(1.0, &mut mass)?;
        discrete.tangent_into(nodes, pressure, &mut tangent)?;
        let mut border = Border::new(nodes.len());
        let (column, row) = border.column_and_row_mut();
        discrete.pressure_force_into(nodes, 1.0, column)?;
        row.copy_from_slice(column);
        Ok(Self {
            discrete,
            shifted: tangent.clone(),
            factors: Factors::new(discrete),
            border,
            tangent,
            mass,
            scale: modulus / equilibrium.measures.length.powi(2),
        })
    }

    /// Factors -(K - `shift` M) with the volume as border.
    fn factor(&mut self, shift: f64) -> Result<()> {
        self.shifted.clone_from(&self.tangent);
        self.discrete.add_mass_into(shift, &mut self.shifted)?;
        self.factors.factor_tangent(&self.shifted)?;
        let factors = &mut self.factors;
        let border = &mut self.border;
        border.eliminate(0.0, |column| factors.solve_in_place(column))
    }

    /// Counts the eigenvalues below `shift`, including those indistinguishable from it.
    fn count(&mut self, constant: Constant, shift: f64) -> Result<usize> {
        for (k, side) in [0.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0]
            .into_iter()
            .enumerate()
        {
            let near = shift + side * ZERO * (self.scale + 20f64.powi(k as i32) * shift.abs());
            if self.factor(near).is_err() {
                continue;
            }
            // g.(K - shift M)^-1 g > 0 removes one of them at constant volume
            let within = match constant {
                Constant::Pressure => 0,
                Constant::Volume => usize::from(self.border.sign() < 0.0),
            };
            if let Some(count) = inertia::positive(self.discrete, &mut self.shifted) {
                return Ok(count.saturating_sub(within));
            }
        }
        Err(NewtonError::Unsettled { eigenvalue: shift })
    }

    fn modes(&mut self, constant: Constant) -> Result<Modes> {
        let unstable = self.count(constant, -ZERO * self.scale)?;
        // the lowest eigenvalue is in (low, high]
        let (mut low, mut high) = (-ZERO * self.scale, self.scale);
        if unstable > 0 {
            (low, high) = (-self.scale, low);
            while self.count(constant, low)? > 0 {
                (low, high) = (4.0 * low, low);
            }
        } else {
            while self.count(constant, high)? == 0 {
                (low, high) = (high, 4.0 * high);
                if !high.is_finite() {
                    return Err(NewtonError::Unsettled { eigenvalue: low });
                }
            }
        }
        for width in WIDTHS {
            while high - low > width * low.abs().max(high.abs()).max(ZERO * self.scale) {
                let middle = 0.5 * (low + high);
                if self.count(constant, middle)? > 0 {
                    high = middle;
                } else {
                    low = middle;
                }
            }
            if let Some(lowest) = self.nearest(constant, low - 0.1 * (high - low))?
                && lowest > low - (high - low)
                && lowest < high + (high - low)
            {
                return Ok(Modes { unstable, lowest });
            }
        }
        Err(NewtonError::Unsettled { eigenvalue: high })
    }

    /// Returns the lowest eigenvalue, by inverse iteration with a `shift` below all of them; `None` if it does not converge.
    fn nearest(&mut self, constant: Constant, shift: f64) -> Result<Option<f64>> {
        self.factor(shift)?;
        let n = self.discrete.start().len();
        let mut x: Vec<f64> = (0..n).map(|i| 1.0 + (i as f64).sin()).collect();
        let mut momentum = vec![0.0; n];
        let mut eigenvalue = f64::INFINITY;
        for _ in 0..ITERATIONS {
            for &held in self.discrete.fixed() {
                x[held] = 0.0;
            }
            // zero in the rows of fixed numbers
            self.mass.mul_into(&x, &mut momentum);
            let scale = 1.0 / dot(&momentum, &x).sqrt();
            momentum.iter_mut().for_each(|m| *m *= scale);
            // (K - shift M) x = M x; the factored matrix has the opposite sign
            x.iter_mut().zip(&momentum).for_each(|(x, m)| *x = -m);
            self.factors.solve_in_place(&mut x)?;
            match constant {
                Constant::Pressure => (),
                Constant::Volume => drop(self.border.correct(&mut x, 0.0)?),
            }
            let found = shift + 1.0 / dot(&momentum, &x);
            if (found - eigenvalue).abs() <= SETTLED * found.abs().max(ZERO * self.scale) {
                return Ok(Some(found));
            }
            eigenvalue = found;
        }
        Ok(None)
    }
}

const ITERATIONS: usize = 60;
