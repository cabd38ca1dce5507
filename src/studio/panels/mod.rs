//! The panels, one file each.

mod environments;
mod job;
mod status;
mod timeline;
mod viewport;

pub use environments::EnvironmentsPanel;
pub use job::JobPanel;
pub use status::StatusPanel;
pub use timeline::TimelinePanel;
pub use viewport::ViewportPanel;
