//! What the worker tells the window: numbers and sentences. Heavy things go through [`super::Latest`].

use crate::progress::Report;

/// One piece of news.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// The calibration and the network are being read.
    Opening,
    /// Frames can be predicted; `device` says where and why there.
    Ready { device: String },
    /// Nothing can be predicted.
    Blocked(Blocked),
    /// A frame or a picture could not be made.
    Failed { sentence: String },
    /// A job began.
    Started { what: &'static str },
    /// A running job reports.
    Report(Report),
    /// A job is over; the sentence says what came of it.
    Finished { sentence: String },
}

/// Why a project cannot be relit.
#[derive(Clone, Debug, PartialEq)]
pub struct Blocked {
    /// Why, and what to do.
    pub sentence: String,
    /// What a job would bring.
    pub need: Option<Need>,
}

/// What a project lacks before it can be relit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Need {
    Calibration,
    Network,
}
