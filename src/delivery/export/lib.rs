//! Export: pictures as PNG, TIFF and EXR stills, with light layers, as movies, and as contact sheets.

mod about;
mod clip;
mod codec;
mod colors;
#[cfg(test)]
mod config_tests;
mod destination;
mod encoder;
mod exr_channels;
mod exr_encode;
mod exr_file;
mod exr_settings;
mod exr_still;
mod footage_print;
mod format;
mod hand_over;
mod interview;
mod join;
mod layers;
mod lettering;
mod listing;
mod look;
mod movie_frames;
mod output_space;
mod overlap;
mod provenance;
mod rebuild;
pub mod relight;
mod scaled;
mod sheet;
mod shot_check;
mod sound;
mod still;
mod time_code;
mod whole;
mod writer;

pub use about::About;
pub use clip::{ClipWriter, Movie};
pub use codec::{Codec, Container};
pub use colors::Encoding;
pub use destination::{Destination, Stills};
pub use exr_settings::{ExrAlpha, ExrCompression, ExrSettings, LayerFiles, LayersBy, Samples};
pub use footage_print::footage_print;
pub use format::{Bits, Existing, Files, Format, MovieAlpha, PixelBits};
pub use hand_over::{HandOver, handed_over};
pub use interview::{Interview, Source};
pub use join::{Flaw, FlawedFrame, flawed_frames, join_movie};
pub use layers::{LightLayer, LightLayers, ListedLayer, beside};
pub use listing::{LayerListing, RestLayer};
pub use movie_frames::movie_frame;
pub use output_space::OutputSpace;
pub use overlap::Stages;
pub use provenance::provenance_of;
pub use rebuild::{Rebuild, rebuilt};
pub use scaled::{fitted, scaled};
pub use sheet::{Tile, contact_sheet};
pub use shot_check::{
    Fault, FileHash, FrameReport, Remark, Requirements, ShotLayers, ShotReport, Verification, hash_file, names_frames,
};
pub use still::write_still;
pub use time_code::TimeCode;
pub use writer::check_files;

/// Frames per second as a fraction. The rates of television (23.976, 29.97, 59.94 …) are recognised
/// in any number of digits.
pub fn rational_rate(frames_per_second: f64) -> (i32, u32) {
    let whole = frames_per_second.round();
    if (whole - frames_per_second).abs() < 1e-6 {
        return (whole as i32, 1);
    }
    let television = (frames_per_second * 1.001).round();
    if (television / 1.001 - frames_per_second).abs() < 5e-3 {
        return (1000 * television as i32, 1001);
    }
    ((frames_per_second * 1000.0).round() as i32, 1000)
}

#[cfg(test)]
mod tests {
    use super::rational_rate;

    #[test]
    fn rates_of_film_and_television_are_exact() {
        assert_eq!(rational_rate(24.0), (24, 1));
        for rate in [23.976, 23.98, 24000.0 / 1001.0] {
            assert_eq!(rational_rate(rate), (24000, 1001));
        }
        assert_eq!(rational_rate(29.97), (30000, 1001));
        assert_eq!(rational_rate(12.5), (12500, 1000));
    }
}
