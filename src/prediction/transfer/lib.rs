//! Reflectance transfer: OLATs of a frame, carried over from the exemplars without training. `docs/method.md` has the formulas
//! and their sources.

mod beside;
mod blend;
mod blur;
mod contrast;
mod detail;
pub mod flow;
mod half_rows;
mod lamps;
mod matching;
mod places;
mod pose;
mod pose_turns;
mod predictor;
mod said;
mod shape;
mod target;
mod transfer;
mod turn;

pub use beside::Alone;
pub use blend::Carried;
pub use detail::{ExemplarDetail, FineField, SharedDetail};
pub use places::Place;
pub use pose::PlatePose;
pub use predictor::OlatPredictor;
pub use transfer::Transfer;
