//! Panes of the window.

use crate::layout::{Pane, Workspace};

/// Visible parts of the window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WindowParts {
    All,
    PictureAndLight,
    /// The workspace's main pane.
    Main,
}

impl WindowParts {
    /// `few`, or all panes again.
    #[must_use]
    pub fn toggled(self, few: Self) -> Self {
        if self == few { Self::All } else { few }
    }
}

/// The workspace and its panes.
#[derive(Clone, Debug, PartialEq)]
pub struct Panes {
    pub workspace: Workspace,
    /// The active pane, which gets the keys.
    pub active: Pane,
    pub parts: WindowParts,
    /// The panes drawn in the last frame.
    pub drawn: Vec<Pane>,
    /// True if the window fills the screen.
    pub full_screen: bool,
}

impl Default for Panes {
    fn default() -> Self {
        let workspace = Workspace::default();
        Self { workspace, active: workspace.main()[0], parts: WindowParts::All, drawn: Vec::new(), full_screen: false }
    }
}

impl Panes {
    /// True if the pane is visible.
    pub fn shows(&self, pane: Pane) -> bool {
        self.drawn.contains(&pane)
    }

    /// Activates a drawn pane if the active one is hidden.
    pub fn activate_drawn(&mut self) {
        if !self.shows(self.active) {
            let is_drawn = |pane: &&Pane| self.drawn.contains(pane);
            let main = self.workspace.main().iter().find(is_drawn);
            if let Some(&active) = main.or(self.drawn.first()) {
                self.active = active;
            }
        }
    }
}
