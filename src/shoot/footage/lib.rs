//! Footage: exemplars and interview frames as linear pictures at the working size, and their import.

mod behind;
pub mod candidate;
mod damaged;
mod exemplar;
mod filmed;
mod frame;
mod frame_mattes;
mod framed;
mod framing;
pub mod gathered;
mod import;
mod lamp_list;
mod lamps;
mod left_out;
mod map;
mod matte_settings;
mod mattes;
mod mended;
mod missing_olats;
pub mod motion;
mod movement;
#[cfg(test)]
mod movie_tests;
#[cfg(test)]
mod names_tests;
mod numbers;
mod parts;
mod round;
pub mod scan;
mod shoot;
mod steady;
pub mod strokes;
mod takes;
mod tracking;
mod understood;
mod uniform;

pub use behind::{BehindReader, picture_behind};
pub use damaged::{STAND_IN_REACH, StandIn, offer, readable_frame, stand_in};
pub use exemplar::{Exemplar, OlatReader, exemplar_sources};
pub use filmed::{FilmedFrame, PictureSize, picture_size};
pub use frame::Frame;
pub use frame_mattes::{FindPerson, FrameMatte, FrameMattes};
pub use framed::{
    cut_picture, dimensions, is_scene_linear, missing_matte, read_encoded, read_framed_light, read_light, read_linear,
    read_mask, read_matte, read_picture,
};
pub use framing::{FrameReport, FrameSettings, Square};
pub use import::{ImportSettings, import, plan_import};
pub use lamps::{LampReport, LampSettings};
pub use matte_settings::MatteSettings;
pub use mattes::{MattesReport, make_mattes};
pub use mended::report_mended;
pub use missing_olats::fill_missing;
pub use motion::{Motion, PoseMotion, SeenIn};
pub use numbers::{FRAME_NUMBERS, first_number};
pub use strokes::{BrushSide, Stroke, Strokes};
pub use tracking::TrackingFrames;
pub use understood::{Understood, understood};
pub use uniform::uniform_coverage;
