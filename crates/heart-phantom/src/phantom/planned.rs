//! What a run writes, before it does: the names of its files and their sizes.

use super::output::{GateFiles, Product};
use super::phases::PhaseOf;
use crate::error::PhantomError;
use crate::files::{
    ATTENUATION, Extensions, FIELDS, Format, LABELS, MOVING, ORBIT_EXTENSION, PROJECTIONS,
    RECONSTRUCTION, REPORT, SLICE, SURFACES, TRUTH,
};
use crate::{Compensation, Mode, Moment, Orbit, Phantom, files};
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::ops::Range;
use std::path::PathBuf;

/// A file that a run writes.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize))]
#[non_exhaustive]
pub struct PlannedFile {
    /// Its name in the folder of the run.
    pub name: PathBuf,
    /// Bytes of its samples or triangles, before any compression: what it has at most, but for a header of some hundred bytes, of an
    /// archive some thousand. None for a header beside its data, and for the report.
    pub bytes: u64,
}

impl Phantom {
    /// The files that `run` writes; surfaces are made for it, to count their triangles.
    ///
    /// ```
    /// use heart_phantom::{Phantom, Scene};
    /// let files = Phantom::new(Scene::default().with_size(32))?.files()?;
    /// let names: Vec<_> = files.iter().map(|file| file.name.to_str().unwrap()).collect();
    /// assert_eq!(names, ["projections.npy", "reconstruction.npy", "truth.npy", "report.json"]);
    /// assert_eq!(files[0].bytes, 90 * 32 * 32 * 4);
    /// # Ok::<(), heart_phantom::PhantomError>(())
    /// ```
    ///
    /// # Errors
    /// For surfaces those of [`Phantom::meshes`].
    pub fn files(&self) -> Result<Vec<PlannedFile>, PhantomError> {
        self.planned(|at| Ok(self.meshes(at)?.map(|mesh| files::stl_bytes(&mesh))))
    }

    /// Their names alone; no surface is made for it.
    #[cfg(feature = "scene")]
    pub(crate) fn file_names(&self) -> Result<Vec<PathBuf>, PhantomError> {
        let planned = self.planned(|_| Ok([0; 2]))?;
        Ok(planned.into_iter().map(|file| file.name).collect())
    }

    /// With the sizes of both surfaces at a phase as they are told.
    fn planned(
        &self,
        surface_bytes: impl Fn(Moment) -> Result<[u64; 2], PhantomError>,
    ) -> Result<Vec<PlannedFile>, PhantomError> {
        let mut planned = Vec::new();
        for &product in &self.parts().output.write {
            self.plan_files(product, &surface_bytes, &mut planned)?;
        }
        planned.push(PlannedFile {
            name: REPORT.into(),
            bytes: 0,
        });
        Ok(planned)
    }

    fn plan_files(
        &self,
        product: Product,
        surface_bytes: &impl Fn(Moment) -> Result<[u64; 2], PhantomError>,
        planned: &mut Vec<PlannedFile>,
    ) -> Result<(), PhantomError> {
        let (camera, phases) = (self.camera(), self.phases());
        let voxels = camera.grid().len() as u64;
        let mut add = |names: Vec<PathBuf>, bytes: u64| {
            // Of two, the first is the header.
            let last = names.len() - 1;
            planned.extend(names.into_iter().enumerate().map(|(k, name)| PlannedFile {
                name,
                bytes: if k == last { bytes } else { 0 },
            }));
        };
        let gates = 0..self.n_gates();
        let sample = self.parts().output.volumes.info().sample_bytes;
        // Of what goes into one file.
        let (in_one, times) = match self.one_file() {
            true => (0..1, self.n_gates() as u64),
            false => (gates.clone(), 1),
        };
        match product {
            Product::Projections => {
                let sample = self.parts().output.projections.info().sample_bytes;
                let bytes = times * sample * (camera.n_views() * camera.view_len()) as u64;
                in_one.for_each(|gate| add(self.projection_names(gate), bytes));
            }
            Product::Reconstruction | Product::Truth => {
                self.plan_volumes(product, in_one, sample * voxels, times, &mut add);
            }
            Product::Labels | Product::Attenuation => {
                let (what, bytes) = match product {
                    Product::Labels => (LABELS, voxels),
                    _ => (ATTENUATION, sample * voxels),
                };
                if self.one_file() {
                    add(self.volume_names(what), times * bytes);
                    return Ok(());
                }
                for scene_phase in phases {
                    add(self.volume_names(&phase_name(what, scene_phase.of)), bytes);
                }
            }
            Product::Motion => {
                for scene_phase in phases {
                    for (what, components) in FIELDS {
                        let names = self.volume_names(&phase_name(what, scene_phase.of));
                        add(names, 4 * components * voxels);
                    }
                }
            }
            Product::Meshes => self.plan_surfaces(surface_bytes, &mut add)?,
            Product::Pictures => {
                let bytes = camera.grid().slice_len() as u64;
                let n = self.n_volumes() as u64;
                let numbers = 0..self.n_volumes();
                numbers.for_each(|number| add(vec![self.picture_name(number)], bytes));
                if n > 1 {
                    add(vec![MOVING.into()], n * bytes);
                }
            }
        }
        Ok(())
    }

    /// Volumes of so many bytes, `times` of them in a file: of the gates `in_one`, or in one frame.
    fn plan_volumes(
        &self,
        product: Product,
        in_one: Range<usize>,
        bytes: u64,
        times: u64,
        add: &mut impl FnMut(Vec<PathBuf>, u64),
    ) {
        let (what, of_gates) = match product {
            Product::Truth => (self.truth_of().file_name(), true),
            _ => (RECONSTRUCTION, !self.is_compensated()),
        };
        in_one.filter(|_| of_gates).for_each(|gate| {
            let name = match self.one_file() {
                true => what.to_owned(),
                false => self.gate_name(what, gate),
            };
            add(self.volume_names(&name), times * bytes);
        });
        let what = if of_gates { TRUTH } else { RECONSTRUCTION };
        (0..self.n_volumes())
            .filter(|_| self.is_compensated())
            .for_each(|number| {
                let name = self.compensated_name(what, number);
                add(self.volume_names(&name), bytes);
            });
    }

    fn plan_surfaces(
        &self,
        surface_bytes: &impl Fn(Moment) -> Result<[u64; 2], PhantomError>,
        add: &mut impl FnMut(Vec<PathBuf>, u64),
    ) -> Result<(), PhantomError> {
        // Phases of one gain, on the way in and on the way out, have the same shape.
        let mut known = HashMap::new();
        for scene_phase in self.phases() {
            let gain = self.cycle().gain(scene_phase.phase).to_bits();
            let bytes = match known.entry(gain) {
                Entry::Occupied(bytes) => *bytes.get(),
                Entry::Vacant(place) => *place.insert(surface_bytes(scene_phase.moment())?),
            };
            for (what, bytes) in SURFACES.iter().zip(bytes) {
                add(vec![surface_name(what, scene_phase.of)], bytes);
            }
        }
        Ok(())
    }

    /// Whether all gates go into one file.
    pub(crate) fn one_file(&self) -> bool {
        matches!(self.parts().mode, Mode::Gated { .. })
            && self.parts().output.gates == GateFiles::OneFile
    }

    /// `what`, or `what-gate-03`.
    pub(crate) fn gate_name(&self, what: &str, gate: usize) -> String {
        match self.n_gates() {
            1 => what.to_owned(),
            gates => format!("{what}-{}", PhaseOf::Gate { gate, gates }),
        }
    }

    /// The file of the views of a gate, that of its radii, where the format has one, and the one of its data, if it has.
    pub(crate) fn projection_names(&self, gate: usize) -> Vec<PathBuf> {
        let format = self.parts().output.projections;
        #[expect(clippy::unreachable, reason = "the parts were checked")]
        let Some(extensions) = format.info().projections else {
            unreachable!("the parts were checked")
        };
        let name = match self.one_file() {
            true => PROJECTIONS.to_owned(),
            false => self.gate_name(PROJECTIONS, gate),
        };
        let mut names = named(&name, extensions);
        let circle = matches!(self.parts().orbit, Orbit::Circle(_));
        if format == Format::InterfileSimind && !circle {
            names.insert(1, format!("{name}.{ORBIT_EXTENSION}").into());
        }
        names
    }

    /// The file of a volume, and the one of its data, if there are two.
    pub(crate) fn volume_names(&self, name: &str) -> Vec<PathBuf> {
        named(name, self.parts().output.volumes.info().volume)
    }

    /// The picture of one of the volumes made of the views.
    pub(crate) fn picture_name(&self, number: usize) -> PathBuf {
        let name = match self.is_compensated() {
            true => self.compensated_name(SLICE, number),
            false => self.gate_name(SLICE, number),
        };
        format!("{name}.png").into()
    }

    pub(crate) fn is_compensated(&self) -> bool {
        self.parts().compensation == Compensation::KnownMotion
    }

    /// `what-compensated`, or `what-compensated-gate-03`.
    pub(crate) fn compensated_name(&self, what: &str, number: usize) -> String {
        match self.n_volumes() {
            1 => format!("{what}-compensated"),
            gates => {
                let of = PhaseOf::Gate {
                    gate: number,
                    gates,
                };
                format!("{what}-compensated-{of}")
            }
        }
    }
}

/// `what`, or `what-end-diastole`.
pub(crate) fn phase_name(what: &str, of: PhaseOf) -> String {
    match of {
        PhaseOf::Static | PhaseOf::Gate { gates: 1, .. } => what.to_owned(),
        _ => format!("{what}-{of}"),
    }
}

pub(crate) fn surface_name(what: &str, of: PhaseOf) -> PathBuf {
    format!("{}.stl", phase_name(what, of)).into()
}

/// A header, or all of it, and the data beside it.
fn named(name: &str, extensions: Extensions) -> Vec<PathBuf> {
    [Some(extensions.header), extensions.data]
        .into_iter()
        .flatten()
        .map(|extension| format!("{name}.{extension}").into())
        .collect()
}
