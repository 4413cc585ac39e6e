//! Command line of the phantom.
fn main() {}
