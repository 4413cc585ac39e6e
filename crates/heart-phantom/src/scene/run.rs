//! A scene from start to end: everything that it asks for, written to a folder.

use super::study::Scene;
use crate::error::PhantomError;
#[cfg(feature = "files")]
use crate::files::MOVING;
use crate::files::{
    self, ATTENUATION, FIELDS, Field, FieldOf, LABELS, Projections, RECONSTRUCTION, Radius,
    SURFACES, SliceOrder, Volume,
};
use crate::phantom::{phase_name, surface_name};
use crate::{
    Artefacts, BeatReport, BinMeans, Memory, Method, MotionReport, Numbers, Orbit, OsemReport,
    Phantom, PhaseReport, Product, ScenePhase, TruthOf, ViewReport, Warning, WorkReport,
};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// How far a computation is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// What is being done.
    pub stage: &'static str,
    /// Share of the work behind us, 0 to 1.
    pub fraction: f64,
}

/// What a run found and did; `report.json` holds it.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct RunReport {
    /// The program and its version: [`files::PROGRAM`].
    pub program: String,
    /// The scene, defaults filled in, if the phantom was made from one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scene: Option<Scene>,
    /// What may surprise.
    pub warnings: Vec<Warning>,
    /// Volumes, ejection fraction, wall.
    pub numbers: Numbers,
    /// The heart at the phases that stand for the views, and at end-diastole and end-systole.
    pub phases: Vec<PhaseReport>,
    /// Torsion, shortening and the scene's points at the phases that stand for the views, where motion was written, or there are points.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub motion: Vec<MotionReport>,
    /// The beats, where they differ or some do not count.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub beats: Option<BeatReport>,
    /// One entry for each gate, or one.
    pub gates: Vec<GateReport>,
    /// What the pictures show, where such were written.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pictures: Option<PictureReport>,
    /// Rows and slices in the files of the formats chosen.
    pub slice_order: SliceOrders,
    /// What the numbers in label volumes stand for, from 0 on, where such were written.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub labels: Vec<String>,
    /// Memory that this was said to take at most.
    pub memory: Memory,
    /// Work done.
    pub work: WorkReport,
    /// Files written, relative to the folder.
    pub files: Vec<PathBuf>,
}

/// The order of what follows each other along z, in the files of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct SliceOrders {
    /// Rows of the projections.
    pub projections: SliceOrder,
    /// Slices of the volumes.
    pub volumes: SliceOrder,
}

/// One set of views.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct GateReport {
    /// When and from where its views are taken.
    pub views: ViewReport,
    /// Estimated relative error of the quadrature over time, where there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub quadrature_error: Option<f64>,
    /// Steps a cycle of that quadrature, as given or as the tolerance took, where there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub quadrature_steps: Option<usize>,
    /// Of views through a collimator the estimated relative error of their blur ([`Sinograms::depth_error`](crate::Sinograms::depth_error)).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub depth_error: Option<f64>,
    /// How means over bins were made, where samples are such ([`Phantom::bin_means`]).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bin_means: Option<BinMeans>,
    /// Mean counts of a sample of 1, where views with noise were made, or the camera's sensitivity is known, and all views have the
    /// same; what each has by that sensitivity is [`ViewReport::counts_per_unit`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub counts_per_unit: Option<f64>,
    /// What OSEM did, where it reconstructed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub osem: Option<OsemReport>,
    /// What the exact volume is the mean over, where it was written: its file is `truth`, or `truth-mean-of-views`, and `rmse` below
    /// is the difference from it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub truth: Option<TruthOf>,
    /// The reconstruction against the truth, where both were made.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub artefacts: Option<Artefacts>,
}

/// The slice that all pictures of a run show, and its greys.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[non_exhaustive]
pub struct PictureReport {
    /// Index of the slice.
    pub slice: usize,
    /// Its height in cm.
    pub z_cm: f64,
    /// Activity that is black, as is everything below.
    pub black: f64,
    /// Activity that is white: the largest of that slice in all gates.
    pub white: f64,
}

/// A phantom that writes into a folder.
struct Writer<'a> {
    phantom: &'a Phantom,
    out: &'a Path,
    files: Vec<PathBuf>,
    /// The middle slice of each reconstruction, for pictures of one window.
    middle: Vec<Vec<f32>>,
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
    let _held = files::lock_folder(out)?;
    phantom.prepare()?;
    let planned = phantom.file_names()?;
    files::check_no_folder(out, &planned)?;
    files::remove_older(out, &planned)?;
    let mut writer = Writer {
        phantom,
        out,
        files: Vec::new(),
        middle: Vec::new(),
    };
    // Of the two extreme shapes: a heart that has none is known before any view.
    let numbers = phantom.numbers()?;
    let warnings = phantom.warnings()?;
    let phases = phantom.phase_reports()?;
    let n_gates = phantom.n_gates();
    let mut gates = Vec::with_capacity(n_gates);
    for gate in 0..n_gates {
        gates.push(writer.gate(gate, &|stage, share| {
            progress(Progress {
                stage,
                fraction: (gate as f64 + share) / (n_gates as f64 + 0.5),
            });
        })?);
    }
    progress(Progress {
        stage: "phases",
        fraction: n_gates as f64 / (n_gates as f64 + 0.5),
    });
    writer.phases()?;
    let pictures = writer.pictures()?;
    let mut report = RunReport {
        program: files::PROGRAM.into(),
        scene: phantom.scene().cloned(),
        warnings,
        numbers,
        phases,
        motion: match writer.wants(Product::Motion) || !phantom.parts().points.is_empty() {
            true => phantom.motion_reports()?,
            false => Vec::new(),
        },
        beats: phantom.beats(),
        gates,
        pictures,
        slice_order: SliceOrders {
            projections: phantom.parts().output.projections.slice_order(),
            volumes: phantom.parts().output.volumes.slice_order(),
        },
        labels: if writer.wants(Product::Labels) {
            phantom.label_names()
        } else {
            Vec::new()
        },
        memory: phantom.memory(),
        work: phantom.work(),
        files: writer.files,
    };
    report.files.push(files::REPORT.into());
    files::write_atomically(&out.join(files::REPORT), |file| {
        serde_json::to_writer_pretty(&mut *file, &report)?;
        file.write_all(b"\n")
    })?;
    Ok(report)
}

impl Writer<'_> {
    fn wants(&self, product: Product) -> bool {
        self.phantom.parts().output.write.contains(&product)
    }

    /// Views, reconstruction and truth of one gate.
    fn gate(
        &mut self,
        gate: usize,
        progress: &(dyn Fn(&'static str, f64) + Sync),
    ) -> Result<GateReport, PhantomError> {
        let phantom = self.phantom;
        let pictures = self.wants(Product::Pictures);
        let reconstruct = self.wants(Product::Reconstruction) || pictures;
        let mut report = GateReport {
            views: ViewReport::of(&phantom.view_times(gate)?, &phantom.radii()?),
            quadrature_error: None,
            quadrature_steps: None,
            depth_error: None,
            bin_means: None,
            counts_per_unit: None,
            osem: None,
            truth: None,
            artefacts: None,
        };
        let mut volume = None;
        if self.wants(Product::Projections) || reconstruct {
            let n_views = phantom.camera().n_views() as f64;
            let views =
                phantom.sinograms(gate, &|done| progress("views", 0.5 * done as f64 / n_views))?;
            report.quadrature_error = views.quadrature_error;
            report.depth_error = views.depth_error;
            report.bin_means = phantom.bin_means()?;
            if views.quadrature_error.is_some() {
                report.quadrature_steps = Some(phantom.steps()?);
            }
            let counts = phantom.counts_per_unit(gate)?.unwrap_or_default();
            let first = counts.first().copied();
            report.counts_per_unit = first.filter(|&first| counts.iter().all(|&all| all == first));
            if phantom.parts().counting.is_some() {
                report.views.counts_per_unit = counts;
            }
            if self.wants(Product::Projections) {
                self.write_projections(gate, &views.samples)?;
            }
            if reconstruct {
                progress("reconstruction", 0.5);
                let passes = match phantom.parts().method {
                    Method::Fbp => 1,
                    Method::Osem(osem) => osem.iterations,
                };
                let told =
                    |done| progress("reconstruction", 0.5 + 0.15 * done as f64 / passes as f64);
                let (made, osem) = phantom.reconstruct_observed(gate, &views.samples, &told)?;
                report.osem = osem;
                if self.wants(Product::Reconstruction) {
                    let name = phantom.gate_name(RECONSTRUCTION, gate);
                    self.write_volume(&name, made.as_slice())?;
                }
                if pictures {
                    let len = phantom.camera().grid().slice_len();
                    let from = phantom.camera().n_rows() / 2 * len;
                    self.middle.push(made[from..from + len].to_vec());
                }
                volume = Some(made);
            }
        }
        if self.wants(Product::Truth) {
            progress("truth", 0.65);
            let (truth, of) = (phantom.truth(gate)?, phantom.truth_of());
            self.write_volume(&phantom.gate_name(of.file_name(), gate), truth.as_slice())?;
            report.truth = Some(of);
            if let Some(volume) = &volume {
                progress("measures", 0.95);
                report.artefacts = Some(phantom.artefacts(gate, volume, &truth)?);
            }
        }
        Ok(report)
    }

    /// Labels, maps and surfaces at the phases that stand for the views.
    fn phases(&mut self) -> Result<(), PhantomError> {
        for scene_phase in self.phantom.phases() {
            let (of, at) = (scene_phase.of, scene_phase.moment());
            if self.wants(Product::Labels) {
                let labels = self.phantom.labels(at)?;
                self.write_volume(&phase_name(LABELS, of), labels.as_slice())?;
            }
            if self.wants(Product::Attenuation) {
                let map = self.phantom.attenuation(at)?;
                self.write_volume(&phase_name(ATTENUATION, of), map.as_slice())?;
            }
            if self.wants(Product::Motion) {
                self.write_motion(&scene_phase)?;
            }
            if self.wants(Product::Meshes) {
                let meshes = self.phantom.meshes(at)?;
                for (surface, mesh) in SURFACES.iter().zip(&meshes) {
                    let file = surface_name(surface, of);
                    files::write_stl(&self.out.join(&file), mesh)?;
                    self.files.push(file);
                }
            }
        }
        Ok(())
    }

    fn write_projections(&mut self, gate: usize, samples: &[f32]) -> Result<(), PhantomError> {
        let (camera, parts) = (self.phantom.camera(), self.phantom.parts());
        let angles = self.phantom.written_angles(gate)?;
        let radii = self.phantom.radii()?;
        let radius = match parts.orbit {
            Orbit::Circle(radius) => Radius::Circular(radius),
            _ => Radius::PerView(&radii),
        };
        let mut projections = Projections::new(*camera.detector(), &angles, radius, samples)?;
        let counts = parts.expected_counts(gate);
        if let Some(counts) = &counts {
            projections = projections.with_counts_per_unit(counts)?;
        }
        let names = self.phantom.projection_names(gate);
        let format = parts.output.projections;
        files::write_projections(&self.out.join(&names[0]), &projections, format)?;
        self.files.extend(names);
        Ok(())
    }

    /// Displacements, velocities and strains to a phase.
    fn write_motion(&mut self, to: &ScenePhase) -> Result<(), PhantomError> {
        let motion = self.phantom.motion(to.moment())?;
        let format = self.phantom.parts().output.volumes;
        let grid = *self.phantom.camera().grid();
        for ((what, _), (samples, of)) in FIELDS.iter().zip([
            (&motion.displacement, FieldOf::Displacement),
            (&motion.velocity, FieldOf::Velocity),
            (&motion.strain, FieldOf::Components(6)),
        ]) {
            let names = self.phantom.volume_names(&phase_name(what, to.of));
            let field = Field::new(grid, samples, of)?;
            files::write_field(&self.out.join(&names[0]), &field, format)?;
            self.files.extend(names);
        }
        Ok(())
    }

    fn write_volume<'a>(
        &mut self,
        name: &str,
        samples: impl Into<files::Samples<'a>>,
    ) -> Result<(), PhantomError> {
        let format = self.phantom.parts().output.volumes;
        let volume = Volume::new(*self.phantom.camera().grid(), samples)?;
        let names = self.phantom.volume_names(name);
        files::write_volume(&self.out.join(&names[0]), &volume, format)?;
        self.files.extend(names);
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
            .map(|frame| Volume::new(slice, frame.as_slice()))
            .collect::<Result<Vec<_>, _>>()?;
        let most = frames.iter().flatten().copied().fold(0.0f32, f32::max);
        let white = if most > 0.0 { f64::from(most) } else { 1.0 };
        let (section, grey) = (files::Section::Axial(0), [0.0, white]);
        for (gate, volume) in volumes.iter().enumerate() {
            let file = self.phantom.picture_name(gate);
            files::write_png(&self.out.join(&file), volume, section, grey)?;
            self.files.push(file);
        }
        if volumes.len() > 1 {
            let seconds = self.phantom.cycle().period() / volumes.len() as f64;
            // GIF counts in hundredths of a second.
            let seconds = seconds.clamp(0.02, 600.0);
            files::write_gif(&self.out.join(MOVING), &volumes, section, grey, seconds)?;
            self.files.push(MOVING.into());
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
