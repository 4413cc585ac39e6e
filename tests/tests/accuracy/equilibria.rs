//! Equilibria of membranes.

use crate::Row;

pub(crate) const ROWS: &[Row] = &[];
