//! One implicit stage: the velocity w at which momentum balances, and the intensity with it.

use membrane_newton::DiscreteMembrane;
use membrane_newton::membrane_forces::FiniteDifferences;
use membrane_newton::{BandMatrix, BandedLu, Measure, NewtonError};

use crate::body::MovingMembrane;
use crate::drive::Moment;
use crate::error::ImplicitError;
use crate::scheme::Jacobian;
use crate::target::{Answer, Target};

/// Solves, for the velocity w and the intensity f,
///
/// ```text
/// (m + h mu) w = m v* + h [ F_e(c) + f n(c) ]        c = c* + h w
/// g(c, w, f) = 0                       f = f_t,   f S(c) = F_t,   V(c) = V_t   or   f = P(t, V(c), V'(c) w)
/// ```
///
/// with the matrix (m + h mu) I - h^2 (K + f dn/dc), bordered by g. Every implicit scheme here is
/// made of such stages. The unknowns are 2 N velocities, not 4 N positions and velocities.
#[derive(Debug, Clone)]
pub(crate) struct Stage {
    /// K = dF_e/dc, the same for every state.
    pub(crate) elastic: BandMatrix,
    matrix: BandMatrix,
    lu: BandedLu,
    /// Inverse matrix times -h n(c).
    column: Vec<f64>,
    /// h dg/dc + dg/dw, and what elimination leaves of dg/df.
    row: Vec<f64>,
    pivot: f64,
    /// h for which `lu` stands, NaN before the first factorisation.
    factored: f64,
    force: Vec<f64>,
    normal: Vec<f64>,
    rhs: Vec<f64>,
    probe: Vec<f64>,
    pub(crate) factorisations: usize,
    pub(crate) force_calls: usize,
}

/// Where and when a stage is solved.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Equation<'a> {
    pub(crate) body: &'a MovingMembrane,
    /// What is prescribed at the end of the stage.
    pub(crate) target: Target<'a>,
    /// Time at the start of the step, and at the end of the stage.
    pub(crate) time: f64,
    pub(crate) end: f64,
    pub(crate) dt: f64,
    /// h = gamma dt.
    pub(crate) h: f64,
    /// Size of the membrane, cm.
    pub(crate) length: f64,
}

impl Stage {
    pub(crate) fn new(body: &MovingMembrane) -> Self {
        let mut elastic = body.differences.band();
        body.differences.add_elastic_tangent_into(1.0, &mut elastic);
        let n = elastic.len();
        Self {
            matrix: body.differences.band(),
            lu: BandedLu::for_matrix(&elastic),
            elastic,
            column: vec![0.0; n],
            row: vec![0.0; n],
            pivot: 1.0,
            factored: f64::NAN,
            force: vec![0.0; n],
            normal: vec![0.0; n],
            rhs: vec![0.0; n],
            probe: vec![0.0; n],
            factorisations: 0,
            force_calls: 0,
        }
    }

    /// Whether the factorisation at hand belongs to this h.
    pub(crate) fn is_factored_for(&self, h: f64) -> bool {
        self.factored == h
    }

    /// Makes the next solve factor anew.
    pub(crate) fn forget(&mut self) {
        self.factored = f64::NAN;
    }

    /// Builds and factors the matrix at `nodes`, their velocities and the intensity.
    pub(crate) fn linearise(
        &mut self,
        eq: &Equation<'_>,
        jacobian: Jacobian,
        (nodes, velocities): (&[f64], &[f64]),
        intensity: f64,
    ) -> Result<(), ImplicitError> {
        let Equation {
            body, h, time, dt, ..
        } = *eq;
        let membrane = |error| ImplicitError::Membrane { time, error };
        let d = &body.differences;
        self.matrix.clear();
        d.add_elastic_tangent_into(-h * h, &mut self.matrix);
        match jacobian {
            Jacobian::Differences { .. } => self
                .add_differences(d, nodes, -h * h * intensity)
                .map_err(membrane)?,
            _ => d
                .add_pressure_tangent_into(nodes, intensity, -h * h, &mut self.matrix)
                .map_err(membrane)?,
        }
        let diagonal = body.mass + h * body.damping;
        for i in 0..self.matrix.len() {
            self.matrix.add(i, i, diagonal).map_err(membrane)?;
        }
        self.factored = f64::NAN;
        let lu = self
            .lu
            .factor(&self.matrix)
            .map_err(|error| ImplicitError::Linear { time, dt, error })?;
        self.factorisations += 1;

        self.pivot = 1.0;
        self.column.fill(0.0);
        self.row.fill(0.0);
        let points = nodes.as_chunks().0;
        let answering = |answer: Answer| {
            let slope = -(h * answer.by_volume + answer.by_rate);
            Some((Some((Measure::Volume, slope)), 1.0))
        };
        // g's gradient, which is that of a measure times a factor, and its slope by f
        let border = match eq.target {
            Target::Intensity(_) => None,
            // Without the rank-one part the intensity does not answer to the change of shape.
            Target::TotalForce(_) if jacobian == Jacobian::Band => {
                Some((None, Measure::Surface.of(points)))
            }
            Target::TotalForce(_) => Some((
                Some((Measure::Surface, h * intensity)),
                Measure::Surface.of(points),
            )),
            Target::Volume(_) => Some((Some((Measure::Volume, h)), 0.0)),
            Target::Feedback(drive) => {
                let at = Moment::of(eq.end, nodes, velocities);
                answering(Answer::about(drive, at, eq.length, h)?)
            }
            Target::Answer(answer) => answering(answer),
        };
        if let Some((gradient, corner)) = border {
            d.pressure_force_into(nodes, -h, &mut self.column)
                .map_err(membrane)?;
            self.force_calls += 1;
            lu.solve_into(&mut self.column);
            hold_ends(&mut self.column);
            if let Some((measure, factor)) = gradient {
                measure.gradient_into(points, self.row.as_chunks_mut().0);
                hold_ends(&mut self.row);
                self.row.iter_mut().for_each(|g| *g *= factor);
            }
            self.pivot = corner - dot(&self.row, &self.column);
        }
        if self.pivot == 0.0 || !self.pivot.is_finite() {
            let error = NewtonError::Singular {
                row: self.row.len(),
                pivot: self.pivot,
            };
            return Err(ImplicitError::Linear { time, dt, error });
        }
        self.factored = h;
        Ok(())
    }

    /// `matrix` += `scale` dn/dc by central differences; nodes three apart do not share a row, so
    /// twelve evaluations of the normals fill the band.
    fn add_differences(
        &mut self,
        d: &FiniteDifferences,
        nodes: &[f64],
        scale: f64,
    ) -> Result<(), membrane_newton::MembraneError> {
        let last = d.n_nodes() - 1;
        // Central differences of n(c): step^2 against rounding / step, in units of the spacing.
        let step = 1e-5 * Measure::Length.of(nodes.as_chunks().0) / last as f64;
        self.probe.copy_from_slice(nodes);
        for colour in 0..6 {
            let (first, k) = (colour / 2, colour % 2);
            let each = |probe: &mut [f64], by: f64| {
                probe
                    .iter_mut()
                    .skip(2 * first + k)
                    .step_by(6)
                    .for_each(|x| *x += by);
            };
            each(&mut self.probe, step);
            d.pressure_force_into(&self.probe, 1.0, &mut self.normal)?;
            self.probe.copy_from_slice(nodes);
            each(&mut self.probe, -step);
            d.pressure_force_into(&self.probe, 1.0, &mut self.force)?;
            self.probe.copy_from_slice(nodes);
            self.force_calls += 2;
            for m in (first..=last).step_by(3) {
                for n in m.saturating_sub(1).max(1)..=(m + 1).min(last - 1) {
                    for row in [2 * n, 2 * n + 1] {
                        let slope = (self.normal[row] - self.force[row]) / (2.0 * step);
                        self.matrix.add(row, 2 * m + k, scale * slope)?;
                    }
                }
            }
        }
        Ok(())
    }

    /// One Newton iteration with the factorisation at hand; `w`, `intensity` and `nodes` = c* + h w
    /// are brought up to date. Returns the largest change of a coordinate of the position.
    pub(crate) fn iterate(
        &mut self,
        eq: &Equation<'_>,
        start: (&[f64], &[f64]),
        w: &mut [f64],
        nodes: &mut [f64],
        intensity: &mut f64,
    ) -> Result<f64, ImplicitError> {
        let Equation { body, h, .. } = *eq;
        let (positions, velocities) = start;
        self.forces(eq, nodes, *intensity)?;
        let (m, m_h) = (body.mass, body.mass + h * body.damping);
        let forces = self.force.iter().zip(&self.normal);
        let momentum = velocities.iter().zip(w.iter());
        for (rhs, ((e, p), (v, w))) in self.rhs.iter_mut().zip(forces.zip(momentum)) {
            *rhs = m * v - m_h * w + h * (e + p);
        }
        hold_ends(&mut self.rhs);
        let lu = self.lu.factored().ok_or(ImplicitError::Linear {
            time: eq.time,
            dt: eq.dt,
            error: NewtonError::NotFactored,
        })?;
        // Pivoting mixes the held rows with their neighbours; no rounding may move an end.
        lu.solve_into(&mut self.rhs);
        hold_ends(&mut self.rhs);
        let points = nodes.as_chunks().0;
        let defect = match eq.target {
            Target::TotalForce(target) => *intensity * Measure::Surface.of(points) - target,
            Target::Volume(target) => Measure::Volume.of(points) - target,
            Target::Intensity(target) => *intensity - target,
            Target::Feedback(drive) => *intensity - drive.at(&Moment::of(eq.end, nodes, w))?,
            Target::Answer(answer) => *intensity - answer.intensity(&Moment::of(eq.end, nodes, w)),
        };
        let df = -(defect + dot(&self.row, &self.rhs)) / self.pivot;
        // The border's defect counts as if the whole membrane had to move by that fraction; that of an intensity
        // moves it by what the step below sees.
        let scale = match eq.target {
            Target::TotalForce(target) | Target::Volume(target) => eq.length / target.abs(),
            Target::Intensity(_) | Target::Feedback(_) | Target::Answer(_) => 0.0,
        };
        let mut change = if defect == 0.0 {
            0.0
        } else {
            defect.abs() * scale
        };
        let solved = self.rhs.iter().zip(&self.column).zip(positions);
        for ((w, node), ((y, z), start)) in w.iter_mut().zip(nodes.iter_mut()).zip(solved) {
            let dw = y - df * z;
            *w += dw;
            *node = start + h * *w;
            // max() would drop a NaN
            let moved = (h * dw).abs();
            change = if moved <= change { change } else { moved };
        }
        *intensity += df;
        Ok(change)
    }

    /// Elastic and pressure force at a state, into `force` and `normal`.
    fn forces(
        &mut self,
        eq: &Equation<'_>,
        nodes: &[f64],
        intensity: f64,
    ) -> Result<(), ImplicitError> {
        let d = &eq.body.differences;
        d.elastic_force_into(nodes, &mut self.force);
        d.pressure_force_into(nodes, intensity, &mut self.normal)
            .map_err(|error| ImplicitError::Membrane {
                time: eq.time,
                error,
            })?;
        self.force_calls += 1;
        Ok(())
    }

    /// `pressure` += h f (dn/dc) w + `growth` n, both as the matrix and its border at hand have
    /// them: what linearising added to the force of the start.
    ///
    /// Taken from the matrix, not from the momentum balance, so that the energy report sees an
    /// error of the linear solver.
    pub(crate) fn add_linearised(
        &mut self,
        eq: &Equation<'_>,
        w: &[f64],
        growth: f64,
        pressure: &mut [f64],
    ) {
        let Equation { body, h, .. } = *eq;
        let m_h = body.mass + h * body.damping;
        for i in 0..w.len() {
            // matrix times column is -h n
            self.probe[i] = w[i] + growth * self.column[i];
        }
        self.matrix.mul_into(&self.probe, &mut self.rhs);
        self.elastic.mul_into(w, &mut self.force);
        for i in 0..w.len() {
            pressure[i] += (m_h * w[i] - self.rhs[i]) / h - h * self.force[i];
        }
    }

    /// Filters an error estimate of (position, velocity) through the stage's matrix, so that stiff
    /// components count for what the scheme makes of them (Hosea and Shampine 1996). Without a factorisation at hand
    /// it stays what it is.
    pub(crate) fn filter(
        &mut self,
        body: &MovingMembrane,
        position: &mut [f64],
        velocity: &mut [f64],
    ) {
        let Some(lu) = self.lu.factored() else { return };
        let h = self.factored;
        self.elastic.mul_into(position, &mut self.rhs);
        for (rhs, v) in self.rhs.iter_mut().zip(velocity.iter()) {
            *rhs = body.mass * v + h * *rhs;
        }
        lu.solve_into(&mut self.rhs);
        velocity.copy_from_slice(&self.rhs);
        for (p, v) in position.iter_mut().zip(velocity.iter()) {
            *p += h * v;
        }
    }
}

/// Zeroes the four coordinates of the two held nodes.
pub(crate) fn hold_ends(values: &mut [f64]) {
    let n = values.len();
    values[..2].fill(0.0);
    values[n - 2..].fill(0.0);
}

/// Eight sums side by side: one alone would wait for each of its additions.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<8>(), b.as_chunks::<8>());
    let mut sums = [0.0; 8];
    for (a, b) in a.iter().zip(b) {
        for k in 0..8 {
            sums[k] += a[k] * b[k];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f64>() + rest
}
