//! Sets of voxels against their definitions.

use proptest::prelude::*;
use revolve_voxel::{Mask, RevolveError};

fn masks() -> impl Strategy<Value = Mask> {
    (1usize..7, 1usize..7, 1usize..9).prop_flat_map(|(nz, ny, nx)| {
        proptest::collection::vec(proptest::bool::weighted(0.2), nz * ny * nx)
            .prop_map(move |set| Mask::new([nz, ny, nx], set).unwrap())
    })
}

fn coordinates(shape: [usize; 3], index: usize) -> [f64; 3] {
    let [_, ny, nx] = shape;
    [index / (ny * nx), index / nx % ny, index % nx].map(|i| i as f64)
}

proptest! {
    /// Against the definition: all pairs of voxels.
    #[test]
    fn farther_than_agrees_with_its_definition(mask in masks(), distance in 0.0..4.0f64) {
        let far = mask.farther_than(distance);
        for (i, &is_far) in far.as_slice().iter().enumerate() {
            let p = coordinates(mask.shape(), i);
            let near = mask.as_slice().iter().enumerate().any(|(j, &set)| {
                let q = coordinates(mask.shape(), j);
                let squared: f64 = p.iter().zip(&q).map(|(a, b)| (a - b) * (a - b)).sum();
                set && squared <= distance * distance
            });
            prop_assert_eq!(is_far, !near);
        }
    }

    /// A voxel survives `k` erosions if all voxels within city-block distance `k` are in the
    /// set (and in the grid).
    #[test]
    fn erosion_is_a_city_block_ball(mask in masks(), steps in 0usize..3) {
        let mut eroded = mask.clone();
        eroded.erode(steps);
        let [nz, ny, nx] = mask.shape();
        for (i, &kept) in eroded.as_slice().iter().enumerate() {
            let [z, y, x] = coordinates(mask.shape(), i).map(|c| c as isize);
            let k = steps as isize;
            let mut expected = true;
            for dz in -k..=k { for dy in -k..=k { for dx in -k..=k {
                if dz.abs() + dy.abs() + dx.abs() <= k {
                    let (z, y, x) = (z + dz, y + dy, x + dx);
                    let inside = (0..nz as isize).contains(&z) && (0..ny as isize).contains(&y) && (0..nx as isize).contains(&x);
                    expected &= inside && mask.as_slice()[((z as usize) * ny + y as usize) * nx + x as usize];
                }
            }}}
            prop_assert_eq!(kept, expected);
        }
    }
}

#[test]
fn erosion_ends_at_the_empty_set() {
    // One step more than the last one that leaves a voxel, and the largest number of steps.
    let full = Mask::new([5, 7, 6], vec![true; 210]).unwrap();
    for (steps, left) in [(2, 3 * 2), (3, 0), (usize::MAX, 0)] {
        let mut mask = full.clone();
        mask.erode(steps);
        assert_eq!(mask.count(), left, "{steps}");
    }
}

#[test]
fn slices() {
    let set = (0..8).map(|i| i > 2).collect();
    let mut mask = Mask::new([2, 2, 2], set).unwrap();
    assert_eq!(mask.count(), 5);
    mask.intersect_slices(&[true, false, false, true]).unwrap();
    let kept: Vec<usize> = (0..8).filter(|&i| mask.as_slice()[i]).collect();
    assert_eq!(kept, [3, 4, 7]);
    assert!(matches!(
        mask.intersect_slices(&[true]),
        Err(RevolveError::WrongLength { given: 1, .. })
    ));
}

#[test]
fn sets_are_united_and_intersected() {
    let mask = |bits: [u8; 4]| Mask::new([1, 2, 2], bits.map(|b| b == 1).to_vec()).unwrap();
    let mut set = mask([1, 1, 0, 0]);
    set.unite(&mask([1, 0, 1, 0])).unwrap();
    assert_eq!(set, mask([1, 1, 1, 0]));
    set.intersect(&mask([0, 1, 1, 1])).unwrap();
    assert_eq!(set, mask([0, 1, 1, 0]));
    // The same number of voxels in another shape: an error without a change.
    let other = Mask::new([2, 2, 1], vec![true; 4]).unwrap();
    assert!(matches!(
        set.unite(&other),
        Err(RevolveError::WrongLength {
            expected: 1,
            given: 2,
            ..
        })
    ));
    assert!(matches!(
        set.intersect(&other),
        Err(RevolveError::WrongLength { .. })
    ));
    assert_eq!(set, mask([0, 1, 1, 0]));
}

#[test]
fn a_wrong_length_is_rejected() {
    assert!(matches!(
        Mask::new([2, 2, 2], vec![true; 7]),
        Err(RevolveError::WrongLength {
            expected: 8,
            given: 7,
            ..
        })
    ));
    assert!(matches!(
        Mask::new([usize::MAX, 2, 2], vec![]),
        Err(RevolveError::TooLarge { .. })
    ));
    assert_eq!(
        Mask::new([0, 3, 0], vec![])
            .unwrap()
            .farther_than(2.0)
            .count(),
        0
    );
    assert_eq!(
        Mask::new([1, 1, 2], vec![true, false])
            .unwrap()
            .farther_than(-1.0)
            .count(),
        2
    );
}
