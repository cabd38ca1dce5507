//! Cost of accuracy in time, measured on the user's own footage and machine.
//!
//! A *rung* is one combination of settings: a network's shape, its training time, and the storage and lighting of its
//! predictions. Rungs vary one knob at a time, then combine those that pay off. Each is measured: time per frame,
//! memory and disk space, and distance from the truth or from a held-out pose.

mod apply;
mod csv;
mod front;
mod judge;
mod ladder;
mod ledger;
mod measure;
mod network_folders;
mod pace;
mod report;
mod run;
#[cfg(test)]
mod tests;
mod together;

pub use apply::{Applied, apply};
pub use base::machine::Machine;
pub use csv::csv;
pub use front::{Pick, front, pick};
pub use judge::Against;
pub use ladder::{Knob, Network, Rung, Show, TradeoffSettings};
pub use ledger::{Base, Failure, Ledger, folder};
pub use measure::{Cost, Measured, Spread};
pub use report::TradeoffReport;
pub use run::tradeoff;
