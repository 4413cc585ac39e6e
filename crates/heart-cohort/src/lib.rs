//! Cohorts of beating hearts, for training networks.
//!
#![doc = include_str!("../README.md")]
//!
//! [`Cohort`] is the validated text. [`Cohort::member`] draws a member. [`run_shard`] computes consecutive members and writes them
//! as one archive. [`merge`] writes one manifest of all shards. [`verify`] recomputes some members and compares bytes. [`survey`]
//! estimates ranges, size and time. [`sbatch`] returns a script for Slurm.
//!
//! # Reproducibility
//! The bytes of a member are a function of the parsed text, its index and the version of the program on processors of one kind.
//! They do not depend on the number of shards, threads, memory or the machine. Between kinds of processors (other instruction sets,
//! another mathematical library of the system) samples may differ by rounding; drawn values do not.

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
