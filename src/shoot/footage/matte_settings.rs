//! Settings for making mattes.

use std::path::PathBuf;

/// Settings for making mattes.
#[derive(Clone, Debug, Default, PartialEq, clap::Args)]
pub struct MatteSettings {
    /// Remake all mattes in PROJECT/mattes.
    #[arg(long)]
    pub replace: bool,
    /// Box around the person in every frame, in pixels of the pictures, with some background outside; for an
    /// interview without a screen.
    #[arg(long = "box", value_name = "LEFT,TOP,WIDTH,HEIGHT", value_parser = parse_box)]
    pub within: Option<[usize; 4]>,
    /// Clean plate: a picture of the same view without the person, or a movie whose first frame is one; for an
    /// interview without a screen. Its exposure may differ.
    #[arg(long, value_name = "FILE", conflicts_with = "within")]
    pub clean_plate: Option<PathBuf>,
    /// Skip averaging mattes over neighbouring frames.
    #[arg(long)]
    pub no_steady: bool,
}

fn parse_box(text: &str) -> std::result::Result<[usize; 4], String> {
    let numbers: std::result::Result<Vec<usize>, _> = text.split(',').map(|n| n.trim().parse()).collect();
    let four = numbers.ok().and_then(|numbers| numbers.try_into().ok());
    four.ok_or_else(|| format!("expected LEFT,TOP,WIDTH,HEIGHT in whole pixels, found {text:?}"))
}
