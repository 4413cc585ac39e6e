//! Piecewise polynomial curves: spectral solutions.

use crate::reference::CurvePoint;

/// One smooth piece of a curve: x(s) and y(s) as Chebyshev series on `[from, to]`.
///
/// x(s) = sum over k of `x[k]` T_k(t), t = (2 s - from - to) / (to - from) in [-1, 1]; y alike.
#[derive(Debug, Clone, PartialEq)]
pub struct CurvePiece {
    /// Material coordinate at which the piece begins.
    pub from: f64,
    /// Material coordinate at which it ends.
    pub to: f64,
    /// Chebyshev coefficients of x(s), cm.
    pub x: Vec<f64>,
    /// Chebyshev coefficients of y(s), cm.
    pub y: Vec<f64>,
}

impl CurvePiece {
    /// Position and derivatives with respect to s; a series without coefficients is zero. Cost O(degree).
    ///
    /// ```
    /// use membrane_forces::CurvePiece;
    /// // T_2(t) = 2 t^2 - 1 on [0, 1], t = 2 s - 1
    /// let piece = CurvePiece { from: 0.0, to: 1.0, x: vec![0.0, 0.0, 1.0], y: vec![0.0, 1.0] };
    /// let here = piece.at(0.75);
    /// assert_eq!(here.position, [-0.5, 0.5]);
    /// assert_eq!(here.first, [4.0, 2.0]);
    /// assert_eq!(here.second, [16.0, 0.0]);
    /// ```
    #[must_use]
    pub fn at(&self, s: f64) -> CurvePoint {
        let rate = 2.0 / (self.to - self.from);
        let t = (s - self.from + (s - self.to)) / (self.to - self.from);
        let (x, y) = (clenshaw(&self.x, t), clenshaw(&self.y, t));
        CurvePoint {
            position: [x[0], y[0]],
            first: [x[1] * rate, y[1] * rate],
            second: [x[2] * rate * rate, y[2] * rate * rate],
        }
    }

    /// The piece mirrored in the x axis and run through backwards: s -> 1 - s, y -> -y.
    pub(crate) fn mirrored(&self) -> Self {
        let flip = |c: &[f64], sign: f64| -> Vec<f64> {
            c.iter()
                .enumerate()
                .map(|(k, c)| if k % 2 == 0 { sign * c } else { -sign * c })
                .collect()
        };
        Self {
            from: 1.0 - self.to,
            to: 1.0 - self.from,
            x: flip(&self.x, 1.0),
            y: flip(&self.y, -1.0),
        }
    }
}

impl CurvePoint {
    /// Unit tangent in the direction of increasing s; NaN where the derivative vanishes.
    #[must_use]
    pub fn tangent(&self) -> [f64; 2] {
        let length = self.first[0].hypot(self.first[1]);
        [self.first[0] / length, self.first[1] / length]
    }

    /// Signed curvature (x' y'' - y' x'') / |c'|^3, 1/cm: negative where the curve turns clockwise, as for the balloon.
    #[must_use]
    pub fn curvature(&self) -> f64 {
        let ([x1, y1], [x2, y2]) = (self.first, self.second);
        (x1 * y2 - y1 * x2) / x1.hypot(y1).powi(3)
    }
}

/// Value and first two derivatives by t of a Chebyshev series (Clenshaw's recurrence and its derivatives).
fn clenshaw(coefficients: &[f64], t: f64) -> [f64; 3] {
    let (mut b, mut db, mut ddb) = ([0.0; 2], [0.0; 2], [0.0; 2]);
    let Some((&mean, others)) = coefficients.split_first() else {
        return [0.0; 3];
    };
    for &c in others.iter().rev() {
        ddb = [4.0 * db[0] + 2.0 * t * ddb[0] - ddb[1], ddb[0]];
        db = [2.0 * b[0] + 2.0 * t * db[0] - db[1], db[0]];
        b = [c + 2.0 * t * b[0] - b[1], b[0]];
    }
    [
        mean + t * b[0] - b[1],
        b[0] + t * db[0] - db[1],
        2.0 * db[0] + t * ddb[0] - ddb[1],
    ]
}
