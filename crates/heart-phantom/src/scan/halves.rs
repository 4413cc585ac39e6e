//! A view under way by two rules: the one with all points is the sum of two halves, the one with half the points twice the even half.

use crate::error::PhantomError;

/// Both halves of the rule for a view.
pub(super) struct Halves<'a> {
    even: &'a mut [f32],
    /// No samples as long as no point has a weight in it.
    odd: &'a mut Vec<f32>,
    both: Vec<f32>,
}

impl<'a> Halves<'a> {
    pub(super) fn new(even: &'a mut [f32], odd: &'a mut Vec<f32>) -> Self {
        let both = Vec::new();
        Self { even, odd, both }
    }

    /// Adds to both what `project` adds, times its weight, to an image; it is called once.
    pub(super) fn add<T>(
        &mut self,
        [even, odd]: [f64; 2],
        project: impl FnOnce(f64, &mut [f32]) -> Result<T, PhantomError>,
    ) -> Result<T, PhantomError> {
        if odd == 0.0 {
            return project(even, self.even);
        }
        self.odd.resize(self.even.len(), 0.0);
        if even == 0.0 {
            return project(odd, self.odd);
        }
        self.both.clear();
        self.both.resize(self.even.len(), 0.0);
        let done = project(1.0, &mut self.both)?;
        for (weight, target) in [(even, &mut *self.even), (odd, &mut self.odd[..])] {
            for (sum, value) in target.iter_mut().zip(&self.both) {
                *sum += (weight * f64::from(*value)) as f32;
            }
        }
        Ok(done)
    }
}
