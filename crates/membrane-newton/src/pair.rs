//! Two membranes with incompressible wall between them, solved together.

use std::ops::Range;

use membrane_forces::{DiscreteMembrane, Material, Measure, Membrane, PressureLaw};

use crate::constraint::{Control, POSITIVE, check};
use crate::equilibrium::Equilibrium;
use crate::error::{NewtonError, Result, own};
use crate::nested::Nested;
use crate::options::NewtonOptions;
use crate::report::NewtonReport;
use crate::sensitivity::Sensitivity;
use crate::solver::Solver;

/// An inner and an outer membrane with constant volume between them.
#[derive(Debug, Clone)]
pub struct Pair {
    inner: Solver,
    outer: Solver,
}

/// Both membranes in equilibrium at the same wall volume as at the start.
///
/// [`Equilibrium::pressure`] of each membrane is the pressure across it: cavity minus wall for the inner one, wall minus outside for the
/// outer one. The control applies to the inner membrane alone, and the outer one follows its volume: a prescribed load is the pressure across
/// the inner membrane, not that of the cavity ([`PairEquilibrium::cavity_pressure`]).
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct PairEquilibrium {
    /// The inner membrane.
    pub inner: Equilibrium,
    /// The outer membrane.
    pub outer: Equilibrium,
    /// Volume between them, cm^3.
    pub wall_volume: f64,
    /// Relative departure of the wall volume from that of the start.
    pub wall_volume_error: f64,
    /// Report of the solve; the reports of `inner` and `outer` are empty.
    pub report: NewtonReport,
}

impl Pair {
    /// Joins two discretised membranes.
    ///
    /// # Errors
    /// As [`Pair::check`].
    pub fn new(inner: Solver, outer: Solver) -> Result<Self> {
        let [within, around] = [&inner, &outer].map(|solver| &*solver.resolution.discrete);
        Self::check(within, around)?;
        Ok(Self { inner, outer })
    }

    /// Returns the volume between two membranes at their starts, cm^3, if they can be a pair. Both are of one material and have intensities
    /// of one unit.
    ///
    /// Their curves must not cross. This is checked at the ends and at the apexes of the starts only; results of a pair are also checked
    /// between them ([`NewtonError::Crossed`]).
    ///
    /// # Errors
    /// [`NewtonError::MixedPair`]; [`NewtonError::NotEnclosed`].
    pub fn check(inner: &dyn DiscreteMembrane, outer: &dyn DiscreteMembrane) -> Result<f64> {
        let both = [inner, outer];
        let membranes = both.map(|discrete| discrete.setting().membrane());
        let kinds = membranes.map(kind);
        if kinds[0] != kinds[1] {
            let [inner, outer] = kinds;
            return Err(NewtonError::MixedPair { inner, outer });
        }
        let volume = |of: &dyn DiscreteMembrane| own(of.measure(Measure::Volume, of.start()));
        let wall_volume = enclosed(both.map(volume))?;
        let [within, around] = membranes.map(Membrane::ends);
        for ([x, inner], [x_outer, outer]) in within.into_iter().zip(around) {
            let (inner, outer) = (inner.abs(), outer.abs());
            if x == x_outer && inner > outer {
                let what = "distance of the end from the axis in cm";
                return Err(NewtonError::NotEnclosed { what, inner, outer });
            }
        }
        let [inner, outer] = both.map(|of| {
            let nodes = own(of.points(of.start())).into_iter();
            let middle = own(of.at(of.start(), 0.5)).position[0];
            nodes.fold(middle, |most, node| most.max(node[0]))
        });
        if inner > outer {
            let what = "largest x in cm";
            return Err(NewtonError::NotEnclosed { what, inner, outer });
        }
        Ok(wall_volume)
    }

    /// The inner membrane.
    #[must_use]
    pub fn inner(&self) -> &Solver {
        &self.inner
    }

    /// The outer membrane.
    #[must_use]
    pub fn outer(&self) -> &Solver {
        &self.outer
    }

    /// Volume between the membranes at the start, cm^3.
    #[must_use]
    pub fn wall_volume(&self) -> f64 {
        self.outer.start_measures().volume - self.inner.start_measures().volume
    }

    /// Both shapes at a volume gain of the inner membrane, from the start.
    ///
    /// # Errors
    /// As [`Solver::solve`].
    pub fn solve_gain(&self, gain: f64, options: &NewtonOptions) -> Result<PairEquilibrium> {
        self.solve(Control::VolumeGain(gain), options)
    }

    /// Both shapes under a control of the inner membrane, from the start.
    ///
    /// # Errors
    /// As [`Solver::solve`]; [`NewtonError::Crossed`].
    pub fn solve(&self, inner: Control, options: &NewtonOptions) -> Result<PairEquilibrium> {
        let nested = [&self.inner, &self.outer].map(|solver| solver.resolution.clone());
        let nested = Nested(nested.into());
        let start = nested.start_state();
        solve_both(nested, start, &[], inner, options)
    }

    /// As [`Self::solve`], from a nearby solution (warm start).
    ///
    /// # Errors
    /// As [`Solver::solve`].
    pub fn solve_from(
        &self,
        near: &PairEquilibrium,
        inner: Control,
        options: &NewtonOptions,
    ) -> Result<PairEquilibrium> {
        let near = [&near.inner, &near.outer];
        let (inside, mut start) = self.inner.resolution.state_near(near[0]);
        let (outside, state) = self.outer.resolution.state_near(near[1]);
        start.extend(state);
        solve_both(Nested(vec![inside, outside]), start, &near, inner, options)
    }
}

/// Names the material and the kind of load, which define the unit of the intensity.
fn kind(membrane: &Membrane) -> &'static str {
    match (membrane.material(), membrane.law()) {
        (Material::Rubber(_), _) => "rubber under a pressure",
        (Material::Springs { .. }, PressureLaw::PerCurrentLength) => "springs under a pressure",
        (Material::Springs { .. }, PressureLaw::PerMaterialLength | PressureLaw::TotalForce) => {
            "springs under a force per material length"
        }
    }
}

/// Returns the volume between an inner and an outer membrane, if it is positive.
fn enclosed([inner, outer]: [f64; 2]) -> Result<f64> {
    let between = outer - inner;
    if between > 0.0 {
        Ok(between)
    } else {
        let what = "volume in cm^3";
        Err(NewtonError::NotEnclosed { what, inner, outer })
    }
}

fn solve_both(
    nested: Nested,
    start: Vec<f64>,
    near: &[&Equilibrium],
    control: Control,
    options: &NewtonOptions,
) -> Result<PairEquilibrium> {
    let (nested, state, report) = nested.solve(start, near, control, options)?;
    let (inner, outer) = state.split_at(nested.0[0].discrete.start().len() + 1);
    // The report belongs to the pair.
    let inner = nested.0[0].answer(inner.to_vec(), NewtonReport::default())?;
    let outer = nested.0[1].answer(outer.to_vec(), NewtonReport::default())?;
    let pair = PairEquilibrium::of(inner, outer, nested.wall_volumes()[0])?;
    Ok(PairEquilibrium { report, ..pair })
}

/// Number of chords of the outer membrane from base to apex.
const CHORDS: usize = 64;

/// Rejects an inner membrane of which a node is outside the outer one, beyond the sagitta of the chords of the latter: at a corner of the
/// curve within a chord the distance from its middle is at least half of the largest. The nearest chord of a node is near that of the node
/// before; all chords are compared only for nodes that appear to be outside. O(nodes + `CHORDS`) if there are none.
fn check_crossing(inner: &Equilibrium, outer: &Equilibrium) -> Result<()> {
    let around = outer.resolution.places(outer.nodes());
    let s = |k: usize| 0.5 * k as f64 / CHORDS as f64;
    let corners: Vec<_> = (0..=CHORDS).map(|k| around(s(k))).collect();
    // Squared distance from a chord, and whether the point is outside of it.
    let from = |k: usize, [x, r]: [f64; 2]| {
        let ends = &corners[k..k + 2];
        let [d, p] = [ends[1], [x, r]].map(|to| [to[0] - ends[0][0], to[1] - ends[0][1]]);
        let t = ((p[0] * d[0] + p[1] * d[1]) / (d[0] * d[0] + d[1] * d[1])).clamp(0.0, 1.0);
        let square = (p[0] - t * d[0]).powi(2) + (p[1] - t * d[1]).powi(2);
        (square, p[1] * d[0] > p[0] * d[1])
    };
    let nearest = |chords: Range<usize>, point| {
        let near = chords.map(|k| (from(k, point), k));
        near.min_by(|a, b| a.0.0.total_cmp(&b.0.0))
            .unwrap_or(((f64::INFINITY, false), 0))
    };
    let least = 1e-9 * outer.measures.length;
    let mut worst: Option<(f64, [f64; 2])> = None;
    let mut chord = 0;
    for point in inner.points().into_iter().filter(|[_, r]| *r >= 0.0) {
        let next = |chord: usize| nearest(chord.saturating_sub(2)..(chord + 3).min(CHORDS), point);
        let mut found = next(chord);
        while found.1 != chord {
            chord = found.1;
            found = next(chord);
        }
        if !found.0.1 {
            continue;
        }
        let ((square, outside), k) = nearest(0..CHORDS, point);
        let (a, b, middle) = (corners[k], corners[k + 1], around(0.5 * (s(k) + s(k + 1))));
        let sagitta = (middle[0] - 0.5 * (a[0] + b[0])).hypot(middle[1] - 0.5 * (a[1] + b[1]));
        let depth = square.sqrt();
        let is_deepest = worst.is_none_or(|(most, _)| depth > most);
        if outside && depth > least.max(2.0 * sagitta) && is_deepest {
            worst = Some((depth, point));
        }
    }
    match worst {
        Some((depth, [x, r])) => Err(NewtonError::Crossed { depth, x, r }),
        None => Ok(()),
    }
}

impl PairEquilibrium {
    /// Combines two membranes that were solved separately to a pair. `wall_volume` in cm^3 is the intended volume between them, from which
    /// `wall_volume_error` of the pair is computed. The report of the pair is empty, those of the membranes are kept.
    ///
    /// # Errors
    /// [`NewtonError::NotEnclosed`]: the outer one encloses at most the volume of the inner one; [`NewtonError::Crossed`];
    /// [`MembraneError::OutOfRange`](membrane_forces::MembraneError::OutOfRange): `wall_volume` is not positive.
    pub fn of(inner: Equilibrium, outer: Equilibrium, wall_volume: f64) -> Result<Self> {
        check("wall volume", wall_volume, POSITIVE)?;
        let volumes = [&inner, &outer].map(|membrane| membrane.measures.volume);
        let between = enclosed(volumes)?;
        check_crossing(&inner, &outer)?;
        Ok(Self {
            wall_volume: between,
            wall_volume_error: between / wall_volume - 1.0,
            inner,
            outer,
            report: NewtonReport::default(),
        })
    }

    /// Pressure of the cavity above that outside the outer membrane: the sum of both [`Equilibrium::pressure`]s. It assumes a uniform pressure
    /// in the wall, that of an incompressible fluid at rest, such as the water between two balloons.
    #[must_use]
    pub fn cavity_pressure(&self) -> f64 {
        self.inner.pressure() + self.outer.pressure()
    }

    /// Derivatives of the inner and of the outer membrane by the value of the inner one's `control` at constant wall volume; see
    /// [`Equilibrium::sensitivity`].
    ///
    /// # Errors
    /// As [`Equilibrium::sensitivity`].
    pub fn sensitivity(&self, control: Control) -> Result<[Sensitivity; 2]> {
        let both = [&self.inner, &self.outer];
        let nested = Nested(both.map(|membrane| membrane.resolution.clone()).into());
        let rate = nested.rate(&both.map(|membrane| &membrane.state[..]).concat(), control)?;
        let (inner, outer) = rate.split_at(self.inner.state.len());
        Ok([
            self.inner.resolution.sensitivity(inner),
            self.outer.resolution.sensitivity(outer),
        ])
    }
}
