//! Memory of a run, estimated before any work.

use super::memory_limit::memory_limit;
use super::method::Method;
use super::output::{Output, Product, ProjectionValues};
use super::products::Needs;
use crate::error::{PhantomError, check_count};
use crate::files::Format;
use crate::scan::{MOST_NODES, STEPS};
use crate::scene::WORK_BYTES;
use crate::truth::{MASK_PHASES, MOST_IN_PASS, finder_bytes, in_pass};
use crate::{Accuracy, Mode, Phantom};
use std::collections::BTreeSet;

/// Bytes per point of the time quadrature: the point (32), its place in a tree of distinct points (about 36) and in the list of phases (8),
/// with the spare capacity of lists.
const POINT_BYTES: u64 = 120;

/// An upper estimate of the memory of `run` in bytes: usually tens of per cent too high, up to three times for OSEM with a collimator, whose
/// work memory is a fixed amount here, and more if the number of shapes of a tolerance is unknown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[non_exhaustive]
pub struct Memory {
    /// Shapes of the heart, with their defects and surface search.
    pub shapes: u64,
    /// Projections of one gate, and their times.
    pub views: u64,
    /// Reconstruction, ground truth and masks of one gate; products that are collected for a file of all gates, and copies while a file is
    /// written; memory of the caller ([`Phantom::with_memory_share`]).
    pub volumes: u64,
    /// Memory per thread: rows of unfinished images, unsorted cells of the OSEM model.
    pub each_thread: u64,
}

impl Memory {
    /// Returns the total for the number of threads of this machine.
    #[must_use]
    pub fn total(&self) -> u64 {
        let threads = rayon::current_num_threads() as u64;
        self.shapes + self.views + self.volumes + threads * self.each_thread
    }
}

impl Phantom {
    /// Estimates the memory of a run without solving shapes or casting rays. [`Phantom::with_memory`] limits the memory of shapes. The
    /// memory of images is known after [`Phantom::prepare`].
    ///
    /// ```
    /// use heart_phantom::{Phantom, Scene};
    /// let memory = Phantom::new(Scene::default())?.memory();
    /// // 90 views of 256 x 256 samples, four bytes each, and two volumes of 256^3 voxels.
    /// assert!(memory.views >= 4 * 90 * 256 * 256 && memory.volumes >= 2 * 4 * 256 * 256 * 256);
    /// # Ok::<(), heart_phantom::PhantomError>(())
    /// ```
    #[must_use]
    pub fn memory(&self) -> Memory {
        self.memory_of(&self.scene().output, self.camera().n_views())
    }

    /// Checks that the memory suffices for some products of a gate, with `n_views` of its views at a time.
    ///
    /// # Errors
    /// [`PhantomError::Memory`]; [`PhantomError::Count`] for more views than the camera has.
    pub fn check_memory(&self, products: &[Product], n_views: usize) -> Result<(), PhantomError> {
        check_count("views", n_views, [0, self.camera().n_views()])?;
        let output = Output {
            write: products.to_vec(),
            ..Output::default()
        };
        self.check_available(self.memory_of(&output, n_views).total())
    }

    /// Checks that a number of bytes is within this run's part of the memory.
    pub(super) fn check_available(&self, needed: u64) -> Result<(), PhantomError> {
        match memory_limit().map(|limit| limit / self.share.runs) {
            Some(available) if needed > available => {
                Err(PhantomError::Memory { needed, available })
            }
            _ => Ok(()),
        }
    }

    /// Estimates the memory of an output whose projections are computed `n_views` at a time.
    fn memory_of(&self, output: &Output, n_views: usize) -> Memory {
        let (camera, parts) = (self.camera(), &self.parts);
        let wants = |product| output.has(product);
        let reconstructs = output.needs(Needs::Reconstruction);
        let sees = output.needs(Needs::Views);
        // `prepare` reports an orbit that is not yet known and an excessive number of nodes.
        let scatter = (self.known_radii()).and_then(|radii| self.bytes_of_scatter(&radii).ok());
        let scatter = scatter.unwrap_or_default();
        let judges = reconstructs && wants(Product::Truth);

        let samples = 4 * (n_views * camera.view_len()) as u64;
        // Points of the time quadrature of the projections that are acquired together.
        let scan = self.scan(self.acquisition_of(0, self.known_steps().unwrap_or(STEPS[0])));
        let points = (scan.acquisition).points_of_all(scan.cycle, camera, camera.rotation());
        let points = points * n_views as f64 / camera.n_views() as f64;
        let points = POINT_BYTES * points.min(MOST_NODES as f64) as u64;
        let windows = self.n_windows() as u64;
        // Noisy and noise-free samples exist at the same time, and so do several energy windows and the unscattered photons; gates that share images
        // are computed together.
        let together = match self.shares_images() {
            true => 2 * self.n_gates() as u64,
            false => 0,
        };
        let copies = 1 + u64::from(parts.scene.noise.is_some()) + together;
        let copies = copies + if windows > 1 { windows } else { 0 };
        let voxels = camera.grid().len() as u64;
        let filters = reconstructs && parts.scene.reconstruction.filter_fwhm.is_some();
        let (reconstruction, cells) = match (reconstructs, &parts.scene.reconstruction.method) {
            (false, _) => (0, 0),
            (true, Method::Fbp) => ((WORK_BYTES as u64).min(8 * voxels), 0),
            (true, Method::Osem(osem)) => self.bytes_of_osem(osem),
        };
        // The projections of all gates, and the ground truth of their volume.
        let together = match self.is_compensated() && reconstructs {
            false => 0,
            true => 2 * self.n_gates() as u64 * samples + 8 * voxels,
        };
        // Two unfinished projections per thread.
        let images = match self.imaging.get() {
            Some(Some(imaging)) if sees => 2 * imaging.view_bytes(camera) as u64,
            _ => 0,
        };
        Memory {
            shapes: self.bytes_of_shapes(wants(Product::Truth), judges),
            views: points
                + if sees {
                    copies * samples + scatter[0]
                } else {
                    0
                },
            each_thread: images.max(cells).max(scatter[1]),
            volumes: self.share.further
                + reconstruction
                + self.bytes_of_files(output, samples)
                + together
                + voxels
                    * (4 * (u64::from(reconstructs) + u64::from(filters))
                        + 4 * u64::from(judges)
                        + 4 * u64::from(
                            parts.organs.is_some() && (judges || wants(Product::Truth)),
                        )
                        + (output.write.iter())
                            .map(|product| product.info().voxel_bytes)
                            .sum::<u64>()),
        }
    }

    /// The shapes that exist at the same time, with their defects and surface searches for ground truth and masks.
    fn bytes_of_shapes(&self, is_voxelised: bool, is_judged: bool) -> u64 {
        let heart = self.heart();
        let scan = self.scan(self.acquisition_of(0, STEPS[0]));
        let seen = self.distinct_shapes(is_voxelised || is_judged);
        let kept = seen.min(heart.most_shapes());
        let passed = if is_voxelised {
            seen.min(in_pass(&scan))
        } else {
            0
        };
        let judged = if is_judged {
            seen.clamp(MASK_PHASES, MOST_IN_PASS)
        } else {
            0
        };
        let alive = kept.max(passed).max(judged).max(2) as u64;
        let fields = (passed.max(judged) * finder_bytes(&scan)) as u64;
        alive * heart.bytes_with_defects() as u64 + fields
    }

    /// The arrays of all cardiac gates that are collected for one file, and the copies of the largest array while it is written; `samples` are the
    /// bytes of the projections of a gate. Labels of a gate have a byte per voxel.
    fn bytes_of_files(&self, output: &Output, samples: u64) -> u64 {
        let voxels = self.camera().grid().len() as u64;
        let windows = self.n_windows() as u64;
        let raw = u64::from(output.values == ProjectionValues::Counts);
        let [of_views, of_volumes] = [output.projections, output.volumes].map(Format::info);
        let (mut collected, mut copied) = (0, 0);
        for product in &output.write {
            let is_joined = output.joins(*product, self.scene().acquisition.mode);
            let gates = if is_joined {
                self.n_cardiac_gates() as u64
            } else {
                1
            };
            let (bytes, copy) = match product {
                Product::Projections | Product::Scatter => {
                    let copy = samples * raw + samples / 4 * of_views.copy_bytes[0];
                    (windows * samples, copy)
                }
                Product::Reconstruction => (4 * voxels, voxels * of_volumes.copy_bytes[1]),
                Product::Meshes | Product::Pictures => (0, 0),
                Product::Truth | Product::Labels | Product::Attenuation | Product::Motion => (
                    product.info().voxel_bytes * voxels,
                    voxels * of_volumes.copy_bytes[1],
                ),
            };
            collected += if is_joined { gates * bytes } else { 0 };
            copied = copied.max(gates * copy);
        }
        collected + copied
    }

    /// The time steps per cycle, given or already found for the tolerance.
    fn known_steps(&self) -> Option<usize> {
        match self.scene().acquisition.accuracy {
            Accuracy::Steps(steps) => Some(steps),
            Accuracy::Tolerance(_) => self.steps.get().copied(),
        }
    }

    /// Counts the shapes that the projections of all gates need, with those of their volumes, at most the number that is stored. For a tolerance
    /// whose steps are unknown this is the number of the finest levels of a cycle: to find the nodes of all views with so many levels would take
    /// minutes.
    fn distinct_shapes(&self, with_volumes: bool) -> usize {
        let most = self.heart().most_shapes().max(MOST_IN_PASS);
        let steps = match (self.known_steps(), self.scene().acquisition.mode) {
            (_, Mode::Static { .. }) => return 1,
            (Some(steps), _) => steps,
            (None, Mode::Instants) => STEPS[0],
            (None, _) => return most.min(STEPS[1] + 1),
        };
        let mut gains = BTreeSet::new();
        for gate in 0..self.n_gates() {
            let scan = self.scan(self.acquisition_of(gate, steps));
            scan.collect_gains(&mut gains, most);
            if with_volumes && gains.len() < most {
                gains.extend(scan.likely_gains(self.scene().truth.tolerance));
            }
        }
        gains.len().min(most)
    }
}
