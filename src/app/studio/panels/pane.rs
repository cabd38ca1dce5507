//! The panes of the window.

use serde::{Deserialize, Serialize};

macro_rules! panes {
    ($($pane:ident, $title:literal, $field:ident: $panel:ty, $frame:ident;)*) => {
        /// A slot for one panel. Saved layouts hold its name.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
        pub enum Pane {
            $($pane,)*
        }

        impl Pane {
            /// All panes, in the order of the menu.
            pub const ALL: [Self; [$($title),*].len()] = [$(Self::$pane),*];

            /// Label of its tab.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$pane => $title,)*
                }
            }
        }
    };
}

with_panels!(panes);
