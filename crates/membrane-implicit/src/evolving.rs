//! The paper's evolving method (section 3.2): integrates the moving membrane until its forces balance.

use std::convert::Infallible;
use std::ops::ControlFlow;

use membrane_newton::{DiscreteMembrane, Measure, Membrane, MembraneError};

use crate::body::Body;
use crate::error::{ImplicitError, Result, positive};
use crate::load::Load;
use crate::motion::Motion;
use crate::report::{Evolution, Frame};
use crate::scheme::{Jacobian, Scheme};

/// Options of [`evolve`]; the defaults are those of the paper where it specifies them.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct EvolvingOptions {
    /// Time step; default 2. From about 2 (mass 1) the norm of the forces falls at every step; below about 0.5 it oscillates like a wave.
    pub dt: f64,
    /// Mass per unit s, over the largest stiffness lambda + 4 lambda_2; default 1.
    pub mass: f64,
    /// Damping mu per unit s, over the largest stiffness, so that steps do not depend on the unit of force; default 1.
    pub damping: f64,
    /// Stop when the norm of F_p + F_e over s, (integral of |F_p + F_e|^2 ds)^(1/2), is at most this fraction of the norm before the first
    /// step, which is that of F_p in the reference configuration; default 4e-6. The norm does not grow with the number of nodes.
    pub tolerance: f64,
    /// Largest number of steps; default 10 000.
    pub max_steps: usize,
    /// Which derivative of the pressure force the linearised step uses; default [`Jacobian::Band`].
    pub jacobian: Jacobian,
    /// Store a frame every this many steps (and the first and the last); 0 stores none. Default 1.
    pub frame_every: usize,
}

impl Default for EvolvingOptions {
    fn default() -> Self {
        Self {
            dt: 2.0,
            mass: 1.0,
            damping: 1.0,
            tolerance: 4e-6,
            max_steps: 10_000,
            jacobian: Jacobian::Band,
            frame_every: 1,
        }
    }
}

/// Declares methods that return the options with another value of one field.
macro_rules! setters {
    ($($(#[$doc:meta])* $with:ident($field:ident: $type:ty);)*) => {$(
        $(#[$doc])*
        #[must_use]
        pub fn $with(mut self, $field: $type) -> Self {
            self.$field = $field;
            self
        }
    )*};
}

impl EvolvingOptions {
    setters! {
        /// Sets the time step.
        with_dt(dt: f64);
        /// Sets the mass per unit s, over the largest stiffness.
        with_mass(mass: f64);
        /// Sets the damping mu per unit s, over the largest stiffness.
        with_damping(damping: f64);
        /// Sets the tolerance on the norm of the forces, relative to that before the first step.
        with_tolerance(tolerance: f64);
        /// Sets the largest number of steps.
        with_max_steps(max_steps: usize);
        /// Sets the derivative of the pressure force.
        with_jacobian(jacobian: Jacobian);
        /// Sets the number of steps between frames; 0 stores none.
        with_frame_every(frame_every: usize);
    }
}

impl Evolution {
    /// Largest distance between a node and its counterpart in `points`, cm.
    ///
    /// # Errors
    /// [`MembraneError::WrongLength`] if the numbers of points and nodes differ.
    pub fn distance_to(&self, points: &[[f64; 2]]) -> Result<f64> {
        MembraneError::length("points to compare with", points.len(), self.points.len())?;
        let pairs = self.points.iter().zip(points);
        Ok(pairs
            .map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]))
            .fold(0.0, f64::max))
    }
}

/// Inflates `membrane` from zero velocity by a total force (Eq. 4) until the forces balance, by the paper's scheme: at every step
///
/// ```text
/// (I (m + dt mu) - dt^2 (K + dF_p/dc)) v+ = m v + dt (F_e(c) + F_p(c))       c+ = c + dt v+
/// ```
///
/// with K = dF_e/dc of first and second neighbours (Rohmer et al. 2006, Eq. 24-29, with their
/// misprints corrected). One band factorisation a step, O(N). Mass m and damping mu are those of the options times the largest stiffness.
///
/// ```
/// use membrane_implicit::{EvolvingOptions, Membrane, ReferenceShape, evolve};
/// let membrane = Membrane::new(ReferenceShape::balloon(8.5, 1.75)?);
/// let evolution = evolve(&membrane, 201, 2588.9, &EvolvingOptions::default())?;
/// assert!(evolution.residual() <= 4e-6 * evolution.norms[0] && evolution.is_monotone());
/// assert!((evolution.intensity - 17.48).abs() < 0.01);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`ImplicitError::NotSettled`], with the evolution, if the norm is above the tolerance after `max_steps`;
/// [`ImplicitError::Collapsed`] if the equilibrium encloses no body. Options out of range, a membrane that cannot be discretised, a step that cannot
/// be made; [`MembraneError::OutOfRange`] for forces whose norm is not finite.
pub fn evolve(
    membrane: &Membrane,
    n_nodes: usize,
    total_force: f64,
    options: &EvolvingOptions,
) -> Result<Evolution> {
    let never = |_, _| ControlFlow::<Infallible>::Continue(());
    match evolve_observed(membrane, n_nodes, total_force, options, never)? {
        ControlFlow::Continue(evolution) => Ok(evolution),
        ControlFlow::Break(never) => match never {},
    }
}

/// As [`evolve`], with a callback `observe` for the number of steps and the norm of the forces before the first step and after each,
/// which can stop the run by a value.
///
/// # Errors
/// As [`evolve`].
pub fn evolve_observed<B>(
    membrane: &Membrane,
    n_nodes: usize,
    total_force: f64,
    options: &EvolvingOptions,
    mut observe: impl FnMut(usize, f64) -> ControlFlow<B>,
) -> Result<ControlFlow<B, Evolution>> {
    positive("time step", options.dt)?;
    MembraneError::within("tolerance", options.tolerance, 0.0, f64::MAX)?;
    MembraneError::within("total force", total_force, f64::MIN, f64::MAX)?;
    positive("mass", options.mass)?;
    MembraneError::within("damping", options.damping, 0.0, f64::MAX)?;
    let body = Body::springs(membrane, n_nodes)?;
    let stiffness = body.discrete.stiffness_scale();
    let body = body
        .with_mass(options.mass * stiffness)?
        .with_damping(options.damping * stiffness)?;
    let load = Load::total_force(move |_| total_force);
    let mut motion =
        Motion::new(body, load, Scheme::SemiImplicitEuler)?.with_jacobian(options.jacobian);
    let norm_of = |motion: &mut Motion| -> Result<f64> {
        let norm = motion.norms()?.0;
        Ok(MembraneError::within(
            "norm of the forces",
            norm,
            0.0,
            f64::MAX,
        )?)
    };
    let mut norms = vec![norm_of(&mut motion)?];
    let mut frames = Vec::new();
    let settled = options.tolerance * norms[0];
    let mut converged = norms[0] <= settled;
    loop {
        let steps = norms.len() - 1;
        if let ControlFlow::Break(value) = observe(steps, norms[steps]) {
            return Ok(ControlFlow::Break(value));
        }
        let last = converged || steps >= options.max_steps;
        if options.frame_every > 0 && (last || steps.is_multiple_of(options.frame_every)) {
            frames.push(frame(&motion, steps)?);
        }
        if last {
            break;
        }
        motion.step(options.dt)?;
        let norm = norm_of(&mut motion)?;
        converged = norm <= settled;
        norms.push(norm);
    }
    let evolution = Evolution {
        steps: norms.len() - 1,
        norms,
        frames,
        points: motion.state().points.to_vec(),
        intensity: total_force / Measure::Surface.of(motion.state().points),
        work: motion.work(),
    };
    if converged {
        let now = motion.state();
        (motion.body()).check_walls(now.points.as_flattened(), now.time, &mut Vec::new())?;
        Ok(ControlFlow::Continue(evolution))
    } else {
        let evolution = Box::new(evolution);
        Err(ImplicitError::NotSettled { evolution })
    }
}

fn frame(motion: &Motion, step: usize) -> Result<Frame> {
    let (now, body) = (motion.state(), motion.body());
    let mut elastic = vec![[0.0; 2]; now.points.len()];
    let mut pressure = elastic.clone();
    let nodes = now.points.as_flattened();
    body.discrete
        .elastic_force_into(nodes, elastic.as_flattened_mut());
    let out = pressure.as_flattened_mut();
    body.pressure_into(now.time, nodes, now.intensity, out)?;
    Ok(Frame {
        step,
        time: now.time,
        points: now.points.to_vec(),
        elastic,
        pressure,
    })
}
