//! Benches of the motion group.
fn main() {}
