//! Results are bitwise identical for any number of threads, as a whole or by slabs; weights of time averages.

use crate::support;

use revolve_voxel::{ParallelDetector, RevolveError, VoxelGrid};
use support::*;

pub(crate) fn with_threads<T: Send>(n: usize, work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new()
        .num_threads(n)
        .build()
        .unwrap()
        .install(work)
}

#[test]
fn results_are_bitwise_independent_of_threads() {
    let body = heart(100);
    let rays = ParallelDetector::new(64, 48, [0.25, 0.3])
        .unwrap()
        .rays(0.4)
        .unwrap();
    let grid = VoxelGrid::centred([50, 46, 42], [0.3, 0.32, 0.34], [0.1, 0.0, -0.1]).unwrap();
    for tolerance in [0.1, 1e-3] {
        let run = |n| {
            with_threads(n, || {
                (
                    body.project::<f32>(&rays, &[0.2, 1.0]).unwrap(),
                    body.voxelize::<f32>(&grid, tolerance, &[0.2, 1.0]).unwrap(),
                )
            })
        };
        let one = run(1);
        assert_eq!(one, run(2));
        assert_eq!(one, run(3));
        // Slabs that are not aligned with blocks.
        let mut at = 0;
        for end in [5, 21, 42] {
            let mut slab = vec![0.0f32; grid.slice_len() * (end - at)];
            voxelize_add(&body, &grid, at..end, tolerance, &[0.2, 1.0], &mut slab).unwrap();
            assert_eq!(slab, one.1.0[at * grid.slice_len()..end * grid.slice_len()]);
            at = end;
        }
    }
}

#[test]
fn some_rows_equal_those_of_the_whole() {
    let body = heart(100);
    let rays = ParallelDetector::new(33, 20, [0.5, 0.7])
        .unwrap()
        .rays(0.4)
        .unwrap();
    let (whole, counters) = body.project::<f32>(&rays, &[0.2, 1.0]).unwrap();
    let mut sum = revolve_voxel::RayCounters::default();
    for rows in [0..1, 1..7, 7..20] {
        let some = rays.rows(rows.clone()).unwrap();
        let (cut, done) = body.project::<f32>(&some, &[0.2, 1.0]).unwrap();
        assert_eq!(cut, whole[33 * rows.start..33 * rows.end]);
        assert_eq!(some.ray(5, 0), rays.ray(5, rows.start));
        sum = sum + done;
    }
    assert_eq!(sum, counters);
    // Rows of rows.
    let twice = rays.rows(4..19).unwrap().rows(2..3).unwrap();
    let (cut, _) = body.project::<f32>(&twice, &[0.2, 1.0]).unwrap();
    assert_eq!(cut, whole[33 * 6..33 * 7]);
    assert!(matches!(
        rays.rows(19..21),
        Err(RevolveError::WrongLength { .. })
    ));
    assert!(matches!(
        rays.rows(3..3),
        Err(RevolveError::TooFew { given: 0, .. })
    ));
}

#[test]
fn adding_with_weights_is_the_weighted_sum() {
    let (a, b) = (heart(40), heart(60));
    let rays = ParallelDetector::new(40, 40, [0.4, 0.4])
        .unwrap()
        .rays(1.0)
        .unwrap();
    let mut sum = vec![0.0f64; 1600];
    a.project_add(&rays, &[0.0, 1.0], 0.25, &mut sum).unwrap();
    b.project_add(&rays, &[0.0, 1.0], 0.75, &mut sum).unwrap();
    let (ia, _) = a.project::<f64>(&rays, &[0.0, 1.0]).unwrap();
    let (ib, _) = b.project::<f64>(&rays, &[0.0, 1.0]).unwrap();
    for k in 0..1600 {
        assert!((sum[k] - 0.25 * ia[k] - 0.75 * ib[k]).abs() < 1e-13);
    }
}

#[test]
fn a_batch_equals_single_rays() {
    let body = heart(150);
    let rays = ParallelDetector::new(90, 70, [0.2, 0.22])
        .unwrap()
        .with_offset([0.03, -0.05])
        .unwrap()
        .rays(2.2)
        .unwrap();
    let (image, counters) = body.project::<f64>(&rays, &[0.0, 1.0]).unwrap();
    let mut hits = 0;
    for row in 0..70 {
        for bin in 0..90 {
            let one = body
                .line_integral(&rays.ray(bin, row).unwrap(), &[0.0, 1.0])
                .unwrap();
            // Two roundings of the position of a ray; grazing rays have half of the digits.
            assert!((image[row * 90 + bin] - one).abs() < 1e-6, "{bin} {row}");
            hits += u64::from(body.chord(1, &rays.ray(bin, row).unwrap()).unwrap() > 0.0)
                + u64::from(body.chord(0, &rays.ray(bin, row).unwrap()).unwrap() > 0.0);
        }
    }
    assert_eq!(counters.hit, hits);
    assert_eq!(counters.cast + counters.skipped, 90 * 70);
}
