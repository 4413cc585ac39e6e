//! Cohorts of beating hearts, for training networks.
//!
#![doc = include_str!("../README.md")]
//!
//! [`Cohort`] is the text, checked; [`Cohort::member`] what was drawn for a member; [`run_shard`] computes some members in a row and writes
//! them as one archive; [`merge`] makes one manifest of all shards; [`verify`] computes some members again and compares bytes;
//! [`survey`] tells ranges, bytes and time before; [`sbatch`] is a script for Slurm.
//!
//! # Which bytes are the same
//! Those of a member depend on the meaning of the text, its index and the version of the program: not on the cut into shards, on threads, on
//! memory, or on who computes it, on processors of one kind. Between kinds of processors (other instruction sets, another mathematical
//! library of the system) samples may differ by rounding; what was drawn does not.

mod checks;
mod cohort;
mod compute;
mod correlation;
mod cut;
mod distribution;
mod draw;
mod error;
mod export;
mod expression;
mod fault;
mod field;
mod folder;
mod geometry;
mod half;
mod manifest;
mod piece;
mod quantile;
mod read;
mod record;
mod shard;
mod slurm;
mod sobol;
mod split;
mod survey;
mod value;
mod verify;
mod workers;

pub use heart_phantom;

pub use cohort::{Cohort, Compression, Precision, Sampling};
pub use cut::Shard;
pub use distribution::Distribution;
pub use draw::Member;
pub use error::{CohortError, TextError};
pub use export::export;
pub use fault::{Fault, FileFault};
pub use manifest::{ManifestReport, merge};
pub use record::Row;
pub use shard::{RunOptions, ShardReport, run_shard};
pub use slurm::{SlurmOptions, sbatch};
pub use split::Subset;
pub use survey::{FieldRange, Survey, survey};
pub use value::FieldValue;
pub use verify::{VerifyReport, verify};
