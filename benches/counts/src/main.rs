//! The kernels whose instructions `cargo xtask counts` counts: `counts NAME` runs one of them, `counts` lists them with the instruction set.
//!
//! Everything runs on the main thread. Only the instructions within [`collected`] are counted, after the preparation of input and plan.

#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]

use std::f64::consts::PI;
use std::hint::black_box;

use membrane_newton::{
    BandMatrix, BandedLu, Control, Discretisation, Membrane, NewtonOptions, ReferenceShape, Solver,
};
use radon::{
    Collimator, FbpMethod, FbpOptions, FbpPlan, ImageGrid, InstructionSet, Kernel, LinearOperator,
    ParallelGeometry, ParallelHoles, Projector, SliceAxis, SpectGeometry, SpectOperator,
    SpectOptions, StackOrder,
};
use revolve_voxel::{Body, Meridian, ParallelDetector, Pose, VoxelGrid};

const KERNELS: [(&str, fn()); 10] = [
    ("banded-lu", banded_lu),
    ("newton-spectral", newton_spectral),
    ("fbp-direct", fbp_direct),
    ("fbp-fourier", fbp_fourier),
    ("strip-forward", strip_forward),
    ("joseph-adjoint", joseph_adjoint),
    ("spect-forward", || spect(true)),
    ("spect-adjoint", || spect(false)),
    ("chords", chords),
    ("voxels", voxels),
];

fn main() {
    // The main thread is the only one of the pool, so that all work is counted.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1);
    pool.use_current_thread().build_global().unwrap();
    match std::env::args().nth(1) {
        Some(name) => KERNELS.iter().find(|(known, _)| *known == name).unwrap().1(),
        None => {
            println!("{:?}", InstructionSet::detect());
            KERNELS.iter().for_each(|(name, _)| println!("{name}"));
        }
    }
}

/// The function whose instructions are counted.
#[inline(never)]
fn collected(work: &mut dyn FnMut()) {
    work();
}

/// Samples between 0 and 2.
fn samples<T>(n: usize, of: fn(f64) -> T) -> Vec<T> {
    (0..n).map(|k| of(1.0 + (0.7 * k as f64).sin())).collect()
}

fn banded_lu() {
    let (n, lower) = (4000, 4);
    let mut matrix = BandMatrix::zeros(n, lower, lower).unwrap();
    for i in 0..n {
        for j in i.saturating_sub(lower)..(i + lower + 1).min(n) {
            // Without a dominant diagonal, so that rows are exchanged.
            matrix
                .add(i, j, (3.0 * i as f64 + 7.0 * j as f64).sin())
                .unwrap();
        }
    }
    let (mut lu, mut x) = (BandedLu::for_matrix(&matrix), samples(n, |x| x));
    collected(&mut || {
        lu.factor(&matrix).unwrap();
        lu.solve_into(&mut x).unwrap();
    });
    black_box(x);
}

fn newton_spectral() {
    let membrane = Membrane::new(ReferenceShape::balloon(8.5, 1.75).unwrap());
    let discretisation = Discretisation::Spectral {
        degree: 14,
        per_piece: 1,
    };
    let solver = Solver::new(&membrane, discretisation).unwrap();
    let options = NewtonOptions::default();
    collected(&mut || {
        black_box(solver.solve(Control::VolumeGain(0.6), &options).unwrap());
    });
}

fn fbp(n: usize, n_slices: usize, method: FbpMethod) {
    let geometry = ParallelGeometry::half_turn(n / 2, n, 1.0).unwrap();
    let grid = ImageGrid::square(n, 1.0).unwrap();
    let options = FbpOptions::default().with_method(method);
    let plan = FbpPlan::<f32>::new(&geometry, &grid, &options).unwrap();
    let data = samples(n_slices * plan.sinogram_len(), |x| x as f32);
    let mut volume = vec![0.0; n_slices * plan.image_len()];
    let (order, mut scratch) = (StackOrder::ViewSliceBin, radon::FbpScratch::default());
    collected(&mut || {
        plan.reconstruct_slab_into(
            &data,
            n_slices,
            order,
            0..n_slices,
            &mut volume,
            &mut scratch,
        )
        .unwrap();
    });
    black_box(volume);
}

fn fbp_direct() {
    fbp(64, 32, FbpMethod::Direct);
}

fn fbp_fourier() {
    fbp(256, 1, FbpMethod::Fourier { tolerance: 1e-3 });
}

fn strip_forward() {
    let geometry = ParallelGeometry::half_turn(32, 64, 1.0).unwrap();
    let grid = ImageGrid::square(64, 1.0).unwrap();
    let projector = Projector::new(&geometry, &grid, Kernel::Strip).unwrap();
    let operator = projector
        .stack_operator(32, StackOrder::ViewSliceBin)
        .unwrap();
    let image = samples(operator.image_len(), |x| x as f32);
    let mut data = vec![0.0; operator.data_len()];
    collected(&mut || operator.forward_into(&image, &mut data).unwrap());
    black_box(data);
}

fn joseph_adjoint() {
    let geometry = ParallelGeometry::half_turn(64, 128, 1.0).unwrap();
    let grid = ImageGrid::square(128, 1.0).unwrap();
    let projector = Projector::new(&geometry, &grid, Kernel::Joseph).unwrap();
    let data = samples(geometry.sinogram_len(), |x| x as f32);
    let mut image = vec![0.0; grid.image_len()];
    collected(&mut || projector.adjoint_into(&data, &mut image).unwrap());
    black_box(image);
}

fn spect(forward: bool) {
    let (views, axis) = (
        ParallelGeometry::full_turn(8, 32, 0.5),
        SliceAxis::new(32, 0.5),
    );
    let (views, axis) = (views.unwrap(), axis.unwrap());
    let geometry = SpectGeometry::circular(&views, &axis, 12.0).unwrap();
    let grid = ImageGrid::square(32, 0.5).unwrap();
    let collimator = Collimator::parallel_holes(&ParallelHoles::GE_LEHR, 0.38).unwrap();
    let options = SpectOptions::default()
        .with_collimator(collimator)
        .with_attenuation(vec![0.1_f32; 32 * 32 * 32]);
    let operator = SpectOperator::new(&geometry, &grid, &axis, &options).unwrap();
    let mut image = samples(operator.image_len(), |x| x as f32);
    let mut data = samples(operator.data_len(), |x| x as f32);
    collected(&mut || match forward {
        true => operator.forward_into(&image, &mut data).unwrap(),
        false => operator.adjoint_into(&data, &mut image).unwrap(),
    });
    black_box((image, data));
}

/// Two nested half ellipsoids of 400 segments.
fn body() -> Body {
    let layer = |a: f64, b: f64| {
        let point = |k: usize| {
            let angle = 0.5 * PI * k as f64 / 400.0;
            [a * angle.sin(), if k < 400 { b * angle.cos() } else { 0.0 }]
        };
        Meridian::new(&(0..=400).map(point).collect::<Vec<_>>()).unwrap()
    };
    let pose = Pose::axis_along_z(4.0).unwrap();
    Body::new(vec![layer(7.0, 2.0), layer(8.0, 3.0)], pose).unwrap()
}

fn chords() {
    let (body, detector) = (body(), ParallelDetector::new(96, 96, [0.1, 0.1]).unwrap());
    let rays = detector.rays(0.4).unwrap();
    collected(&mut || {
        black_box(body.project::<f32>(&rays, &[0.3, 1.0]).unwrap());
    });
}

fn voxels() {
    let (body, grid) = (body(), VoxelGrid::cube(32, 0.3).unwrap());
    let tolerance = 1e-3;
    collected(&mut || {
        black_box(body.voxelize::<f32>(&grid, tolerance, &[0.3, 1.0]).unwrap());
    });
}
