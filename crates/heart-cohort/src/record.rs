//! The record of a shard: one row per member, and the checksums of the archive and of the record.

use crate::cohort::{Cohort, Subset};
use crate::compute::Computed;
use crate::draw::Member;
use crate::error::{CohortError, Fault, FileFault};
use crate::field::FieldValue;
use crate::folder::Shard;
use crate::piece::END;
use heart_phantom::Numbers;
use heart_phantom::files::{self, PROGRAM};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, BufReader, Read, Seek};
use std::path::Path;

/// The row of a member in the record of its shard.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Row {
    /// Name in the shard, eight digits.
    pub key: String,
    /// Index in the cohort, from 0.
    pub member: u64,
    /// Name of its case; empty if the cohort has no cases.
    pub case: String,
    /// Subset; `None` if the cohort is not split.
    pub split: Option<Subset>,
    /// Number of draws until the constraints were met.
    pub attempts: u32,
    /// Reason of the rejection; `None` for a member in the shard.
    pub rejected: Option<String>,
    /// Offset of the member in the archive in bytes.
    pub offset: u64,
    /// Its length in bytes; 0 for a rejected member.
    pub bytes: u64,
    /// Its BLAKE3 checksum in hexadecimal, as `b3sum` prints it; empty for a rejected member.
    pub blake3: String,
    /// Drawn values by the dotted paths of the fields.
    pub values: BTreeMap<String, FieldValue>,
    /// The fields of [`Numbers`] by name: `edv`, `esv`, `stroke_volume`, `ejection_fraction`, `gain`, `cardiac_output`,
    /// `av_plane_displacement`, `av_plane_fraction`, `longitudinal_shortening`, `wall_volume`, `diastolic_thickness.side`,
    /// `diastolic_thickness.apex`, `systolic_thickness.side`, `systolic_thickness.apex`; empty for a rejected member.
    pub numbers: BTreeMap<String, f64>,
    /// Warnings of the phantom.
    pub warnings: Vec<String>,
}

impl Row {
    /// The row of a member that begins at `offset`.
    pub(crate) fn new(member: &Member, made: Result<&Computed, &String>, offset: u64) -> Self {
        let made_of = |of: fn(&Computed) -> String| made.map_or(String::new(), of);
        Self {
            key: member.key.clone(),
            member: member.index,
            case: member.case.clone(),
            split: member.split,
            attempts: member.attempts,
            rejected: made.err().cloned(),
            offset,
            bytes: made.map_or(0, |made| made.bytes.len() as u64),
            blake3: made_of(|made| made.blake3.clone()),
            values: member.values.clone(),
            numbers: made.map_or_else(|_| BTreeMap::new(), |made| numbers_of(&made.numbers)),
            warnings: made.map_or(Vec::new(), |made| made.warnings.clone()),
        }
    }

    fn is_of(&self, member: &Member) -> bool {
        self.case == member.case
            && self.split == member.split
            && self.attempts == member.attempts
            && self.values == member.values
    }
}

/// The JSON file of a shard.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Record {
    /// The program and its version.
    pub(crate) program: String,
    /// Digest of the cohort.
    pub(crate) cohort: String,
    /// Members of the cohort.
    pub(crate) members: u64,
    pub(crate) shard: Shard,
    /// Length of the archive.
    pub(crate) bytes: u64,
    pub(crate) rows: Vec<Row>,
}

/// The last field of a record is the checksum of the preceding text, in hexadecimal digits between these two.
const SEAL: [&str; 2] = [",\n  \"blake3\": \"", "\"\n}\n"];
/// Length of the end, including 64 digits.
const SEAL_BYTES: usize = SEAL[0].len() + 64 + SEAL[1].len();
/// The text that the checksum replaces.
const UNSEALED: &str = "\n}";

impl Record {
    pub(crate) fn new(cohort: &Cohort, shard: Shard, bytes: u64, rows: Vec<Row>) -> Self {
        Self {
            program: PROGRAM.to_owned(),
            cohort: cohort.digest().to_owned(),
            members: cohort.members(),
            shard,
            bytes,
            rows,
        }
    }

    /// Writes the record with its checksum.
    pub(crate) fn write(&self, path: &Path) -> Result<(), CohortError> {
        files::write_atomically(path, |out| {
            let mut text = serde_json::to_vec_pretty(self)?;
            text.truncate(text.len() - UNSEALED.len());
            let seal = seal(blake3::hash(&text));
            out.write_all(&text)?;
            out.write_all(seal.as_bytes())
        })?;
        Ok(())
    }

    /// Reads the record of a shard. Verifies its checksum and that it lists the members of the shard, each once and in order;
    /// compares neither the archive nor the drawn values.
    pub(crate) fn read(folder: &Path, shard: Shard) -> Result<Self, Fault> {
        let mut file = BufReader::new(regular(&folder.join(shard.record_name()))?);
        let unread = |error: io::Error| unreadable(&error);
        let length = file.get_ref().metadata().map_err(unread)?.len();
        let body = length
            .checked_sub(SEAL_BYTES as u64)
            .ok_or(Fault::Checksum)?;
        let sum = checksum(&mut (&mut file).take(body)).map_err(unread)?;
        let mut end = String::new();
        file.read_to_string(&mut end).map_err(|_| Fault::Checksum)?;
        if end != seal(sum) {
            return Err(Fault::Checksum);
        }
        file.rewind().map_err(unread)?;
        let text = file.take(body).chain(UNSEALED.as_bytes());
        let record: Self = serde_json::from_reader(text).map_err(|_| Fault::Members)?;
        match record.has_all_of(shard) {
            true => Ok(record),
            false => Err(Fault::Members),
        }
    }

    fn has_all_of(&self, shard: Shard) -> bool {
        let Some(members) = shard.range(self.members).filter(|_| self.shard == shard) else {
            return false;
        };
        let mut end = 0;
        let are_adjacent = self.rows.iter().all(|row| {
            let is_there = row.rejected.is_none();
            let is_next = row.offset == end && row.key == Member::key_of(row.member);
            end = end.saturating_add(row.bytes);
            is_next && is_there == (row.bytes > 0) && is_there != row.blake3.is_empty()
        });
        are_adjacent
            && members.eq(self.rows.iter().map(|row| row.member))
            && end.saturating_add(END.len() as u64) == self.bytes
    }

    /// Returns the number of rejected members.
    pub(crate) fn rejected(&self) -> u64 {
        let rejected = self.rows.iter().filter(|row| row.rejected.is_some());
        rejected.count() as u64
    }

    /// Returns the number of members with warnings.
    pub(crate) fn warned(&self) -> u64 {
        let warned = self.rows.iter().filter(|row| !row.warnings.is_empty());
        warned.count() as u64
    }

    /// Returns whether it belongs to this cohort and this version of the program.
    pub(crate) fn is_of(&self, cohort: &Cohort) -> bool {
        self.cohort == cohort.digest() && self.program == PROGRAM
    }

    /// Compares case, number of draws and values of all rows with the draws of the members.
    pub(crate) fn check_draws(&self, cohort: &Cohort) -> Result<(), Fault> {
        let differs = |row: &&Row| {
            !cohort
                .member(row.member)
                .is_ok_and(|member| row.is_of(&member))
        };
        match self.rows.iter().find(differs) {
            None => Ok(()),
            Some(row) => Err(Fault::Drawn { member: row.member }),
        }
    }

    /// Compares the length of the archive with that of the record.
    pub(crate) fn check_length(&self, folder: &Path) -> Result<File, Fault> {
        let file = regular(&folder.join(self.shard.file_name()))?;
        match file.metadata() {
            Ok(found) if found.len() == self.bytes => Ok(file),
            Ok(_) => Err(Fault::Archive { member: None }),
            Err(error) => Err(unreadable(&error)),
        }
    }

    /// Compares the archive with the checksums of the record, byte by byte.
    pub(crate) fn check_archive(&self, folder: &Path) -> Result<(), Fault> {
        let unread = |error: io::Error| unreadable(&error);
        let mut file = BufReader::with_capacity(1 << 20, self.check_length(folder)?);
        for row in self.rows.iter().filter(|row| row.rejected.is_none()) {
            let sum = checksum(&mut (&mut file).take(row.bytes)).map_err(unread)?;
            if sum.to_string() != row.blake3 {
                let member = Some(row.member);
                return Err(Fault::Archive { member });
            }
        }
        let mut end = Vec::new();
        file.read_to_end(&mut end).map_err(unread)?;
        match end == END {
            true => Ok(()),
            false => Err(Fault::Archive { member: None }),
        }
    }

    /// Compares the shard with the cohort and the archive.
    pub(crate) fn check(&self, cohort: &Cohort, folder: &Path) -> Result<(), FileFault> {
        let in_record = |fault| FileFault::new(self.shard.record_name(), fault);
        if !self.is_of(cohort) {
            return Err(in_record(Fault::OtherCohort));
        }
        self.check_draws(cohort).map_err(in_record)?;
        (self.check_archive(folder)).map_err(|fault| FileFault::new(self.shard.file_name(), fault))
    }
}

fn seal(sum: blake3::Hash) -> String {
    format!("{}{sum}{}", SEAL[0], SEAL[1])
}

/// Opens a regular file; opening a pipe would block.
pub(crate) fn regular(path: &Path) -> Result<File, Fault> {
    let found = fs::metadata(path).and_then(|found| match found.is_file() {
        true => File::open(path).map(Some),
        false => Ok(None),
    });
    match found {
        Ok(file) => file.ok_or(Fault::NotAFile),
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            Err(Fault::Missing { following: 0 })
        }
        Err(error) => Err(unreadable(&error)),
    }
}

pub(crate) fn unreadable(error: &io::Error) -> Fault {
    Fault::Unreadable {
        reason: error.to_string(),
    }
}

pub(crate) fn checksum(from: &mut impl Read) -> io::Result<blake3::Hash> {
    let mut sum = blake3::Hasher::new();
    sum.update_reader(from)?;
    Ok(sum.finalize())
}

/// The numbers of a heart by name; nested ones as `outer.name`.
fn numbers_of(numbers: &Numbers) -> BTreeMap<String, f64> {
    let mut flat = BTreeMap::new();
    let mut add =
        |name: String, value: &Value| value.as_f64().map(|number| flat.insert(name, number));
    if let Ok(Value::Object(table)) = serde_json::to_value(numbers) {
        for (name, value) in &table {
            match value {
                Value::Object(inner) => {
                    for (within, value) in inner {
                        add(format!("{name}.{within}"), value);
                    }
                }
                value => drop(add(name.clone(), value)),
            }
        }
    }
    flat
}
