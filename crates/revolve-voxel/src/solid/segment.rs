//! Straight segments of a meridian, and bounds on rounding.

/// Bound on the rounding of poses, angles and ray positions, relative to their sizes: directions this close to parallel or
/// perpendicular to the axis are parallel or perpendicular.
pub(crate) const ROUNDING: f64 = 64.0 * f64::EPSILON;

/// A straight segment of the closed meridian: a cone, cylinder or disc of the surface.
///
/// The path runs from the base to the apex with the solid on its right, so `(-tr, tx)` points outward.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Segment {
    pub(crate) x0: f64,
    pub(crate) r0: f64,
    pub(crate) x1: f64,
    pub(crate) r1: f64,
    /// Unit tangent.
    pub(crate) tx: f64,
    pub(crate) tr: f64,
    /// Slant length.
    pub(crate) length: f64,
    /// Sum of the unit normals that meet at the start (end): determines the sign of distances to it.
    pub(crate) start_normal: [f64; 2],
    pub(crate) end_normal: [f64; 2],
}

impl Segment {
    pub(crate) fn start(&self) -> [f64; 2] {
        [self.x0, self.r0]
    }

    pub(crate) fn end(&self) -> [f64; 2] {
        [self.x1, self.r1]
    }

    /// [x_min, x_max, r_min, r_max].
    pub(crate) fn bounds(&self) -> [f64; 4] {
        [
            self.x0.min(self.x1),
            self.x0.max(self.x1),
            self.r0.min(self.r1),
            self.r0.max(self.r1),
        ]
    }

    pub(crate) fn new(a: [f64; 2], b: [f64; 2]) -> Self {
        let (dx, dr) = (b[0] - a[0], b[1] - a[1]);
        let length = dx.hypot(dr);
        let (tx, tr) = (dx / length, dr / length);
        Self {
            x0: a[0],
            r0: a[1],
            x1: b[0],
            r1: b[1],
            tx,
            tr,
            length,
            start_normal: [-tr, tx],
            end_normal: [-tr, tx],
        }
    }
}

/// Returns the point of a chord nearest to a given point: the fraction along it, and the squared distance.
pub(crate) fn on_chord(p: [f64; 2], [from, to]: [[f64; 2]; 2]) -> [f64; 2] {
    let [way, off] = [to, p].map(|end| [end[0] - from[0], end[1] - from[1]]);
    let length = way[0] * way[0] + way[1] * way[1];
    let along = match length > 0.0 {
        true => ((off[0] * way[0] + off[1] * way[1]) / length).clamp(0.0, 1.0),
        false => 0.0,
    };
    let off = [0, 1].map(|k| off[k] - along * way[k]);
    [along, off[0] * off[0] + off[1] * off[1]]
}
