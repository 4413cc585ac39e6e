//! temporary baseline
use super::rays::Tap;
use crate::Sample;
pub(super) fn gather<T: Sample>(lanes: usize, memory: &[T], taps: &[Tap<T>], sums: &mut [T]) {
    for tap in taps {
        let pixel = &memory[tap.pixel as usize * lanes..][..lanes];
        for (sum, &x) in sums.iter_mut().zip(pixel) {
            *sum += tap.weight * x;
        }
    }
}
pub(super) fn scatter<T: Sample>(lanes: usize, memory: &mut [T], taps: &[Tap<T>], ray: &[T]) {
    for tap in taps {
        let pixel = &mut memory[tap.pixel as usize * lanes..][..lanes];
        for (x, &y) in pixel.iter_mut().zip(ray) {
            *x += tap.weight * y;
        }
    }
}
