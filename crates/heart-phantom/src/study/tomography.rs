//! The three acquisitions of section 5: sinograms, reconstructions, measures.

use super::report;
use super::run::Run;
use crate::acquire::{Acquisition, Sinograms, acquire};
use crate::error::PhantomError;
use crate::truth::{Measures, Regions, truth};
use radon::{FbpOptions, FbpPlan, StackOrder, Window};

/// Activity of the cavity and of the wall.
pub(super) const ACTIVITY: [f64; 2] = [0.0, 1.0];
/// Largest error of a voxel's covered fraction in the truth: far below what 90 views resolve.
const TRUTH_TOLERANCE: f64 = 1e-3;
/// Seconds from a view to the next: 90 views over 180 degrees at 2 degrees a second.
const VIEW_INTERVAL: f64 = 1.0;
/// Phases of a whole-cycle average.
const QUADRATURE_POINTS: usize = 32;

/// The three acquisitions in the order of the report.
pub(super) const ACQUISITIONS: [(&str, Acquisition); 3] = [
    ("static", Acquisition::Static { phase: 0.0 }),
    (
        "short",
        Acquisition::Instants {
            interval: VIEW_INTERVAL,
        },
    ),
    (
        "long",
        Acquisition::WholeCycle {
            points: QUADRATURE_POINTS,
        },
    ),
];

/// One acquisition with its reconstruction.
pub(super) struct Reconstructed {
    /// Line integrals `[view][row][bin]`.
    pub(super) sinograms: Sinograms,
    /// Ram-Lak, `[z][y][x]`.
    pub(super) volume: Vec<f32>,
    /// Figures of Ram-Lak.
    pub(super) ram_lak: report::Acquisition,
    /// Figures of Hann.
    pub(super) hann: report::Acquisition,
}

/// Takes one acquisition, reconstructs it with both windows, measures it and writes sinogram,
/// volumes and truth.
pub(super) fn reconstruct(
    run: &mut Run<'_>,
    (name, acquisition): (&'static str, Acquisition),
    regions: &Regions,
) -> Result<Reconstructed, PhantomError> {
    let (n, views) = (run.camera.n_bins(), run.camera.n_views());
    run.stage("solving shapes");
    let solved = run.heart.shapes_solved();
    let clock = run.clock();
    acquisition.solve(&run.heart, &run.camera, &run.cycle)?;
    run.time.solve += clock.seconds();

    run.stage("projecting");
    let clock = run.clock();
    let sinograms = acquire(
        &run.heart,
        &run.camera,
        &run.cycle,
        acquisition,
        ACTIVITY,
        &|_| (),
    )?;
    run.time.project += clock.seconds();

    run.stage("truth");
    let clock = run.clock();
    // A scan of instants has no one truth.
    let truth = match acquisition {
        Acquisition::Instants { .. } => None,
        _ => Some(truth(
            &run.heart,
            &run.camera,
            &run.cycle,
            acquisition,
            ACTIVITY,
            TRUTH_TOLERANCE,
        )?),
    };
    run.write(name, "sinogram", &[views, n, n], &sinograms.samples)?;
    if let Some(truth) = &truth {
        run.write(name, "truth", &[n; 3], truth)?;
    }
    run.time.truth_and_files += clock.seconds();

    let mut volume = vec![0.0f32; n * n * n];
    let mut figures = Vec::new();
    // Hann first, so that the volume that is left for the pictures is Ram-Lak's.
    for (suffix, window) in [("hann", Window::Hann), ("ram-lak", Window::RamLak)] {
        run.stage("reconstructing");
        let clock = run.clock();
        let options = FbpOptions::default().with_window(window);
        let plan = FbpPlan::new(run.camera.geometry(), run.camera.image(), &options)?;
        plan.reconstruct_stack_into(
            &sinograms.samples,
            n,
            StackOrder::ViewSliceBin,
            &mut volume,
            &mut plan.scratch(),
        )?;
        run.time.reconstruct += clock.seconds();

        run.stage("measuring");
        let clock = run.clock();
        let measures = Measures::of(&volume, truth.as_deref(), regions, &run.camera)?;
        run.write(name, suffix, &[n; 3], &volume)?;
        run.time.truth_and_files += clock.seconds();
        figures.push(summarise(run, acquisition, &sinograms, solved, &measures));
    }
    let [hann, ram_lak] = figures
        .try_into()
        .unwrap_or_else(|_| unreachable!("two windows, two sets of figures"));
    Ok(Reconstructed {
        sinograms,
        volume,
        ram_lak,
        hann,
    })
}

fn summarise(
    run: &Run<'_>,
    acquisition: Acquisition,
    sinograms: &Sinograms,
    solved_before: usize,
    measures: &Measures,
) -> report::Acquisition {
    report::Acquisition {
        distinct_shapes: matches!(acquisition, Acquisition::Instants { .. })
            .then_some(sinograms.distinct_phases),
        quadrature_points: match acquisition {
            Acquisition::WholeCycle { points } => Some(points),
            _ => None,
        },
        quadrature_error: sinograms.quadrature_error,
        shapes_solved: run.heart.shapes_solved() - solved_before,
        rays_cast: sinograms.rays.cast,
        rays_skipped: sinograms.rays.skipped,
        rmse_truth: measures.rmse_truth,
        wall_mean: measures.wall_mean,
        wall_std: measures.wall_std,
        background_rms: measures.background_rms,
        cavity_mean: measures.cavity_mean,
        total_activity: measures.total_activity,
    }
}
