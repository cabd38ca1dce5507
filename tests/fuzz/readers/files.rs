//! Small valid pictures of every kind, as seeds.

use exr::prelude::*;
use image::{DynamicImage, ImageFormat};
use std::io::Cursor;

/// Some colours, partly brighter than white.
fn color(x: usize, y: usize) -> [f32; 3] {
    [x as f32 / 8.0, y as f32 / 4.0, ((x ^ y) & 3) as f32]
}

/// Radiance HDR: plain, run-length coded by pixel and by channel, from the bottom up, and with keys in its header.
pub fn radiance() -> Vec<Vec<u8>> {
    let head = |keys: &str, size: &str| format!("#?RADIANCE\n{keys}\n{size}\n").into_bytes();
    let mut plain = head("FORMAT=32-bit_rle_rgbe\n", "-Y 4 +X 8");
    plain.extend((0..32u8).flat_map(|i| [i * 8, 255 - i, 7, 120 + i]));
    let keys = "EXPOSURE=2\nCOLORCORR=1 2 0.5\nFORMAT=32-bit_rle_xyze\n";
    let mut old = head(keys, "+X 8 -Y 4");
    old.extend((0..8).flat_map(|i| [9, 8, 7, 128 + i, 1, 1, 1, 3]));
    let mut new = head("", "-Y 8 +X 16");
    for _ in 0..8 {
        new.extend([2, 2, 0, 16]);
        (0..4).for_each(|channel| new.extend([128 + 12, channel, 4, 1, 2, 3, 130]));
    }
    vec![plain, old, new]
}

fn openexr_of(
    size: (usize, usize),
    display: Option<(i32, i32, usize, usize)>,
    encoding: Encoding,
    names: [&str; 3],
) -> Vec<u8> {
    let (width, height) = size;
    let list = names.iter().enumerate().map(|(c, name)| {
        let values = (0..width * height).map(|i| color(i % width, i / width)[c]);
        let samples = match c {
            0 => FlatSamples::F32(values.collect()),
            1 => FlatSamples::F16(values.map(f16::from_f32).collect()),
            _ => FlatSamples::U32(values.map(|v| v as u32).collect()),
        };
        AnyChannel::new(*name, samples)
    });
    let channels = AnyChannels::sort(list.collect());
    let layer = Layer::new(size, LayerAttributes::default(), encoding, channels);
    let mut image = Image::from_layer(layer);
    if let Some((x, y, columns, rows)) = display {
        image.attributes.display_window = IntegerBounds::new((x, y), (columns, rows));
    }
    let mut bytes = Vec::new();
    image.write().to_buffered(Cursor::new(&mut bytes)).unwrap();
    bytes
}

/// OpenEXR: lines and tiles, every compression, a separate display window, layers by name and grey.
pub fn openexr() -> Vec<Vec<u8>> {
    let encoding = |compression, blocks, line_order| Encoding { compression, blocks, line_order };
    use Compression::*;
    let mut files: Vec<Vec<u8>> = [Uncompressed, RLE, ZIP1, ZIP16, PIZ, PXR24, B44]
        .into_iter()
        .map(|compression| {
            let kind = encoding(compression, Blocks::ScanLines, LineOrder::Increasing);
            openexr_of((8, 4), None, kind, ["R", "G", "B"])
        })
        .collect();
    let tiles = encoding(ZIP1, Blocks::Tiles(Vec2(4, 4)), LineOrder::Decreasing);
    files.push(openexr_of((8, 4), Some((-2, 1, 16, 8)), tiles, ["key.R", "key.G", "key.B"]));
    files.push(openexr_of((6, 3), None, Encoding::UNCOMPRESSED, ["Y", "Z", "id"]));
    files
}

/// PNG, JPEG and TIFF, of eight and sixteen bits and of floating point, in grey and in colour.
pub fn encoded() -> Vec<Vec<u8>> {
    let rgb = image::RgbImage::from_fn(16, 8, |x, y| image::Rgb([(x * 16) as u8, (y * 32) as u8, (x ^ y) as u8]));
    let rgb = DynamicImage::ImageRgb8(rgb);
    let write = |picture: DynamicImage, format| {
        let mut bytes = Vec::new();
        (picture.write_to(&mut Cursor::new(&mut bytes), format)).unwrap();
        bytes
    };
    vec![
        write(rgb.clone(), ImageFormat::Png),
        write(rgb.to_luma_alpha16().into(), ImageFormat::Png),
        write(rgb.to_rgba16().into(), ImageFormat::Png),
        write(rgb.clone(), ImageFormat::Jpeg),
        write(rgb.to_luma8().into(), ImageFormat::Jpeg),
        write(rgb.clone(), ImageFormat::Tiff),
        write(rgb.to_luma16().into(), ImageFormat::Tiff),
        write(rgb.to_rgb32f().into(), ImageFormat::Tiff),
    ]
}
