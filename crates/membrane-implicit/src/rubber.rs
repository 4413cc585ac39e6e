//! Rubber in motion: a scheme that keeps the energy.

use membrane_newton::membrane_forces::FiniteDifferences;
use membrane_newton::{BandedLu, Border, DiscreteMembrane, Measure, Membrane, NewtonError};

use crate::drive::{Drive, DriveKind, Moment};
use crate::energy::Energy;
use crate::error::{ImplicitError, positive, within};

/// A balloon of rubber, moving, under a pressure or with a volume that is prescribed: water pumped into it.
///
/// The mass of a node is that of half the rubber of its elements (density times volume), m; with V the volume inside and eta a damping per
/// mass,
///
/// ```text
/// m c'' = -dE/dc + p dV/dc - eta m c'
/// ```
///
/// A step takes the midpoint rule with discrete derivatives (Gonzalez 1996, doi:10.1007/BF02440162), for a function U
///
/// ```text
/// D U = U'(c_m) + [U(c1) - U(c0) - U'(c_m).d] d / |d|^2,     d = c1 - c0,  c_m the middle
/// ```
///
/// so that D U . d = U(c1) - U(c0): kinetic plus elastic energy change by p times the change of the volume, less the damping, whatever the
/// length of the step, as exactly as its equations are solved. Order 2, and no vibration is damped that is not by eta.
///
/// Moduli in kPa and lengths in cm go with a density in kPa s^2/cm^2: 1 g/cm^3 is 1e-4. Energies are then in kPa cm^3 = mJ.
///
/// ```
/// use membrane_implicit::{Drive, Membrane, RestShape, RubberMotion};
/// use membrane_newton::{Rubber, StrainEnergy, Thickness};
/// let latex = Rubber::new(StrainEnergy::NeoHookean { mu: 400.0 }, Thickness::constant(0.05)?)?;
/// let balloon = Membrane::new(RestShape::balloon(8.5, 1.75)?).with_rubber(latex);
/// // filled at 20 cm^3/s, begun within a tenth of a second
/// let flow = |t: f64| 20.0 * (t - 0.1 * (1.0 - (-t / 0.1).exp()));
/// let mut motion = RubberMotion::filled(&balloon, 41, 1e-4, flow)?.with_damping(20.0)?;
/// while motion.time() < 0.5 {
///     motion.step(0.005)?;
/// }
/// assert!((motion.volume() - motion.start_volume() - flow(motion.time())).abs() < 1e-9);
/// assert!(motion.energy().imbalance().abs() < 1e-9 * motion.energy().pressure_work);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct RubberMotion {
    discrete: FiniteDifferences,
    /// Of each number of a state, density included.
    mass: Vec<f64>,
    damping: f64,
    drive: Drive,
    time: f64,
    nodes: Vec<f64>,
    velocity: Vec<f64>,
    pressure: f64,
    energy: Energy,
}

/// Iterations of a step; each leaves less than a tenth or so of the error where a step resolves anything.
const ITERATIONS: usize = 60;

/// The product of the last change and of the step, over their squared size, below which an iteration that no longer gains is down to
/// rounding.
const ROUNDING: f64 = 1e-14;

impl RubberMotion {
    /// A membrane of rubber at rest in its start shape at t = 0, of this density, under a pressure or with a volume given by `drive`.
    ///
    /// # Errors
    /// As [`MovingMembrane::new`](crate::MovingMembrane::new); a membrane of springs; a density that is not positive; a drive of another
    /// kind, without a value at t = 0 or with another volume than there is.
    pub fn new(
        membrane: &Membrane,
        n_nodes: usize,
        density: f64,
        drive: Drive,
    ) -> Result<Self, ImplicitError> {
        let refused = |error| ImplicitError::Membrane { time: 0.0, error };
        positive("density", density)?;
        match drive.kind() {
            DriveKind::Intensity | DriveKind::Volume => (),
            DriveKind::TotalForce | DriveKind::Feedback => return Err(ImplicitError::RubberDrive),
        }
        let discrete = FiniteDifferences::half(membrane, n_nodes).map_err(refused)?;
        let nodes = discrete.start().to_vec();
        let mut mass = vec![0.0; nodes.len()];
        let ones = vec![density; nodes.len()];
        discrete.momentum_into(&ones, &mut mass).map_err(refused)?;
        let elastic = discrete.strain_energy(&nodes).map_err(refused)?;
        let mut motion = Self {
            mass,
            damping: 0.0,
            drive,
            time: 0.0,
            velocity: vec![0.0; nodes.len()],
            nodes,
            pressure: 0.0,
            energy: Energy {
                kinetic: 0.0,
                elastic,
                initial: elastic,
                pressure_work: 0.0,
                damping_loss: 0.0,
                numerical_loss: 0.0,
            },
            discrete,
        };
        let prescribed = motion.prescribed(0.0)?;
        match motion.drive.kind() {
            DriveKind::Volume => {
                let actual = motion.volume();
                if (prescribed - actual).abs() > 1e-9 * actual.abs().max(1e-9) {
                    return Err(ImplicitError::VolumeMismatch {
                        time: 0.0,
                        prescribed,
                        actual,
                    });
                }
            }
            DriveKind::Intensity | DriveKind::TotalForce | DriveKind::Feedback => {
                motion.pressure = prescribed;
            }
        }
        Ok(motion)
    }

    /// The same with water pumped in: `inflow(t)` is the volume added by t, cm^3, zero at first.
    ///
    /// # Errors
    /// As [`RubberMotion::new`].
    pub fn filled(
        membrane: &Membrane,
        n_nodes: usize,
        density: f64,
        inflow: impl Fn(f64) -> f64 + Send + Sync + 'static,
    ) -> Result<Self, ImplicitError> {
        let refused = |error| ImplicitError::Membrane { time: 0.0, error };
        let discrete = FiniteDifferences::half(membrane, n_nodes).map_err(refused)?;
        let rest = discrete.measure(Measure::Volume, discrete.start());
        let rest = rest.map_err(refused)?;
        let drive = Drive::volume(move |t| rest + inflow(t));
        Self::new(membrane, n_nodes, density, drive)
    }

    /// The same with damping eta per mass, 1/s.
    ///
    /// # Errors
    /// Negative, or not finite.
    pub fn with_damping(mut self, eta: f64) -> Result<Self, ImplicitError> {
        self.damping = within("damping", eta, 0.0, f64::MAX)?;
        Ok(self)
    }

    /// Time reached.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Nodes [x, y] of the upper half, from the held end to the axis, cm.
    pub fn points(&self) -> &[[f64; 2]] {
        self.nodes.as_chunks().0
    }

    /// Velocity of each node, cm/s.
    pub fn velocities(&self) -> &[[f64; 2]] {
        self.velocity.as_chunks().0
    }

    /// Pressure over the last step.
    pub fn pressure(&self) -> f64 {
        self.pressure
    }

    /// Volume inside, cm^3.
    pub fn volume(&self) -> f64 {
        self.volume_of(&self.nodes)
    }

    /// Volume inside at rest, cm^3.
    pub fn start_volume(&self) -> f64 {
        self.volume_of(self.discrete.start())
    }

    /// Where the energy is and where it went since the motion began.
    pub fn energy(&self) -> Energy {
        self.energy
    }

    /// One step of length `dt`.
    ///
    /// # Errors
    /// A step that is not positive, the drive's value, equations that cannot be solved, rubber stretched beyond what it can be. The state is
    /// then still that before the step.
    pub fn step(&mut self, dt: f64) -> Result<(), ImplicitError> {
        positive("time step", dt)?;
        let by_volume = self.drive.kind() == DriveKind::Volume;
        // a pressure acts at the middle of the step, a volume is that of its end
        let at = self.time + if by_volume { dt } else { 0.5 * dt };
        let prescribed = self.prescribed(at)?;
        let mut pressure = if by_volume { self.pressure } else { prescribed };
        let mut nodes = self.nodes.clone();
        for (x, v) in nodes.iter_mut().zip(&self.velocity) {
            *x += dt * v;
        }
        let target = by_volume.then_some(prescribed);
        self.solve(&mut nodes, &mut pressure, target, dt)?;
        self.accept(nodes, pressure, dt)
    }

    fn volume_of(&self, nodes: &[f64]) -> f64 {
        let volume = self.discrete.measure(Measure::Volume, nodes);
        volume.unwrap_or(f64::NAN)
    }

    fn prescribed(&self, time: f64) -> Result<f64, ImplicitError> {
        let given = self.drive.value(&Moment {
            time,
            volume: f64::NAN,
            volume_rate: f64::NAN,
        });
        if given.is_finite() {
            Ok(given)
        } else {
            Err(ImplicitError::BadDrive { time, given })
        }
    }

    /// Newton with the tangent at the middle of the step for twice the balance of momentum,
    /// 4 m (d - dt v0) / dt^2 + 2 eta m d / dt = 2 (-D E + p D V), and the volume.
    fn solve(
        &self,
        nodes: &mut [f64],
        pressure: &mut f64,
        target: Option<f64>,
        dt: f64,
    ) -> Result<(), ImplicitError> {
        let (d, n) = (&self.discrete, nodes.len());
        let linear = |error: NewtonError| ImplicitError::Linear {
            time: self.time,
            dt,
            error,
        };
        let mut tangent = d.tangent();
        let mut lu = BandedLu::for_matrix(&tangent.band);
        let mut border = Border::new(n);
        let size = nodes.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let mut last = f64::INFINITY;
        for _ in 0..ITERATIONS {
            let [middle, elastic, volume] = self.discrete_derivatives(nodes)?;
            d.taut_tangent_into(&middle, *pressure, f64::NEG_INFINITY, &mut tangent)
                .map_err(|error| self.refused(error))?;
            let mut missing = self.missing(nodes, dt, |i| elastic[i] + *pressure * volume[i]);
            for i in (0..n).filter(|i| !d.held().contains(i)) {
                let added = tangent.band.add(i, i, -self.inertia(i, dt));
                added.map_err(|error| self.refused(error))?;
            }
            d.held().iter().for_each(|&held| missing[held] = 0.0);
            let lu = lu.factor(&tangent.band).map_err(linear)?;
            lu.solve_into(&mut missing);
            if let Some(target) = target {
                let defect = target - self.volume_of(nodes);
                let column = border.column_mut();
                column
                    .iter_mut()
                    .zip(&volume)
                    .for_each(|(c, v)| *c = 2.0 * v);
                d.held().iter().for_each(|&held| column[held] = 0.0);
                d.measure_gradient_into(Measure::Volume, nodes, border.row_mut());
                let eliminated = border.eliminate(0.0, |column| {
                    lu.solve_into(column);
                    Ok(())
                });
                let change = eliminated.and_then(|border| border.correct(&mut missing, defect));
                *pressure += change.map_err(linear)?;
            }
            d.held().iter().for_each(|&held| missing[held] = 0.0);
            let mut change = 0.0f64;
            for (x, step) in nodes.iter_mut().zip(&missing) {
                *x += step;
                change = if step.abs() <= change {
                    change
                } else {
                    step.abs()
                };
            }
            // what is left does no more work than the energies' rounding
            let moved = nodes
                .iter()
                .zip(&self.nodes)
                .map(|(b, a)| (b - a) * (b - a));
            let rounded = change * moved.sum::<f64>().sqrt() <= ROUNDING * size * size;
            if change <= 1e-15 * size || (change >= 0.3 * last && rounded) {
                return Ok(());
            }
            if !change.is_finite() {
                break;
            }
            last = change;
        }
        Err(ImplicitError::StepNotSolved {
            time: self.time,
            dt,
            iterations: ITERATIONS,
            change: last,
        })
    }

    /// What a change of a position changes of twice the balance of momentum.
    fn inertia(&self, i: usize, dt: f64) -> f64 {
        self.mass[i] * (4.0 / (dt * dt) + 2.0 * self.damping / dt)
    }

    /// Twice the balance of momentum of the step to `nodes` under `force`.
    fn missing(&self, nodes: &[f64], dt: f64, force: impl Fn(usize) -> f64) -> Vec<f64> {
        let missing = |i: usize| {
            let moved = nodes[i] - self.nodes[i];
            self.inertia(i, dt) * moved
                - 4.0 * self.mass[i] * self.velocity[i] / dt
                - 2.0 * force(i)
        };
        (0..nodes.len()).map(missing).collect()
    }

    /// The middle of the step to `nodes`, -D E and D V, zero where the membrane is held.
    fn discrete_derivatives(&self, nodes: &[f64]) -> Result<[Vec<f64>; 3], ImplicitError> {
        let d = &self.discrete;
        let middle = self.nodes.iter().zip(nodes).map(|(a, b)| 0.5 * (a + b));
        let middle: Vec<f64> = middle.collect();
        let (mut elastic, mut volume) = (vec![0.0; nodes.len()], vec![0.0; nodes.len()]);
        d.elastic_force_into(&middle, &mut elastic);
        d.check_stretches(&middle)
            .and_then(|()| d.pressure_force_into(&middle, 1.0, &mut volume))
            .map_err(|error| self.refused(error))?;
        let moved: Vec<f64> = nodes.iter().zip(&self.nodes).map(|(b, a)| b - a).collect();
        let square: f64 = moved.iter().map(|d| d * d).sum();
        if square > 0.0 {
            let energy = d
                .strain_energy(nodes)
                .map_err(|error| self.refused(error))?;
            let before = self.energy.elastic;
            self.secant(&mut elastic, &moved, square, [energy, before]);
            let volumes = [self.volume(), self.volume_of(nodes)];
            self.secant(&mut volume, &moved, square, volumes);
        }
        Ok([middle, elastic, volume])
    }

    /// Adds to `derivative` so much of `moved` that its product with that is the difference of the two values, unless that difference is
    /// met to their rounding already.
    fn secant(&self, derivative: &mut [f64], moved: &[f64], square: f64, [from, to]: [f64; 2]) {
        let product: f64 = derivative.iter().zip(moved).map(|(a, b)| a * b).sum();
        let missing = to - from - product;
        if missing.abs() <= 4.0 * f64::EPSILON * from.abs().max(to.abs()) {
            return;
        }
        let factor = missing / square;
        for (value, moved) in derivative.iter_mut().zip(moved) {
            *value += factor * moved;
        }
    }

    /// Makes the solved step the present, and its account: each term by its own formula.
    fn accept(&mut self, nodes: Vec<f64>, pressure: f64, dt: f64) -> Result<(), ImplicitError> {
        let elastic = self.discrete.strain_energy(&nodes);
        let elastic = elastic.map_err(|error| self.refused(error))?;
        let (before, after) = (self.volume(), self.volume_of(&nodes));
        let (mut kinetic, mut lost) = (0.0, 0.0);
        for i in 0..nodes.len() {
            let mean = (nodes[i] - self.nodes[i]) / dt;
            self.velocity[i] = 2.0 * mean - self.velocity[i];
            kinetic += 0.5 * self.mass[i] * self.velocity[i] * self.velocity[i];
            lost += dt * self.damping * self.mass[i] * mean * mean;
        }
        self.nodes = nodes;
        self.pressure = pressure;
        self.time += dt;
        self.energy.kinetic = kinetic;
        self.energy.elastic = elastic;
        self.energy.pressure_work += pressure * (after - before);
        self.energy.damping_loss += lost;
        Ok(())
    }

    fn refused(&self, error: membrane_newton::MembraneError) -> ImplicitError {
        let time = self.time;
        ImplicitError::Membrane { time, error }
    }
}
