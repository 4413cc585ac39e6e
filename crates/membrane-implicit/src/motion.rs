//! The motion of a membrane, or of a pair with an incompressible wall.

mod adaptive;
mod run;

use membrane_newton::membrane_forces::Material;
use membrane_newton::{DiscreteMembrane, Measure, MembraneError, Pair, PressureLaw, Stiffness};

use crate::body::{Body, FARTHEST};
use crate::constraint::{Constraint, check_support, derivatives};
use crate::error::{ImplicitError, Result};
use crate::kinematics::Kinematics;
use crate::load::Load;
use crate::mover::Mover;
use crate::report::{Energy, Work};
use crate::scheme::{Jacobian, LoadKind, Scheme};
pub use adaptive::Tolerance;
pub use run::{Stop, TimeStep};

/// An initial-value problem and its current state.
///
/// All memory is allocated here. A step costs O(N) and allocates nothing, except for the first adaptive step, whose error estimate uses
/// step doubling.
///
/// ```
/// use membrane_implicit::{Load, Membrane, Motion, Body, ReferenceShape, Scheme, Stop, TimeStep};
/// let membrane = Membrane::new(ReferenceShape::balloon(8.5, 1.75)?);
/// let body = Body::springs(&membrane, 101)?.with_damping(1.0)?;
/// let mut motion = Motion::new(body, Load::intensity(|_| 17.5), Scheme::TrBdf2)?;
/// motion.run(TimeStep::Fixed(0.002), &[Stop::Time(0.5)])?;
/// assert!((motion.state().points[50][0] - 10.839353).abs() < 1e-3);
/// assert!(motion.energy().imbalance().abs() < 1e-9 * motion.energy().pressure_work);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[doc(alias = "time integration", alias = "ode")]
#[derive(Debug, Clone)]
pub struct Motion {
    load: Load,
    inner: Mover,
    /// The outer membrane of a pair, whose volume follows that of the inner one.
    outer: Option<Mover>,
    wall_volume: f64,
    next_dt: Option<f64>,
    initial: f64,
}

/// Largest number of load values per step: those of the eleven drifts.
const MAX_CONSTRAINTS: usize = 11;

/// A membrane at the current time.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct State<'a> {
    /// Time.
    pub time: f64,
    /// Nodes [x, y] from s = 0 to s = 1, cm; for rubber those up to the axis, of which `Measures::of` is half (see [`Measure`]).
    pub points: &'a [[f64; 2]],
    /// Velocity of each node.
    pub velocities: &'a [[f64; 2]],
    /// Force intensity f or p of the membrane's [`PressureLaw`]; for a volume prescribed under [`Scheme::Midpoint`] its average over the
    /// last step. Only under [`PressureLaw::PerCurrentLength`] and for rubber it is a pressure; f is a force per unit s. See
    /// [`State::pressure`].
    pub intensity: f64,
    law: PressureLaw,
    /// Number of times that the curve through the points covers the body.
    copies: f64,
}

impl State<'_> {
    /// Enclosed volume of revolution, cm^3.
    #[must_use]
    pub fn volume(&self) -> f64 {
        self.copies * Measure::Volume.of(self.points)
    }

    /// dV/dt, cm^3/s.
    #[must_use]
    pub fn volume_rate(&self) -> f64 {
        let rate = Measure::Volume.rate(self.points, self.velocities);
        self.copies * rate.unwrap_or(f64::NAN)
    }

    /// Pressure across the membrane (inside minus outside), force per current area, in the unit of the stiffness, for rubber of the modulus
    /// (kPa). Under the law per current length it is the intensity; the other laws distribute the force evenly over the material, and the
    /// pressure is the average over the curve, intensity over current length ([`PressureLaw::mean_pressure`]).
    #[must_use]
    pub fn pressure(&self) -> f64 {
        let length = Measure::Length.of(self.points);
        self.law.mean_pressure(self.intensity, length)
    }
}

impl Motion {
    /// Starts a membrane at zero velocity in its initial shape at t = 0.
    ///
    /// # Errors
    /// The load has no finite value at t = 0, or prescribes a volume other than that of the membrane;
    /// [`ImplicitError::VolumeRateMismatch`]: under [`Scheme::Midpoint`] it prescribes a flow at t = 0; the scheme does not support the load or
    /// the material ([`Scheme`]), and no scheme an intensity or a feedback under [`PressureLaw::TotalForce`].
    pub fn new(body: Body, load: Load, scheme: Scheme) -> Result<Self> {
        check_support(scheme, load.kind(), &body)?;
        let inner = Mover::new(body, scheme, load.kind());
        let mut motion = Self {
            load,
            inner,
            outer: None,
            wall_volume: 0.0,
            next_dt: None,
            initial: 0.0,
        };
        motion.start()?;
        Ok(motion)
    }

    /// Starts two membranes at zero velocity. `load` inflates the inner one; the outer one encloses the volume of the inner one and of the wall,
    /// which is constant (incompressible wall). The corresponding load on the outer membrane is an unknown of each step.
    ///
    /// # Errors
    /// As [`Motion::new`]; a splitting; [`ImplicitError::Pair`]: membranes that [`Pair::check`] rejects.
    pub fn pair(inner: Body, outer: Body, load: Load, scheme: Scheme) -> Result<Self> {
        check_support(scheme, LoadKind::Volume, &outer)?;
        let wall_volume =
            Pair::check(&inner.discrete, &outer.discrete).map_err(ImplicitError::Pair)?;
        let mut motion = Self::new(inner, load, scheme)?;
        motion.outer = Some(Mover::new(outer, scheme, LoadKind::Volume));
        motion.wall_volume = wall_volume;
        motion.start()?;
        Ok(motion)
    }

    /// Sets the derivative of the pressure force; the default is [`Jacobian::Exact`].
    #[must_use]
    pub fn with_jacobian(mut self, jacobian: Jacobian) -> Self {
        self.movers_mut().for_each(|m| m.set_jacobian(jacobian));
        self
    }

    /// Replaces the load from the current time; state and energy account are kept. The shape within the last step is then no longer
    /// available.
    ///
    /// ```
    /// # use membrane_implicit::{Body, Load, Membrane, Motion, ReferenceShape, Scheme, Stop, TimeStep};
    /// # let body = Body::springs(&Membrane::new(ReferenceShape::balloon(8.5, 1.75)?), 51)?.with_damping(1.0)?;
    /// let mut motion = Motion::new(body, Load::intensity(|_| 17.5), Scheme::TrBdf2)?;
    /// motion.run(TimeStep::Fixed(0.01), &[Stop::Volume(150.0)])?;
    /// // closed there
    /// let volume = motion.state().volume();
    /// motion.set_load(Load::volume(move |_| volume))?;
    /// motion.run(TimeStep::Fixed(0.01), &[Stop::Time(1.0)])?;
    /// assert!((motion.state().volume() - volume).abs() < 1e-9);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// A volume may change its rate here, as if a valve closed: [`Load::volume`] describes the impulse.
    ///
    /// # Errors
    /// As [`Motion::new`], except for the rate of a volume; the motion is then unchanged.
    pub fn set_load(&mut self, load: Load) -> Result<()> {
        check_support(self.inner.scheme, load.kind(), &self.inner.body)?;
        let mut next = self.clone();
        next.inner.set_load(load.kind());
        next.load = load;
        if let Some(outer) = &mut next.outer {
            outer.set_load(LoadKind::Volume);
        }
        next.next_dt = None;
        next.report_state();
        next.begin()?;
        *self = next;
        Ok(())
    }

    /// Replaces the stiffness of the springs of the (inner) membrane from the current time; state, load and counters are kept. Called before
    /// every step it makes the stiffness a function of time; that of the middle of the step keeps the second order of a scheme. The energy
    /// that the change adds to the elastic energy of the shape is added to [`Energy::initial`].
    ///
    /// ```
    /// # use membrane_implicit::{Body, Load, Membrane, Motion, ReferenceShape, Scheme, Stiffness};
    /// # let body = Body::springs(&Membrane::new(ReferenceShape::balloon(8.5, 1.75)?), 51)?.with_damping(1.0)?;
    /// let mut motion = Motion::new(body, Load::intensity(|_| 17.5), Scheme::Midpoint)?;
    /// for _ in 0..100 {
    ///     let middle = motion.time() + 0.005;
    ///     motion.set_stiffness(Stiffness::constant(1.5 - 0.5 * (6.8 * middle).cos())?)?;
    ///     motion.step(0.01)?;
    /// }
    /// assert!(motion.energy().imbalance().abs() < 1e-9 * motion.energy().pressure_work);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`MembraneError::OtherMaterial`] for rubber; a stiffness that is not positive at a spring. The motion is then unchanged.
    pub fn set_stiffness(&mut self, stiffness: Stiffness) -> Result<()> {
        let body = &self.inner.body;
        let membrane = body.discrete.setting().membrane();
        if let Material::Rubber(_) = membrane.material() {
            let (what, needs) = ("stiffness", "springs");
            return Err(MembraneError::OtherMaterial { what, needs }.into());
        }
        let membrane = membrane.clone().with_stiffness(stiffness);
        let body = Body::springs(&membrane, body.discrete.n_nodes())?
            .with_mass(body.mass())?
            .with_damping(body.damping())?;
        let mut next = self.clone();
        next.inner.set_body(body);
        next.initial += next.energy().elastic - self.energy().elastic;
        next.begin()?;
        *self = next;
        Ok(())
    }

    /// Sets time, shape and velocity of a single membrane. The velocities of fixed nodes are set to zero.
    ///
    /// # Errors
    /// A pair; [`ImplicitError::FixedNode`]: fixed nodes more than 1e-9 of the length of the curve from their places; lists whose length differs from
    /// the membrane's nodes, numbers that are not finite or beyond 1e100, and as [`Motion::new`].
    pub fn with_state(
        mut self,
        time: f64,
        points: &[[f64; 2]],
        velocities: &[[f64; 2]],
    ) -> Result<Self> {
        if self.outer.is_some() {
            return Err(ImplicitError::StateOfPair);
        }
        MembraneError::within("time", time, f64::MIN, f64::MAX)?;
        let expected = self.state().points.len();
        for (what, list) in [("points", points), ("velocities", velocities)] {
            MembraneError::length(what, list.len(), expected)?;
            for value in list.as_flattened() {
                MembraneError::within(what, *value, -FARTHEST, FARTHEST)?;
            }
        }
        self.inner
            .set(time, points.as_flattened(), velocities.as_flattened())?;
        self.start()?;
        Ok(self)
    }

    /// [`Motion::begin`], with the initial energy. A scheme that does not damp an impulse needs a volume that starts at the present rate.
    fn start(&mut self) -> Result<()> {
        self.report_state();
        self.begin()?;
        let Mover { body, scheme, .. } = &self.inner;
        if self.load.kind() == LoadKind::Volume && *scheme == Scheme::Midpoint {
            let now = self.inner.now().load_state(body);
            let wave = body.wave_time();
            let [_, prescribed, _] = derivatives(&self.load, now, 1e-4 * wave)?;
            let (time, actual) = (now.time, now.volume_rate);
            // differences have a rounding error of about 1e-11, and an error of 1e-5 for 100 rad per wave
            if (prescribed - actual).abs() * wave > 1e-5 * now.volume.abs() {
                return Err(ImplicitError::VolumeRateMismatch {
                    time,
                    prescribed,
                    actual,
                });
            }
        }
        let energy = self.energy();
        self.initial = energy.kinetic + energy.elastic;
        Ok(())
    }

    /// Computes intensities and accelerations at the current time.
    fn begin(&mut self) -> Result<()> {
        let (load, inner) = (&self.load, &mut self.inner);
        let time = inner.now().time;
        let mut constraint = Constraint::of(load, time)?;
        if let Constraint::Volume(_) = constraint {
            let now = inner.now().load_state(&inner.body);
            // the step is a fraction of the membrane's shortest period
            let e = 0.1 * inner.body.largest_explicit_step();
            let ([prescribed, _, second], actual) = (derivatives(load, now, e)?, now.volume);
            if (prescribed - actual).abs() > 1e-9 * actual.abs().max(1e-9) {
                return Err(ImplicitError::VolumeMismatch {
                    time,
                    prescribed,
                    actual,
                });
            }
            constraint = Constraint::Volume(second);
        }
        inner.begin(constraint)?;
        if let Some(outer) = &mut self.outer {
            outer.begin(Constraint::Volume(inner.volume_acceleration()))?;
        }
        Ok(())
    }

    /// Returns the load.
    #[must_use]
    pub fn load(&self) -> &Load {
        &self.load
    }

    /// Returns the current time.
    #[must_use]
    pub fn time(&self) -> f64 {
        self.inner.now().time
    }

    /// Returns the state of the membrane, or of the inner one of a pair.
    #[must_use]
    pub fn state(&self) -> State<'_> {
        view(&self.inner.body, self.inner.now())
    }

    /// Returns the state of the outer membrane of a pair.
    #[must_use]
    pub fn outer(&self) -> Option<State<'_>> {
        self.outer
            .as_ref()
            .map(|outer| view(&outer.body, outer.now()))
    }

    /// Returns the (inner) body.
    #[must_use]
    pub fn body(&self) -> &Body {
        &self.inner.body
    }

    /// Returns the relative error of the wall volume of a pair: the volume between the membranes over that at the start, minus one.
    #[must_use]
    pub fn wall_volume_error(&self) -> Option<f64> {
        let wall = self.outer()?.volume() - self.state().volume();
        Some(wall / self.wall_volume - 1.0)
    }

    /// Returns the counters since the start of the motion, the sum of both membranes for a pair.
    #[must_use]
    pub fn work(&self) -> Work {
        let mut work = self.inner.work;
        if let Some(Mover { work: outer, .. }) = &self.outer {
            work.iterations += outer.iterations;
            work.factorisations += outer.factorisations;
            work.force_calls += outer.force_calls;
        }
        work
    }

    /// Returns the energy balance since the start of the motion, the sum of both membranes for a pair. Cost O(N).
    #[must_use]
    pub fn energy(&self) -> Energy {
        let mut energy = Energy {
            initial: self.initial,
            ..Energy::default()
        };
        self.movers()
            .for_each(|mover| mover.add_energy(&mut energy));
        energy
    }

    /// Returns the norms over s of F_p + F_e and of the velocity, the larger of two membranes.
    ///
    /// # Errors
    /// The neighbours of a node coincide.
    pub fn norms(&mut self) -> Result<(f64, f64)> {
        self.movers_mut()
            .try_fold((0.0, 0.0), |(force, speed), mover| {
                let (f, v) = mover.norms()?;
                Ok((f.max(force), v.max(speed)))
            })
    }

    /// Makes one step of length `dt`.
    ///
    /// # Errors
    /// A step that is not positive or that exceeds the stability limit of an explicit scheme ([`Scheme`]), the load's value, equations that
    /// cannot be solved, numbers that overflow, walls that intersect under a prescribed volume
    /// ([`ImplicitError::Collapsed`]). The state is then unchanged.
    pub fn step(&mut self, dt: f64) -> Result<()> {
        self.check_fixed(dt)?;
        self.attempt(dt)?;
        self.accept(None)
    }

    /// Makes one step, as long as `tolerance` allows but at most `most`; returns its length.
    ///
    /// # Errors
    /// As [`Motion::step`]; [`ImplicitError::StepTooSmall`].
    pub fn step_adaptive(&mut self, tolerance: &Tolerance, most: f64) -> Result<f64> {
        let dt = self.attempt_adaptive(tolerance, most)?;
        self.accept(None)?;
        Ok(dt)
    }

    /// Interpolates shape and velocity of the (inner) membrane at a time within the last step: cubic Hermite interpolation, error
    /// O(dt^4) in addition to that of the scheme. Cost O(N).
    ///
    /// # Errors
    /// A time outside the last step; [`MembraneError::WrongLength`] for slices whose length is not N.
    pub fn at_into(
        &self,
        time: f64,
        points: &mut [[f64; 2]],
        velocities: &mut [[f64; 2]],
    ) -> Result<()> {
        self.inner.at_into(time, points, velocities)
    }

    /// Rejects a fixed step that is not positive or with which an explicit scheme is unstable.
    fn check_fixed(&self, dt: f64) -> Result<()> {
        // not because of rounding: the limit is often the spacing of the nodes
        let limit = self.inner.longest_step() * (1.0 + 1e-12);
        let what = match limit.is_finite() {
            true => "time step of an explicit scheme",
            false => "time step",
        };
        MembraneError::within(what, dt, f64::MIN_POSITIVE, limit.min(f64::MAX))?;
        Ok(())
    }

    fn movers(&self) -> impl Iterator<Item = &Mover> {
        std::iter::once(&self.inner).chain(&self.outer)
    }

    fn movers_mut(&mut self) -> impl Iterator<Item = &mut Mover> {
        std::iter::once(&mut self.inner).chain(&mut self.outer)
    }

    fn attempt(&mut self, dt: f64) -> Result<()> {
        let (load, inner) = (&self.load, &mut self.inner);
        let time = inner.now().time;
        let n = inner.load_times.len();
        let mut constraints = [Constraint::Intensity(0.0); MAX_CONSTRAINTS];
        for i in 0..n {
            constraints[i] = Constraint::of(load, time + dt * inner.load_times[i])?;
        }
        inner.attempt(dt, &constraints[..n])?;
        if let Some(outer) = &mut self.outer {
            let n = outer.load_times.len();
            for (i, constraint) in constraints[..n].iter_mut().enumerate() {
                *constraint = Constraint::Volume(inner.stage_volume(i + 1) + self.wall_volume);
            }
            outer.attempt(dt, &constraints[..n])?;
        }
        Ok(())
    }

    /// Accepts the attempted step, unless walls intersect at its end, which is set to `time` if given.
    fn accept(&mut self, time: Option<f64>) -> Result<()> {
        self.movers_mut().try_for_each(Mover::check_walls)?;
        self.movers_mut().for_each(Mover::accept);
        if let Some(time) = time {
            self.inner.set_time(time);
        }
        self.report_state();
        Ok(())
    }

    /// Passes the accepted state to the load.
    fn report_state(&mut self) {
        let Mover { body, .. } = &self.inner;
        let now = self.inner.now();
        self.load.accepted(|| now.load_state(body));
    }
}

fn view<'a>(body: &Body, now: &'a Kinematics) -> State<'a> {
    State {
        time: now.time,
        points: now.nodes.as_chunks::<2>().0,
        velocities: now.velocity.as_chunks::<2>().0,
        intensity: now.intensity,
        law: body.discrete.law(),
        copies: body.copies(),
    }
}
