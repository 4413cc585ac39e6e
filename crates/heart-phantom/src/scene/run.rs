//! A scene from start to end: everything that it asks for, written to a folder.

use super::run_report::{
    GateReport, MeasuredEjection, PictureReport, Progress, RunReport, SliceOrders,
};
use super::study::Scene;
use crate::error::{PhantomError, check_count};
use crate::files::{self, Folder};
use crate::phantom::{Index, Needs};
use crate::{Method, Mode, Phantom, Product, ViewReport};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A run in steps: [`run`] for whoever makes something of the results besides, while they are there.
///
/// ```
/// use heart_phantom::{Phantom, Run, Scene};
/// let phantom = Phantom::new(Scene::default().with_size(16))?;
/// let folder = tempfile::tempdir()?; // or any other
/// let mut run = Run::begin(&phantom, folder.path(), &["notes.txt".into()])?;
/// let mut most = 0.0f32;
/// for gate in 0..phantom.n_gates() {
///     let results = run.gate(gate, &|_| ())?;
///     most = results.reconstruction.iter().flatten().copied().fold(most, f32::max);
/// }
/// let report = run.finish(&|_| (), |report| {
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
    /// The scene, which names the study.
    pub(super) study: Option<String>,
    /// Names that files of the caller will have.
    beside: Vec<PathBuf>,
    pub(super) files: Vec<PathBuf>,
    gates: Vec<GateReport>,
    /// The middle slice of each reconstruction, for pictures of one window.
    middle: Vec<Vec<f32>>,
    /// The views of all gates, where volumes are made of them together.
    pub(super) seen: Vec<f32>,
    /// The gates so far of products that go into one file.
    pub(super) joined: BTreeMap<Product, Vec<f32>>,
    _folder: Folder,
}

/// What a gate of a run has made, of what the scene asks for.
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
pub struct GateResults {
    /// The views, `[view][row][bin]`.
    pub projections: Option<Vec<f32>>,
    /// The volume reconstructed from them, `[z][y][x]`.
    pub reconstruction: Option<Vec<f32>>,
    /// The exact volume, `[z][y][x]`.
    pub truth: Option<Vec<f32>>,
}

/// Computes and writes what the scene's `[output]` asks for, and `report.json`. Every file is written whole or not at all;
/// `report.json` comes last. One of an earlier run goes first, and then what it lists and this run does not write again, so that where
/// it is, all is, and nothing of another run.
///
/// # Errors
/// Before any view: [`PhantomError::File`] if the folder cannot be written to, [`PhantomError::Busy`] if another run writes to it,
/// [`PhantomError::Foreign`] if it has a `report.json` that no run has written, [`PhantomError::Refused`] for what
/// [`Phantom::prepare`] finds. Later [`PhantomError::File`] only, but for a shape that was not tried
/// before.
pub fn run(
    phantom: &Phantom,
    out: &Path,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<RunReport, PhantomError> {
    let mut run = Run::begin(phantom, out, &[])?;
    for gate in 0..phantom.n_gates() {
        run.gate(gate, progress)?;
    }
    run.finish(progress, |_| Ok(()))
}

impl<'a> Run<'a> {
    /// Takes the folder, finds what would be refused, and removes what an earlier run has left. `beside` are the names of files that
    /// the caller will write there.
    ///
    /// # Errors
    /// Those of [`run`] before any view.
    pub fn begin(
        phantom: &'a Phantom,
        out: &'a Path,
        beside: &[PathBuf],
    ) -> Result<Self, PhantomError> {
        let folder = Folder::lock(out)?;
        phantom.prepare()?;
        let planned = [&phantom.file_names()?, beside].concat();
        folder.clear(&planned)?;
        // Of the two extreme shapes: a heart that has none is known before any view.
        phantom.numbers()?;
        Ok(Self {
            phantom,
            out,
            study: phantom.whole_scene().map(Scene::to_toml),
            beside: beside.to_vec(),
            files: Vec::new(),
            gates: Vec::new(),
            middle: Vec::new(),
            seen: Vec::new(),
            joined: BTreeMap::new(),
            _folder: folder,
        })
    }

    /// Writes views, reconstruction and truth of a gate, which have to come in their order from 0, each once.
    ///
    /// # Errors
    /// [`PhantomError::Count`] for another gate; later those of [`run`].
    pub fn gate(
        &mut self,
        gate: usize,
        progress: &(dyn Fn(Progress) + Sync),
    ) -> Result<GateResults, PhantomError> {
        let next = self.gates.len();
        check_count("gate", gate, [next, next])?;
        check_count("gate", gate, [0, self.phantom.n_gates() - 1])?;
        let all = self.phantom.n_gates() as f64 + 0.5;
        let told = |stage, share| {
            progress(Progress {
                stage,
                fraction: (gate as f64 + share) / all,
            });
        };
        let (report, results) = self.make(gate, &told)?;
        self.gates.push(report);
        Ok(results)
    }

    /// Writes what is of phases, the pictures, by `write` what is the caller's, and `report.json`.
    ///
    /// # Errors
    /// [`PhantomError::Count`] if a gate is missing; what `write` gives; those of [`run`].
    pub fn finish<E: From<PhantomError>>(
        mut self,
        progress: &(dyn Fn(Progress) + Sync),
        write: impl FnOnce(&RunReport) -> Result<(), E>,
    ) -> Result<RunReport, E> {
        let (phantom, n_gates) = (self.phantom, self.phantom.n_gates());
        check_count("gates", self.gates.len(), [n_gates, n_gates])?;
        progress(Progress {
            stage: "phases",
            fraction: n_gates as f64 / (n_gates as f64 + 0.5),
        });
        let compensated = self.compensated(progress)?;
        self.phases()?;
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
        report.files.append(&mut self.beside);
        report.files.push(files::REPORT.into());
        files::write_atomically(&self.out.join(files::REPORT), |file| {
            serde_json::to_writer_pretty(&mut *file, &report)?;
            file.write_all(b"\n")
        })?;
        Ok(report)
    }
}

impl Run<'_> {
    pub(super) fn wants(&self, product: Product) -> bool {
        self.phantom.scene().output.has(product)
    }

    /// Views, reconstruction and truth of one gate.
    fn make(
        &mut self,
        gate: usize,
        progress: &(dyn Fn(&'static str, f64) + Sync),
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
            let views =
                phantom.sinograms(gate, &|done| progress("views", 0.5 * done as f64 / n_views))?;
            report.view_error = Some(views.view_error);
            report.resolution = phantom.resolution()?;
            if views.view_error.time > 0.0 {
                report.quadrature_steps = Some(phantom.steps()?);
            }
            let counts = phantom.counts_per_unit(gate)?.unwrap_or_default();
            let sum = |view: &[f32]| view.iter().map(|sample| f64::from(*sample)).sum::<f64>();
            let sums = views.samples.chunks(phantom.camera().view_len()).map(sum);
            report.counts = (!counts.is_empty()).then(|| {
                sums.zip(&counts)
                    .map(|(sum, per_unit)| sum * per_unit)
                    .sum()
            });
            let first = counts.first().copied();
            report.counts_per_unit = first.filter(|&first| counts.iter().all(|&all| all == first));
            if phantom.scene().counting.is_some() {
                report.views.counts_per_unit = counts;
            }
            if output.has(Product::Projections) {
                self.write(Product::Projections, Index::Gate(gate), &views.samples)?;
            }
            if phantom.is_compensated() && output.needs(Needs::Reconstruction) {
                self.seen.extend_from_slice(&views.samples);
            } else if output.needs(Needs::Reconstruction) {
                progress("reconstruction", 0.5);
                let iterations = match phantom.scene().reconstruction.method {
                    Method::Fbp => 1,
                    Method::Osem(osem) => osem.iterations,
                };
                let told = |done| {
                    progress(
                        "reconstruction",
                        0.5 + 0.15 * done as f64 / iterations as f64,
                    )
                };
                let (made, osem) = phantom.reconstruct_observed(gate, &views.samples, &told)?;
                report.osem = osem;
                self.reconstructed(Index::Gate(gate), &made)?;
                report.polar_map = Some(phantom.polar_map(gate, &made)?);
                results.reconstruction = Some(made);
            }
            results.projections = Some(views.samples);
        }
        if output.has(Product::Truth) {
            progress("truth", 0.65);
            let truth = phantom.truth(gate)?;
            self.write(Product::Truth, Index::Gate(gate), &truth)?;
            report.truth = Some(phantom.truth_of());
            report.polar_map_truth = Some(phantom.polar_map(gate, &truth)?);
            if let Some(volume) = &results.reconstruction {
                progress("measures", 0.95);
                report.artefacts = Some(phantom.artefacts(gate, volume, &truth)?);
            }
            results.truth = Some(truth);
        }
        Ok((report, results))
    }

    /// Writes a reconstructed volume, and keeps its middle slice for the pictures.
    pub(super) fn reconstructed(
        &mut self,
        index: Index,
        volume: &[f32],
    ) -> Result<(), PhantomError> {
        if self.wants(Product::Reconstruction) {
            self.write(Product::Reconstruction, index, volume)?;
        }
        if self.wants(Product::Pictures) {
            let len = self.phantom.camera().grid().slice_len();
            let from = self.phantom.camera().n_rows() / 2 * len;
            self.middle.push(volume[from..from + len].to_vec());
        }
        Ok(())
    }

    /// Labels, maps, motion and surfaces at the phases that stand for the views.
    fn phases(&mut self) -> Result<(), PhantomError> {
        let phantom = self.phantom;
        let mut labels_of_all = Vec::new();
        for scene_phase in phantom.phases() {
            let (index, at) = (Index::Phase(scene_phase.of), scene_phase.moment());
            if self.wants(Product::Labels) {
                let mut labels = phantom.labels(at)?;
                if phantom.joins(Product::Labels) {
                    labels_of_all.append(&mut labels);
                } else {
                    self.put_volume(Product::Labels, index, labels.as_slice())?;
                }
            }
            if self.wants(Product::Attenuation) {
                self.write(Product::Attenuation, index, &phantom.attenuation(at)?)?;
            }
            if self.wants(Product::Motion) {
                self.write_motion(&scene_phase)?;
            }
            if self.wants(Product::Meshes) {
                for (surface, mesh) in phantom.meshes(at)?.iter().enumerate() {
                    let names = phantom.names_of(Product::Meshes, surface, index);
                    files::write_stl(&self.out.join(&names[0]), mesh)?;
                    self.files.extend(names);
                }
            }
        }
        if !labels_of_all.is_empty() {
            self.put_volume(Product::Labels, Index::All, labels_of_all.as_slice())?;
        }
        Ok(())
    }

    /// The middle slice of each gate, and of several the beat once round in its own time; greys from nothing to the largest
    /// sample of all of them.
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
            let seconds = self.phantom.cycle().period() / volumes.len() as f64;
            // GIF counts in hundredths of a second.
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
