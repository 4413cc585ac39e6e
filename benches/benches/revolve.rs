//! Benches of the revolve group.
fn main() {}
