//! Singular points of integrals along the axis.

/// Axial positions in an interval at which the area of a cross-section is not smooth.
pub(crate) struct Breaks {
    at: [f64; 80],
    len: usize,
}

impl Breaks {
    pub(crate) fn new(from: f64, to: f64) -> Self {
        let mut at = [0.0; 80];
        at[..2].copy_from_slice(&[from, to]);
        Self { at, len: 2 }
    }

    pub(crate) fn add(&mut self, x: f64) {
        // Two ends, eight corners, two crossings of each of twelve edges, two touches of each of six faces: 46 at most. Of a
        // wedge's sides six edges each, twelve crossings of the faces, two ends of the axis: 26.
        if self.at[0] < x && x < self.at[1] {
            self.at[self.len] = x;
            self.len += 1;
        }
    }

    pub(crate) fn sorted(&mut self) -> &[f64] {
        let at = &mut self.at[..self.len];
        at.sort_by(f64::total_cmp);
        at
    }
}
