//! Everything about this crate, in one program: what is generic is compiled once.

mod bad_inputs;
mod half;
mod oracle;
