//! Commands for lights placed by hand.

/// Adds, copies and removes lights placed by hand. Each command is one undo step. The selected light is
/// [`crate::State::chosen_light`].
#[derive(Clone, Debug, PartialEq)]
pub enum LightsCommand {
    /// Add a softbox and select it.
    Add,
    /// Duplicate the selected light with its keys, and select the copy.
    Duplicate,
    /// Copy the selected light with its keys to the clipboard.
    Copy,
    /// Add the light in this clipboard text, and select it.
    Paste(String),
    /// Remove the selected light with its keys.
    Remove,
    /// Rename the group with this index.
    RenameGroup(usize, String),
    /// Remove the group with this index; its lights stay.
    RemoveGroup(usize),
}
