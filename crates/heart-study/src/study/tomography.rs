//! The three acquisitions of section 5: sinograms, reconstructions, measures.

use super::report;
use super::run::Run;
use heart_phantom::radon::{FbpOptions, FbpPlan, StackOrder, Window};
use heart_phantom::{Acquisition, Measures, PhantomError, Regions, Sinograms, acquire};

/// Activity of the cavity and of the wall.
pub(super) const ACTIVITY: [f64; 2] = [0.0, 1.0];
/// Largest error of a voxel's covered fraction in the truth: far below what 90 views resolve.
const TRUTH_TOLERANCE: f64 = 1e-3;
/// Phases of a whole-cycle average.
const QUADRATURE_POINTS: usize = 32;

/// The three acquisitions in the order of the report. A camera's views are a second apart, 90 of them over 180 degrees at 2 degrees a
/// second.
pub(super) const ACQUISITIONS: [(&str, Acquisition); 3] = [
    ("static", Acquisition::still(0.0)),
    ("short", Acquisition::Instants),
    (
        "long",
        Acquisition::WholeCycle {
            points: QUADRATURE_POINTS,
        },
    ),
];

/// One acquisition and what was found of it.
pub(super) struct Reconstructed {
    /// Line integrals `[view][row][bin]`.
    pub(super) sinograms: Sinograms,
    /// Figures of Ram-Lak.
    pub(super) ram_lak: report::Acquisition,
    /// Figures of Hann.
    pub(super) hann: report::Acquisition,
}

/// The reconstructions and the truth of one acquisition, `[z][y][x]`; the reconstructions' memory is used again by the next one.
#[derive(Default)]
pub(super) struct Volumes {
    pub(super) ram_lak: Vec<f32>,
    hann: Vec<f32>,
    truth: Vec<f32>,
}

/// Takes one acquisition, reconstructs it with both windows, measures it and writes sinogram,
/// volumes and truth. Each file is written while what comes next is computed.
pub(super) fn reconstruct(
    run: &mut Run<'_>,
    (name, acquisition): (&'static str, Acquisition),
    regions: &Regions,
    volumes: &mut Volumes,
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

    let clock = run.clock();
    run.stage("truth");
    let truth_of = acquisition.truth_of(&run.cycle, &run.camera);
    let cube = [n; 3];
    let Volumes {
        ram_lak,
        hann,
        truth,
    } = volumes;
    let truth = beside(
        || run.write(name, "sinogram", &[views, n, n], &sinograms.samples),
        || {
            let (heart, camera, cycle) = (&run.heart, &run.camera, &run.cycle);
            *truth = Vec::new(); // gone before the next one comes
            *truth =
                heart_phantom::truth(heart, camera, cycle, acquisition, ACTIVITY, TRUTH_TOLERANCE)?;
            Ok(&truth[..])
        },
    )?;

    let fbp = |window, volume: &mut Vec<f32>| {
        let clock = run.clock();
        volume.resize(n * n * n, 0.0);
        let options = FbpOptions::default().with_window(window);
        let plan = FbpPlan::new(run.camera.geometry(), run.camera.image(), &options)?;
        plan.reconstruct_stack_into(
            &sinograms.samples,
            n,
            StackOrder::ViewSliceBin,
            volume,
            &mut plan.scratch(),
        )?;
        Ok(clock.seconds())
    };
    let measure = |volume: &[f32]| Measures::of(volume, Some(truth), regions, &run.camera);
    run.stage("reconstructing");
    let first = beside(
        || run.write(name, truth_of.file_name(), &cube, truth),
        || fbp(Window::Hann, hann),
    )?;
    let (second, of_hann) = beside(
        || run.write(name, "hann", &cube, hann),
        || Ok((fbp(Window::RamLak, ram_lak)?, measure(hann)?)),
    )?;
    run.stage("measuring");
    let of_ram_lak = beside(
        || run.write(name, "ram-lak", &cube, ram_lak),
        || measure(ram_lak),
    )?;
    run.time.reconstruct += first + second;
    run.time.truth_and_files += clock.seconds() - first - second;
    let figures = |measures| summarise(run, acquisition, &sinograms, solved, measures);
    let (ram_lak, hann) = (figures(&of_ram_lak), figures(&of_hann));
    Ok(Reconstructed {
        sinograms,
        ram_lak,
        hann,
    })
}

/// Writes a file on one thread while the others compute, if there are others.
fn beside<T: Send>(
    write: impl FnOnce() -> Result<(), PhantomError> + Send,
    compute: impl FnOnce() -> Result<T, PhantomError> + Send,
) -> Result<T, PhantomError> {
    let (written, computed) = rayon::join(write, compute);
    written?;
    computed
}

fn summarise(
    run: &Run<'_>,
    acquisition: Acquisition,
    sinograms: &Sinograms,
    solved_before: usize,
    measures: &Measures,
) -> report::Acquisition {
    report::Acquisition {
        distinct_shapes: matches!(acquisition, Acquisition::Instants)
            .then_some(sinograms.distinct_phases),
        quadrature_points: match acquisition {
            Acquisition::WholeCycle { points } => Some(points),
            _ => None,
        },
        quadrature_error: sinograms.quadrature_error,
        shapes_solved: run.heart.shapes_solved() - solved_before,
        rays_cast: sinograms.rays.cast,
        rays_skipped: sinograms.rays.skipped,
        truth: Some(acquisition.truth_of(&run.cycle, &run.camera)),
        rmse_truth: measures.rmse_truth,
        wall_mean: measures.wall_mean,
        wall_std: measures.wall_std,
        background_rms: measures.background_rms,
        cavity_mean: measures.cavity_mean,
        total_activity: measures.total_activity,
    }
}
