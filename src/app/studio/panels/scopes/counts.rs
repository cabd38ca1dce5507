//! Counts of the scopes: codes of the picture or of a region.

use crate::region::Region;
use crate::theme;
use egui::{Color32, ColorImage};
use imaging::color::luminance;

/// Reach of the vectorscope from the middle, in units of Cb and Cr: 75 % bars are inside.
pub const REACH: f32 = 0.5;
/// The angle of skin in the vectorscope, from +Cb towards +Cr: the I axis of NTSC.
pub const SKIN_DEG: f32 = 123.0;
/// Red, green and blue, as the scopes draw them.
pub const COLORS: [Color32; 3] =
    [Color32::from_rgb(220, 90, 80), Color32::from_rgb(90, 190, 100), Color32::from_rgb(90, 140, 230)];

/// Pixels per 8-bit code, for each channel.
pub type Histogram = [[u32; 256]; 3];

/// Codes to count, of a picture or a region.
pub struct Codes<'a> {
    pixels: &'a [[u8; 3]],
    columns: usize,
    of: Region,
    /// Row step: 1 counts all rows.
    step: usize,
}

impl<'a> Codes<'a> {
    /// Codes of a picture of `size` columns and rows, every `step`th row. The region is given in a picture of `whole`
    /// columns and rows.
    pub fn new(rgb: &'a [u8], size: [usize; 2], (region, whole): (Option<Region>, [usize; 2]), step: usize) -> Self {
        let all = Region { left: 0, top: 0, right: size[0], bottom: size[1] };
        let region = region.and_then(|region| region.inside(whole));
        let region = region.and_then(|region| region.scaled(whole, size).inside(size));
        Self { pixels: rgb.as_chunks().0, columns: size[0], of: region.unwrap_or(all), step: step.max(1) }
    }

    fn rows(&self) -> impl Iterator<Item = &'a [[u8; 3]]> {
        let Self { pixels, columns, of, step } = *self;
        (of.top..of.bottom).step_by(step).filter_map(move |row| {
            let row = row * columns;
            pixels.get(row + of.left..row + of.right)
        })
    }

    /// Index of each column among `among` columns.
    fn columns(&self, among: usize) -> Vec<usize> {
        let [width, _] = self.of.size();
        (0..width).map(|x| x * among / width.max(1)).collect()
    }

    /// Number of pixels that one counted pixel represents.
    pub fn share(&self) -> f32 {
        let [_, rows] = self.of.size();
        rows as f32 / rows.div_ceil(self.step).max(1) as f32
    }
}

/// Text with the number of pixels at the end of the range, black (0) or white (255), in each channel. A counted pixel
/// represents `share` pixels.
pub fn clipped(histogram: &Histogram, code: usize, share: f32) -> String {
    let [r, g, b] = histogram.map(|counts| (counts[code] as f32 * share).round());
    let end = if code == 0 { "black" } else { "white" };
    let about = if share == 1.0 { "" } else { "about " };
    format!("Clipped {end}: {about}R {r}, G {g}, B {b} pixels")
}

/// Count of each code.
pub fn histogram(codes: &Codes) -> Histogram {
    let mut counts = [[0; 256]; 3];
    for pixel in codes.rows().flatten() {
        for (counts, &code) in counts.iter_mut().zip(pixel) {
            counts[usize::from(code)] += 1;
        }
    }
    counts
}

/// A value for each code, computed from the code as a share of 255.
fn table<T>(of: impl Fn(f32) -> T) -> [T; 256] {
    std::array::from_fn(|code| of(code as f32 / 255.0))
}

/// Row of a level from 0 to 1, brightest first.
fn row(level: f32, rows: usize) -> usize {
    (((1.0 - level) * (rows - 1) as f32 + 0.5) as usize).min(rows - 1)
}

/// Brightness of a drawn count, from 0 to 1: rare ones stay visible.
fn shade(count: u32, most: u32) -> f32 {
    match count {
        0 => 0.0,
        _ => (count as f32 / most.max(1) as f32).powf(0.4),
    }
}

fn most(counts: &[u32]) -> u32 {
    counts.iter().copied().max().unwrap_or(0)
}

/// Count of each level of luma in each column of the picture; bright means often.
pub fn waveform(codes: &Codes, size: [usize; 2]) -> ColorImage {
    let [columns, rows] = size;
    let mut counts = vec![0u32; columns * rows];
    let places = codes.columns(columns);
    let [red, green, blue] = [0, 1, 2]
        .map(|channel| table(|code| luminance(std::array::from_fn(|c| if c == channel { code } else { 0.0 }))));
    for line in codes.rows() {
        for (place, &[r, g, b]) in places.iter().zip(line) {
            let luma = red[usize::from(r)] + green[usize::from(g)] + blue[usize::from(b)];
            counts[row(luma, rows) * columns + place] += 1;
        }
    }
    let most = most(&counts);
    let grey = |count: u32| Color32::from_gray((24.0 + 200.0 * shade(count, most)) as u8);
    ColorImage::new(size, counts.into_iter().map(grey).collect())
}

/// As [`waveform`] for red, green and blue, side by side.
pub fn parade(codes: &Codes, size: [usize; 2]) -> ColorImage {
    let [columns, rows] = size;
    let third = columns / 3;
    let mut counts = [0, 1, 2].map(|_| vec![0u32; third * rows]);
    let places = codes.columns(third);
    let starts = table(|code| row(code, rows) * third);
    for line in codes.rows() {
        for (place, pixel) in places.iter().zip(line) {
            for (counts, &code) in counts.iter_mut().zip(pixel) {
                counts[starts[usize::from(code)] + place] += 1;
            }
        }
    }
    let mut picture = ColorImage::filled(size, theme::WELL);
    for (channel, (counts, color)) in counts.into_iter().zip(COLORS).enumerate() {
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

/// Count of each chroma: Cb to the right, Cr up.
pub fn vectorscope(codes: &Codes, side: usize) -> ColorImage {
    let mut counts = vec![0u32; side * side];
    let [red, green, blue] =
        [0, 1, 2].map(|channel| table(|code| chroma(std::array::from_fn(|c| if c == channel { code } else { 0.0 }))));
    let place = |share: f32| {
        let place = (0.5 + 0.5 * share / REACH) * (side - 1) as f32 + 0.5;
        (place as usize).min(side - 1)
    };
    for &[r, g, b] in codes.rows().flatten() {
        let parts = [red[usize::from(r)], green[usize::from(g)], blue[usize::from(b)]];
        let [cb, cr] = [0, 1].map(|axis| parts.iter().map(|part| part[axis]).sum::<f32>());
        counts[place(-cr) * side + place(cb)] += 1;
    }
    // Grey pixels do not set the scale: they would hide everything else.
    let middle = side / 2;
    let colored =
        counts.iter().enumerate().filter(|(i, _)| (i / side).abs_diff(middle) > 1 || (i % side).abs_diff(middle) > 1);
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

    fn all(rgb: &[u8], columns: usize) -> Codes<'_> {
        let size = [columns, rgb.len() / 3 / columns];
        Codes::new(rgb, size, (None, size), 1)
    }

    #[test]
    fn scopes_count_every_pixel_at_its_level() {
        // A grey ramp, two rows.
        let row = (0..=255u8).flat_map(|code| [code; 3]);
        let rgb: Vec<u8> = row.clone().chain(row).collect();
        let codes = all(&rgb, 256);
        assert!(histogram(&codes).iter().flatten().all(|&count| count == 2));
        let waveform = waveform(&codes, SIZE);
        let [columns, levels] = SIZE;
        let brightest = |column: usize| (0..levels).max_by_key(|level| waveform.pixels[level * columns + column].r());
        assert_eq!(brightest(0), Some(levels - 1));
        assert_eq!(brightest(columns - 1), Some(0));
        let mut counts = histogram(&codes);
        assert_eq!(clipped(&counts, 255, 1.0), "Clipped white: R 2, G 2, B 2 pixels");
        counts[1][0] = 12_345;
        assert_eq!(clipped(&counts, 0, 1.0), "Clipped black: R 2, G 12345, B 2 pixels");
    }

    #[test]
    fn each_colour_has_its_third_of_the_parade_and_its_place_among_the_vectors() {
        let red: Vec<u8> = [191, 0, 0].repeat(64);
        let parade = parade(&all(&red, 64), SIZE);
        let [columns, rows] = SIZE;
        let level = |third: usize| {
            let column = third * columns / 3;
            (0..rows).find(|row| parade.pixels[row * columns + column] != theme::WELL)
        };
        let three_quarters = (0.25 * (rows - 1) as f32).round() as usize;
        assert_eq!(level(0), Some(three_quarters));
        assert_eq!((level(1), level(2)), (Some(rows - 1), Some(rows - 1)));

        let vectors = vectorscope(&all(&red, 64), VECTORS);
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

    #[test]
    fn a_region_is_counted_alone_and_a_picture_that_moves_by_some_of_its_rows() {
        // The code of a pixel is its row; the picture is twice as large as its codes.
        let rgb: Vec<u8> = (0..64u8).flat_map(|y| [y; 3 * 8]).collect();
        let region = Region { left: 4, top: 20, right: 8, bottom: 40 };
        let counted = |region, step| {
            let codes = Codes::new(&rgb, [8, 64], (region, [16, 128]), step);
            (histogram(&codes)[1], codes.share())
        };
        let (counts, share) = counted(Some(region), 1);
        assert_eq!(share, 1.0);
        let rows: Vec<usize> = (0..256).filter(|&code| counts[code] > 0).collect();
        assert_eq!(rows, (10..20).collect::<Vec<_>>());
        assert!(rows.iter().all(|&code| counts[code] == 2));
        let (counts, share) = counted(None, 8);
        assert_eq!((counts.iter().sum::<u32>(), share), (64, 8.0));
        let (counts, share) = counted(None, 48);
        assert_eq!((counts.iter().sum::<u32>(), share), (16, 32.0));
        let none = Codes::new(&[], [0, 0], (None, [16, 128]), 1);
        assert_eq!(histogram(&none), [[0; 256]; 3]);
        waveform(&none, SIZE);

        let said = clipped(&[[3; 256]; 3], 255, 8.0);
        assert_eq!(said, "Clipped white: about R 24, G 24, B 24 pixels");
    }
}
