//! Covered fractions of voxels, by points.

use nalgebra::Vector3;
use tests::Random;

/// With so many points the covered fraction of a voxel that a plane cuts has an error below 1e-3, a third of the smallest tolerance.
const N: u32 = 48 * 48 * 48;
/// Powers of the inverse of the real root of g^4 = g + 1, whose multiples are evenly distributed in a cube. No plane contains many of the points, as planes
/// along a lattice do.
const STEPS: [f64; 3] = [
    0.819_172_513_396_164_5,
    0.671_043_606_703_789_3,
    0.549_700_477_901_971,
];

/// Returns the fraction of a voxel whose offsets from its centre are inside.
pub(crate) fn covered(spacing: [f64; 3], inside: impl Fn(Vector3<f64>) -> bool) -> f64 {
    let point = |k: &u32| {
        let at = |axis: usize| (f64::from(*k) * STEPS[axis] + 0.5).fract() - 0.5;
        inside(Vector3::from(
            [0, 1, 2].map(|axis| at(axis) * spacing[axis]),
        ))
    };
    (0..N).filter(point).count() as f64 / f64::from(N)
}

/// The volume of a unit cube around the origin below a plane, by inclusion and exclusion of corners.
#[test]
fn planes_cut_the_exact_volume() {
    let mut random = Random::new(1);
    let mut worst = 0.0f64;
    for k in 0..60 {
        let normal = match k % 4 {
            3 => [0, 1, 2].map(|_| random.any(0.01, 1.0)),
            axis => [0, 1, 2].map(|other| if axis == other { 1.0 } else { 1e-3 }),
        };
        let height = random.any(-0.4, 0.4) * normal.iter().sum::<f64>();
        let below = |corner: u32| {
            let at = |axis: usize| f64::from(corner >> axis & 1) * normal[axis];
            let depth = height + normal.iter().sum::<f64>() / 2.0 - at(0) - at(1) - at(2);
            let sign = if corner.count_ones().is_multiple_of(2) {
                1.0
            } else {
                -1.0
            };
            sign * depth.max(0.0).powi(3) / 6.0
        };
        let exact = (0..8).map(below).sum::<f64>() / normal.iter().product::<f64>();
        let found = covered([1.0; 3], |p| p.dot(&Vector3::from(normal)) < height);
        worst = worst.max((found - exact).abs());
    }
    assert!(worst < 1e-3, "{worst}");
}
