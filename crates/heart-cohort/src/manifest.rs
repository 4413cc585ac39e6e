//! The manifest of all members from the records of their shards.

use crate::cohort::Subset;
use crate::error::{CohortError, Fault, FileFault};
use crate::field::FieldValue;
use crate::folder::{Listing, check_own};
use crate::record::{Record, Row};
use crate::shard::remove_left;
use heart_phantom::files;
use std::collections::BTreeSet;
use std::io;
use std::path::{Path, PathBuf};

/// The content of a manifest.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct ManifestReport {
    /// The manifest.
    pub path: PathBuf,
    /// Number of members, including rejected ones.
    pub members: u64,
    /// Number of rejected members.
    pub rejected: u64,
    /// Number of members with warnings.
    pub warned: u64,
    /// Number of shards.
    pub shards: u64,
    /// Length of all archives in bytes.
    pub bytes: u64,
}

/// Columns of every manifest. Columns of fields and of numbers follow, each in the order of their names.
const FIRST: [&str; 12] = [
    "key", "member", "shard", "offset", "bytes", "blake3", "status", "reason", "case", "split",
    "attempts", "warnings",
];

/// Writes `manifest.csv` from the records of a directory that contains all shards of a cohort. It does not read the archives, only
/// their lengths: [`verify`](crate::verify()) finds damaged members. One row per member, in order: `key`,
/// `shard` with `offset` and `bytes` of the member in it, `status` (`ok` or `rejected`) with its `reason`, drawn fields by their
/// paths, volumes and ejection fraction. An apostrophe precedes a text that begins with one of `= + - @`, which a spreadsheet would
/// evaluate. Temporary files of killed processes are removed. One record at a time is in memory.
///
/// # Errors
/// [`heart_phantom::PhantomError::Foreign`] for a `manifest.csv` of another program; [`CohortError::NoShards`]; [`CohortError::Faults`] for missing shards, names of another number of shards, records that do not match
/// their checksum, archives of another length (their bytes are not read) and shards of several cohorts; errors of writing.
pub fn merge(folder: &Path) -> Result<ManifestReport, CohortError> {
    let path = folder.join("manifest.csv");
    let columns = FIRST.join(",");
    check_own(&path, columns.len() as u64, |start| {
        start == columns.as_bytes()
    })?;
    let listing = Listing::of(folder)?;
    let (mut drawn, mut numbers) = (BTreeSet::new(), BTreeSet::new());
    let mut report = ManifestReport {
        path,
        members: 0,
        rejected: 0,
        warned: 0,
        shards: listing.of,
        bytes: 0,
    };
    let mut faults = Vec::new();
    let mut first = None;
    for shard in listing.shards() {
        let in_record = |fault| FileFault::new(shard.record_name(), fault);
        let checked = Record::read(folder, shard).map_err(in_record);
        let checked = checked.and_then(|record| {
            let of = (record.cohort.clone(), record.program.clone());
            if *first.get_or_insert_with(|| of.clone()) != of {
                return Err(in_record(Fault::OtherCohort));
            }
            (record.check_length(folder).map(|_| record))
                .map_err(|fault| FileFault::new(shard.file_name(), fault))
        });
        match checked {
            Ok(record) => {
                report.bytes += record.bytes;
                report.members += record.rows.len() as u64;
                report.rejected += record.rejected();
                report.warned += record.warned();
                for row in record.rows {
                    drawn.extend(row.values.into_keys());
                    numbers.extend(row.numbers.into_keys());
                }
            }
            Err(fault) => faults.push(fault),
        }
    }
    faults.splice(0..0, listing.faults.iter().cloned());
    if !faults.is_empty() {
        let folder = folder.to_path_buf();
        return Err(CohortError::Faults { folder, faults });
    }
    files::write_atomically(&report.path, |out| {
        let mut csv = csv::Writer::from_writer(out);
        let names = FIRST.into_iter().map(str::to_owned);
        csv.write_record(names.chain(drawn.iter().chain(&numbers).cloned()))?;
        for shard in listing.shards() {
            let record = Record::read(folder, shard).map_err(io::Error::other)?;
            for row in &record.rows {
                let drawn = drawn.iter().map(|name| row.values.get(name).map(cell));
                let numbers = numbers.iter().map(|name| row.numbers.get(name).map(number));
                let others = drawn.chain(numbers).map(Option::unwrap_or_default);
                csv.write_record(
                    first_cells(row, shard.file_name())
                        .into_iter()
                        .chain(others),
                )?;
            }
        }
        csv.flush()
    })?;
    remove_left(folder, "shard-");
    Ok(report)
}

/// The cells of [`FIRST`].
fn first_cells(row: &Row, archive: String) -> [String; FIRST.len()] {
    let is_there = row.rejected.is_none();
    let offset = is_there.then(|| row.offset.to_string());
    [
        row.key.clone(),
        row.member.to_string(),
        archive,
        offset.unwrap_or_default(),
        row.bytes.to_string(),
        row.blake3.clone(),
        (if is_there { "ok" } else { "rejected" }).to_owned(),
        text(row.rejected.as_deref().unwrap_or_default()),
        text(&row.case),
        row.split.map_or("", Subset::name).to_owned(),
        row.attempts.to_string(),
        text(&row.warnings.join("; ")),
    ]
}

fn cell(value: &FieldValue) -> String {
    match value {
        FieldValue::Number(value) => number(value),
        FieldValue::Text(value) => text(value),
        FieldValue::Truth(_)
        | FieldValue::Whole(_)
        | FieldValue::List(_)
        | FieldValue::Table(_) => value.to_string(),
    }
}

/// The shortest text that parses to the same number.
fn number(number: &f64) -> String {
    format!("{number:?}")
}

/// A text that no spreadsheet evaluates as a formula.
fn text(text: &str) -> String {
    match text.starts_with(['=', '+', '-', '@', '\t', '\r']) {
        true => format!("'{text}"),
        false => text.to_owned(),
    }
}
