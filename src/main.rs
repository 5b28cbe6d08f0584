//! The command line of Starlings.
fn main() {}
