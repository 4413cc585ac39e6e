//! Reconstruction and projectors.

use crate::Row;

pub(crate) const ROWS: &[Row] = &[];
