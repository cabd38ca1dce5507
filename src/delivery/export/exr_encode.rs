//! Encoder of EXR files on all cores.
//!
//! ZIP is deflated by zlib-rs at its fastest level: light layers are noise to a compressor, and a higher level takes
//! three times as long for files a seventh smaller. Other compressions are the `exr` crate's.

use exr::block::chunk::{Chunk, CompressedBlock, CompressedScanLineBlock};
use exr::block::writer::ChunksWriter;
use exr::block::{UncompressedBlock, enumerate_ordered_header_block_indices};
use exr::compression::Compression;
use exr::error::Result;
use exr::image::write::layers::{LayersWriter, WritableLayers};
use exr::meta::header::Header;
use exr::prelude::{FlatImage, WritableImage};
use flate2::write::ZlibEncoder;
use rayon::prelude::*;
use std::io::{Cursor, Write};

/// Bytes of a file of scan lines.
///
/// # Errors
/// When the format cannot hold the picture.
pub(super) fn encode(image: &FlatImage) -> Result<Vec<u8>> {
    let headers = image.write().infer_meta_data();
    let layers = image.layer_data.create_writer(&headers);
    let mut bytes = Vec::new();
    exr::block::write(Cursor::new(&mut bytes), headers, true, |meta, file| {
        let headers = &meta.headers;
        let blocks: Vec<_> = enumerate_ordered_header_block_indices(headers).collect();
        for blocks in blocks.chunks(4 * rayon::current_num_threads()) {
            let chunk = |&(_, index): &(usize, _)| {
                let data = layers.extract_uncompressed_block(headers, index);
                compressed(headers, UncompressedBlock { index, data })
            };
            let chunks: Vec<_> = blocks.par_iter().map(chunk).collect::<Result<_>>()?;
            for ((number, _), chunk) in blocks.iter().zip(chunks) {
                file.write_chunk(*number, chunk)?;
            }
        }
        Ok(())
    })?;
    Ok(bytes)
}

/// Block of scan lines as the file holds it.
fn compressed(headers: &[Header], block: UncompressedBlock) -> Result<Chunk> {
    let UncompressedBlock { index, ref data } = block;
    let header = &headers[index.layer];
    let is_zip = matches!(header.compression, Compression::ZIP1 | Compression::ZIP16);
    // Files are little-endian.
    if !is_zip || cfg!(target_endian = "big") {
        return block.compress_to_chunk(headers);
    }
    let mut deflated = ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
    deflated.write_all(&predicted(data))?;
    let deflated = deflated.finish()?;
    // A block that does not shrink is stored.
    let pixels = if deflated.len() < data.len() { deflated } else { block.data };
    Ok(Chunk {
        layer_index: index.layer,
        compressed_block: CompressedBlock::ScanLine(CompressedScanLineBlock {
            y_coordinate: index.pixel_position.y() as i32 + header.own_attributes.layer_position.y(),
            compressed_pixels_le: pixels,
        }),
    })
}

/// OpenEXR's preparation for ZIP: the even bytes, the odd bytes, then each as its difference from the one before, plus 128.
fn predicted(bytes: &[u8]) -> Vec<u8> {
    let (pairs, last) = bytes.as_chunks::<2>();
    let mut sorted = Vec::with_capacity(bytes.len());
    sorted.extend(pairs.iter().map(|pair| pair[0]));
    sorted.extend(last);
    sorted.extend(pairs.iter().map(|pair| pair[1]));
    let mut differences = Vec::with_capacity(bytes.len());
    differences.extend(sorted.first());
    let pairs = sorted.iter().zip(sorted.iter().skip(1));
    differences.extend(pairs.map(|(before, byte)| byte.wrapping_sub(*before).wrapping_add(128)));
    differences
}

#[cfg(test)]
mod tests {
    use super::super::exr_settings::ExrCompression;
    use super::*;
    use exr::prelude::{
        AnyChannel, AnyChannels, Blocks, Encoding, FlatSamples, ImageAttributes, IntegerBounds, Layer, LayerAttributes,
        LineOrder, ReadChannels, ReadLayers, Vec2, f16,
    };

    /// A part of 37 × 41 pixels, off the corner of its picture: constant, smooth, and noise that deflate cannot shrink.
    fn part(name: &str, compression: ExrCompression) -> Layer<AnyChannels<FlatSamples>> {
        let size = Vec2(37, 41);
        let noise = |i: usize| (i as u32).wrapping_mul(2_654_435_761).rotate_left(13);
        let halves = |value: &dyn Fn(usize) -> u16| {
            FlatSamples::F16((0..size.area()).map(|i| f16::from_bits(value(i))).collect())
        };
        let channels = [
            AnyChannel::new("A", halves(&|_| 0x3c00)),
            // Finite: the exponent is below its largest.
            AnyChannel::new("B", halves(&|i| (noise(i) >> 16) as u16 & 0xbfff)),
            AnyChannel::new("G", halves(&|i| 0x3000 + i as u16)),
            AnyChannel::new("Z", FlatSamples::U32((0..size.area()).map(noise).collect())),
        ];
        let header = LayerAttributes {
            layer_name: Some(name.into()),
            layer_position: Vec2(5, -3),
            ..LayerAttributes::default()
        };
        let encoding = Encoding {
            compression: compression.method(),
            blocks: Blocks::ScanLines,
            line_order: LineOrder::Increasing,
        };
        Layer::new(size, header, encoding, AnyChannels::sort(channels.into_iter().collect()))
    }

    #[test]
    fn every_compression_and_part_comes_back_bit_for_bit() {
        for compression in ExrCompression::ALL {
            for names in [&["one"][..], &["one", "two"]] {
                let window = IntegerBounds::new(Vec2(0, 0), Vec2(64, 64));
                let parts = names.iter().map(|name| part(name, compression));
                let image: FlatImage =
                    exr::prelude::Image::from_layers(ImageAttributes::new(window), parts.collect::<Vec<_>>());
                let bytes = encode(&image).unwrap();
                let read = exr::prelude::read()
                    .no_deep_data()
                    .largest_resolution_level()
                    .all_channels()
                    .all_layers()
                    .all_attributes()
                    .from_buffered(Cursor::new(bytes))
                    .unwrap();
                for (read, written) in read.layer_data.iter().zip(&image.layer_data) {
                    assert_eq!(read.attributes.layer_position, Vec2(5, -3));
                    assert!(read.channel_data == written.channel_data, "{compression:?} {names:?}");
                }
                assert_eq!(read.layer_data.len(), names.len());
            }
        }
    }
}
