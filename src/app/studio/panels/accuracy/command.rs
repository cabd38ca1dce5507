//! Commands of the accuracy panel.

use tradeoff::TradeoffSettings;

/// Measures the time that accuracy costs, and chooses a rung.
#[derive(Clone, Debug, PartialEq)]
pub enum AccuracyCommand {
    /// Start or resume the measurement.
    Measure(Box<TradeoffSettings>),
    /// Use the network of this rung.
    Apply(String),
    /// Read these pictures of rungs.
    Draw(Vec<String>),
}
