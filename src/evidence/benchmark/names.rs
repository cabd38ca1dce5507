//! Names of the timed work.

/// The network's work.
pub const STEP: &str = "training step";
pub const PREDICTION: &str = "prediction";
/// Work on pictures.
pub const PICTURES: [&str; 3] =
    ["relit frame, network included", "relit frame, predicted before", "turn of the light in the window"];
/// Placeholder for all passes when none was timed.
pub const PASSES: &str = "every pass";
pub const SELF_TEST: &str = "self-test";
/// First use of a network's kernels: the timed work, and the name of its first run.
pub const FIRST: [(&str, &str); 2] = [(STEP, "first training step"), (PREDICTION, "first prediction")];

/// The first run of a process that finds no cached kernels.
pub fn first_ever((_, name): &(&str, &str)) -> String {
    format!("{name} ever")
}

/// The first run of a process that finds another's cached kernels.
pub fn first_again((_, name): &(&str, &str)) -> String {
    format!("{name} again, after a start")
}
