//! Benches of the radon group.
fn main() {}
