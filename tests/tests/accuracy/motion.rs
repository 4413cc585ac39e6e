//! Membranes in motion.

use crate::Row;

pub(crate) const ROWS: &[Row] = &[];
