//! Projections: bin averages, time averages, depth response, truncation.

use crate::Row;

pub(crate) const ROWS: &[Row] = &[];
