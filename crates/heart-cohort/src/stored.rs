//! Reads the members of a shard, in order or one of them.

use crate::error::{CohortError, Fault, FileFault};
use crate::folder::Shard;
use crate::record::{Record, Row, checksum, regular, unreadable};
use flate2::read::GzDecoder;
use heart_phantom::PhantomError;
use heart_phantom::files::{NpyArray, get_npy};
use serde::de::DeserializeOwned;
use std::collections::BTreeMap;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

/// A member of a shard: its row and its files.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct StoredMember {
    /// The row of the record: drawn values, volumes, warnings.
    pub row: Row,
    /// The decompressed files by their names without key and compression: `cls`, `geometry.json`, `projections.npy`, ...
    pub files: BTreeMap<String, Vec<u8>>,
}

impl StoredMember {
    /// Parses a JSON file: `scene.json` as a [`Scene`](heart_phantom::Scene), others for instance as `serde_json::Value`.
    ///
    /// | key of `geometry.json` | value |
    /// | --- | --- |
    /// | `shape_zyx`, `voxel_mm` | numbers of voxels `[nz, ny, nx]`; edges of a voxel along x, y, z in mm |
    /// | `affine` | 4 x 4, from voxel indices (x, y, z, 1) to the centre in mm: right, anterior, superior, as in NIfTI |
    /// | `label_names` | names of the labels, from 0 |
    /// | `phases` | of each map of labels and attenuation: `of`, `phase` (fraction of the cycle), `seconds`, `breath` (respiratory position) |
    /// | `cycle_seconds` | length of the cardiac cycle |
    /// | `gates` | of each gate, lists over its projections: `angle_degrees`, `start_seconds`, `window_seconds` |
    /// | `radius_mm`, `bin_mm`, `row_mm` | distance of the collimator face of each projection, if there is an orbit; pitch of bins and rows |
    /// | `projection_values` | `normalised` or `counts`: `output.values` of the scene |
    /// | `counts_per_unit` | `[gate][view]`, counts per unit of a normalised sample; null without projections or without counts |
    /// | `edv_ml`, `esv_ml`, `ejection_fraction` | volumes and ejection fraction |
    ///
    /// # Errors
    /// [`PhantomError::Read`], whose source lists the files of the member, if there is no such file; if it does not have this type.
    pub fn json<T: DeserializeOwned>(&self, name: &str) -> Result<T, CohortError> {
        self.parse(name, |bytes| Ok(serde_json::from_slice(bytes)?))
    }

    /// Reads an array: projections `[gate][view][row][bin]`, ground truth and reconstruction `[gate][z][y][x]`, labels and attenuation
    /// `[phase][z][y][x]`. Half precision is returned as `f32`.
    ///
    /// Projections are activity concentration times length in cm (MBq/mL cm with `[counting]`, else relative to the activity of the
    /// scene). With `noise.counts` they are counts divided by `counts_per_unit` of `geometry.json`, not integers, unless the scene has
    /// `output.values = "counts"`. Ground truth and reconstruction are activity concentrations, attenuation is in 1/cm, labels are
    /// indices of `label_names`.
    ///
    /// # Errors
    /// [`PhantomError::Read`], whose source lists the files of the member, if there is no such file; if it is not an array.
    pub fn array(&self, name: &str) -> Result<NpyArray, CohortError> {
        self.parse(name, |bytes| get_npy(bytes))
    }

    fn parse<T>(
        &self,
        name: &str,
        of: impl FnOnce(&[u8]) -> io::Result<T>,
    ) -> Result<T, CohortError> {
        let bytes = self.files.get(name).ok_or_else(|| {
            let names: Vec<&str> = self.files.keys().map(String::as_str).collect();
            let what = format!("the member has the files {}", names.join(", "));
            io::Error::new(io::ErrorKind::NotFound, what)
        });
        let path = format!("{}.{name}", self.row.key).into();
        Ok(bytes
            .and_then(|bytes| of(bytes))
            .map_err(|source| PhantomError::Read { path, source })?)
    }

    fn new(row: Row, piece: &[u8]) -> io::Result<Self> {
        let mut files = BTreeMap::new();
        for entry in tar::Archive::new(piece).entries()? {
            let mut entry = entry?;
            let path = entry.path()?.to_string_lossy().into_owned();
            let name = path.split_once('.').map_or("", |(_, name)| name);
            let mut bytes = Vec::new();
            let name = match name.strip_suffix(".gz") {
                Some(name) => GzDecoder::new(entry)
                    .read_to_end(&mut bytes)
                    .map(|_| name)?,
                None => entry.read_to_end(&mut bytes).map(|_| name)?,
            };
            files.insert(name.to_owned(), bytes);
        }
        Ok(Self { row, files })
    }
}

/// Reads the members of a shard in order, without rejected ones. Each member is compared with its checksum. One member is in memory.
///
/// ```
/// use heart_cohort::{Cohort, RunOptions, Shard, heart_phantom::no_observer, read_shard, run_shard};
/// let cohort = Cohort::from_toml(r#"
/// members = 2
/// [scene]
/// heart.discretisation = { differences = { nodes = 51 } }
/// camera = { views = 4, bins = 8, rows = 8, pitch = [2.0, 2.0] }
/// output.write = ["projections"]
/// [vary]
/// cycle.volume.gain = { uniform = [0.3, 0.6] }
/// "#)?;
/// let (folder, shard) = (tempfile::tempdir()?, Shard { shard: 1, of: 1 });
/// let report = run_shard(&cohort, folder.path(), shard, &RunOptions::new(1), &no_observer)?;
/// assert_eq!(report.rejected, 0);
/// for member in read_shard(folder.path(), shard)? {
///     let member = member?;
///     let views = member.array("projections.npy")?;
///     assert_eq!(views.shape, [1, 4, 8, 8]); // [gate][view][row][bin]
///     let ejection_fraction = member.row.numbers["ejection_fraction"];
///     assert!(ejection_fraction > 0.2 && views.samples.iter().any(|x| *x > 0.0));
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`CohortError::Faults`] for a record that is missing or does not match its checksum, for an archive of another length, and, by the
/// iterator, for a member that does not match its checksum.
pub fn read_shard(
    folder: &Path,
    shard: Shard,
) -> Result<impl Iterator<Item = Result<StoredMember, CohortError>>, CohortError> {
    let rows = read_rows(folder, shard)?.into_iter();
    Ok(rows
        .filter(|row| row.rejected.is_none())
        .map(move |row| read_member(folder, shard, &row)))
}

/// Reads the rows of all members of a shard, with rejected ones, for [`read_member`]. No array is read.
///
/// # Errors
/// [`CohortError::Faults`] for a record that is missing or does not match its checksum, and for an archive of another length.
pub fn read_rows(folder: &Path, shard: Shard) -> Result<Vec<Row>, CohortError> {
    let in_file = |file, fault| CohortError::fault(folder, FileFault::new(file, fault));
    let record =
        Record::read(folder, shard).map_err(|fault| in_file(shard.record_name(), fault))?;
    (record.check_length(folder)).map_err(|fault| in_file(shard.file_name(), fault))?;
    Ok(record.rows)
}

/// Reads one member of a shard at the position of its row, in any order, and compares it with its checksum. Threads may read
/// different members at the same time; no other member is read.
///
/// ```
/// use heart_cohort::{Cohort, RunOptions, Shard, heart_phantom::no_observer, read_member, read_rows, run_shard};
/// let cohort = Cohort::from_toml(r#"
/// members = 5
/// [scene]
/// heart.discretisation = { differences = { nodes = 51 } }
/// camera = { views = 4, bins = 8, rows = 8, pitch = [2.0, 2.0] }
/// output.write = ["projections"]
/// [vary]
/// cycle.volume.gain = { uniform = [0.3, 0.6] }
/// "#)?;
/// let folder = tempfile::tempdir()?;
/// let mut rows = Vec::new();
/// for shard in [1, 2].map(|shard| Shard { shard, of: 2 }) {
///     let report = run_shard(&cohort, folder.path(), shard, &RunOptions::new(1), &no_observer)?;
///     assert_eq!(report.rejected, 0);
///     rows.extend(read_rows(folder.path(), shard)?.into_iter().map(|row| (shard, row)));
/// }
/// for epoch in 0..2u64 {
///     rows.sort_by_key(|(_, row)| (row.member + 3 * epoch) * 7 % 5); // or any other shuffle
///     for (shard, row) in &rows {
///         let member = read_member(folder.path(), *shard, row)?;
///         assert_eq!(member.array("projections.npy")?.shape, [1, 4, 8, 8]);
///     }
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`CohortError::NoScene`] for the row of a rejected member; [`CohortError::Faults`] for a missing archive and for a member that does not
/// match its checksum.
pub fn read_member(folder: &Path, shard: Shard, row: &Row) -> Result<StoredMember, CohortError> {
    let in_archive = |fault| CohortError::fault(folder, FileFault::new(shard.file_name(), fault));
    let unread = |error: io::Error| in_archive(unreadable(&error));
    if let Some(reason) = &row.rejected {
        return Err(CohortError::NoScene {
            member: row.member,
            what: reason.clone(),
        });
    }
    let mut file = regular(&folder.join(shard.file_name())).map_err(in_archive)?;
    file.seek(SeekFrom::Start(row.offset)).map_err(unread)?;
    let mut piece = Vec::new();
    (file.take(row.bytes).read_to_end(&mut piece)).map_err(unread)?;
    if checksum(&mut &piece[..]).map_err(unread)?.to_string() != row.blake3 {
        let member = Some(row.member);
        return Err(in_archive(Fault::Archive { member }));
    }
    StoredMember::new(row.clone(), &piece).map_err(unread)
}
