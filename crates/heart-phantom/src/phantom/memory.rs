//! Memory of a run, estimated before any work.

use super::method::Method;
use super::output::Product;
use super::products::Needs;
use crate::error::PhantomError;
use crate::model::without_overlap;
use crate::scan::MOST_NODES;
use crate::scan::{Accuracy, STEPS};
use crate::scene::WORK_BYTES;
use crate::truth::{MASK_PHASES, MOST_IN_PASS, finder_bytes, in_pass};
use crate::{Defect, Phantom};
use std::collections::BTreeSet;

/// Bytes per point of the time quadrature: the point (32), its place in a tree of distinct points (about 36) and in the list of phases (8),
/// with the spare capacity of lists.
const POINT_BYTES: u64 = 120;

/// Returns the memory in bytes that Linux can give this process: the least of physical memory with swap, the limit of the control group and
/// the rest of the address space. `None` if unknown.
pub(crate) fn memory_limit() -> Option<u64> {
    let read = |path| std::fs::read_to_string(path).unwrap_or_default();
    let number = |text: &str| text.split_whitespace().find_map(|word| word.parse().ok());
    let value = |text: &str, name: &str| -> Option<u64> {
        let line = text.lines().find_map(|line| line.strip_prefix(name));
        number(line?)
    };
    let memory = read("/proc/meminfo");
    let physical = value(&memory, "MemTotal:")
        .map(|kib| kib.saturating_add(value(&memory, "SwapTotal:").unwrap_or(0)) << 10);
    let group = number(&read("/sys/fs/cgroup/memory.max"));
    let used = value(&read("/proc/self/status"), "VmSize:").unwrap_or(0) << 10;
    let address = value(&read("/proc/self/limits"), "Max address space")
        .map(|limit: u64| limit.saturating_sub(used));
    [physical, group, address].into_iter().flatten().min()
}

/// # Errors
/// [`PhantomError::Memory`] if the operating system cannot give that many bytes.
pub(crate) fn check_memory(needed: u64) -> Result<(), PhantomError> {
    match memory_limit() {
        Some(available) if needed > available => Err(PhantomError::Memory { needed, available }),
        _ => Ok(()),
    }
}

/// An upper estimate of the memory of `run` in bytes: usually tens of per cent too high, more if the number of shapes of a tolerance
/// is unknown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Memory {
    /// Shapes of the heart, with their defects and surface search.
    pub shapes: u64,
    /// Projections of one gate, and their times.
    pub views: u64,
    /// Reconstruction, ground truth and masks of one gate; products that are collected for a file of all gates.
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
        let (heart, camera, parts) = (self.heart(), self.camera(), self.parts());
        let wants = |product| parts.scene.output.has(product);
        let reconstructs = parts.scene.output.needs(Needs::Reconstruction);
        let sees = parts.scene.output.needs(Needs::Views);
        // `prepare` reports an orbit that is not yet known and an excessive number of nodes.
        let known = (self.facing.get()).map(|views| views.iter().map(|view| view.radius).collect());
        let radii: Option<Vec<f64>> = parts.nominal_radii().or(known);
        let scatter = radii.and_then(|radii| self.bytes_of_scatter(&radii).ok());
        let scatter = scatter.unwrap_or_default();
        let judges = reconstructs && wants(Product::Truth);

        let seen = self.distinct_shapes();
        let kept = seen.min(heart.most_shapes());
        let scan = self.scan(camera, 0, self.acquisition_of(0, STEPS[0]));
        let passed = if wants(Product::Truth) {
            seen.min(in_pass(&scan))
        } else {
            0
        };
        let judged = if judges {
            seen.clamp(MASK_PHASES, MOST_IN_PASS)
        } else {
            0
        };
        let alive = kept.max(passed).max(judged).max(2) as u64;
        let shape = heart.shape_bytes() as u64;
        let regions = parts.scene.defects.iter().map(Defect::region);
        let defects = without_overlap(regions).map_or(0, |pieces| pieces.len()) as u64 * shape;
        let fields = (passed.max(judged) * finder_bytes(&scan)) as u64;

        let samples = 4 * (camera.n_views() * camera.view_len()) as u64;
        // Points of the time quadrature of the projections that are acquired together.
        let points = scan.acquisition.points_of_all(scan.cycle, camera);
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
        let (reconstruction, cells) = match (reconstructs, &parts.scene.reconstruction.method) {
            (false, _) => (0, 0),
            (true, Method::Fbp) => ((WORK_BYTES as u64).min(8 * voxels), 0),
            (true, Method::Osem(osem)) => self.bytes_of_osem(osem),
        };
        // Products in a file of all gates are collected until the last gate; labels of a gate have a byte per voxel.
        let joined = parts
            .scene
            .output
            .write
            .iter()
            .filter(|of| self.joins(**of));
        let collected: u64 = joined
            .map(|product| match product {
                Product::Projections | Product::Scatter => windows * samples,
                Product::Reconstruction => 4 * voxels,
                _ => product.info().voxel_bytes * voxels,
            })
            .sum();
        let collected = self.n_gates() as u64 * collected;
        // The projections of all gates, and the ground truth of their volume.
        let together = match self.is_compensated() && reconstructs {
            false => 0,
            true => 2 * self.n_gates() as u64 * samples + 8 * voxels,
        };
        // Two unfinished projections per thread.
        let images = match self.imaging_known() {
            Some(imaging) if sees => 2 * imaging.view_bytes(camera) as u64,
            _ => 0,
        };
        Memory {
            shapes: alive * (shape + defects) + fields,
            views: points
                + if sees {
                    copies * samples + scatter[0]
                } else {
                    0
                },
            each_thread: images.max(cells).max(scatter[1]),
            volumes: reconstruction
                + collected
                + together
                + voxels
                    * (4 * u64::from(reconstructs)
                        + 4 * u64::from(judges)
                        + (parts.scene.output.write.iter())
                            .map(|product| product.info().voxel_bytes)
                            .sum::<u64>()),
        }
    }

    /// Counts the shapes that the projections of all gates need, at most the number that is stored; for a tolerance those of its steps, or
    /// of the finest steps if these are unknown.
    fn distinct_shapes(&self) -> usize {
        let steps = match self.scene().acquisition.accuracy {
            Accuracy::Steps(steps) => steps,
            Accuracy::Tolerance(_) => self.steps_known().unwrap_or(STEPS[1]),
        };
        let most = self.heart().most_shapes().max(MOST_IN_PASS);
        let mut gains = BTreeSet::new();
        for gate in 0..self.n_gates() {
            let acquisition = self.acquisition_of(gate, steps);
            // Views, and volumes.
            for acquisition in [acquisition, acquisition.linear()] {
                let scan = self.scan(self.camera(), gate, acquisition);
                scan.collect_gains(&mut gains, most);
            }
        }
        gains.len()
    }
}
