//! Depth-dependent resolution.

use crate::Row;

pub(crate) const ROWS: &[Row] = &[];
