//! Products of a run: one table, from which validation, planning, memory, file names and writing follow.

use super::output::{GateFiles, Output, Product};
use super::phases::PhaseOf;
use crate::error::PhantomError;
use crate::files::{self, Extensions, FieldOf, Format, ORBIT_EXTENSION, REPORT, are_equal};
use crate::{Compensation, Mode, MotionPhase, Phantom};
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::path::PathBuf;

/// File name of the animation of all images.
const ANIMATION: &str = "beat";

/// Properties of a product before it is computed.
pub(crate) struct ProductInfo {
    /// Stem of the file name and content of each array.
    pub(crate) arrays: &'static [(&'static str, Content)],
    /// Number of arrays of each kind.
    per: Per,
    /// Input of the computation.
    pub(super) needs: Needs,
    /// Bytes per voxel of its arrays in memory, for each gate or phase.
    pub(crate) voxel_bytes: u64,
}

/// The content of an array.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Content {
    /// Projections, `[view][row][bin]`.
    Views,
    /// A number per voxel, `[z][y][x]`.
    Volume,
    /// A label per voxel.
    Labels,
    /// Several numbers per voxel.
    Field(FieldOf),
    /// Triangles.
    Surface,
    /// Grey values of a slice.
    Picture,
}

/// The items that have one array each.
enum Per {
    /// Each gate.
    Gate,
    /// Each phase that represents projections ([`Phantom::phases`]).
    Phase,
    /// Each reconstructed volume: of a gate, or motion-compensated.
    Volume,
    /// Each gate, and each motion-compensated volume.
    GateAndVolume,
}

/// The input of a product; each includes the earlier ones.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub(crate) enum Needs {
    /// The shapes of the heart.
    Shapes,
    /// The projections.
    Views,
    /// The reconstructed volumes.
    Reconstruction,
}

/// Index of an array among the arrays of its kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Index {
    /// Of a gate.
    Gate(usize),
    /// Of a phase.
    Phase(PhaseOf),
    /// A motion-compensated volume.
    Volume(usize),
    /// All cardiac gates of a respiratory gate, 0 without respiratory gates.
    Cardiac(usize),
    /// All volumes.
    All,
}

impl ProductInfo {
    /// Stem and content of an array; those of energy windows have the same.
    fn array(&self, array: usize) -> (&'static str, Content) {
        self.arrays[array.min(self.arrays.len() - 1)]
    }

    /// Whether all gates can go into one file.
    fn joins(&self) -> bool {
        match self.arrays[0].1 {
            Content::Views | Content::Volume | Content::Labels => true,
            Content::Field(_) | Content::Surface | Content::Picture => false,
        }
    }
}

impl Product {
    /// The table.
    pub(crate) const fn info(self) -> &'static ProductInfo {
        match self {
            Self::Projections => &ProductInfo {
                arrays: &[("projections", Content::Views)],
                per: Per::Gate,
                needs: Needs::Views,
                voxel_bytes: 0,
            },
            Self::Scatter => &ProductInfo {
                arrays: &[("scatter", Content::Views)],
                per: Per::Gate,
                needs: Needs::Views,
                voxel_bytes: 0,
            },
            Self::Reconstruction => &ProductInfo {
                arrays: &[("reconstruction", Content::Volume)],
                per: Per::Volume,
                needs: Needs::Reconstruction,
                voxel_bytes: 0, // counted with the reconstruction itself
            },
            Self::Truth => &ProductInfo {
                arrays: &[("truth", Content::Volume)],
                per: Per::GateAndVolume,
                ..OF_PHASES
            },
            Self::Labels => &ProductInfo {
                arrays: &[("labels", Content::Labels)],
                voxel_bytes: 1,
                ..OF_PHASES
            },
            Self::Attenuation => &OF_PHASES,
            Self::Meshes => &ProductInfo {
                arrays: &[("inner", Content::Surface), ("outer", Content::Surface)],
                voxel_bytes: 0,
                ..OF_PHASES
            },
            Self::Motion => &ProductInfo {
                arrays: &[
                    ("displacement", Content::Field(FieldOf::Displacement)),
                    ("velocity", Content::Field(FieldOf::Velocity)),
                    ("strain", Content::Field(FieldOf::Components(6))),
                ],
                voxel_bytes: 96, // twelve numbers, and one field again in the order of its file
                ..OF_PHASES
            },
            Self::Pictures => &ProductInfo {
                arrays: &[("slice", Content::Picture)],
                per: Per::Volume,
                needs: Needs::Reconstruction,
                voxel_bytes: 0,
            },
        }
    }
}

/// Attenuation maps; other products of phases differ in some properties.
const OF_PHASES: ProductInfo = ProductInfo {
    arrays: &[("attenuation", Content::Volume)],
    per: Per::Phase,
    needs: Needs::Shapes,
    voxel_bytes: 4,
};

impl Output {
    /// Whether a product is written.
    pub(crate) fn has(&self, product: Product) -> bool {
        self.write.contains(&product)
    }

    /// Whether a written product needs this input.
    pub(crate) fn needs(&self, needs: Needs) -> bool {
        (self.write.iter()).any(|product| product.info().needs >= needs)
    }

    /// Whether all cardiac gates are written to one file, if the product allows it.
    pub(crate) fn one_file(&self, mode: Mode) -> bool {
        matches!(mode, Mode::Gated { .. }) && self.gates == GateFiles::OneFile
    }

    /// Whether all cardiac gates of a product go into one file.
    pub(crate) fn joins(&self, product: Product, mode: Mode) -> bool {
        product.info().joins() && self.one_file(mode)
    }

    /// The first format, with its field of `[output]`, that cannot store all gates of a product in one file.
    pub(crate) fn without_gates(&self, mode: Mode) -> Option<(&'static str, Format)> {
        let joins = |content: fn(&Content) -> bool| {
            let joined = self.write.iter().filter(|product| product.info().joins());
            joined
                .flat_map(|product| product.info().arrays)
                .any(|(_, of)| content(of))
        };
        let formats = [
            (
                "projections",
                self.projections,
                joins(|of| *of == Content::Views),
            ),
            ("volumes", self.volumes, joins(|of| *of != Content::Views)),
        ];
        let lacks = |(field, format, used): (_, Format, bool)| {
            (used && self.one_file(mode) && !format.info().gates).then_some((field, format))
        };
        formats.into_iter().find_map(lacks)
    }
}

/// A file of a run.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
#[non_exhaustive]
pub struct PlannedFile {
    /// Its name in the output directory.
    pub name: PathBuf,
    /// Bytes of its samples or triangles before compression; a header adds some hundred bytes, an archive some thousand. 0 for a header
    /// beside its data, and for the report.
    pub bytes: u64,
}

impl Phantom {
    /// Lists the files that `run` writes. Computes the surfaces to count their triangles.
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

    /// Lists only the names; computes no surface.
    pub(crate) fn file_names(&self) -> Result<Vec<PathBuf>, PhantomError> {
        let planned = self.planned(|_| Ok([0; 2]))?;
        Ok(planned.into_iter().map(|file| file.name).collect())
    }

    /// The files, with the sizes of both surfaces at a phase from `surfaces`.
    fn planned(
        &self,
        surfaces: impl Fn(MotionPhase) -> Result<[u64; 2], PhantomError>,
    ) -> Result<Vec<PlannedFile>, PhantomError> {
        // Shapes of equal gain, during filling and emptying, have the same surface.
        let mut known = HashMap::new();
        let mut surface = |of, array: usize| -> Result<u64, PhantomError> {
            let Some(phase) = self.phases().into_iter().find(|phase| phase.of == of) else {
                return Ok(0);
            };
            let bytes = match known.entry(self.cycle().gain(phase.at.phase).to_bits()) {
                Entry::Occupied(bytes) => *bytes.get(),
                Entry::Vacant(place) => *place.insert(surfaces(phase.at)?),
            };
            Ok(bytes[array])
        };
        let mut planned = Vec::new();
        for &product in &self.scene().output.write {
            for index in self.indices(product) {
                for array in 0..self.n_arrays(product) {
                    let (_, content) = product.info().array(array);
                    let bytes = match (content, index) {
                        (Content::Surface, Index::Phase(of)) => surface(of, array)?,
                        _ => self.bytes_of(content, index),
                    };
                    let names = self.names_of(product, array, index);
                    // The last of several files contains the data.
                    let last = names.len().saturating_sub(1);
                    planned.extend(names.into_iter().enumerate().map(|(k, name)| PlannedFile {
                        name,
                        bytes: if k == last { bytes } else { 0 },
                    }));
                }
            }
        }
        planned.push(PlannedFile {
            name: REPORT.into(),
            bytes: 0,
        });
        Ok(planned)
    }

    /// Lists the indices of the arrays of a product.
    fn indices(&self, product: Product) -> Vec<Index> {
        let gates = || (0..self.n_gates()).map(Index::Gate).collect::<Vec<_>>();
        let volumes = || (0..self.n_volumes()).map(Index::Volume).collect::<Vec<_>>();
        let cardiac = || {
            (0..self.n_respiratory_gates())
                .map(Index::Cardiac)
                .collect::<Vec<_>>()
        };
        let all = vec![Index::All];
        let joined = self.joins(product);
        match (&product.info().per, self.is_compensated()) {
            (Per::Volume, true) => match product {
                Product::Pictures if self.n_volumes() > 1 => [volumes(), all].concat(),
                _ => volumes(),
            },
            (Per::GateAndVolume, true) if joined => [cardiac(), volumes()].concat(),
            (Per::GateAndVolume, true) => [gates(), volumes()].concat(),
            _ if joined => cardiac(),
            (Per::Phase, _) => (self.phases().iter())
                .map(|phase| Index::Phase(phase.of))
                .collect(),
            (Per::Volume, false) if product == Product::Pictures && self.n_gates() > 1 => {
                [gates(), all].concat()
            }
            (Per::Gate | Per::Volume | Per::GateAndVolume, _) => gates(),
        }
    }

    /// Number of arrays of a product; projections have one for each energy window.
    pub(crate) fn n_arrays(&self, product: Product) -> usize {
        match product.info().arrays[0].1 {
            Content::Views => self.n_windows(),
            Content::Volume
            | Content::Labels
            | Content::Field(_)
            | Content::Surface
            | Content::Picture => product.info().arrays.len(),
        }
    }

    /// Whether all cardiac gates of a product go into one file.
    pub(crate) fn joins(&self, product: Product) -> bool {
        (self.scene().output).joins(product, self.scene().acquisition.mode)
    }

    /// Returns the number G of cardiac gates, or 1: gated projection set k G + g is cardiac gate g in respiratory gate k.
    #[must_use]
    pub fn n_cardiac_gates(&self) -> usize {
        self.scene().acquisition.mode.n_gates()
    }

    /// Returns the number of respiratory gates, or 1.
    pub(crate) fn n_respiratory_gates(&self) -> usize {
        self.n_gates() / self.n_cardiac_gates()
    }

    /// Bytes of an array in its file before compression, except of surfaces.
    fn bytes_of(&self, content: Content, index: Index) -> u64 {
        let (camera, output) = (self.camera(), &self.scene().output);
        let voxels = camera.grid().len() as u64;
        let one = match content {
            Content::Views => {
                let samples = (camera.n_views() * camera.view_len()) as u64;
                output.projections.info().sample_bytes * samples
            }
            Content::Volume => output.volumes.info().sample_bytes * voxels,
            Content::Labels => voxels,
            Content::Field(of) => 4 * of.components() as u64 * voxels,
            Content::Surface => 0,
            Content::Picture => camera.grid().slice_len() as u64,
        };
        let times = match (index, content) {
            (Index::All, _) => self.n_volumes(),
            (Index::Cardiac(_), _) => self.n_cardiac_gates(),
            (Index::Gate(_) | Index::Phase(_) | Index::Volume(_), _) => 1,
        };
        times as u64 * one
    }

    /// Returns the files of an array: header first, data last.
    pub(crate) fn names_of(&self, product: Product, array: usize, index: Index) -> Vec<PathBuf> {
        let output = &self.scene().output;
        let (stem, content) = product.info().array(array);
        let stem = match (product, index) {
            (Product::Truth, Index::Gate(_) | Index::Cardiac(_)) => self.truth_of().file_name(),
            (Product::Pictures, Index::All) => ANIMATION,
            _ => stem,
        };
        let stem = match (content, array) {
            (Content::Views, 1..) => format!("{stem}-window-{}", array + 1),
            _ => stem.to_owned(),
        };
        let of_gate = |stem: &str, kind: &str, gate, gates| match gates {
            1 => stem.to_owned(),
            _ => format!("{stem}-{kind}{}", PhaseOf::Gate { gate, gates }),
        };
        let name = match index {
            Index::All | Index::Phase(PhaseOf::Static | PhaseOf::Gate { gates: 1, .. }) => stem,
            Index::Phase(of) => format!("{stem}-{of}"),
            Index::Cardiac(gate) => {
                of_gate(&stem, "respiratory-", gate, self.n_respiratory_gates())
            }
            Index::Gate(gate) => of_gate(&stem, "", gate, self.n_gates()),
            Index::Volume(k) => of_gate(&format!("{stem}-compensated"), "", k, self.n_volumes()),
        };
        let single = |header| Extensions { header, data: None };
        let extensions = match content {
            Content::Views => output.projections.info().projections,
            Content::Volume | Content::Labels | Content::Field(_) => {
                Some(output.volumes.info().volume)
            }
            Content::Surface => Some(single("stl")),
            Content::Picture if index == Index::All => Some(single("gif")),
            Content::Picture => Some(single("png")),
        };
        let orbit = (content == Content::Views
            && output.projections == Format::InterfileSimind
            && !self.radii().is_ok_and(|radii| are_equal(&radii)))
        .then_some(ORBIT_EXTENSION);
        let extensions = extensions.map(|known| [Some(known.header), orbit, known.data]);
        (extensions.into_iter().flatten().flatten())
            .map(|extension| format!("{name}.{extension}").into())
            .collect()
    }

    /// Whether volumes are motion-compensated.
    pub(crate) fn is_compensated(&self) -> bool {
        self.scene().reconstruction.compensation == Compensation::KnownMotion
    }
}
