//! Benches of the membrane group.
fn main() {}
