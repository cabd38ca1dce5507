//! The visible side of two compared pictures, its name and its codes.

use super::toolbar;
use crate::comparison::CompareMode;
use crate::panel_context::PanelContext;
use egui::Ui;
use worker::PreviewPicture;

/// One of the two pictures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Side {
    #[default]
    First,
    Second,
}

/// The visible part of the two pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seen {
    /// The picture without a comparison.
    Alone,
    /// One of the two.
    One(Side),
    Both,
    /// Their difference, in place of the first.
    Difference,
}

/// True while Shift is held to see the other picture.
pub fn peeks(ui: &Ui) -> bool {
    ui.input(|i| i.modifiers.shift_only() && !i.pointer.any_down())
}

impl Seen {
    /// The visible part of the newest picture now.
    pub fn now(ui: &Ui, context: &PanelContext, relit: &PreviewPicture) -> Self {
        let compare = &context.state.compare;
        if !compare.on || context.state.four.on || relit.second.is_none() {
            // Even so, another picture may replace the relit one.
            return match relit.first {
                Some(_) => Self::One(Side::First),
                None => Self::Alone,
            };
        }
        match compare.mode {
            CompareMode::Side => Self::Both,
            _ if peeks(ui) => Self::One(Side::Second),
            CompareMode::Wipe => Self::Both,
            CompareMode::Toggle if compare.second => Self::One(Side::Second),
            CompareMode::Toggle => Self::One(Side::First),
            CompareMode::Difference => Self::Difference,
        }
    }
}

impl Side {
    /// Name of the picture on this side.
    pub fn name(self, context: &PanelContext, relit: &PreviewPicture) -> String {
        let compare = &context.state.compare;
        match (self, &compare.first, &relit.first) {
            (Self::First, Some(with), Some(_)) => toolbar::name(with, context),
            (Self::First, ..) => "relit".to_owned(),
            (Self::Second, ..) => toolbar::name(&compare.reference, context),
        }
    }

    /// Name of the picture after its letter, A or B.
    pub fn title(self, context: &PanelContext, relit: &PreviewPicture) -> String {
        let letter = match self {
            Self::First => "A",
            Self::Second => "B",
        };
        format!("{letter} {}", self.name(context, relit))
    }

    /// 8-bit codes of the picture, and their columns and rows. Empty if they are only on the GPU.
    pub fn codes(self, relit: &PreviewPicture) -> (&[u8], [usize; 2]) {
        let other = match self {
            Self::First => &relit.first,
            Self::Second => &relit.second,
        };
        match (self, other) {
            (_, Some((_, codes))) => (&codes.rgb, [codes.width, codes.height]),
            (Self::First, None) => (&relit.rgb, relit.rgb_size),
            (Self::Second, None) => (&[], [0, 0]),
        }
    }
}
