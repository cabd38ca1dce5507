//! Pictures of decoded pixels: turned, with the colour that the file names.

use super::profile::Named;
use super::properties::{About, Coding};
use super::whole::{Content, Picture};
use crate::color_space::transformed;
use crate::raster::{Image, Mask};
use image::metadata::Orientation;
use image::{ColorType, DynamicImage};
use std::path::Path;

/// Columns and rows after the turn.
pub(super) fn turned(stored: (usize, usize), orientation: Orientation) -> (usize, usize) {
    use Orientation::{Rotate90, Rotate90FlipH, Rotate270, Rotate270FlipH};
    match orientation {
        Rotate90 | Rotate270 | Rotate90FlipH | Rotate270FlipH => (stored.1, stored.0),
        _ => stored,
    }
}

/// Properties and colour of a picture with these colours, `stored` columns and rows, and this turn.
pub(super) fn describe(
    path: &Path,
    format: &'static str,
    stored: (usize, usize),
    color: ColorType,
    named: std::result::Result<Option<Named>, String>,
    orientation: Orientation,
) -> (About, Option<Named>) {
    let mut notes = Vec::new();
    let is_as_stored = orientation == Orientation::NoTransforms;
    if !is_as_stored {
        notes.push("Turned by the orientation in its file.".to_owned());
    }
    let named = named.unwrap_or_else(|fault| {
        notes.push(format!("{} was read as sRGB: {fault}.", path.display()));
        None
    });
    let turned_by = if format == "TIFF" { "its orientation tag" } else { "EXIF" };
    let origin = named.as_ref().map(|named| named.origin.clone());
    let is_light = matches!(color, ColorType::Rgb32F | ColorType::Rgba32F);
    let about = About {
        size: turned(stored, orientation),
        format,
        coding: match origin {
            origin if is_light => Coding::Light(origin),
            Some(origin) => Coding::Named(origin),
            None => Coding::Open,
        },
        has_alpha: color.has_alpha(),
        bits: 8 * color.bytes_per_pixel() / color.channel_count(),
        layer: None,
        turned_by: (!is_as_stored).then_some(turned_by),
        is_converted: named
            .as_ref()
            .is_some_and(|named| if is_light { named.matrix().is_some() } else { named.profile.is_some() }),
        is_whole: true,
        notes,
    };
    (about, named)
}

/// The picture of decoded pixels.
pub(super) fn finish(
    about: About,
    named: Option<Named>,
    mut picture: DynamicImage,
    orientation: Orientation,
) -> Picture {
    picture.apply_orientation(orientation);
    if !matches!(about.coding, Coding::Light(_)) {
        return Picture { about, content: Content::Codes(picture, named) };
    }
    let (width, height) = about.size;
    let pixels = picture.into_rgba32f();
    let alpha = about.has_alpha.then(|| Mask { width, height, pixels: pixels.pixels().map(|p| p.0[3]).collect() });
    let matrix = named.as_ref().and_then(Named::matrix);
    let light = pixels.pixels().map(|p| {
        let light = [p.0[0], p.0[1], p.0[2]];
        matrix.map_or(light, |matrix| transformed(&matrix, light))
    });
    let light = Image { width, height, pixels: light.collect() };
    Picture { about, content: Content::Light(light, alpha) }
}
