//! Limits on the memory that a picture file may claim.

use exr::meta::header::Header;

/// Maximum number of pixels, checked before memory is allocated: 1.6 GB of light, or 16384 × 8192.
pub const MAX_PIXELS: usize = 1 << 27;
/// Maximum memory of a decoder in bytes: 16 for each pixel, and 64 MiB.
pub(crate) const MAX_DECODER_BYTES: u64 = 16 * MAX_PIXELS as u64 + (64 << 20);
/// Maximum size in bytes of a block of lines or a tile: a panorama of 16384 × 8192 half floats in one tile.
const MAX_BLOCK_BYTES: usize = 1 << 30;

/// Rejects an OpenEXR file whose blocks (lines or tiles that are decoded at once) exceed `MAX_BLOCK_BYTES`:
/// decoders allocate that memory before they read the block.
///
/// # Errors
/// When a block is too large: a description of it.
pub fn check_openexr(parts: &[Header]) -> std::result::Result<(), String> {
    for part in parts {
        let (block, layer) = (part.max_block_pixel_size(), part.layer_size);
        let (width, height) = (block.x().min(layer.x()), block.y().min(layer.y()));
        let bytes = (width.checked_mul(height)).and_then(|pixels| pixels.checked_mul(part.channels.bytes_per_pixel));
        if bytes.is_none_or(|bytes| bytes > MAX_BLOCK_BYTES) {
            return Err(format!(
                "its blocks have {width} × {height} pixels of {} bytes; the limit per block is \
                 {MAX_BLOCK_BYTES} bytes",
                part.channels.bytes_per_pixel
            ));
        }
    }
    Ok(())
}

/// Refuses pictures that would take too much memory, or none.
pub(crate) fn check_size((width, height): (usize, usize)) -> std::result::Result<(), String> {
    match width.checked_mul(height) {
        Some(0) => Err("it has no pixels".to_owned()),
        Some(pixels) if pixels <= MAX_PIXELS => Ok(()),
        _ => Err(format!("it claims to have {width} × {height} pixels, and at most {MAX_PIXELS} are read")),
    }
}
