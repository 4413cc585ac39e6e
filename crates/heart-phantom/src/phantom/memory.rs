//! How much memory a scene needs, before any work.

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

/// About a point of the quadrature (32), its place in a tree of distinct ones (some 36) and in the list of phases (8), with the room by
/// which lists grow.
const POINT_BYTES: u64 = 120;

/// Memory in bytes that the operating system can give this process, as far as Linux reports it: the least of physical memory with swap,
/// the limit of the control group and what is left of the address space.
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
/// [`PhantomError::Memory`] if that many bytes are more than the operating system can give.
pub(crate) fn check_memory(needed: u64) -> Result<(), PhantomError> {
    match memory_limit() {
        Some(available) if needed > available => Err(PhantomError::Memory { needed, available }),
        _ => Ok(()),
    }
}

/// Memory that `run` of a scene takes at most, in bytes: an estimate, some tens of per cent above what is taken as a
/// rule, more where a tolerance leaves open how many shapes it takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Memory {
    /// Shapes of the heart, with the defects in them and with what finds their surfaces in voxels.
    pub shapes: u64,
    /// The views of one gate, and when they see what.
    pub views: u64,
    /// Reconstruction, exact volume and masks of one gate; all that goes into one file of all gates.
    pub volumes: u64,
    /// What each thread takes besides: slabs of the views under way through a collimator, cells that OSEM's model sorts.
    pub each_thread: u64,
}

impl Memory {
    /// All of it, on as many threads as there are here.
    pub fn total(&self) -> u64 {
        let threads = rayon::current_num_threads() as u64;
        self.shapes + self.views + self.volumes + threads * self.each_thread
    }
}

impl Phantom {
    /// The memory that a run takes at most; no shape is solved and no ray cast for it. What shapes take while views are taken can be
    /// bounded ([`Phantom::with_memory`]). What the slabs of a collimator's views take is known once [`Phantom::prepare`] was called.
    ///
    /// ```
    /// use heart_phantom::{Phantom, Scene};
    /// let memory = Phantom::new(Scene::default())?.memory();
    /// // 90 views of 256 x 256 samples, four bytes each, and two volumes of 256^3 voxels.
    /// assert!(memory.views >= 4 * 90 * 256 * 256 && memory.volumes >= 2 * 4 * 256 * 256 * 256);
    /// # Ok::<(), heart_phantom::PhantomError>(())
    /// ```
    pub fn memory(&self) -> Memory {
        let (heart, camera, parts) = (self.heart(), self.camera(), self.parts());
        let wants = |product| parts.scene.output.has(product);
        let reconstructs = parts.scene.output.needs(Needs::Reconstruction);
        let sees = parts.scene.output.needs(Needs::Views);
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
        // Points of the quadrature over time, of as many views as are taken together.
        let points = scan.acquisition.points_of_all(scan.cycle, camera);
        let points = POINT_BYTES * points.min(MOST_NODES as f64) as u64;
        // Noise is counted beside what it is the noise of.
        let copies = 1 + u64::from(parts.scene.noise.is_some());
        let voxels = camera.grid().len() as u64;
        let (reconstruction, cells) = match (reconstructs, &parts.scene.reconstruction.method) {
            (false, _) => (0, 0),
            (true, Method::Fbp) => ((WORK_BYTES as u64).min(8 * voxels), 0),
            (true, Method::Osem(osem)) => self.bytes_of_osem(osem),
        };
        // Products of all gates wait until the last one is there; labels of a gate have a byte per voxel.
        let joined = parts
            .scene
            .output
            .write
            .iter()
            .filter(|of| self.joins(**of));
        let collected: u64 = joined
            .map(|product| match product {
                Product::Projections => samples,
                Product::Reconstruction => 4 * voxels,
                _ => product.info().voxel_bytes * voxels,
            })
            .sum();
        let collected = self.n_gates() as u64 * collected;
        // The views of all gates together, and their volume's truth.
        let together = match self.is_compensated() && reconstructs {
            false => 0,
            true => 2 * self.n_gates() as u64 * samples + 8 * voxels,
        };
        // Two views a thread may be under way.
        let slabs = match self.depth_known() {
            Some(depth) if sees => 2 * depth.view_bytes() as u64,
            _ => 0,
        };
        Memory {
            shapes: alive * (shape + defects) + fields,
            views: points + if sees { copies * samples } else { 0 },
            each_thread: slabs.max(cells),
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

    /// Shapes that the views of all gates need, no more than are kept at most; with a tolerance those of the steps that meet it, or if
    /// that is not known yet of the finest.
    fn distinct_shapes(&self) -> usize {
        let steps = match self.scene().acquisition.accuracy {
            Accuracy::Steps(steps) => steps,
            Accuracy::Tolerance(_) => self.steps_known().unwrap_or(STEPS[1]),
        };
        let most = self.heart().most_shapes().max(MOST_IN_PASS);
        let mut gains = BTreeSet::new();
        for gate in 0..self.n_gates() {
            let scan = self.scan(self.camera(), gate, self.acquisition_of(gate, steps));
            scan.collect_gains(&mut gains, most);
        }
        gains.len()
    }
}
