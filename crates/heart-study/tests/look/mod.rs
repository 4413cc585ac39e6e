//! Images and page of a run.

mod beat;
mod planes;
