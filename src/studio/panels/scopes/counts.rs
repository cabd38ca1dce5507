//! What the scopes count: codes of the picture or of a region.

use crate::region::Region;
use crate::theme;
use egui::{Color32, ColorImage};
use imaging::color::luminance;
use std::borrow::Cow;
use worker::PreviewPicture;

/// How far from the middle the vectorscope reaches, in units of Cb and Cr: 75 % bars are inside.
pub const REACH: f32 = 0.5;
/// The angle of skin in the vectorscope, from +Cb towards +Cr: the I axis of NTSC.
pub const SKIN_DEG: f32 = 123.0;
/// Red, green and blue, as the scopes draw them.
pub const COLORS: [Color32; 3] = [
    Color32::from_rgb(220, 90, 80),
    Color32::from_rgb(90, 190, 100),
    Color32::from_rgb(90, 140, 230),
];

/// Pixels per 8-bit code, for each channel.
pub type Histogram = [[u32; 256]; 3];

/// The codes that are counted: the picture's, or a region's; and how many columns they have.
pub fn codes(relit: &PreviewPicture, region: Option<Region>) -> (Cow<'_, [u8]>, usize) {
    let columns = relit.rgb_size[0];
    let size = [relit.width, relit.height];
    let Some(region) = region.and_then(|region| region.inside(size)) else {
        return (Cow::Borrowed(&relit.rgb), columns);
    };
    let region = region.scaled(size, relit.rgb_size);
    let pixels = region.of(relit.rgb.as_chunks::<3>().0, columns);
    (pixels.flatten().copied().collect(), region.size()[0])
}

/// How many pixels are at the end of the range, black (0) or white (255), in each channel.
pub fn clipped(histogram: &Histogram, code: usize) -> String {
    let [r, g, b] = histogram.map(|counts| counts[code]);
    let end = if code == 0 { "black" } else { "white" };
    format!("Clipped {end}: R {r}, G {g}, B {b} pixels")
}

/// How often each code occurs.
pub fn histogram(rgb: &[u8]) -> Histogram {
    let mut counts = [[0; 256]; 3];
    for pixel in rgb.as_chunks::<3>().0 {
        for (counts, &code) in counts.iter_mut().zip(pixel) {
            counts[usize::from(code)] += 1;
        }
    }
    counts
}

/// How often each level occurs in each column of a picture's values, from 0 to 1; the brightest level comes first.
fn levels(
    values: impl Iterator<Item = f32>,
    width: usize,
    [columns, rows]: [usize; 2],
) -> Vec<u32> {
    let width = width.max(1);
    let mut counts = vec![0u32; columns * rows];
    for (i, value) in values.enumerate() {
        let level = ((1.0 - value) * (rows - 1) as f32).round() as usize;
        let column = (i % width) * columns / width;
        counts[level.min(rows - 1) * columns + column] += 1;
    }
    counts
}

/// How bright a count is drawn, from 0 to 1: rare ones stay visible.
fn shade(count: u32, most: u32) -> f32 {
    match count {
        0 => 0.0,
        _ => (count as f32 / most.max(1) as f32).powf(0.4),
    }
}

fn most(counts: &[u32]) -> u32 {
    counts.iter().copied().max().unwrap_or(0)
}

/// How often each level of luma occurs in each column of the picture; bright means often.
pub fn waveform(rgb: &[u8], width: usize, size: [usize; 2]) -> ColorImage {
    let pixels = rgb.as_chunks::<3>().0.iter();
    let luma = pixels.map(|pixel| luminance(pixel.map(|code| f32::from(code) / 255.0)));
    let counts = levels(luma, width, size);
    let most = most(&counts);
    let grey = |count: u32| Color32::from_gray((24.0 + 200.0 * shade(count, most)) as u8);
    ColorImage::new(size, counts.into_iter().map(grey).collect())
}

/// The same for red, green and blue, side by side.
pub fn parade(rgb: &[u8], width: usize, size: [usize; 2]) -> ColorImage {
    let [columns, rows] = size;
    let third = columns / 3;
    let mut picture = ColorImage::filled(size, theme::WELL);
    for (channel, color) in COLORS.into_iter().enumerate() {
        let codes = rgb.as_chunks::<3>().0.iter().map(|pixel| pixel[channel]);
        let counts = levels(
            codes.map(|code| f32::from(code) / 255.0),
            width,
            [third, rows],
        );
        let most = most(&counts);
        for (i, &count) in counts.iter().enumerate() {
            let share = shade(count, most);
            if share > 0.0 {
                let at = i / third * columns + channel * third + i % third;
                picture.pixels[at] = theme::WELL.lerp_to_gamma(color, 0.25 + 0.75 * share);
            }
        }
    }
    picture
}

/// Cb and Cr of codes (ITU-R BT.709), each from −0.5 to 0.5.
pub fn chroma([r, g, b]: [f32; 3]) -> [f32; 2] {
    let luma = luminance([r, g, b]);
    [(b - luma) / 1.8556, (r - luma) / 1.5748]
}

/// How often each chroma occurs: Cb to the right, Cr up.
pub fn vectorscope(rgb: &[u8], side: usize) -> ColorImage {
    let mut counts = vec![0u32; side * side];
    for pixel in rgb.as_chunks::<3>().0 {
        let [cb, cr] = chroma(pixel.map(|code| f32::from(code) / 255.0));
        let place = |share: f32| {
            let place = (0.5 + 0.5 * share / REACH) * (side - 1) as f32;
            place.round().clamp(0.0, (side - 1) as f32) as usize
        };
        counts[place(-cr) * side + place(cb)] += 1;
    }
    // Grey pixels do not set the scale: they would hide everything else.
    let middle = side / 2;
    let colored = counts
        .iter()
        .enumerate()
        .filter(|(i, _)| (i / side).abs_diff(middle) > 1 || (i % side).abs_diff(middle) > 1);
    let most = colored.map(|(_, &count)| count).max().unwrap_or(0);
    let grey = |count: u32| {
        let share = shade(count, most).min(1.0);
        Color32::from_gray((24.0 + 216.0 * share) as u8)
    };
    ColorImage::new([side; 2], counts.into_iter().map(grey).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [usize; 2] = [192, 96];
    const VECTORS: usize = 128;

    #[test]
    fn scopes_count_every_pixel_at_its_level() {
        // A grey ramp, two rows.
        let row = (0..=255u8).flat_map(|code| [code; 3]);
        let rgb: Vec<u8> = row.clone().chain(row).collect();
        assert!(histogram(&rgb).iter().flatten().all(|&count| count == 2));
        let waveform = waveform(&rgb, 256, SIZE);
        let [columns, levels] = SIZE;
        let brightest = |column: usize| {
            (0..levels).max_by_key(|level| waveform.pixels[level * columns + column].r())
        };
        assert_eq!(brightest(0), Some(levels - 1));
        assert_eq!(brightest(columns - 1), Some(0));
        let mut counts = histogram(&rgb);
        assert_eq!(clipped(&counts, 255), "Clipped white: R 2, G 2, B 2 pixels");
        counts[1][0] = 12_345;
        assert_eq!(
            clipped(&counts, 0),
            "Clipped black: R 2, G 12345, B 2 pixels"
        );
    }

    #[test]
    fn each_colour_has_its_third_of_the_parade_and_its_place_among_the_vectors() {
        let red: Vec<u8> = [191, 0, 0].repeat(64);
        let parade = parade(&red, 64, SIZE);
        let [columns, rows] = SIZE;
        let level = |third: usize| {
            let column = third * columns / 3;
            (0..rows).find(|row| parade.pixels[row * columns + column] != theme::WELL)
        };
        let three_quarters = (0.25 * (rows - 1) as f32).round() as usize;
        assert_eq!(level(0), Some(three_quarters));
        assert_eq!((level(1), level(2)), (Some(rows - 1), Some(rows - 1)));

        let vectors = vectorscope(&red, VECTORS);
        let brightest = (0..vectors.pixels.len()).max_by_key(|&i| vectors.pixels[i].r());
        let brightest = brightest.unwrap();
        let (x, y) = (brightest % VECTORS, brightest / VECTORS);
        // Cb = −0.086, Cr = 0.375 at three quarters.
        assert!(x.abs_diff(53) <= 1 && y.abs_diff(16) <= 1, "{x}, {y}");
        // Skin lies near its line.
        let [cb, cr] = chroma([0.80, 0.60, 0.50]);
        let off = cr.atan2(cb).to_degrees() - SKIN_DEG;
        assert!(off.abs() < 12.0, "{off}");
    }
}
