//! Cohorts of beating hearts for machine learning.
//!
#![doc = include_str!("../README.md")]
//!
//! [`Cohort`] is a validated cohort description (TOML). [`Cohort::member`] draws a member. [`run_shard`] computes consecutive members
//! and writes them as one archive, which [`read_shard`] reads, and [`read_member`] in any order. [`merge`] writes one manifest of all shards.
//! [`verify`] checks all checksums and recomputes some members. [`survey`] estimates ranges, size and time.
//!
//! # Reproducibility
//! On one platform the bytes of a member depend only on the cohort description, the index of the member and the version of the
//! program. They do not depend on the number of shards or threads, the memory or the machine. Between platforms (instruction sets,
//! mathematical library of the system) samples may differ by rounding errors; drawn values do not differ.

mod checks;
mod cohort;
mod compute;
mod correlation;
mod distribution;
mod draw;
mod error;
mod export;
mod expression;
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
mod sobol;
mod stored;
mod survey;
mod verify;
mod workers;

pub use heart_phantom;

pub use cohort::{Cohort, Subset};
pub use compute::RunOptions;
pub use draw::Member;
pub use error::{CohortError, Fault, FileFault};
pub use export::export;
pub use field::FieldValue;
pub use folder::{Shard, list_shards};
pub use manifest::{ManifestReport, merge};
pub use record::Row;
pub use shard::{ShardReport, run_shard};
pub use stored::{StoredMember, read_member, read_rows, read_shard};
pub use survey::{FieldRange, Survey, survey};
pub use verify::{VerifyReport, verify};
