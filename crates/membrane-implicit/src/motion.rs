//! A membrane, or a pair with incompressible wall, carried through time.

mod adaptive;
mod run;

use membrane_newton::Measure;

use crate::body::{FARTHEST, MovingMembrane};
use crate::drive::{Drive, DriveKind, Moment};
use crate::energy::Energy;
pub use adaptive::Tolerance;
pub use run::{Stop, TimeStep};

use crate::error::{ImplicitError, at_least, length, positive, within};
use crate::instant::Instant;
use crate::scheme::{Jacobian, Scheme};
use crate::stepper::Stepper;
use crate::target::Target;
use crate::work::Work;

/// A motion in progress: an initial-value problem with the state it has reached.
///
/// Everything is allocated here; a step costs O(N) and allocates nothing, except a first adaptive step whose error is estimated by
/// step doubling.
///
/// ```
/// use membrane_implicit::{Drive, Membrane, Motion, MovingMembrane, RestShape, Scheme, Stop, TimeStep};
/// let membrane = Membrane::new(RestShape::balloon(8.5, 1.75)?);
/// let body = MovingMembrane::new(&membrane, 101)?.with_damping(1.0)?;
/// let mut motion = Motion::new(body, Drive::intensity(|_| 17.5), Scheme::TrBdf2)?;
/// motion.run(TimeStep::Fixed(0.002), &[Stop::Time(0.5)])?;
/// assert!((motion.state().points[50][0] - 10.839353).abs() < 1e-3);
/// assert!(motion.energy().imbalance().abs() < 1e-9 * motion.energy().pressure_work);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Motion {
    drive: Drive,
    inner: Stepper,
    /// The outer membrane of a pair: its volume follows that of the inner one.
    outer: Option<Stepper>,
    wall_volume: f64,
    next_dt: Option<f64>,
    initial: f64,
}

/// Most values of the drive that a step asks for: those of the eleven drifts.
const MAX_TARGETS: usize = 11;

/// One membrane at the present time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State<'a> {
    /// Time.
    pub time: f64,
    /// Nodes [x, y] from s = 0 to s = 1, cm.
    pub points: &'a [[f64; 2]],
    /// Velocity of each node.
    pub velocities: &'a [[f64; 2]],
    /// Force intensity f or p.
    pub intensity: f64,
}

impl State<'_> {
    /// Enclosed volume of revolution, cm^3.
    pub fn volume(&self) -> f64 {
        Measure::Volume.of(self.points)
    }

    /// dV/dt, cm^3/s; not a number if there are other velocities than points.
    pub fn volume_rate(&self) -> f64 {
        let rate = Measure::Volume.rate(self.points, self.velocities);
        rate.unwrap_or(f64::NAN)
    }
}

impl Motion {
    /// A membrane at rest in its start shape at t = 0.
    ///
    /// # Errors
    /// The drive has no finite value at t = 0, or prescribes a volume that the membrane does not
    /// have, or a volume to an explicit scheme, or answers to the state under a splitting.
    pub fn new(body: MovingMembrane, drive: Drive, scheme: Scheme) -> Result<Self, ImplicitError> {
        match drive.kind() {
            DriveKind::Volume if scheme.has_explicit_pressure() => {
                return Err(ImplicitError::ExplicitVolume);
            }
            DriveKind::Feedback if !scheme.has_stages() => {
                return Err(ImplicitError::SplitFeedback);
            }
            _ => (),
        }
        let inner = Stepper::new(body, scheme, drive.kind());
        let mut motion = Self {
            drive,
            inner,
            outer: None,
            wall_volume: 0.0,
            next_dt: None,
            initial: 0.0,
        };
        motion.begin()?;
        Ok(motion)
    }

    /// Two membranes at rest, `drive` inflating the inner one; the outer one encloses the inner
    /// volume and the wall's, which stays what it is at rest (incompressible water). The load that
    /// this takes on the outer membrane is an unknown of each step.
    ///
    /// # Errors
    /// As [`Motion::new`]; an explicit scheme; an outer membrane that does not enclose more than
    /// the inner one.
    pub fn pair(
        inner: MovingMembrane,
        outer: MovingMembrane,
        drive: Drive,
        scheme: Scheme,
    ) -> Result<Self, ImplicitError> {
        if scheme.has_explicit_pressure() {
            return Err(ImplicitError::ExplicitVolume);
        }
        let volumes = [inner.start_volume(), outer.start_volume()];
        let wall_volume = volumes[1] - volumes[0];
        if !(wall_volume.is_finite() && wall_volume > 0.0) {
            let [inner, outer] = volumes;
            return Err(ImplicitError::NotEnclosed { inner, outer });
        }
        let mut motion = Self::new(inner, drive, scheme)?;
        motion.outer = Some(Stepper::new(outer, scheme, DriveKind::Volume));
        motion.wall_volume = wall_volume;
        motion.begin()?;
        Ok(motion)
    }

    /// The same with another derivative of the pressure force; [`Jacobian::Exact`] otherwise.
    ///
    /// # Errors
    /// A refresh every 0 steps.
    pub fn with_jacobian(mut self, jacobian: Jacobian) -> Result<Self, ImplicitError> {
        if let Jacobian::Differences { refresh_every } = jacobian {
            at_least("refresh_every", refresh_every, 1)?;
        }
        self.steppers_mut().for_each(|s| s.set_jacobian(jacobian));
        Ok(self)
    }

    /// The same single membrane at another time, in another shape, moving. The end nodes stay
    /// where they are held.
    ///
    /// # Errors
    /// A pair; lists of another length than the membrane's nodes, numbers that are not finite or beyond 1e100, and
    /// as [`Motion::new`].
    pub fn with_state(
        mut self,
        time: f64,
        points: &[[f64; 2]],
        velocities: &[[f64; 2]],
    ) -> Result<Self, ImplicitError> {
        if self.outer.is_some() {
            return Err(ImplicitError::StateOfPair);
        }
        within("time", time, f64::MIN, f64::MAX)?;
        let expected = self.inner.body.n_nodes();
        for (what, list) in [("points", points), ("velocities", velocities)] {
            length(what, list.len(), expected)?;
            for value in list.as_flattened() {
                within(what, *value, -FARTHEST, FARTHEST)?;
            }
        }
        self.inner
            .set(time, points.as_flattened(), velocities.as_flattened());
        self.begin()?;
        Ok(self)
    }

    /// Intensities and accelerations at the start.
    fn begin(&mut self) -> Result<(), ImplicitError> {
        self.tell();
        let Self {
            drive,
            inner,
            outer,
            ..
        } = self;
        let time = inner.now().time;
        let mut target = Target::of(drive, time)?;
        if let Target::Volume(prescribed) = target {
            let actual = inner.now().volume();
            if (prescribed - actual).abs() > 1e-9 * actual.abs() {
                return Err(ImplicitError::VolumeMismatch {
                    time,
                    prescribed,
                    actual,
                });
            }
            // V'' looking forward only; the step is a fraction of the membrane's shortest period.
            let e = 0.1 * inner.body.largest_explicit_step();
            let v = |k: f64| match Target::of(drive, time + k * e)? {
                Target::Volume(volume) => Ok(volume),
                _ => Ok(f64::NAN),
            };
            let change = 2.0 * prescribed - 5.0 * v(1.0)? + 4.0 * v(2.0)? - v(3.0)?;
            target = Target::Volume(change / (e * e));
        }
        inner.begin(target)?;
        if let Some(outer) = outer {
            let target = Target::Volume(inner.volume_acceleration());
            outer.begin(target)?;
        }
        let energy = self.energy();
        self.initial = energy.kinetic + energy.elastic;
        Ok(())
    }

    /// Time reached.
    pub fn time(&self) -> f64 {
        self.inner.now().time
    }

    /// The membrane, or the inner one of a pair.
    pub fn state(&self) -> State<'_> {
        view(self.inner.now())
    }

    /// The outer membrane of a pair.
    pub fn outer(&self) -> Option<State<'_>> {
        self.outer.as_ref().map(|outer| view(outer.now()))
    }

    /// The (inner) body.
    pub fn body(&self) -> &MovingMembrane {
        &self.inner.body
    }

    /// Volume between the membranes of a pair, over what it should be, minus one.
    pub fn wall_volume_error(&self) -> Option<f64> {
        let wall = self.outer()?.volume() - self.state().volume();
        Some(wall / self.wall_volume - 1.0)
    }

    /// Counters since the motion was made; those of both membranes added for a pair.
    pub fn work(&self) -> Work {
        let mut work = self.inner.work;
        if let Some(Stepper { work: outer, .. }) = &self.outer {
            work.iterations += outer.iterations;
            work.factorisations += outer.factorisations;
            work.force_calls += outer.force_calls;
        }
        work
    }

    /// Where the energy is and where it went since the motion began; both membranes added for a
    /// pair. Cost O(N).
    pub fn energy(&self) -> Energy {
        let mut energy = self.inner.energy();
        if let Some(outer) = &self.outer {
            energy = energy.plus(&outer.energy());
        }
        energy.initial = self.initial;
        energy
    }

    /// Norms over s of F_p + F_e and of the velocity; the larger of the two membranes.
    ///
    /// # Errors
    /// The neighbours of a node coincide.
    pub fn norms(&mut self) -> Result<(f64, f64), ImplicitError> {
        let (mut force, mut speed) = self.inner.norms()?;
        if let Some(outer) = &mut self.outer {
            let (f, s) = outer.norms()?;
            (force, speed) = (force.max(f), speed.max(s));
        }
        Ok((force, speed))
    }

    /// One step of length `dt`.
    ///
    /// # Errors
    /// A step that is not positive, the drive's value, equations that cannot be solved, numbers
    /// that overflow. The state is then still that before the step.
    pub fn step(&mut self, dt: f64) -> Result<(), ImplicitError> {
        positive("time step", dt)?;
        self.attempt(dt)?;
        self.accept(None);
        Ok(())
    }

    /// One step as long as `tolerance` allows, at most `most`; returns its length.
    ///
    /// # Errors
    /// As [`Motion::step`]; [`ImplicitError::StepTooSmall`].
    pub fn step_adaptive(
        &mut self,
        tolerance: &Tolerance,
        most: f64,
    ) -> Result<f64, ImplicitError> {
        let dt = self.attempt_adaptive(tolerance, most)?;
        self.accept(None);
        Ok(dt)
    }

    /// Shape and velocity of the (inner) membrane at a time within the last step: cubic Hermite
    /// interpolation, error O(dt^4) beside that of the scheme. Cost O(N).
    ///
    /// # Errors
    /// A time outside the last step; [`ImplicitError::WrongLength`] for slices that are not N long.
    pub fn at_into(
        &self,
        time: f64,
        points: &mut [[f64; 2]],
        velocities: &mut [[f64; 2]],
    ) -> Result<(), ImplicitError> {
        self.inner.at_into(time, points, velocities)
    }

    /// As [`Motion::at_into`], of the outer membrane; does nothing without one.
    ///
    /// # Errors
    /// A time outside the last step; [`ImplicitError::WrongLength`] for slices that are not N long.
    pub fn outer_at_into(
        &self,
        time: f64,
        points: &mut [[f64; 2]],
        velocities: &mut [[f64; 2]],
    ) -> Result<(), ImplicitError> {
        match &self.outer {
            Some(outer) => outer.at_into(time, points, velocities),
            None => Ok(()),
        }
    }

    fn steppers_mut(&mut self) -> impl Iterator<Item = &mut Stepper> {
        std::iter::once(&mut self.inner).chain(&mut self.outer)
    }

    fn attempt(&mut self, dt: f64) -> Result<(), ImplicitError> {
        let Self {
            drive,
            inner,
            outer,
            wall_volume,
            ..
        } = self;
        let time = inner.now().time;
        let n = inner.drive_times().len();
        let mut targets = [Target::Intensity(0.0); MAX_TARGETS];
        for i in 0..n {
            targets[i] = Target::of(drive, time + dt * inner.drive_times()[i])?;
        }
        inner.attempt(dt, &targets[..n])?;
        if let Some(outer) = outer {
            for i in 0..n {
                targets[i] = Target::Volume(inner.stage_volume(i + 1) + *wall_volume);
            }
            outer.attempt(dt, &targets[..n])?;
        }
        Ok(())
    }

    /// Makes the attempted step the present, at `time` if the clock has to be put right.
    fn accept(&mut self, time: Option<f64>) {
        self.steppers_mut().for_each(Stepper::accept);
        if let Some(time) = time {
            self.inner.set_time(time);
        }
        self.tell();
    }

    /// Tells the drive where the motion is.
    fn tell(&mut self) {
        let now = self.inner.now();
        self.drive
            .accepted(|| Moment::of(now.time, &now.nodes, &now.velocity));
    }
}

fn view(instant: &Instant) -> State<'_> {
    State {
        time: instant.time,
        points: instant.nodes.as_chunks::<2>().0,
        velocities: instant.velocity.as_chunks::<2>().0,
        intensity: instant.intensity,
    }
}
