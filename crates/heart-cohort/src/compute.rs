//! Computes a member, its part of a shard, with the options of the computation.

use crate::cohort::{Cohort, Compression, Precision};
use crate::draw::Member;
use crate::geometry::geometry;
use crate::half::half;
use crate::piece::Piece;
use crate::read::json_of;
use flate2::write::GzEncoder;
use heart_phantom::files::{Samples, put_npy};
use heart_phantom::{
    Heart, MotionPhase, Numbers, Phantom, PhantomError, Product, ProjectionValues, chain,
    check_count,
};
use serde_json::json;
use std::io::Write;
use std::sync::{Mutex, PoisonError};

/// Upper bound on the size of an array header, the padding of its file and the header of the next.
const NPY_HEADER: usize = 2048;

const MOST_THREADS: usize = 4096;

/// Options of the computation of a shard. Results do not depend on them, except that a member whose memory exceeds its part is rejected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct RunOptions {
    /// Number of members computed concurrently, each on one thread: 1 to 4096.
    pub threads: usize,
    /// Bytes for shapes of the heart on all threads, at least 1 ([`Heart::with_memory`]); default 512 MiB.
    pub memory: usize,
}

impl RunOptions {
    /// Options for a number of concurrent members, 1 to 4096, and 512 MiB; the functions that compute members reject others, and 0 bytes,
    /// with [`PhantomError::Count`] before any work.
    #[must_use]
    pub fn new(threads: usize) -> Self {
        Self {
            threads,
            memory: Heart::DEFAULT_MEMORY,
        }
    }

    /// Validates the numbers of threads and bytes.
    pub(crate) fn check(&self) -> Result<(), PhantomError> {
        check_count("threads", self.threads, [1, MOST_THREADS])?;
        check_count("memory", self.memory, [1, usize::MAX]).map(drop)
    }
}

/// The format of arrays.
type Form = (Compression, Precision);

/// A computed member: its files in the shard.
#[derive(Debug)]
pub(crate) struct Computed {
    /// Bytes of the archive, including headers and padding.
    pub(crate) bytes: Vec<u8>,
    /// Their BLAKE3 checksum.
    pub(crate) blake3: String,
    pub(crate) numbers: Numbers,
    pub(crate) warnings: Vec<String>,
}

/// Buffers of completed members for reuse: new pages of the system would take a sixth of the time of a member.
#[derive(Debug, Default)]
pub(crate) struct Spare {
    bytes: Mutex<Vec<Vec<u8>>>,
    samples: Mutex<Vec<Vec<f32>>>,
}

/// Returns an existing vector or a new one.
fn taken<T>(vectors: &Mutex<Vec<Vec<T>>>) -> Vec<T> {
    let mut vectors = vectors.lock().unwrap_or_else(PoisonError::into_inner);
    vectors.pop().unwrap_or_default()
}

fn given<T>(vectors: &Mutex<Vec<Vec<T>>>, vector: Vec<T>) {
    let mut vectors = vectors.lock().unwrap_or_else(PoisonError::into_inner);
    vectors.push(vector);
}

impl Spare {
    /// Returns the buffers of a written member.
    pub(crate) fn give_back(&self, computed: Computed) {
        given(&self.bytes, computed.bytes);
    }
}

/// Computes a member on the threads of the current pool, with its part of the memory of all concurrent members.
///
/// # Errors
/// The reason of the rejection.
pub(crate) fn compute(
    cohort: &Cohort,
    member: &Member,
    options: &RunOptions,
    spare: &Spare,
) -> Result<Computed, String> {
    let scene = member.scene().map_err(|error| error.to_string())?;
    let phantom = Phantom::new(scene).map_err(|error| chain(&error))?;
    let form = (cohort.compression, cohort.precision);
    let further = bytes_of_arrays(&phantom, form);
    let phantom = phantom
        .with_memory(options.memory / options.threads)
        .with_memory_share(options.threads, further);
    let mut samples = taken(&spare.samples);
    let made = of_phantom(member, &phantom, form, spare, &mut samples);
    given(&spare.samples, samples);
    made.map_err(|error| chain(&error))
}

/// Returns an upper estimate of the bytes of the arrays of a member besides those of its phantom: projections or ground truth of all gates,
/// the largest array that is computed for all gates or phases, and archives.
fn bytes_of_arrays(phantom: &Phantom, (_, precision): Form) -> u64 {
    /// An archive is computed, one is complete and one is written.
    const ARCHIVES: u64 = 3;
    let (camera, n_gates) = (phantom.camera(), phantom.n_gates() as u64);
    let views = n_gates * (camera.n_views() * camera.view_len()) as u64;
    let voxels = camera.grid().len() as u64;
    let of_phases = phantom.phases().len() as u64 * voxels;
    let (mut shared, mut largest, mut archive) = (0, 0, 0);
    for product in products_of(phantom) {
        let (samples, each) = match product {
            Product::Projections => (views, 4),
            Product::Reconstruction | Product::Truth => (n_gates * voxels, 4),
            Product::Attenuation => (of_phases, 4),
            Product::Labels => (of_phases, 1),
            // Rejected when the text was read.
            _ => (0, 0),
        };
        let bytes = each * samples;
        let (halves, stored) = match precision {
            // Their bits, and these as a file.
            Precision::Float16 if each == 4 => (bytes, bytes / 2),
            Precision::Float16 | Precision::Float32 => (0, bytes),
        };
        let views = if needs_views(product) { 4 * views } else { 0 };
        let (own, new) = match product {
            Product::Projections | Product::Truth => (bytes, 0),
            _ => (0, bytes),
        };
        shared = shared.max(views).max(own);
        largest = largest.max(new + halves);
        archive += stored;
    }
    shared + largest + ARCHIVES * archive
}

fn of_phantom(
    member: &Member,
    phantom: &Phantom,
    form: Form,
    spare: &Spare,
    samples: &mut Vec<f32>,
) -> Result<Computed, PhantomError> {
    phantom.prepare()?;
    let (numbers, warnings) = (phantom.numbers()?, phantom.warnings()?);
    let warnings: Vec<String> = warnings.iter().map(ToString::to_string).collect();
    let products = products_of(phantom);
    let mut piece = Piece::new(&member.key, taken(&spare.bytes));
    let failed = |source| PhantomError::File {
        path: member.key.clone().into(),
        source,
    };
    (piece.add_json("scene.json", &json_of(phantom.scene()))).map_err(failed)?;
    let told = json!({
        "member": member.index, "case": member.case, "split": member.split, "values": member.values, "numbers": numbers, "warnings": warnings,
    });
    piece.add_json("numbers.json", &told).map_err(failed)?;
    (piece.add("cls", |out| write!(out, "{}", member.case_index))).map_err(failed)?;
    // Views precede volumes, which may be reconstructed from them.
    let has_views = products.iter().any(|product| needs_views(*product));
    if has_views {
        let camera = phantom.camera();
        samples.resize(
            phantom.n_gates() * camera.n_views() * camera.view_len(),
            0.0,
        );
        phantom.sinograms_of_gates_into(samples)?;
    }
    // The counts of existing projections are known.
    let geometry = geometry(phantom, has_views)?;
    (piece.add("geometry.json", |out| writeln!(out, "{geometry}"))).map_err(failed)?;
    for product in products {
        add(&mut piece, phantom, product, form, samples)?;
    }
    let bytes = piece.into_bytes();
    Ok(Computed {
        blake3: blake3::hash(&bytes).to_string(),
        bytes,
        numbers,
        warnings,
    })
}

fn products_of(phantom: &Phantom) -> Vec<Product> {
    let mut products = phantom.scene().output.write.clone();
    products.sort_unstable();
    products.dedup();
    products
}

fn needs_views(product: Product) -> bool {
    matches!(product, Product::Projections | Product::Reconstruction)
}

/// The array of a product: for all gates `[gate][view][row][bin]` or `[gate][z][y][x]`, or for all phases `[phase][z][y][x]`.
/// `samples` contains the views until the exact volumes replace them.
fn add(
    piece: &mut Piece,
    phantom: &Phantom,
    product: Product,
    form: Form,
    samples: &mut Vec<f32>,
) -> Result<(), PhantomError> {
    let camera = phantom.camera();
    let [nx, ny, nz] = camera.grid().shape();
    let n_gates = phantom.n_gates();
    let phases: Vec<MotionPhase> = phantom.phases().iter().map(|phase| phase.at).collect();
    let views_shape = [n_gates, camera.n_views(), camera.n_rows(), camera.n_bins()];
    let gates_shape = [n_gates, nz, ny, nx];
    let phases_shape = [phases.len(), nz, ny, nx];
    let of_gate = (samples.len() / n_gates).max(1);
    match product {
        Product::Projections if phantom.scene().output.values == ProjectionValues::Counts => {
            let mut counts = Vec::with_capacity(samples.len());
            for (gate, own) in samples.chunks(of_gate).enumerate() {
                counts.extend_from_slice(&phantom.in_values_of_output(gate, 0, own)?);
            }
            // Half precision has gaps between integers above 2048.
            let form = (form.0, Precision::Float32);
            put(piece, form, "projections", &views_shape, &counts[..])
        }
        Product::Projections => put(piece, form, "projections", &views_shape, &samples[..]),
        Product::Reconstruction => {
            let mut volumes = Vec::with_capacity(gates_shape.iter().product());
            for (gate, own) in samples.chunks(of_gate).enumerate() {
                volumes.extend(phantom.reconstruct(gate, own)?);
            }
            put(piece, form, "reconstruction", &gates_shape, &volumes[..])
        }
        Product::Truth => {
            samples.resize(gates_shape.iter().product(), 0.0);
            phantom.truth_of_gates_into(samples)?;
            put(piece, form, "truth", &gates_shape, &samples[..])
        }
        Product::Labels => {
            let mut labels = Vec::with_capacity(phases_shape.iter().product());
            for phase in phases {
                labels.extend(phantom.labels(phase)?);
            }
            put(piece, form, "labels", &phases_shape, &labels[..])
        }
        Product::Attenuation => {
            let mut maps = Vec::with_capacity(phases_shape.iter().product());
            for phase in phases {
                maps.extend(phantom.attenuation(phase)?);
            }
            put(piece, form, "attenuation", &phases_shape, &maps[..])
        }
        // Rejected when the text was read.
        _ => Ok(()),
    }
}

/// Adds an array as `name.npy` in the format of the cohort.
fn put<'a>(
    piece: &mut Piece,
    (compression, precision): Form,
    name: &str,
    shape: &[usize],
    samples: impl Into<Samples<'a>>,
) -> Result<(), PhantomError> {
    let failed = |source| PhantomError::File {
        path: format!("{name}.npy").into(),
        source,
    };
    let samples = samples.into();
    let halves = match (samples, precision) {
        (Samples::F32(values), Precision::Float16) => Some(npy_of_halves(shape, values)?),
        _ => None,
    };
    let write = |out: &mut dyn Write| match &halves {
        Some(npy) => out.write_all(npy),
        None => put_npy(out, shape, samples),
    };
    let added = match compression {
        Compression::None => piece.add(&format!("{name}.npy"), |out| {
            // Exact capacity: a growing vector allocates up to twice as much.
            out.reserve_exact(samples.len() * samples.bytes_each() + NPY_HEADER);
            write(out)
        }),
        Compression::Gzip => piece.add(&format!("{name}.npy.gz"), |out| {
            let mut out = GzEncoder::new(out, flate2::Compression::fast());
            write(&mut out)?;
            out.finish().map(drop)
        }),
    };
    added.map_err(failed)
}

/// A NumPy array of half precision: the array of its bits with the type `<f2` in the header.
fn npy_of_halves(shape: &[usize], values: &[f32]) -> Result<Vec<u8>, PhantomError> {
    let mut bits = Vec::with_capacity(values.len());
    for &value in values {
        bits.push(half(value).ok_or(PhantomError::OutOfRange {
            what: "a sample in half precision",
            given: value.into(),
            least: -65_504.0,
            most: 65_504.0,
        })?);
    }
    let mut npy = Vec::with_capacity(2 * bits.len() + NPY_HEADER);
    let put = put_npy(&mut npy, shape, Samples::U16(&bits));
    put.map_err(|source| PhantomError::File {
        path: "npy".into(),
        source,
    })?;
    let at = npy.windows(3).position(|word| word == b"<u2");
    at.into_iter().for_each(|at| npy[at + 1] = b'f');
    Ok(npy)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = r#"
members = 1
[scene]
heart.discretisation = { differences = { nodes = 51 } }
camera = { views = 12, bins = 32, rows = 32, pitch = [0.5, 0.5] }
acquisition.mode = { gated = { gates = 3 } }
attenuation = { coefficient = 0.15, medium = "heart" }
output.write = ["projections", "reconstruction", "truth", "labels", "attenuation"]
"#;

    fn computed(text: &str, threads: usize) -> Result<(u64, u64), String> {
        let cohort = Cohort::from_toml(text).unwrap();
        let member = cohort.member(0).unwrap();
        let phantom = Phantom::new(member.scene().unwrap()).unwrap();
        let form = (cohort.compression, cohort.precision);
        let options = RunOptions::new(threads);
        let made = compute(&cohort, &member, &options, &Spare::default())?;
        Ok((bytes_of_arrays(&phantom, form), made.bytes.len() as u64))
    }

    #[test]
    fn the_estimate_contains_the_arrays_of_all_gates() {
        for (precision, volumes) in [("", 2), ("precision = \"float16\"\n", 3)] {
            let (estimated, archive) = computed(&format!("{precision}{TEXT}"), 1).unwrap();
            // Three archives without their headers, and arrays of volumes of all gates: shared ones, computed ones, and halves.
            let arrays = volumes * 4 * 3 * 32u64.pow(3);
            let least = 3 * (archive - 40_000) + arrays;
            assert!(least <= estimated, "{precision} {archive} {estimated}");
            assert!(
                estimated < least + 200_000,
                "{precision} {archive} {estimated}"
            );
        }
    }

    #[test]
    fn a_member_beyond_its_part_of_the_memory_is_rejected() {
        let reason = computed(TEXT, 1 << 40).unwrap_err();
        assert!(reason.contains("bytes of memory"), "{reason}");
    }
}
