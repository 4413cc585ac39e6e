//! Sources and media of simple shapes.

use photon_scatter::{Camera, Emission, Medium, Piece, Random, Response, Source, Spectrum, View};

/// A ball of water of some density.
pub(crate) struct Ball {
    pub(crate) centre: [f64; 3],
    pub(crate) radius: f64,
    pub(crate) density: f64,
}

impl Medium for Ball {
    fn pieces(&self, position: [f64; 3], direction: [f64; 3], pieces: &mut Vec<Piece>) {
        let p: [f64; 3] = std::array::from_fn(|k| position[k] - self.centre[k]);
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let middle = -dot(p, direction);
        let square = self.radius.powi(2) - dot(p, p) + middle * middle;
        if square > 0.0 {
            pieces.push(Piece {
                enter: middle - square.sqrt(),
                exit: middle + square.sqrt(),
                density: self.density,
            });
        }
    }
}

/// Activity 1 per cm^3 in a ball, times a factor.
pub(crate) struct BallSource(pub(crate) [f64; 3], pub(crate) f64, pub(crate) f64);

impl Source for BallSource {
    fn emit(&self, random: &mut Random) -> Emission {
        let Self(centre, radius, activity) = self;
        let r = radius * random.uniform().cbrt();
        let direction = random.direction();
        Emission {
            position: std::array::from_fn(|k| centre[k] + r * direction[k]),
            weight: activity * 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3),
        }
    }
}

/// A point of some activity.
pub(crate) struct Point(pub(crate) [f64; 3], pub(crate) f64);

impl Source for Point {
    fn emit(&self, _: &mut Random) -> Emission {
        Emission {
            position: self.0,
            weight: self.1,
        }
    }
}

/// Water in an elliptic cylinder about z.
pub(crate) struct Cylinder {
    pub(crate) semi_axes: [f64; 2],
    pub(crate) half_height: f64,
}

impl Medium for Cylinder {
    fn pieces(&self, o: [f64; 3], d: [f64; 3], pieces: &mut Vec<Piece>) {
        let [a, b] = self.semi_axes;
        let (px, py, vx, vy) = (o[0] / a, o[1] / b, d[0] / a, d[1] / b);
        let vv = vx * vx + vy * vy;
        let middle = -(px * vx + py * vy) / vv;
        let square = (1.0 - (px * vy - py * vx).powi(2) / vv) / vv;
        let ends = [-1.0, 1.0].map(|side| (side * self.half_height - o[2]) / d[2]);
        let enter = (middle - square.sqrt()).max(ends[0].min(ends[1]));
        let exit = (middle + square.sqrt()).min(ends[0].max(ends[1]));
        if square > 0.0 && enter < exit {
            pieces.push(Piece {
                enter,
                exit,
                density: 1.0,
            });
        }
    }
}

/// Half-widths of a chest 40 cm wide and 25 cm deep, long enough to represent an infinite one.
pub(crate) const CHEST: Cylinder = Cylinder {
    semi_axes: [20.0, 12.5],
    half_height: 30.0,
};

pub(crate) const LEHR: Response = Response {
    slope: 0.0186,
    at_face: 0.0637,
    intrinsic: 0.161,
};

pub(crate) fn camera(bins: usize, pitch: f64, degrees: &[f64]) -> Camera {
    let view = |degrees: &f64| View {
        angle: degrees.to_radians(),
        radius: 25.0,
    };
    let views: Vec<View> = degrees.iter().map(view).collect();
    Camera::new([bins; 2], [pitch; 2], &views, LEHR).unwrap()
}

/// A window of 20 % about 140.5 keV, resolution 10 %.
pub(crate) fn photopeak() -> Spectrum {
    Spectrum::new(140.5, 0.1, &[[126.45, 154.55]]).unwrap()
}

/// Average of a Gaussian over a bin of some width, whose centre is at a distance from its maximum.
pub(crate) fn share(off: f64, width: f64, variance: f64) -> f64 {
    let [low, high] =
        [-0.5, 0.5].map(|side| libm::erf((off + side * width) / (2.0 * variance).sqrt()));
    0.5 * (high - low) / width
}
