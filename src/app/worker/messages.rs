//! Messages between the network's thread and the relighter.

use super::PredictedFrame;
use super::comparison::ComparisonSource;
use super::mailbox::Request;
use super::preview::PreviewRequest;
use light::Rig;
use std::sync::Arc;

/// Request to the network's thread.
pub(super) enum NetworkRequest {
    /// To open its source again: there may be a newer network, or another device.
    Open,
    Predict(FrameRequest),
    /// OLATs for the first (0) or the second (1) of two pictures to compare.
    Compare(usize, ComparisonRequest),
}

/// A frame to be predicted by the network of a generation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct FrameRequest {
    pub generation: u64,
    pub frame: usize,
}

/// OLATs to compare a frame of a generation with.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ComparisonRequest {
    pub generation: u64,
    pub source: ComparisonSource,
    pub frame: usize,
}

/// News for the relighter, and requests to it.
pub(super) enum RelighterRequest {
    Opened(OpenedSource),
    Predicted(Arc<PredictedFrame>),
    /// OLATs for the first (0) or the second (1) of two pictures to compare.
    Compared(usize, FoundComparison),
    Show(Box<PreviewRequest>),
    /// To make the picture that all of this calls for; `rested` says that nothing else was asked for a while.
    Relight {
        rested: bool,
    },
}

/// A source that was opened. The generation counts openings: each may have another network.
#[derive(Clone)]
pub(super) struct OpenedSource {
    pub generation: u64,
    pub rig: Arc<Rig>,
}

/// The OLATs that were found.
#[derive(Clone)]
pub(super) struct FoundComparison {
    pub of: ComparisonRequest,
    pub found: Arc<PredictedFrame>,
}

impl Request for NetworkRequest {
    fn lane(&self) -> Option<usize> {
        Some(match self {
            Self::Open => 0,
            Self::Predict(_) => 1,
            Self::Compare(side, _) => 2 + side,
        })
    }
}

impl Request for RelighterRequest {
    /// An opening comes before what was predicted after it, and a picture when there is nothing else to learn.
    fn lane(&self) -> Option<usize> {
        Some(match self {
            Self::Opened(_) => 0,
            Self::Predicted(_) => 1,
            Self::Compared(side, _) => 2 + side,
            Self::Show(_) => 4,
            Self::Relight { .. } => 5,
        })
    }
}
