//! Commands of the training panel.

/// Trains the network.
#[derive(Clone, Debug, PartialEq)]
pub enum TrainingCommand {
    /// Train with the current settings: from the start, or from the checkpoint.
    Start { fresh: bool },
    /// Restore the saved checkpoint of this name.
    GoBack(String),
    /// Read the list of checkpoints.
    ListCheckpoints,
}
