//! Equilibria at constant stiffness: a linear equation, solved exactly.

use std::f64::consts::PI;
use std::ops::{Add, Mul};

use crate::chebyshev::{bisect, gauss_legendre};
use crate::error::{MembraneError, Result, finite, not_negative, positive};
use crate::measures::{Measure, Measures};
use crate::reference::CurvePoint;

/// Exact equilibrium of a balloon or a disc of constant stiffness under the law per current length; of a disc also under a force per material
/// length.
///
/// With z = x + i y and kappa = p / lambda the equilibrium is z'' + i kappa z' = z0'', and variation of constants gives
///
/// ```text
/// z'(s) = e^(-i kappa s) z'(0) + integral over t < s of e^(-i kappa (s - t)) z0''(t) dt
/// ```
///
/// with z'(0) from the fixed end z(1). Only the cap bends: there z0'' = -i R omega^2 e^(-i omega (t - a)), omega the turning rate. A Gauss
/// rule computes the integrals over the cap to rounding. The curve runs to infinity as kappa -> 2 pi.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearEquilibrium {
    kappa: f64,
    radius: f64,
    /// Start of the cap, s = a; it ends at 1 - a. 1/2 for the disc, which has no cap.
    cap: f64,
    /// rho omega^2 of the cap, 0 for the disc.
    source: f64,
    /// Turning rate of the cap per unit s.
    omega: f64,
    slope: Complex,
}

impl LinearEquilibrium {
    /// The balloon of [`ReferenceShape::balloon`](crate::ReferenceShape::balloon) under a pressure p at constant stiffness lambda, in one unit.
    ///
    /// ```
    /// use membrane_forces::LinearEquilibrium;
    /// let balloon = LinearEquilibrium::balloon(8.5, 1.75, 3.0, 3.0)?;
    /// assert!((balloon.measures().volume - 180.00034338).abs() < 1e-8);
    /// // the reference configuration (Table 2, corrected): area R (2 h + pi R / 2)
    /// let rest = LinearEquilibrium::balloon(8.5, 1.75, 0.0, 1.0)?.measures();
    /// assert!((rest.area - 34.560563750809).abs() < 1e-11);
    /// # Ok::<(), membrane_forces::MembraneError>(())
    /// ```
    ///
    /// # Errors
    /// A size or stiffness that is not finite or not positive, sizes whose ratio or measures overflow;
    /// [`MembraneError::PastBlowUp`]: |p| >= 2 pi lambda.
    pub fn balloon(h: f64, radius: f64, pressure: f64, stiffness: f64) -> Result<Self> {
        positive("cylinder length", h)?;
        positive("radius", radius)?;
        let length = 2.0 * h + PI * radius;
        let omega = length / radius;
        let cap = [h / length, radius * omega * omega, omega];
        Self::new([pressure, stiffness], radius, cap)
    }

    /// The disc of [`ReferenceShape::disc`](crate::ReferenceShape::disc) under a pressure p at constant stiffness lambda, in one unit: an arc
    /// of a circle.
    ///
    /// # Errors
    /// As [`LinearEquilibrium::balloon`].
    pub fn disc(radius: f64, pressure: f64, stiffness: f64) -> Result<Self> {
        positive("radius", radius)?;
        Self::new([pressure, stiffness], radius, [0.5, 0.0, 0.0])
    }

    /// The disc of [`ReferenceShape::disc`](crate::ReferenceShape::disc) under a force f per material length, with f / lambda = `ratio` (cm): the
    /// same arc as under the pressure mu lambda, where mu is the root of R mu^2 = (f / lambda) sin(mu / 2) in (0, 2 pi) (appendix, constants
    /// corrected).
    ///
    /// ```
    /// let circle = membrane_forces::LinearEquilibrium::circle(1.0, 10.0)?;
    /// assert!((circle.kappa() - 3.162193779122982).abs() < 1e-14);
    /// # Ok::<(), membrane_forces::MembraneError>(())
    /// ```
    ///
    /// # Errors
    /// An argument that is not finite, a radius that is not positive, a negative ratio; sizes whose measures overflow.
    pub fn circle(radius: f64, ratio: f64) -> Result<Self> {
        positive("radius", radius)?;
        not_negative("load over stiffness", ratio)?;
        // With x = mu / 2: 4 R x = (f / lambda) sin(x) / x; the left rises, the right falls on (0, pi).
        let half = match ratio {
            0.0 => 0.0,
            _ => bisect(0.0, PI, |x| 4.0 * radius * x > ratio * sinc(x)),
        };
        let mu = (2.0 * half).min((2.0 * PI).next_down());
        Self::new([mu, 1.0], radius, [0.5, 0.0, 0.0])
    }

    fn new([p, lambda]: [f64; 2], radius: f64, [cap, source, omega]: [f64; 3]) -> Result<Self> {
        let limit = 2.0 * PI * positive("stiffness", lambda)?;
        if finite("pressure", p)?.abs() >= limit {
            return Err(MembraneError::PastBlowUp { pressure: p, limit });
        }
        let kappa = p / lambda;
        let mut this = Self {
            kappa,
            radius,
            cap,
            source,
            omega,
            slope: Complex(0.0, 0.0),
        };
        // z is linear in z'(0): its error at s = 1 for z'(0) = 0, divided by the change per unit
        let missed = (Complex(0.0, radius) + this.state(1.0).0) * -1.0;
        this.slope = missed * phase(0.5 * kappa) * (1.0 / sinc(0.5 * kappa));
        // The bend of a small cap on a large cylinder overflows.
        let slope = finite("slope at the fixed end", this.slope.norm())?;
        // No position is larger, and measures are of the order of its cube at most.
        let size = 10.0 * (radius + slope + source);
        if !(size * size * size).is_finite() {
            this.measures().finite()?;
        }
        Ok(this)
    }

    /// Returns kappa = p / lambda: for a disc the angle through which the arc turns, mu. Its radius is R / sin(mu / 2).
    #[must_use]
    pub fn kappa(&self) -> f64 {
        self.kappa
    }

    /// z(s) and z'(s) from z'(0) as it stands.
    fn state(&self, s: f64) -> (Complex, Complex) {
        let mut z = Complex(0.0, self.radius) + self.slope * turn(-self.kappa, s);
        let mut v = self.slope * phase(-self.kappa * s);
        let (a, end) = (self.cap, s.min(1.0 - self.cap));
        if end > a {
            for (fraction, weight) in gauss_legendre(48) {
                let t = a + (end - a) * fraction;
                let bend = self.bend(t) * (weight * (end - a));
                z = z + bend * turn(-self.kappa, s - t);
                v = v + bend * phase(-self.kappa * (s - t));
            }
        }
        (z, v)
    }

    /// z0''(t) on the cap.
    fn bend(&self, t: f64) -> Complex {
        Complex(0.0, -self.source) * phase(-self.omega * (t - self.cap))
    }

    /// The curve at material coordinate `s`, clamped to [0, 1].
    #[must_use]
    pub fn at(&self, s: f64) -> CurvePoint {
        let s = s.clamp(0.0, 1.0);
        let (z, v) = self.state(s);
        let mut second = Complex(0.0, -self.kappa) * v;
        if s > self.cap && s < 1.0 - self.cap {
            second = second + self.bend(s);
        }
        CurvePoint {
            position: [z.0, z.1],
            first: [v.0, v.1],
            second: [second.0, second.1],
        }
    }

    /// Length, area, surface and volume by a Gauss rule on the exact curve, to rounding; as
    /// [`Measure`](crate::Measure) defines them, also where suction draws the curve across the axis.
    #[must_use]
    pub fn measures(&self) -> Measures {
        let mut sums = [0.0; 4];
        for (from, to) in self.one_sided() {
            for (fraction, weight) in gauss_legendre(48) {
                let (z, v) = self.state(from + (to - from) * fraction);
                for (sum, measure) in sums.iter_mut().zip(Measure::ALL) {
                    let (value, ..) = measure.integrand([z.0, z.1], [v.0, v.1]);
                    *sum += 2.0 * weight * (to - from) * value;
                }
            }
        }
        sums.into()
    }

    /// Parts of [0, 1/2] between which the curve bends or crosses the axis: |y| has a kink there.
    fn one_sided(&self) -> Vec<(f64, f64)> {
        const SAMPLES: usize = 64;
        let y = |s: f64| self.state(s).0.1;
        let mut cuts = vec![0.0];
        for (from, to) in [(0.0, self.cap), (self.cap, 0.5)] {
            for k in 0..SAMPLES {
                let at = |k: usize| from + (to - from) * k as f64 / SAMPLES as f64;
                let (low, high) = (at(k), at(k + 1));
                let before = y(low);
                if before * y(high) < 0.0 {
                    cuts.push(bisect(low, high, |s| y(s) * before <= 0.0));
                }
            }
            cuts.push(to);
        }
        cuts.windows(2).map(|cut| (cut[0], cut[1])).collect()
    }
}

/// e^(i angle)
fn phase(angle: f64) -> Complex {
    Complex(angle.cos(), angle.sin())
}

/// Integral of e^(i rate t) over [0, s], exact also as the rate vanishes.
fn turn(rate: f64, s: f64) -> Complex {
    let half = 0.5 * rate * s;
    phase(half) * (s * sinc(half))
}

/// sin(x) / x.
fn sinc(x: f64) -> f64 {
    if x.abs() < 1e-8 { 1.0 } else { x.sin() / x }
}

/// Real and imaginary part.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Complex(f64, f64);

impl Complex {
    /// Absolute value.
    fn norm(self) -> f64 {
        self.0.hypot(self.1)
    }
}

impl Add for Complex {
    type Output = Self;
    fn add(self, b: Self) -> Self {
        Self(self.0 + b.0, self.1 + b.1)
    }
}

impl Mul for Complex {
    type Output = Self;
    fn mul(self, b: Self) -> Self {
        Self(self.0 * b.0 - self.1 * b.1, self.0 * b.1 + self.1 * b.0)
    }
}

impl Mul<f64> for Complex {
    type Output = Self;
    fn mul(self, b: f64) -> Self {
        Self(self.0 * b, self.1 * b)
    }
}
