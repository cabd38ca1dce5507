//! Cost of accuracy in time, measured on a person's own footage and machine.
//!
//! A *rung* is one way to go: a network of some shape, trained for some minutes, and how its predictions are kept and
//! lit. The rungs turn one knob at a time, then those that pay together. Each is measured: how long a frame takes, what
//! it needs of memory and disk, and how near it comes to the truth or to a pose that was held out.

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
