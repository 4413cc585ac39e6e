//! One implicit stage: the velocity w at which momentum balances, and the intensity with it.

use membrane_newton::membrane_forces::FiniteDifferences;
use membrane_newton::{
    BandMatrix, BandedLu, Border, DiscreteMembrane, Measure, NewtonError, dot_in_eight,
};

use crate::body::{MovingMembrane, hold_ends};
use crate::drive::Moment;
use crate::error::ImplicitError;
use crate::scheme::Jacobian;
use crate::target::{Answer, Target};
use crate::work::Work;

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
    pub(crate) jacobian: Jacobian,
    pub(crate) matrix: BandMatrix,
    lu: BandedLu,
    /// Column -h n(c), row h dg/dc + dg/dw.
    pub(crate) border: Border,
    /// h for which `lu` and `border` stand, NaN if they do for none.
    factored: f64,
    /// F_e and F_p.
    forces: [Vec<f64>; 2],
    /// What is missing in the balance of momentum, then the change of w that makes up for it.
    correction: Vec<f64>,
    /// For differences of the normals.
    moved: Vec<f64>,
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
}

impl Equation<'_> {
    fn linear(&self, error: NewtonError) -> ImplicitError {
        let Self { time, dt, .. } = *self;
        ImplicitError::Linear { time, dt, error }
    }
}

impl Stage {
    pub(crate) fn new(body: &MovingMembrane) -> Self {
        let matrix = body.differences.band();
        let zero = vec![0.0; matrix.len()];
        Self {
            jacobian: Jacobian::Exact,
            lu: BandedLu::for_matrix(&matrix),
            border: Border::new(zero.len()).with_dot(dot_in_eight),
            factored: f64::NAN,
            forces: [zero.clone(), zero.clone()],
            correction: zero.clone(),
            moved: zero,
            matrix,
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
        (nodes, velocities): (&[f64], &[f64]),
        intensity: f64,
        work: &mut Work,
    ) -> Result<(), ImplicitError> {
        let Equation { body, h, time, .. } = *eq;
        let membrane = |error| ImplicitError::Membrane { time, error };
        let d = &body.differences;
        self.matrix.clear();
        d.add_elastic_tangent_into(-h * h, &mut self.matrix)
            .map_err(membrane)?;
        match self.jacobian {
            Jacobian::Differences { .. } => {
                self.add_differences(d, nodes, -h * h * intensity, work)
            }
            Jacobian::Exact | Jacobian::Band => {
                d.add_pressure_tangent_into(nodes, intensity, -h * h, &mut self.matrix)
            }
        }
        .map_err(membrane)?;
        let diagonal = body.inertia(h);
        for i in 0..self.matrix.len() {
            self.matrix.add(i, i, diagonal).map_err(membrane)?;
        }
        self.forget();
        let lu = self.lu.factor(&self.matrix).map_err(|e| eq.linear(e))?;
        work.factorisations += 1;

        let points = nodes.as_chunks().0;
        let answering = |answer: Answer| {
            let slope = -(h * answer.by_volume + answer.by_rate);
            Some((Some((Measure::Volume, slope)), 1.0))
        };
        // g's gradient, which is that of a measure times a factor, and its slope by f
        let border = match eq.target {
            Target::Intensity(_) => None,
            // Without the rank-one part the intensity does not answer to the change of shape.
            Target::TotalForce(_) if self.jacobian == Jacobian::Band => {
                Some((None, Measure::Surface.of(points)))
            }
            Target::TotalForce(_) => Some((
                Some((Measure::Surface, h * intensity)),
                Measure::Surface.of(points),
            )),
            Target::Volume(_) => Some((Some((Measure::Volume, h)), 0.0)),
            Target::Feedback(drive) => {
                let at = Moment::of(eq.end, nodes, velocities);
                answering(Answer::about(drive, at, body.length, h)?)
            }
            Target::Answer(answer) => answering(answer),
        };
        let row = self.border.row_mut();
        row.fill(0.0);
        if let Some((Some((measure, factor)), _)) = border {
            measure.gradient_into(points, row.as_chunks_mut().0);
            hold_ends(row);
            row.iter_mut().for_each(|g| *g *= factor);
        }
        let column = self.border.column_mut();
        let eliminated = if let Some((_, corner)) = border {
            body.pressure_into(time, nodes, -h, column)?;
            work.force_calls += 1;
            self.border.eliminate(corner, |column| {
                lu.solve_into(column);
                hold_ends(column);
                Ok(())
            })
        } else {
            column.fill(0.0);
            self.border.eliminate(1.0, |_| Ok(()))
        };
        eliminated.map_err(|e| eq.linear(e))?;
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
        work: &mut Work,
    ) -> Result<(), membrane_newton::MembraneError> {
        let last = d.n_nodes() - 1;
        // Central differences of n(c): step^2 against rounding / step, in units of the spacing.
        let step = 1e-5 * Measure::Length.of(nodes.as_chunks().0) / last as f64;
        for colour in 0..6 {
            let (first, k) = (colour / 2, colour % 2);
            for (by, normals) in [step, -step].into_iter().zip(&mut self.forces) {
                self.moved.copy_from_slice(nodes);
                let own = self.moved.iter_mut().skip(2 * first + k).step_by(6);
                own.for_each(|x| *x += by);
                d.pressure_force_into(&self.moved, 1.0, normals)?;
                work.force_calls += 1;
            }
            let [ahead, behind] = &self.forces;
            for m in (first..=last).step_by(3) {
                for n in m.saturating_sub(1).max(1)..=(m + 1).min(last - 1) {
                    for row in [2 * n, 2 * n + 1] {
                        let slope = (ahead[row] - behind[row]) / (2.0 * step);
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
        (positions, velocities): (&[f64], &[f64]),
        (nodes, w, intensity): (&mut [f64], &mut [f64], &mut f64),
        work: &mut Work,
    ) -> Result<f64, ImplicitError> {
        let Equation { body, h, .. } = *eq;
        work.iterations += 1;
        let [elastic, pressure] = &mut self.forces;
        body.differences.elastic_force_into(nodes, elastic);
        body.pressure_into(eq.time, nodes, *intensity, pressure)?;
        work.force_calls += 1;
        let (m, m_h) = (body.mass, body.inertia(h));
        let forces = elastic.iter().zip(pressure.iter());
        let momentum = velocities.iter().zip(w.iter());
        for (missing, ((e, p), (v, w))) in self.correction.iter_mut().zip(forces.zip(momentum)) {
            *missing = m * v - m_h * w + h * (e + p);
        }
        hold_ends(&mut self.correction);
        let lu = self.lu.factored();
        let (lu, border) = lu
            .zip(self.border.eliminated())
            .ok_or_else(|| eq.linear(NewtonError::NotFactored))?;
        // Pivoting mixes the held rows with their neighbours; no rounding may move an end.
        lu.solve_into(&mut self.correction);
        hold_ends(&mut self.correction);
        let points = nodes.as_chunks().0;
        let defect = match eq.target {
            Target::TotalForce(target) => *intensity * Measure::Surface.of(points) - target,
            Target::Volume(target) => Measure::Volume.of(points) - target,
            Target::Intensity(target) => *intensity - target,
            Target::Feedback(drive) => *intensity - drive.at(&Moment::of(eq.end, nodes, w))?,
            Target::Answer(answer) => *intensity - answer.intensity(&Moment::of(eq.end, nodes, w)),
        };
        let correct = border.correct(&mut self.correction, -defect);
        *intensity += correct.map_err(|e| eq.linear(e))?;
        // The border's defect counts as if the whole membrane had to move by that fraction; that of an intensity
        // moves it by what the step below sees.
        let scale = match eq.target {
            Target::TotalForce(target) | Target::Volume(target) => body.length / target.abs(),
            Target::Intensity(_) | Target::Feedback(_) | Target::Answer(_) => 0.0,
        };
        let mut change = if defect == 0.0 {
            0.0
        } else {
            defect.abs() * scale
        };
        let moving = w.iter_mut().zip(nodes).zip(positions);
        for (((w, node), start), dw) in moving.zip(&self.correction) {
            *w += dw;
            *node = start + h * *w;
            // max() would drop a NaN
            let moved = (h * dw).abs();
            change = if moved <= change { change } else { moved };
        }
        Ok(change)
    }

    /// Filters an error estimate through the matrix at hand, if there is one.
    pub(crate) fn filter(&self, body: &MovingMembrane, error: &mut LocalError) {
        if let Some(lu) = self.lu.factored() {
            error.filter(body, self.factored, |v| lu.solve_into(v));
        }
    }
}

/// Estimated error of a step, and the room that filtering takes.
#[derive(Debug, Clone)]
pub(crate) struct LocalError {
    pub(crate) position: Vec<f64>,
    pub(crate) velocity: Vec<f64>,
    /// K times the error of the position.
    force: Vec<f64>,
}

impl LocalError {
    pub(crate) fn new(n: usize) -> Self {
        Self {
            position: vec![0.0; n],
            velocity: vec![0.0; n],
            force: vec![0.0; n],
        }
    }

    /// Filters it through the matrix of an implicit stage, which `solve` divides by, so that stiff components count for what the
    /// scheme makes of them (Hosea and Shampine 1996).
    pub(crate) fn filter(&mut self, body: &MovingMembrane, h: f64, solve: impl FnOnce(&mut [f64])) {
        body.springs.mul_into(&self.position, &mut self.force);
        for (v, force) in self.velocity.iter_mut().zip(&self.force) {
            *v = body.mass * *v + h * force;
        }
        solve(&mut self.velocity);
        for (p, v) in self.position.iter_mut().zip(&self.velocity) {
            *p += h * v;
        }
    }
}
