//! One manifest of all members, from the records of their shards.

use crate::error::CohortError;
use crate::folder;
use crate::shard::remove_left;
use crate::table::{Cell, Columns, ForEach};
use heart_phantom::files;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// What a manifest holds.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct ManifestReport {
    /// Members, those that were refused included.
    pub members: u64,
    /// Members that were refused.
    pub refused: u64,
    /// Shards.
    pub shards: u64,
    /// Length of all archives.
    pub bytes: u64,
    /// The files written.
    pub files: Vec<PathBuf>,
}

/// Makes one manifest of the records of a folder that holds all shards of a cohort: `manifest.csv`. One row a member, in their order: `key`, `shard` with `offset` and `bytes` of the member's piece in it, `status`
/// (`ok` or `refused`) with its `reason`, the fields that were drawn by their paths, volumes and ejection fraction. Whatever killed
/// processes have left half written goes. One record is held in memory at a time.
///
/// # Errors
/// [`CohortError::Cuts`], [`CohortError::Missing`]; [`CohortError::OtherCohort`] if shards are of several cohorts; what writing can
/// return.
pub fn merge(folder: &Path) -> Result<ManifestReport, CohortError> {
    let shards = folder::shards_of(folder)?;
    let mut columns = Columns::default();
    let mut report = ManifestReport {
        members: 0,
        refused: 0,
        shards: shards.len() as u64,
        bytes: 0,
        files: Vec::new(),
    };
    let mut first: Option<(String, String)> = None;
    for &shard in &shards {
        let record = folder::record_of(folder, shard)?;
        columns.add(&record);
        report.members += record.rows.len() as u64;
        report.refused += record
            .rows
            .iter()
            .filter(|row| row.refused.is_some())
            .count() as u64;
        report.bytes += record.bytes;
        let of = (record.cohort, record.program);
        if *first.get_or_insert_with(|| of.clone()) != of {
            let path = folder.join(shard.file_name()).with_extension("json");
            return Err(CohortError::OtherCohort { path });
        }
    }
    let for_each = |take: &mut dyn FnMut(Vec<Cell>) -> io::Result<()>| -> io::Result<()> {
        for &shard in &shards {
            let record = folder::record_of(folder, shard).map_err(io::Error::other)?;
            for row in &record.rows {
                take(columns.cells(row, &shard.file_name()))?;
            }
        }
        Ok(())
    };
    let path = folder.join("manifest.csv");
    files::write_atomically(&path, |out| write_csv(out, &columns, &for_each))?;
    report.files.push(path);
    for &shard in &shards {
        remove_left(folder, shard);
    }
    Ok(report)
}

fn write_csv(out: &mut dyn Write, columns: &Columns, for_each: ForEach<'_>) -> io::Result<()> {
    let mut csv = csv::Writer::from_writer(out);
    csv.write_record(columns.all().map(|(name, _)| name))?;
    for_each(&mut |cells| {
        let cells = cells.into_iter().map(|cell| match cell {
            Cell::Nothing => String::new(),
            Cell::Text(text) => text,
            Cell::Whole(whole) => whole.to_string(),
            // The shortest number that is read back as the same.
            Cell::Number(number) => format!("{number:?}"),
        });
        Ok(csv.write_record(cells)?)
    })?;
    csv.flush()
}
