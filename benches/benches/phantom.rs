//! Benches of the phantom group.
fn main() {}
