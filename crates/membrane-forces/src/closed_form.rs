//! Equilibria and measures in closed form.

use std::f64::consts::PI;

use crate::chebyshev::bisect;
use crate::error::{Result, not_negative, positive};
use crate::measures::Measures;

/// Measures of the balloon in the reference configuration (Table 2, area corrected): length 2 h + pi R, area
/// R (2 h + pi R / 2), surface 2 pi R h + 2 pi R^2, volume pi R^2 (h + 2 R / 3).
///
/// ```
/// let rest = membrane_forces::balloon_measures(8.5, 1.75)?;
/// assert!((rest.area - 34.560563750809).abs() < 1e-11);
/// # Ok::<(), membrane_forces::MembraneError>(())
/// ```
///
/// # Errors
/// A size that is not finite or not positive, or so large that one of the measures is not finite.
pub fn balloon_measures(h: f64, radius: f64) -> Result<Measures> {
    positive("cylinder length", h)?;
    let r = positive("radius", radius)?;
    Measures {
        length: 2.0 * h + PI * r,
        area: r * (2.0 * h + 0.5 * PI * r),
        surface: 2.0 * PI * r * (h + r),
        volume: PI * r * r * (h + 2.0 * r / 3.0),
    }
    .finite()
}

/// Half the angle of an arc below which formulas avoid cancellation and underflow.
const NEARLY_FLAT: f64 = 0.25;

/// The disc under force per material length: an arc of a circle (appendix, constants corrected).
///
/// z(s) = iR (2 e^(-i mu s) - 1 - e^(-i mu)) / (1 - e^(-i mu)), traversed at the constant speed C = R mu / sin(mu / 2), where mu = f /
/// (lambda C), that is R mu^2 = (f / lambda) sin(mu / 2) with its one root in (0, 2 pi).
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct CircleEquilibrium {
    /// Radius of the disc, R, cm.
    pub disc_radius: f64,
    /// Angle through which the arc turns, mu, in [0, 2 pi).
    pub angle: f64,
}

impl CircleEquilibrium {
    /// Computes the arc for a disc of radius `radius` under f / lambda = `ratio` (cm).
    ///
    /// ```
    /// let circle = membrane_forces::CircleEquilibrium::new(1.0, 10.0)?;
    /// assert!((circle.angle - 3.162193779122982).abs() < 1e-14);
    /// # Ok::<(), membrane_forces::MembraneError>(())
    /// ```
    ///
    /// # Errors
    /// An argument that is not finite, a radius that is not positive, a negative ratio; sizes whose measures overflow.
    pub fn new(radius: f64, ratio: f64) -> Result<Self> {
        positive("radius", radius)?;
        not_negative("load over stiffness", ratio)?;
        if ratio == 0.0 {
            let flat = Self {
                disc_radius: radius,
                angle: 0.0,
            };
            flat.measures().finite()?;
            return Ok(flat);
        }
        // With x = mu / 2: 4 R x = (f / lambda) sin(x) / x; the left rises, the right falls on (0, pi).
        let half = bisect(0.0, PI, |x| {
            let falls = match x < NEARLY_FLAT {
                // The product of both may underflow.
                true => ratio * (x.sin() / x),
                false => ratio * x.sin() / x,
            };
            4.0 * radius * x > falls
        });
        let this = Self {
            disc_radius: radius,
            angle: 2.0 * half,
        };
        this.measures().finite()?;
        Ok(this)
    }

    /// Radius of the arc, R / sin(mu / 2), cm; infinite for the flat disc, and for an arc whose radius overflows.
    #[must_use]
    pub fn arc_radius(&self) -> f64 {
        self.disc_radius / (0.5 * self.angle).sin()
    }

    /// Position [x, y] at material coordinate s, in [0, 1].
    #[must_use]
    pub fn at(&self, s: f64) -> [f64; 2] {
        // Angle from the apex; sums turned into products so that nothing cancels as mu -> 0.
        let (half, theta) = (0.5 * self.angle, self.angle * (0.5 - s));
        if half == 0.0 {
            return [0.0, self.disc_radius * (1.0 - 2.0 * s)];
        }
        let over = |angle: f64| self.disc_radius * (angle.sin() / half.sin());
        let bulge = 2.0 * (0.5 * (half + theta)).sin();
        [bulge * over(0.5 * (half - theta)), over(theta)]
    }

    /// Length R mu / sin(mu / 2), area between arc and chord, surface and volume of the cap.
    #[must_use]
    pub fn measures(&self) -> Measures {
        let half = 0.5 * self.angle;
        let r = self.disc_radius;
        if half == 0.0 {
            return Measures {
                length: 2.0 * r,
                area: 0.0,
                surface: PI * r * r,
                volume: 0.0,
            };
        }
        let (wide, height) = (half / half.sin(), r * (0.5 * half).tan());
        let area = if half < NEARLY_FLAT {
            // 3 (x - sin x) / (4 (x/2)^3) with x = mu: power series to rounding.
            let square = self.angle * self.angle;
            let series = [20.0, 42.0, 72.0, 110.0, 156.0, 210.0]
                .into_iter()
                .rev()
                .fold(1.0, |sum, divisor| 1.0 - square / divisor * sum);
            r * r * (2.0 / 3.0) * half * wide * wide * series
        } else {
            let radius = r / half.sin();
            0.5 * radius * radius * (self.angle - self.angle.sin())
        };
        Measures {
            length: 2.0 * r * wide,
            area,
            surface: PI * (r * r + height * height),
            volume: PI * height * (3.0 * r * r + height * height) / 6.0,
        }
    }
}
