//! A run: computes the products of a scene and writes them to a directory.

use super::read::json_text;
use super::run_report::{
    GateReport, MeasuredEjection, PictureReport, Progress, RunReport, SliceOrders,
};
use super::study::Scene;
use crate::error::{PhantomError, check_count};
use crate::files::{self, Folder};
use crate::observer::check_stop;
use crate::phantom::{Index, Needs};
use crate::{Mode, Observer, Phantom, Product, Sinograms, ViewReport};
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// A run in steps: [`run`] for a caller who uses the results of each gate.
///
/// ```
/// use heart_phantom::{Phantom, Run, Scene, no_observer};
/// let phantom = Phantom::new(Scene::default().with_size(16))?;
/// let folder = tempfile::tempdir()?; // or any other
/// let mut run = Run::begin(&phantom, folder.path(), &["notes.txt".into()])?;
/// let mut most = 0.0f32;
/// for gate in 0..phantom.n_gates() {
///     let results = run.gate(gate, &no_observer)?;
///     most = results.reconstruction.iter().flatten().copied().fold(most, f32::max);
/// }
/// let report = run.finish(&no_observer, |report| {
///     let notes = format!("{most} of {} mL", report.numbers.edv);
///     heart_phantom::files::write_atomically(&folder.path().join("notes.txt"), |out| out.write_all(notes.as_bytes()))
/// })?;
/// assert!(report.files.contains(&"notes.txt".into()));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Run<'a> {
    pub(super) phantom: &'a Phantom,
    pub(super) out: &'a Path,
    /// The scene as text, which defines the identifiers of the study.
    pub(super) study: Option<String>,
    /// Names of files that the caller writes.
    beside: Vec<PathBuf>,
    pub(super) files: Vec<PathBuf>,
    gates: Vec<GateReport>,
    /// The middle slice of each reconstruction, for images with a common grey scale.
    middle: Vec<Vec<f32>>,
    /// Unscattered projections of later gates that were computed with those of an earlier one.
    ahead: Vec<Option<Sinograms>>,
    /// The projections of all gates, for motion-compensated volumes.
    pub(super) seen: Vec<f32>,
    /// Gates so far of arrays that are written to one file.
    pub(super) joined: BTreeMap<(Product, usize), Vec<f32>>,
    folder: Folder,
}

/// The results of a gate that the scene requests.
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
pub struct GateResults {
    /// Projections, `[view][row][bin]`.
    pub projections: Option<Vec<f32>>,
    /// Reconstructed volume, `[z][y][x]`.
    pub reconstruction: Option<Vec<f32>>,
    /// Voxelised ground truth, `[z][y][x]`.
    pub truth: Option<Vec<f32>>,
}

/// Computes and writes the products of `[output]`, and `report.json`. Every file is written atomically, `report.json` last. A run first
/// removes the `report.json` of an earlier run, then the files that it lists and that are not written again. If `report.json` exists, the
/// output of the run is complete; a run that ends without it removes its files.
///
/// # Errors
/// Before the first view: [`PhantomError::File`] if the directory is not writable, [`PhantomError::Busy`] if another run writes to it,
/// [`PhantomError::Foreign`] if it contains a `report.json` of another program or a file under a name that the run writes and that no
/// `report.json` of an earlier run lists, [`PhantomError::Rejected`] for errors of [`Phantom::prepare`].
/// Later: [`PhantomError::File`], [`PhantomError::Stopped`], and errors of shapes that were not solved before.
pub fn run(
    phantom: &Phantom,
    out: &Path,
    progress: Observer<'_, Progress>,
) -> Result<RunReport, PhantomError> {
    let mut run = Run::begin(phantom, out, &[])?;
    for gate in 0..phantom.n_gates() {
        run.gate(gate, progress)?;
    }
    run.finish(progress, |_| Ok(()))
}

impl<'a> Run<'a> {
    /// Locks the directory, validates the scene, and removes the files of an earlier run. `beside` names the files that the caller writes
    /// there; they are removed, too, if the run ends without a report.
    ///
    /// # Errors
    /// Errors of [`run`] before the first view; [`PhantomError::Name`] for a path in `beside` that is not a plain name, is given twice or is
    /// the name of a file of the run.
    pub fn begin(
        phantom: &'a Phantom,
        out: &'a Path,
        beside: &[PathBuf],
    ) -> Result<Self, PhantomError> {
        let mut folder = Folder::lock(out)?;
        phantom.prepare()?;
        // Solves the two extreme shapes: if one does not exist, the error comes before the first view.
        phantom.numbers()?;
        let planned = [&phantom.file_names()?, beside].concat();
        folder.clear(&planned)?;
        Ok(Self {
            phantom,
            out,
            study: phantom.whole_scene().map(Scene::to_toml),
            beside: beside.to_vec(),
            files: Vec::new(),
            gates: Vec::new(),
            middle: Vec::new(),
            ahead: Vec::new(),
            seen: Vec::new(),
            joined: BTreeMap::new(),
            folder,
        })
    }

    /// Writes projections, reconstruction and ground truth of a gate. Gates must come in order from 0, each once.
    ///
    /// # Errors
    /// [`PhantomError::Count`] for another gate; errors of [`run`], after which this run cannot be continued.
    pub fn gate(
        &mut self,
        gate: usize,
        progress: Observer<'_, Progress>,
    ) -> Result<GateResults, PhantomError> {
        let next = self.gates.len();
        check_count("gate", gate, [0, self.phantom.n_gates() - 1])?;
        check_count("gate", gate, [next, next])?;
        let all = self.phantom.n_gates() as f64 + 0.5;
        let told = |stage, share| {
            progress(Progress {
                stage,
                fraction: (gate as f64 + share) / all,
            })
        };
        let (report, results) = self.make(gate, &told)?;
        self.gates.push(report);
        Ok(results)
    }

    /// Writes the products of single phases, images, the files of the caller (by `write`), and `report.json`, which lists those files of the
    /// caller that exist.
    ///
    /// # Errors
    /// [`PhantomError::Count`] if a gate is missing; errors of `write`; errors of [`run`].
    pub fn finish<E: From<PhantomError>>(
        mut self,
        progress: Observer<'_, Progress>,
        write: impl FnOnce(&RunReport) -> Result<(), E>,
    ) -> Result<RunReport, E> {
        let (phantom, n_gates) = (self.phantom, self.phantom.n_gates());
        check_count("gates", self.gates.len(), [n_gates, n_gates])?;
        let compensated = self.compensated(progress)?;
        self.phases(progress)?;
        let pictures = self.pictures()?;
        let mut report = RunReport {
            program: files::PROGRAM.into(),
            scene: phantom.whole_scene().cloned(),
            warnings: phantom.warnings()?,
            numbers: phantom.numbers()?,
            phases: phantom.phase_reports()?,
            motion: match self.wants(Product::Motion) || !phantom.scene().points.is_empty() {
                true => phantom.motion_reports()?,
                false => Vec::new(),
            },
            measured: match phantom.scene().acquisition.mode {
                Mode::Gated { .. } => MeasuredEjection::of(&self.gates),
                Mode::Static { .. } | Mode::Instants | Mode::Exposure { .. } | Mode::WholeCycle => {
                    None
                }
            },
            beats: phantom.beats(),
            gates: std::mem::take(&mut self.gates),
            compensated,
            pictures,
            slice_order: SliceOrders {
                projections: phantom.scene().output.projections.info().row_order,
                volumes: phantom.scene().output.volumes.info().slice_order,
            },
            labels: match self.wants(Product::Labels) {
                true => phantom.label_names(),
                false => Vec::new(),
            },
            memory: phantom.memory(),
            work: phantom.work(),
            files: std::mem::take(&mut self.files),
        };
        write(&report)?;
        self.beside.retain(|name| self.out.join(name).is_file());
        report.files.append(&mut self.beside);
        report.files.push(files::REPORT.into());
        files::write_atomically(&self.out.join(files::REPORT), |file| {
            writeln!(file, "{}", json_text(&report)?)
        })?;
        self.folder.finish();
        Ok(report)
    }
}

impl Run<'_> {
    pub(super) fn wants(&self, product: Product) -> bool {
        self.phantom.scene().output.has(product)
    }

    /// Computes projections, reconstruction and ground truth of a gate.
    fn make(
        &mut self,
        gate: usize,
        progress: &(dyn Fn(&'static str, f64) -> ControlFlow<()> + Sync),
    ) -> Result<(GateReport, GateResults), PhantomError> {
        let phantom = self.phantom;
        let output = &phantom.scene().output;
        let mut report = GateReport {
            views: ViewReport::of(&phantom.view_times(gate)?, &phantom.radii()?),
            ..GateReport::default()
        };
        let mut results = GateResults::default();
        if output.needs(Needs::Views) {
            let n_views = phantom.camera().n_views() as f64;
            let done = |done: usize| progress("views", 0.5 * done as f64 / n_views);
            check_stop(done(0))?;
            if gate == 0 && phantom.shares_images() {
                let all = phantom.primary_of_gates(&done)?;
                self.ahead = all.into_iter().map(Some).collect();
            }
            let mut windows = match self.ahead.get_mut(gate).and_then(Option::take) {
                Some(primary) => phantom.windows_of(gate, primary)?,
                None => phantom.windows(gate, &done)?,
            };
            if output.has(Product::Projections) {
                for (window, views) in windows.iter().enumerate() {
                    self.write(
                        (Product::Projections, window),
                        Index::Gate(gate),
                        &views.samples,
                    )?;
                }
            }
            if output.has(Product::Scatter) {
                for window in 0..windows.len() {
                    let samples = phantom.scatter_samples(gate, window)?;
                    self.write((Product::Scatter, window), Index::Gate(gate), &samples)?;
                }
            }
            let views = windows.swap_remove(0);
            drop(windows);
            report.view_error = Some(views.view_error);
            report.resolution = phantom.resolution()?;
            if views.view_error.time > 0.0 {
                report.quadrature_steps = Some(phantom.steps()?);
            }
            let counts = phantom.counts_per_unit(gate)?.unwrap_or_default();
            report.counts =
                (!counts.is_empty()).then(|| phantom.sum_of_counts(&views.samples, &counts));
            let first = counts.first().copied();
            report.counts_per_unit = first.filter(|&first| counts.iter().all(|&all| all == first));
            if phantom.scene().counting.is_some() {
                report.views.counts_per_unit = counts;
            }
            if phantom.is_compensated() && output.needs(Needs::Reconstruction) {
                self.seen.extend_from_slice(&views.samples);
            } else if output.needs(Needs::Reconstruction) {
                let iterations = phantom.scene().reconstruction.method.iterations();
                let told = |done| {
                    progress(
                        "reconstruction",
                        0.5 + 0.15 * done as f64 / iterations as f64,
                    )
                };
                let mut made = phantom.empty_volume()?;
                report.osem = phantom.reconstruct_into(gate, &views.samples, &mut made, &told)?;
                self.reconstructed(Index::Gate(gate), &made)?;
                report.polar_map = Some(phantom.polar_map(gate, &made)?);
                results.reconstruction = Some(made);
            }
            results.projections = Some(views.samples);
        }
        if output.has(Product::Truth) {
            check_stop(progress("truth", 0.65))?;
            let truth = phantom.truth(gate)?;
            self.write((Product::Truth, 0), Index::Gate(gate), &truth)?;
            report.truth = Some(phantom.truth_of());
            report.polar_map_truth = Some(phantom.polar_map(gate, &truth)?);
            if let Some(volume) = &results.reconstruction {
                check_stop(progress("measures", 0.95))?;
                report.artefacts = Some(phantom.artefacts(gate, volume, &truth)?);
            }
            results.truth = Some(truth);
        }
        Ok((report, results))
    }

    /// Writes a reconstructed volume, and keeps its middle slice for the images.
    pub(super) fn reconstructed(
        &mut self,
        index: Index,
        volume: &[f32],
    ) -> Result<(), PhantomError> {
        if self.wants(Product::Reconstruction) {
            self.write((Product::Reconstruction, 0), index, volume)?;
        }
        if self.wants(Product::Pictures) {
            let len = self.phantom.camera().grid().slice_len();
            let from = self.phantom.camera().n_rows() / 2 * len;
            self.middle.push(volume[from..from + len].to_vec());
        }
        Ok(())
    }

    /// Writes labels, attenuation maps, motion and surfaces at the phases that represent the projections.
    fn phases(&mut self, progress: Observer<'_, Progress>) -> Result<(), PhantomError> {
        let phantom = self.phantom;
        let (phases, n_gates) = (phantom.phases(), phantom.n_gates() as f64);
        let gates = phantom.n_cardiac_gates();
        let mut labels = Vec::new();
        for (k, scene_phase) in phases.iter().enumerate() {
            check_stop(progress(Progress {
                stage: "phases",
                fraction: (n_gates + 0.4 + 0.1 * k as f64 / phases.len() as f64) / (n_gates + 0.5),
            }))?;
            let (index, at) = (Index::Phase(scene_phase.of), scene_phase.at);
            if self.wants(Product::Labels) {
                labels.append(&mut phantom.labels(at)?);
                let index = match phantom.joins(Product::Labels) {
                    true if (k + 1) % gates > 0 => None,
                    true => Some(Index::Cardiac(k / gates)),
                    false => Some(index),
                };
                if let Some(index) = index {
                    let labels = std::mem::take(&mut labels);
                    self.put_volume(Product::Labels, index, labels.as_slice())?;
                }
            }
            if self.wants(Product::Attenuation) {
                self.write((Product::Attenuation, 0), index, &phantom.attenuation(at)?)?;
            }
            if self.wants(Product::Motion) {
                self.write_motion(scene_phase)?;
            }
            if self.wants(Product::Meshes) {
                for (surface, mesh) in phantom.meshes(at)?.iter().enumerate() {
                    let names = phantom.names_of(Product::Meshes, surface, index);
                    files::write_stl(&self.out.join(&names[0]), mesh)?;
                    self.files.extend(names);
                }
            }
        }
        Ok(())
    }

    /// Writes the middle slice of each gate and, for several gates, an animation at its true speed, of one cardiac cycle after another for
    /// each respiratory gate; the grey scale runs from 0 to the largest sample of all of them.
    #[cfg(feature = "files")]
    fn pictures(&mut self) -> Result<Option<PictureReport>, PhantomError> {
        let frames = std::mem::take(&mut self.middle);
        if frames.is_empty() {
            return Ok(None);
        }
        let grid = self.phantom.camera().grid();
        let ([nx, ny, nz], spacing) = (grid.shape(), grid.spacing());
        let slice = revolve_voxel::VoxelGrid::centred([nx, ny, 1], spacing, [0.0; 3])?;
        let volumes = (frames.iter())
            .map(|frame| files::Volume::new(slice, frame.as_slice()))
            .collect::<Result<Vec<_>, _>>()?;
        let most = frames.iter().flatten().copied().fold(0.0f32, f32::max);
        let white = if most > 0.0 { f64::from(most) } else { 1.0 };
        let (section, grey) = (files::Section::Axial(0), [0.0, white]);
        for (gate, volume) in volumes.iter().enumerate() {
            let index = match self.phantom.is_compensated() {
                true => Index::Volume(gate),
                false => Index::Gate(gate),
            };
            let names = self.phantom.names_of(Product::Pictures, 0, index);
            files::write_png(&self.out.join(&names[0]), volume, section, grey)?;
            self.files.extend(names);
        }
        if volumes.len() > 1 {
            let cycle = self.phantom.cycle();
            let seconds = match (self.phantom.n_cardiac_gates(), cycle.breathing()) {
                (1, Some(motion)) => motion.breathing().period / volumes.len() as f64,
                (gates, _) => cycle.period() / gates as f64,
            };
            // GIF stores time in hundredths of a second.
            let seconds = seconds.clamp(0.02, 600.0);
            let names = (self.phantom).names_of(Product::Pictures, 0, Index::All);
            files::write_gif(&self.out.join(&names[0]), &volumes, section, grey, seconds)?;
            self.files.extend(names);
        }
        Ok(Some(PictureReport {
            slice: nz / 2,
            z_cm: ((nz / 2) as f64 - 0.5 * (nz - 1) as f64) * spacing[2],
            black: grey[0],
            white,
        }))
    }

    #[cfg(not(feature = "files"))]
    fn pictures(&mut self) -> Result<Option<PictureReport>, PhantomError> {
        Ok(None)
    }
}
