//! A resolution of a membrane, and the finer one to use if it does not suffice.

use std::f64::consts::{PI, TAU};
use std::sync::{Arc, OnceLock};

use membrane_forces::{
    CurvePiece, DiscreteMembrane, Material, Measure, Measures, Membrane, MembraneError,
    SpectralElements,
};

use crate::block::Block;
use crate::constraint::{Constraint, Control};
use crate::error::{NewtonError, Result, own};
use crate::route::Route;

#[derive(Debug)]
pub(crate) struct Resolution {
    pub(crate) discrete: Box<dyn DiscreteMembrane>,
    pub(crate) start: Measures,
    /// The action if the polynomials have not converged.
    pub(crate) adaptive: Option<Adaptive>,
    /// Polynomials of half the degree, whose solution is the initial value.
    pub(crate) coarse: Option<Arc<Resolution>>,
    pub(crate) profile: Sampled,
}

#[derive(Debug)]
pub(crate) struct Adaptive {
    tolerance: f64,
    level: usize,
    finer: OnceLock<Result<Arc<Resolution>, MembraneError>>,
}

/// Points per node at which the stiffness or thickness is compared with its polynomials.
const SAMPLES: usize = 4;
/// Degrees on each smooth piece; after the last one its elements split.
const DEGREES: [usize; 4] = [8, 12, 16, 24];
/// The last level has 32 elements on each smooth piece.
const LAST_LEVEL: usize = 8;

impl Resolution {
    /// Returns the first one that resolves the start.
    pub(crate) fn adaptive(membrane: &Membrane, tolerance: f64) -> Result<Arc<Self>> {
        let mut resolution = Arc::new(Self::step(membrane, tolerance, 0)?);
        while let Err(unresolved) = resolution.check_resolved(&resolution.start_state()) {
            resolution = resolution.finer().unwrap_or(Err(unresolved))?;
        }
        Ok(resolution)
    }

    fn step(membrane: &Membrane, tolerance: f64, level: usize) -> Result<Self, MembraneError> {
        let top = DEGREES.len() - 1;
        let (degree, splits) = (DEGREES[level.min(top)], level.saturating_sub(top));
        let elements = SpectralElements::new(membrane, degree, 1 << splits)?;
        let adaptive = Adaptive {
            tolerance,
            level,
            finer: OnceLock::new(),
        };
        Self::new(elements, Some(adaptive))
    }

    /// Polynomials of this degree.
    pub(crate) fn spectral(
        membrane: &Membrane,
        degree: usize,
        per_piece: usize,
    ) -> Result<Self, MembraneError> {
        let mut this = Self::new(SpectralElements::new(membrane, degree, per_piece)?, None)?;
        if let Some(coarse) = this.route().coarse_degree(degree) {
            let coarse = Self::spectral(membrane, coarse, per_piece);
            this.coarse = coarse.ok().map(Arc::new);
        }
        Ok(this)
    }

    pub(crate) fn new(
        discrete: impl DiscreteMembrane + 'static,
        adaptive: Option<Adaptive>,
    ) -> Result<Self, MembraneError> {
        let pieces = discrete.pieces(discrete.start())?;
        Ok(Self {
            start: discrete.measures(discrete.start())?.finite()?,
            profile: Sampled::new(discrete.setting().membrane(), &pieces)?,
            discrete: Box::new(discrete),
            adaptive,
            coarse: None,
        })
    }

    /// Returns the next finer one, made at the first request; `None` beyond the finest, without a tolerance, or if memory does not suffice.
    pub(crate) fn finer(&self) -> Option<Result<Arc<Self>>> {
        let adaptive = self.adaptive.as_ref().filter(|a| a.level < LAST_LEVEL)?;
        let membrane = self.discrete.setting().membrane();
        let made = || Self::step(membrane, adaptive.tolerance, adaptive.level + 1).map(Arc::new);
        match adaptive.finer.get_or_init(made).clone() {
            Err(MembraneError::TooMany { .. }) => None,
            finer => Some(finer.map_err(NewtonError::from)),
        }
    }

    /// Returns the next finer one if it was made.
    pub(crate) fn made_finer(&self) -> Option<Arc<Self>> {
        self.adaptive.as_ref()?.finer.get()?.clone().ok()
    }

    /// Returns twice the degree of the polynomials times their last two coefficients, over the length of the curve; the largest of any
    /// element. At least the error of the profile; `None` without polynomials.
    pub(crate) fn tail(&self, nodes: &[f64]) -> Option<f64> {
        let pieces = own(self.discrete.pieces(nodes));
        let scale = own(self.discrete.measure(Measure::Length, nodes));
        // The collocation error is about the tail of the derivative.
        let last_two =
            |c: &[f64]| 2.0 * c.len() as f64 * c.iter().rev().take(2).map(|c| c.abs()).sum::<f64>();
        let tails = pieces
            .iter()
            .map(|piece| last_two(&piece.x).max(last_two(&piece.y)) / scale);
        (tails.reduce(f64::max)).map(|tail| tail.max(self.profile.error))
    }

    /// Whether the polynomials of `state` have converged: their tail against the tolerance.
    pub(crate) fn check_resolved(&self, state: &[f64]) -> Result<()> {
        let Some(&Adaptive { tolerance, .. }) = self.adaptive.as_ref() else {
            return Ok(());
        };
        match self.tail(&state[..state.len() - 1]) {
            Some(tail) if tail > tolerance || tail.is_nan() => {
                Err(NewtonError::Unresolved { tail, tolerance })
            }
            Some(_) | None => Ok(()),
        }
    }

    pub(crate) fn route(&self) -> Route {
        Route::of(&*self.discrete)
    }

    pub(crate) fn constraint(&self, control: Control) -> Result<Constraint> {
        Constraint::new(control, &*self.discrete, &self.start)
    }

    pub(crate) fn system(&self, constraint: Constraint) -> Block<'_> {
        Block::new(&*self.discrete, self.start, constraint)
    }

    /// Nodes, then the force intensity.
    pub(crate) fn start_state(&self) -> Vec<f64> {
        let mut state = self.discrete.start().to_vec();
        state.push(0.0);
        state
    }

    /// Returns the position at a material coordinate; cost O(degree), or O(1) for finite differences.
    pub(crate) fn places<'a>(&'a self, nodes: &'a [f64]) -> impl Fn(f64) -> [f64; 2] + 'a {
        let pieces = own(self.discrete.pieces(nodes));
        move |s| {
            let piece = pieces.partition_point(|piece| piece.to < s);
            let at = match pieces.get(piece).or(pieces.last()) {
                Some(piece) => piece.at(s),
                None => own(self.discrete.at(nodes, s)),
            };
            at.position
        }
    }

    /// Returns the state with the curve of `state`, a state of `from`. Fixed numbers are kept.
    pub(crate) fn carry(&self, from: &Self, state: &[f64]) -> Vec<f64> {
        let (nodes, intensity) = state.split_at(state.len() - 1);
        let place = from.places(nodes);
        let start = self.discrete.start();
        let positions = self.discrete.positions().into_iter();
        let mut carried: Vec<f64> = positions.take(start.len() / 2).flat_map(place).collect();
        for &held in self.discrete.fixed() {
            carried[held] = start[held];
        }
        carried.extend(intensity);
        carried
    }
}

/// The stiffness or thickness on the polynomials of a start.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sampled {
    /// Mean relative difference from the polynomials through its values at the nodes, at [`SAMPLES`] points per node: features between the
    /// nodes change the shape by about as much.
    error: f64,
    /// Largest stiffness over the smallest one, 1 for rubber.
    pub(crate) contrast: f64,
}

impl Sampled {
    fn new(membrane: &Membrane, pieces: &[CurvePiece]) -> Result<Self, MembraneError> {
        let profile = |s: f64| match membrane.material() {
            Material::Springs { .. } => membrane.effective_stiffness(s),
            Material::Rubber(rubber) => rubber.thickness().at(s),
        };
        let (mut error, mut range) = (0.0, [f64::INFINITY, 0.0f64]);
        for piece in pieces {
            let (p, length) = (piece.x.len() - 1, piece.to - piece.from);
            // just inside, so that a jump at the end is evaluated on this side
            let at = |t: f64| {
                let s = piece.from + 0.5 * (1.0 + t) * length;
                profile(s.max(piece.from + 1e-12).min(piece.to - 1e-12))
            };
            let mut nodes = Vec::with_capacity(p + 1);
            for j in 0..=p {
                let node = -(PI * j as f64 / p as f64).cos();
                nodes.push([node, at(node)?]);
            }
            let n = SAMPLES * p;
            for k in 0..n {
                let t = (2 * k + 1) as f64 / n as f64 - 1.0;
                let exact = at(t)?;
                range = [range[0].min(exact), range[1].max(exact)];
                error += (interpolated(&nodes, t) - exact).abs() / exact * length / n as f64;
            }
        }
        Ok(Self {
            error,
            contrast: match membrane.material() {
                Material::Springs { .. } if !pieces.is_empty() => range[1] / range[0],
                _ => 1.0,
            },
        })
    }
}

/// Returns the polynomial through values at Chebyshev-Lobatto nodes, at another point: the barycentric formula (Berrut & Trefethen, SIAM Review 46
/// (2004) 501, doi:10.1137/S0036144502417715).
fn interpolated(nodes: &[[f64; 2]], t: f64) -> f64 {
    let (mut above, mut below) = (0.0, 0.0);
    for (j, [node, value]) in nodes.iter().enumerate() {
        let sign = if j % 2 == 0 { 1.0 } else { -1.0 };
        let end = if j == 0 || j + 1 == nodes.len() {
            0.5
        } else {
            1.0
        };
        let weight = sign * end / (t - node);
        above += weight * value;
        below += weight;
    }
    above / below
}

/// Volume swept by a shell of the size of the start that moves by its radius.
pub(crate) fn swept_by_radius(start: &Measures) -> f64 {
    start.surface * start.length / TAU
}

/// Volume swept by the start if each of its points moves by its mean distance from the axis, surface over pi times length.
pub(crate) fn swept_by_mean_radius(start: &Measures) -> f64 {
    start.surface * start.surface / (PI * start.length)
}
