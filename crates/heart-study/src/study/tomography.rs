//! The three acquisitions of section 5: sinograms, reconstructions, image quality.

use super::run::Run;
use crate::report;
use heart_phantom::radon::Window;
use heart_phantom::{ImageQuality, Mode, Phantom, PhantomError, Regions, Sinograms, no_observer};
use std::collections::BTreeSet;
use std::time::Instant;

/// The three acquisitions in the order of the report. Views are one second apart, 90 of them over 180 degrees at 2 degrees per
/// second.
pub(super) const ACQUISITIONS: [(&str, Mode); 3] = [
    ("static", Mode::Static { phase: 0.0 }),
    ("short", Mode::Instants),
    ("long", Mode::WholeCycle),
];

/// Arrays of each acquisition, of which it has one ground truth.
pub(super) const ARRAYS: [&str; 5] = [
    "sinogram",
    "truth",
    "truth-mean-of-views",
    "hann",
    "ram-lak",
];

/// One acquisition with its results.
pub(super) struct Reconstructed {
    /// Line integrals `[view][row][bin]`.
    pub(super) sinograms: Sinograms,
    /// Figures of Ram-Lak.
    pub(super) ram_lak: report::Acquisition,
    /// Figures of Hann.
    pub(super) hann: report::Acquisition,
}

/// Simulates one acquisition, reconstructs it with both windows, computes the image quality and writes sinogram, volumes and ground truth. Files
/// are written concurrently with the next computation. `volumes` contains the reconstructions with Ram-Lak and Hann, `[z][y][x]`;
/// the next acquisition reuses their memory.
pub(super) fn reconstruct(
    run: &mut Run<'_>,
    (name, mode): (&'static str, Mode),
    regions: &Regions,
    [ram_lak, hann]: &mut [Vec<f32>; 2],
) -> Result<Reconstructed, PhantomError> {
    let with = |window| {
        let mut scene = run.phantom.scene().clone().with_mode(mode);
        scene.reconstruction.window = window;
        run.phantom.with_scene(scene)
    };
    let (phantom, smooth) = (with(Window::RamLak)?, with(Window::Hann)?);
    let (camera, truth_of) = (phantom.camera(), phantom.truth_of());
    let (n, views) = (camera.n_bins(), camera.n_views());
    run.stage("solving shapes")?;
    let solved = run.phantom.heart().shapes_solved();
    let clock = Instant::now();
    phantom.solve(0)?;
    run.time.solve += clock.elapsed().as_secs_f64();

    run.stage("projecting")?;
    let clock = Instant::now();
    let sinograms = phantom.sinograms(0, &no_observer)?;
    run.time.project += clock.elapsed().as_secs_f64();

    let clock = Instant::now();
    run.stage("truth")?;
    let cube = [n; 3];
    let truth = beside(
        || run.write(name, "sinogram", &[views, n, n], &sinograms.samples),
        || phantom.truth(0),
    )?;
    let fbp = |phantom: &Phantom, volume: &mut Vec<f32>| {
        let clock = Instant::now();
        volume.resize(phantom.camera().grid().len(), 0.0);
        phantom.reconstruct_into(0, &sinograms.samples, volume, &no_observer)?;
        Ok(clock.elapsed().as_secs_f64())
    };
    let measure = |volume: &[f32]| ImageQuality::of(volume, Some(&truth), regions);
    run.stage("reconstructing")?;
    let first = beside(
        || run.write(name, truth_of.file_name(), &cube, &truth),
        || fbp(&smooth, hann),
    )?;
    let (second, of_hann) = beside(
        || run.write(name, "hann", &cube, hann),
        || Ok((fbp(&phantom, ram_lak)?, measure(hann)?)),
    )?;
    run.stage("measuring")?;
    let of_ram_lak = beside(
        || run.write(name, "ram-lak", &cube, ram_lak),
        || measure(ram_lak),
    )?;
    let steps = phantom.steps()?;
    let times = phantom.view_times(0)?;
    let phases: BTreeSet<u64> = times.iter().map(|time| time.phase.to_bits()).collect();
    let counts = [steps, phases.len(), solved];
    let figures = |quality| summarise(&phantom, counts, &sinograms, quality);
    let (ram_lak, hann) = (figures(of_ram_lak), figures(of_hann));
    run.time.reconstruct += first + second;
    run.time.truth_and_files += clock.elapsed().as_secs_f64() - first - second;
    Ok(Reconstructed {
        sinograms,
        ram_lak,
        hann,
    })
}

/// Writes a file on one thread while the others compute, if there are several.
fn beside<T: Send>(
    write: impl FnOnce() -> Result<(), PhantomError> + Send,
    compute: impl FnOnce() -> Result<T, PhantomError> + Send,
) -> Result<T, PhantomError> {
    let (written, computed) = rayon::join(write, compute);
    written?;
    computed
}

fn summarise(
    phantom: &Phantom,
    [steps, phases, solved_before]: [usize; 3],
    sinograms: &Sinograms,
    quality: ImageQuality,
) -> report::Acquisition {
    let mode = phantom.scene().acquisition.mode;
    let averaged = matches!(mode, Mode::WholeCycle);
    report::Acquisition {
        distinct_shapes: matches!(mode, Mode::Instants).then_some(phases),
        quadrature_points: averaged.then_some(steps),
        view_error: averaged.then(|| sinograms.view_error.total()),
        shapes_solved: phantom.heart().shapes_solved() - solved_before,
        rays_cast: sinograms.rays.cast,
        rays_skipped: sinograms.rays.skipped,
        truth: Some(phantom.truth_of()),
        quality,
    }
}
