//! What the tests of all crates share.

pub mod small_disk;
