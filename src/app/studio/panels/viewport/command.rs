//! Commands for light by the face.

/// Places lights by the point on which they should fall.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AimCommand {
    /// Let a press on the picture place a light, or let it turn the environment again.
    Toggle,
    /// The pointer was pressed: the drag moves the light with this index, or places a new one.
    Begin(Option<usize>),
    /// The pointer is over this column and row of the picture; None outside it.
    At(Option<[usize; 2]>),
}
