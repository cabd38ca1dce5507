//! Messages between the network's thread and the relighter.

use super::comparison::ComparisonSource;
use super::mailbox::Request;
use super::prediction::PredictedFrame;
use super::preview::PreviewRequest;
use light::Rig;
use std::sync::Arc;

/// Request to the network's thread.
pub(super) enum NetworkRequest {
    /// Open the source again: there may be a newer network, or another device.
    Open,
    Predict(FrameRequest),
    /// OLATs for the first (0) or second (1) picture of a comparison.
    Compare(usize, ComparisonRequest),
}

/// A frame to predict with the network of a generation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct FrameRequest {
    pub generation: u64,
    pub frame: usize,
}

/// OLATs to compare with a frame of a generation.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ComparisonRequest {
    pub generation: u64,
    pub source: ComparisonSource,
    pub frame: usize,
}

/// Messages and requests for the relighter.
pub(super) enum RelighterRequest {
    Opened(OpenedSource),
    Predicted(Arc<PredictedFrame>),
    /// OLATs for the first (0) or second (1) picture of a comparison.
    Compared(usize, FoundComparison),
    Show(Box<PreviewRequest>),
    /// Make the picture for all of this; `rested` is true after a pause without requests.
    Relight {
        rested: bool,
    },
}

/// A source that was opened. The generation counts openings; each may have another network.
#[derive(Clone)]
pub(super) struct OpenedSource {
    pub generation: u64,
    pub rig: Arc<Rig>,
}

/// OLATs found for a comparison.
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
    /// An opening comes before later predictions; a picture comes when there is no other message.
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
