//! Equilibria as initial value problems from the apex, by Runge and Kutta's fourth order: no nodes, no tangents, no volume integrals of
//! the library.

use std::f64::consts::{PI, TAU};

use membrane_forces::StrainEnergy;

/// Steps from the apex to the ring.
const STEPS: usize = 4000;

/// A step of length `h` from `t`.
fn runge_kutta<const N: usize>(
    t: f64,
    y: [f64; N],
    h: f64,
    rates: impl Fn(f64, [f64; N]) -> Option<[f64; N]>,
) -> Option<[f64; N]> {
    let ahead = |by: f64, k: [f64; N]| std::array::from_fn(|i| y[i] + by * k[i]);
    let k1 = rates(t, y)?;
    let k2 = rates(t + 0.5 * h, ahead(0.5 * h, k1))?;
    let k3 = rates(t + 0.5 * h, ahead(0.5 * h, k2))?;
    let k4 = rates(t + h, ahead(h, k3))?;
    Some(std::array::from_fn(|i| {
        y[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i])
    }))
}

/// A disc of springs of stiffness 1 + a cos(2 pi k s) under the law per material length.
#[derive(Clone, Copy)]
pub(super) struct Springs {
    pub(super) radius: f64,
    pub(super) amplitude: f64,
    pub(super) waves: f64,
}

impl Springs {
    pub(super) fn stiffness(self, s: f64) -> f64 {
        1.0 + self.amplitude * (TAU * self.waves * s).cos()
    }

    /// Curve from the apex, at which its tension is (0, -t): T' = lambda' c0' - f n with c0' = (0, -2 R). Every hundredth point.
    fn shoot(self, load: f64, t: f64) -> Vec<(f64, [f64; 2])> {
        let rates = |s: f64, [x, y, _, _]: [f64; 4]| {
            let size = x.hypot(y);
            let (wave, stiffness) = (TAU * self.waves, self.stiffness(s));
            let slope = -self.amplitude * wave * (wave * s).sin();
            let turned = [
                load * y / size,
                -2.0 * self.radius * slope - load * x / size,
            ];
            Some([turned[0], turned[1], x / stiffness, y / stiffness])
        };
        let h = -0.5 / STEPS as f64;
        let (mut state, mut points) = ([0.0, -t, 0.0, 0.0], vec![(0.5, [0.0; 2])]);
        for k in 0..STEPS {
            let next = runge_kutta(0.5 + h * k as f64, state, h, rates);
            state = next.unwrap_or([f64::NAN; 4]);
            if (k + 1) % 100 == 0 {
                points.push((0.5 + h * (k + 1) as f64, [state[2], state[3]]));
            }
        }
        points
    }

    /// The curve whose tension at the apex is near `tension`, by the secant rule on the distance of the ring from its position.
    pub(super) fn solve(self, load: f64, tension: f64) -> Option<Vec<(f64, [f64; 2])>> {
        let ring = |points: &[(f64, [f64; 2])]| points[points.len() - 1].1;
        let missed = |t: f64| ring(&self.shoot(load, t))[1] - self.radius;
        let (mut a, mut b) = (tension * (1.0 - 1e-4), tension * (1.0 + 1e-4));
        let (mut at_a, mut at_b) = (missed(a), missed(b));
        for _ in 0..30 {
            if (b - a).abs() <= 1e-13 * b.abs() || at_a == at_b {
                break;
            }
            let next = b - at_b * (b - a) / (at_b - at_a);
            (a, at_a) = (b, at_b);
            (b, at_b) = (next, missed(next));
        }
        let mut points = self.shoot(load, b);
        // the ring defines x = 0
        let x = ring(&points)[0];
        points.iter_mut().for_each(|(_, place)| place[0] -= x);
        (at_b.abs() < 1e-9 * self.radius).then_some(points)
    }
}

/// A flat sheet of rubber of thickness 1.
pub(super) struct Sheet {
    pub(super) energy: StrainEnergy,
}

/// A sheet fixed at a ring of radius 1.
pub(super) struct Shot {
    pub(super) pressure: f64,
    pub(super) volume: f64,
}

impl Sheet {
    /// The stretch l1 that has this tension along the meridian, T1 = W_1 / l2, from a guess.
    fn stretch(&self, tension: f64, l2: f64, guess: f64) -> Option<f64> {
        let mut l1 = guess;
        for _ in 0..50 {
            let w = self.energy.at(l1, l2).ok()?;
            let step = (w.by[0] / l2 - tension) / (w.second[0] / l2);
            l1 -= step.clamp(-0.3 * l1, 0.3 * l1);
            if step.abs() <= 1e-15 * l1 {
                break;
            }
        }
        Some(l1)
    }

    /// Derivatives of radius y, angle psi, tension T1, height x and volume by the reference radius, under pressure 1; and l1.
    ///
    /// T1 psi' + T2 sin(psi) / y = p and T1' = (T2 - T1) cos(psi) / y along the curve.
    fn rates(
        &self,
        radius: f64,
        [y, psi, tension, _, _]: [f64; 5],
        guess: f64,
    ) -> Option<([f64; 5], f64)> {
        let l2 = y / radius;
        let l1 = self.stretch(tension, l2, guess)?;
        let around = self.energy.at(l1, l2).ok()?.by[1] / l1;
        let (sin, cos) = psi.sin_cos();
        let rates = [
            l1 * cos,
            l1 * (1.0 - around * sin / y) / tension,
            l1 * (around - tension) * cos / y,
            l1 * sin,
            PI * y * y * l1 * sin,
        ];
        Some((rates, l1))
    }

    /// The sheet with the stretch `apex` at its apex: under pressure 1 up to its reference width, then scaled to a ring of radius 1.
    pub(super) fn shoot(&self, apex: f64) -> Option<Shot> {
        let tension = self.energy.at(apex, apex).ok()?.by[0] / apex;
        // near the apex a sphere of curvature p / (2 T)
        let step = tension * 2e-3;
        let first = 0.5 * step;
        let psi = first * apex / (2.0 * tension);
        let y = apex * first;
        let mut state = [y, psi, tension, 0.5 * y * psi, 0.25 * PI * y.powi(3) * psi];
        let (mut radius, mut guess) = (first, apex);
        for _ in 0..20 * STEPS {
            let before = state;
            let near = guess;
            let rates = |radius: f64, y: [f64; 5]| Some(self.rates(radius, y, near)?.0);
            state = runge_kutta(radius, state, step, rates)?;
            radius += step;
            guess = self.rates(radius, state, guess)?.1;
            if state[0] <= radius {
                // a partial step back to the ring: a secant of y - radius over fractions of the step
                let ahead = |part: f64| runge_kutta(radius - step, before, part * step, rates);
                let (mut low, mut high) = (0.0, 1.0);
                for _ in 0..50 {
                    let middle = 0.5 * (low + high);
                    let y = ahead(middle)?[0];
                    if y > radius - step + middle * step {
                        low = middle;
                    } else {
                        high = middle;
                    }
                }
                let ring = radius - step + low * step;
                // lengths scale as 1 / pressure
                let volume = ahead(low)?[4] / ring.powi(3);
                return Some(Shot {
                    pressure: ring,
                    volume,
                });
            }
        }
        None
    }

    /// The first maximum of the pressure as the apex stretches, by golden sections.
    pub(super) fn first_maximum(&self) -> Option<f64> {
        let pressure = |apex: f64| Some(self.shoot(apex)?.pressure);
        let (mut apex, mut last) = (1.1, pressure(1.1)?);
        loop {
            let next = pressure(apex * 1.05)?;
            if next < last {
                break;
            }
            (apex, last) = (apex * 1.05, next);
            if apex > 6.0 {
                return None;
            }
        }
        let (mut low, mut high) = (apex / 1.05, apex * 1.05);
        let golden = 0.5 * (5f64.sqrt() - 1.0);
        for _ in 0..40 {
            let (a, b) = (high - golden * (high - low), low + golden * (high - low));
            if pressure(a)? < pressure(b)? {
                low = a
            } else {
                high = b
            }
        }
        pressure(0.5 * (low + high))
    }
}
