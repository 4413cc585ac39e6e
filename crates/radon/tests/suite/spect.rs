//! The SPECT operator against its definition, its adjoint, reproducibility, rejected input.

mod bad_inputs;

use crate::common;

use common::noise;
use common::spect::PlainCamera;
use radon::{
    Collimator, HoleResponse, ImageGrid, Kernel, LinearOperator, ParallelGeometry, ParallelHoles,
    Projector, RadonError, Sample, SliceAxis, SpectGeometry, SpectOperator, SpectOptions,
    StackOrder, adjoint_mismatch,
};

/// A small camera whose pitches, sizes and offsets are all different, with views over a full turn, one of them at a multiple of 45 degrees.
struct Small {
    geometry: SpectGeometry,
    grid: ImageGrid,
    layers: SliceAxis,
}

fn small() -> Small {
    let angles = [0.0, 0.4, std::f64::consts::FRAC_PI_4, 2.0, -1.9, 5.0];
    let views = ParallelGeometry::new(angles, 17, 0.55).unwrap();
    let views = views.with_offset(0.13).unwrap();
    let rows = SliceAxis::new(9, 0.7).unwrap().with_centre(-0.2).unwrap();
    let radii = [6.0, 7.0, 6.5, 8.0, 6.0, 9.0];
    Small {
        geometry: SpectGeometry::new(&views, &rows, radii).unwrap(),
        grid: ImageGrid::anisotropic(13, 10, [0.5, 0.6])
            .unwrap()
            .with_centre([0.3, -0.2])
            .unwrap(),
        layers: SliceAxis::new(11, 0.6).unwrap(),
    }
}

impl Small {
    fn n_voxels(&self) -> usize {
        self.grid.image_len() * self.layers.n_slices()
    }

    fn operator<T: Sample>(&self, options: &SpectOptions<T>) -> SpectOperator<T> {
        SpectOperator::new(&self.geometry, &self.grid, &self.layers, options).unwrap()
    }

    fn map<T: Sample>(&self) -> Vec<T> {
        let noise: Vec<T> = noise(self.n_voxels(), 5);
        noise
            .iter()
            .map(|x| T::of(0.15 * (1.0 + x.f64())))
            .collect()
    }
}

fn eleven_views(rows: &SliceAxis) -> SpectGeometry {
    let angles: Vec<f64> = (0..11).map(|k| 0.3 * f64::from(k)).collect();
    let views = ParallelGeometry::new(angles, 17, 0.55).unwrap();
    SpectGeometry::circular(&views, rows, 9.0).unwrap()
}

/// Wide enough that the farthest planes are 3 bins wide.
fn wide() -> Collimator {
    Collimator::new(0.1, 0.15, 0.2).unwrap()
}

fn options<T: Sample>(collimator: Collimator, map: Vec<T>) -> SpectOptions<T> {
    SpectOptions::default()
        .with_collimator(collimator)
        .with_attenuation(map)
}

fn forward<T: Sample>(operator: &SpectOperator<T>, volume: &[T]) -> Vec<T> {
    let mut views = vec![T::ONE; operator.data_len()];
    operator.forward_into(volume, &mut views).unwrap();
    views
}

fn largest(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |m, x| m.max(x.abs()))
}

#[test]
fn views_agree_with_the_definition() {
    let small = small();
    let volume: Vec<f64> = noise(small.n_voxels(), 1)
        .iter()
        .map(|x: &f64| 1.0 + x)
        .collect();
    let map: Vec<f64> = small.map();
    let dense = map.iter().map(|mu| 20.0 * mu).collect();
    // A few voxels in air.
    let sparse = map
        .iter()
        .enumerate()
        .map(|(k, mu)| if k % 13 == 4 { *mu } else { 0.0 })
        .collect();
    let even = Collimator::new(0.0, 0.6, 0.5).unwrap();
    // Without blur to rounding. Weights of a blur that is the same at all depths are dropped below 1.5e-5 of the central one. A depth-dependent blur
    // is accurate to the tolerance for peaks, which random voxels are not.
    for (collimator, map, most) in [
        (Collimator::default(), vec![], 1e-12),
        (Collimator::default(), map.clone(), 1e-12),
        (Collimator::default(), dense, 1e-12),
        (Collimator::default(), sparse, 1e-12),
        (even, map.clone(), 1e-5),
        (wide(), vec![], 1e-3),
        (wide(), map, 1e-3),
    ] {
        let plain = PlainCamera {
            geometry: &small.geometry,
            grid: &small.grid,
            layers: &small.layers,
            collimator,
            attenuation: &map,
        };
        let expected = plain.views(&volume);
        let views = forward(&small.operator(&options(collimator, map.clone())), &volume);
        let off: Vec<f64> = views.iter().zip(&expected).map(|(a, b)| a - b).collect();
        let off = largest(&off) / largest(&expected);
        println!("{collimator:?}, {} voxels attenuate: {off:.2e}", map.len());
        assert!(off < most, "{off}");
    }
}

/// A detector smaller than the volume: activity beside it is blurred into it.
#[test]
fn activity_beside_the_detector_is_blurred_into_the_views() {
    let small = small();
    let views = ParallelGeometry::new([0.4, 2.2], 5, 0.4).unwrap();
    let rows = SliceAxis::new(3, 0.5).unwrap();
    let geometry = SpectGeometry::circular(&views, &rows, 7.0).unwrap();
    let volume: Vec<f64> = noise(small.n_voxels(), 1)
        .iter()
        .map(|x: &f64| 1.0 + x)
        .collect();
    let collimator = Collimator::new(0.0, 0.5, 0.4).unwrap();
    let (grid, layers) = (&small.grid, &small.layers);
    let map = small.map();
    let plain = PlainCamera {
        geometry: &geometry,
        grid,
        layers,
        collimator,
        attenuation: &map,
    };
    let expected = plain.views(&volume);
    let operator =
        SpectOperator::new(&geometry, grid, layers, &options(collimator, map.clone())).unwrap();
    for (a, b) in forward(&operator, &volume).iter().zip(&expected) {
        // A fraction of 3e-5 of a Gaussian lies beyond each of the four sides.
        assert!((a / b - 1.0).abs() < 1.3e-4, "{a} {b}");
    }
}

#[test]
fn without_blur_and_attenuation_the_operator_equals_the_projector_of_strips() {
    let small = small();
    let axis = SliceAxis::new(11, 0.6).unwrap();
    let geometry = SpectGeometry::circular(small.geometry.views(), &axis, 50.0).unwrap();
    let options = SpectOptions::default();
    let operator = SpectOperator::new(&geometry, &small.grid, &axis, &options).unwrap();
    let volume: Vec<f64> = noise(small.n_voxels(), 2);
    let strips = Projector::new(geometry.views(), &small.grid, Kernel::Strip).unwrap();
    let expected = strips
        .stack_operator(11, StackOrder::ViewSliceBin)
        .and_then(|a| a.forward(&volume))
        .unwrap();
    for (a, b) in forward(&operator, &volume).iter().zip(&expected) {
        // Sums of some 20 voxels of size 1.
        assert!((a - b).abs() < 1e-13, "{a} {b}");
    }
}

#[test]
fn the_adjoint_is_the_transpose() {
    let small = small();
    for collimator in [Collimator::default(), wide()] {
        for attenuated in [false, true] {
            let map = |on: bool| if on { small.map() } else { vec![] };
            let operator = small.operator(&options(collimator, map(attenuated)));
            let off = adjoint_mismatch::<f64, _>(&operator, 3).unwrap();
            assert!(off < 1e-14, "{off}");
            for part in operator.subsets(4).unwrap() {
                let off = adjoint_mismatch::<f64, _>(part.operator(), 3).unwrap();
                assert!(off < 1e-14, "{off}");
            }
            let map = if attenuated { small.map() } else { vec![] };
            let off =
                adjoint_mismatch::<f32, _>(&small.operator(&options(collimator, map)), 3).unwrap();
            // Rounding errors of f32 in sums of a few hundred terms with either sign.
            assert!(off < 1e-6, "{off}");
        }
    }
}

#[test]
fn results_are_bitwise_independent_of_threads() {
    let (small, options) = (small(), options::<f32>(wide(), small().map()));
    // More views than one thread computes at a time.
    let geometry = eleven_views(&SliceAxis::new(9, 0.7).unwrap());
    let operator = SpectOperator::new(&geometry, &small.grid, &small.layers, &options).unwrap();
    let (x, y) = (
        noise(operator.image_len(), 6),
        noise(operator.data_len(), 7),
    );
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let mut back = vec![0.0; x.len()];
        let views = pool.build().unwrap().install(|| {
            operator.adjoint_into(&y, &mut back).unwrap();
            forward(&operator, &x)
        });
        (views, back)
    };
    let one = run(1);
    assert!([2, 3, 5].into_iter().all(|threads| run(threads) == one));
}

/// Eight views are computed at a time on one thread. The rows of the detector extend beyond those of the volume by more than a block, which
/// sums of earlier views must not fill.
#[test]
fn views_are_bitwise_independent_of_those_projected_before() {
    let small = small();
    let geometry = eleven_views(&SliceAxis::new(60, 0.7).unwrap());
    let options = options::<f32>(wide(), small.map());
    let new = || SpectOperator::new(&geometry, &small.grid, &small.layers, &options).unwrap();
    let x = noise(small.n_voxels(), 6);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1);
    let all = pool.build().unwrap().install(|| forward(&new(), &x));
    for (view, samples) in all.chunks(geometry.view_len()).enumerate() {
        let (alone, _) = new().subsets(11).unwrap().swap_remove(view).into_parts();
        assert_eq!(forward(&alone, &x), samples, "{view}");
    }
}

/// With all lengths in another unit, samples scale as lengths; exactly for a power of two.
#[test]
fn samples_scale_with_the_unit_of_length() {
    let views = |unit: f64| {
        let angles = [0.0, 0.4, std::f64::consts::FRAC_PI_2, 2.0, -1.9];
        let views = ParallelGeometry::new(angles, 17, 0.55 * unit).unwrap();
        let views = views.with_offset(0.13 * unit).unwrap();
        let rows = SliceAxis::new(9, 0.7 * unit).unwrap();
        let geometry = SpectGeometry::circular(&views, &rows, 9.0 * unit).unwrap();
        let grid = ImageGrid::anisotropic(13, 4, [0.5 * unit, 0.6 * unit]).unwrap();
        let layers = SliceAxis::new(11, 0.6 * unit).unwrap();
        let n = grid.image_len() * layers.n_slices();
        let map = noise::<f64>(n, 5)
            .into_iter()
            .map(|x| 0.15 * (1.0 + x) / unit);
        let collimator = Collimator::new(0.1, 0.15 * unit, 0.2 * unit).unwrap();
        let options = options(collimator, map.collect());
        let operator = SpectOperator::new(&geometry, &grid, &layers, &options).unwrap();
        let samples = forward(&operator, &noise::<f64>(n, 6));
        samples
            .iter()
            .map(|sample| sample / unit)
            .collect::<Vec<_>>()
    };
    let expected = views(1.0);
    assert!([0.125, 8.0].into_iter().all(|unit| views(unit) == expected));
}

/// Another map, with the same or other attenuating pixels, or none: bitwise identical to an operator with this map, also for subsets.
#[test]
fn replacing_the_map_is_bitwise_identical_to_a_new_operator() {
    let small = small();
    let map: Vec<f64> = small.map();
    let thin: Vec<f64> = map.iter().map(|mu| 0.3 * mu).collect();
    let pixels = small.grid.image_len();
    let inner = (0..map.len())
        .map(|k| if k % pixels < 60 { map[k] } else { 0.0 })
        .collect();
    let x: Vec<f64> = noise(small.n_voxels(), 8);
    let first = small.operator(&options(wide(), map));
    for map in [thin, inner, vec![]] {
        let new = small.operator(&options(wide(), map.clone()));
        let other = first.with_attenuation(&map).unwrap();
        assert_eq!(forward(&other, &x), forward(&new, &x));
        let part = first.subsets(4).unwrap().swap_remove(1);
        let part = part.operator().with_attenuation(&map).unwrap();
        let new = new.subsets(4).unwrap().swap_remove(1);
        assert_eq!(forward(&part, &x), forward(new.operator(), &x));
    }
    let wrong = first.with_attenuation(&[-1.0]).unwrap_err();
    assert!(
        matches!(wrong, RadonError::WrongLength { given: 1, .. }),
        "{wrong}"
    );
}

/// A subset is bitwise identical to its views and lists the indices of their data.
#[test]
fn subsets_are_parts_of_the_whole() {
    let small = small();
    let operator = small.operator::<f64>(&options(wide(), small.map()));
    let x: Vec<f64> = noise(operator.image_len(), 8);
    let whole = forward(&operator, &x);
    let mut seen = vec![0; whole.len()];
    let subsets = operator.subsets(4).unwrap();
    assert_eq!(subsets[1].operator().views(), [1, 5]);
    for part in &subsets {
        for (value, &index) in forward(part.operator(), &x).iter().zip(part.data()) {
            assert_eq!(*value, whole[index]);
            seen[index] += 1;
        }
    }
    assert!(seen.iter().all(|&n| n == 1));
    // A subset of a subset: views 1 and 5 one by one.
    let nested = subsets[1].operator().subsets(2).unwrap();
    assert_eq!(nested[1].operator().views(), [5]);
    let own = forward(subsets[1].operator(), &x);
    for (value, &index) in forward(nested[1].operator(), &x)
        .iter()
        .zip(nested[1].data())
    {
        assert_eq!(*value, own[index]);
    }
}

/// Each voxel separately: no sample of its views is below zero, as EM requires.
#[test]
fn no_entry_is_negative() {
    let small = small();
    for tolerance in [1e-4, 0.1] {
        let options = options(wide(), small.map()).with_tolerance(tolerance);
        let operator = small.operator::<f64>(&options);
        for voxel in (0..small.n_voxels()).step_by(97) {
            let mut volume = vec![0.0; small.n_voxels()];
            volume[voxel] = 1.0;
            let views = forward(&operator, &volume);
            assert!(views.iter().all(|&x| x >= 0.0) && views.iter().any(|&x| x > 0.0));
        }
    }
}

/// The peak of a point is too high by at most the tolerance and never too low; the largest error is at least half the tolerance.
#[test]
fn peaks_meet_the_tolerance() {
    let views = ParallelGeometry::new([0.0], 65, 0.3).unwrap();
    let axis = SliceAxis::new(65, 0.3).unwrap();
    let geometry = SpectGeometry::circular(&views, &axis, 15.0).unwrap();
    let (grid, layer) = (
        ImageGrid::new(1, 90, 0.3).unwrap(),
        SliceAxis::new(1, 0.3).unwrap(),
    );
    let collimator = Collimator::new(0.04, 0.06, 0.2).unwrap();
    let peaks = |tolerance: f64| -> Vec<f64> {
        let options = SpectOptions::default()
            .with_collimator(collimator)
            .with_tolerance(tolerance);
        let operator = SpectOperator::new(&geometry, &grid, &layer, &options).unwrap();
        let peak = |iy: usize| {
            let mut volume = vec![0.0; 90];
            volume[iy] = 1.0;
            largest(&forward(&operator, &volume))
        };
        (0..90).step_by(7).map(peak).collect()
    };
    let mut worst: f64 = 0.0;
    for (found, fine) in peaks(0.01).iter().zip(&peaks(1e-4)) {
        let off = found / fine - 1.0;
        // 1e-4: errors of the finer operator and of successive blurs.
        assert!((-2e-4..0.01).contains(&off), "{off}");
        worst = worst.max(off);
    }
    assert!(worst > 0.005, "{worst}");
}

/// One pixel and one bin, a volume outside all rows, rows and bins much wider and much narrower than voxels.
#[test]
fn extreme_shapes_of_volume_and_detector() {
    let one = ParallelGeometry::new([0.7], 1, 3.0).unwrap();
    let seen =
        |views: &ParallelGeometry, rows: SliceAxis, layers: SliceAxis, n: usize, radius: f64| {
            let geometry = SpectGeometry::circular(views, &rows, radius).unwrap();
            let grid = ImageGrid::square(n, 1.0).unwrap();
            let map = vec![0.1; n * n * layers.n_slices()];
            let operator =
                SpectOperator::new(&geometry, &grid, &layers, &options(wide(), map)).unwrap();
            let volume = vec![1.0; operator.image_len()];
            assert!(adjoint_mismatch::<f64, _>(&operator, 3).unwrap() < 1e-14);
            forward(&operator, &volume).iter().sum::<f64>()
        };
    let axis = |n: usize, spacing: f64| SliceAxis::new(n, spacing).unwrap();
    // A voxel of side 1 in a bin of 3 and a row of 3, less the part blurred out of it.
    let sum = seen(&one, axis(1, 3.0), axis(1, 1.0), 1, 5.0);
    assert!(sum > 0.08 && sum < 1.0 / 9.0, "{sum}");
    let above = axis(3, 1.0).with_centre(90.0).unwrap();
    assert_eq!(seen(&one, axis(1, 3.0), above, 4, 9.0), 0.0);
    let fine = ParallelGeometry::new([0.7], 300, 0.02).unwrap();
    assert!(seen(&fine, axis(2, 4.0), axis(50, 0.04), 2, 9.0) > 0.0);
    let coarse = ParallelGeometry::new([0.7], 2, 50.0).unwrap();
    assert!(seen(&coarse, axis(100, 0.02), axis(2, 1.0), 8, 9.0) > 0.0);
}
