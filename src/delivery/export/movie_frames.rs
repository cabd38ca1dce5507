//! Movie frames that workers make separately: one PNG each, in exactly the codes that ffmpeg is fed later; planes stand
//! one below the other. The joined movie equals that of a single export byte for byte.

use super::about::PROVENANCE;
use super::clip::frame_bytes;
use super::codec::Codec;
use super::colors::Encoding;
use super::format::MovieAlpha;
use super::still::png_error;
use super::whole::read_png;
use base::error::{Error, Result};
use base::files::write_beside;
use compositor::Picture;
use std::io;
use std::path::{Path, PathBuf};

/// Most frames per folder, so that no folder holds millions of files.
const IN_A_FOLDER: usize = 1000;

/// File in `folder` of frame `frame` of a movie made in parts.
pub fn movie_frame(folder: &Path, frame: usize) -> PathBuf {
    let thousand = format!("{:06}", frame / IN_A_FOLDER);
    folder.join(thousand).join(format!("{frame:09}.png"))
}

/// Folder of the frames, and the codec and alpha of their movie.
#[derive(Clone, Debug)]
pub(super) struct MovieFrames {
    pub folder: PathBuf,
    codec: Codec,
    alpha: MovieAlpha,
}

/// Layout of a PNG.
#[derive(PartialEq)]
struct Layout {
    color: png::ColorType,
    depth: png::BitDepth,
    /// Columns and rows: planes are stacked.
    size: (usize, usize),
}

impl MovieFrames {
    pub fn new(folder: &Path, codec: Codec, alpha: MovieAlpha) -> Self {
        Self { folder: folder.to_path_buf(), codec, alpha }
    }

    /// File of frame `frame`.
    pub fn path(&self, frame: usize) -> PathBuf {
        movie_frame(&self.folder, frame)
    }

    /// Layout of the PNGs of a movie of `size`.
    fn layout(&self, size: (usize, usize)) -> Layout {
        use png::{BitDepth, ColorType};
        let (width, height) = self.codec.padded(size);
        let (color, depth, planes) = match (self.codec.is_planar(), self.codec.has_alpha()) {
            (true, true) => (ColorType::Grayscale, BitDepth::Sixteen, 4),
            (true, false) => (ColorType::Grayscale, BitDepth::Sixteen, 3),
            (false, true) => (ColorType::Rgba, BitDepth::Sixteen, 1),
            (false, false) => (ColorType::Rgb, BitDepth::Eight, 1),
        };
        Layout { color, depth, size: (width, planes * height) }
    }

    /// Writes frame `frame` with the provenance `made_of`.
    ///
    /// # Errors
    /// When the file cannot be written, or the picture has no display codes.
    pub fn write(&self, frame: usize, picture: &Picture, encoding: &Encoding, made_of: Option<&str>) -> Result<()> {
        let path = self.path(frame);
        let mut bytes = frame_bytes(&path, (self.codec, self.alpha), encoding, picture)?;
        let Layout { color, depth, size: (width, height) } = self.layout(picture.alpha.size());
        if depth == png::BitDepth::Sixteen {
            swap_bytes(&mut bytes);
        }
        write_beside(&path, |out| {
            let mut info = png::Info::with_size(width as u32, height as u32);
            (info.color_type, info.bit_depth) = (color, depth);
            let mut encoder = png::Encoder::with_info(out, info).map_err(io::Error::other)?;
            // Each file is read only once; the disk takes longer than light compression saves.
            encoder.set_compression(png::Compression::Fast);
            if let Some(made_of) = made_of {
                let added = encoder.add_text_chunk(PROVENANCE.to_owned(), made_of.to_owned());
                added.map_err(io::Error::other)?;
            }
            let mut writer = encoder.write_header().map_err(png_error)?;
            writer.write_image_data(&bytes).map_err(png_error)?;
            writer.finish().map_err(png_error)
        })
    }

    /// Frame `frame` in ffmpeg's layout, at the movie's size `size`.
    ///
    /// # Errors
    /// When the file is missing, damaged, or has another format or size.
    pub fn read(&self, frame: usize, size: (usize, usize)) -> Result<Vec<u8>> {
        let path = self.path(frame);
        let (mut bytes, info) = read_png(&path)?;
        let found =
            Layout { color: info.color_type, depth: info.bit_depth, size: (info.width as usize, info.height as usize) };
        if found != self.layout(size) {
            return Err(Error::codec(
                "read",
                &path,
                format!("it is not a frame of {} × {} pixels for {}", size.0, size.1, self.codec.name()),
                "Write this frame again",
            ));
        }
        if info.bit_depth == png::BitDepth::Sixteen {
            swap_bytes(&mut bytes);
        }
        Ok(bytes)
    }
}

/// PNG samples are big-endian, ffmpeg's little-endian.
fn swap_bytes(bytes: &mut [u8]) {
    bytes.chunks_exact_mut(2).for_each(|word| word.swap(0, 1));
}

#[cfg(test)]
mod tests {
    use super::super::still::tests::picture;
    use super::*;

    #[test]
    fn what_is_read_again_is_what_ffmpeg_would_have_been_fed() {
        let folder = tempfile::tempdir().unwrap();
        let plain = Encoding::default();
        // Some codecs pad odd sizes.
        let shown = picture(7, 5, [0.5, 0.03, 0.9], false);
        let straight = [Codec::H264, Codec::H265, Codec::ProRes4444, Codec::Ffv1];
        let straight = straight.map(|codec| (codec, MovieAlpha::Straight));
        let premultiplied = (Codec::ProRes4444, MovieAlpha::Premultiplied);
        let mut seen = Vec::new();
        for (codec, alpha) in straight.into_iter().chain([premultiplied]) {
            let frames = MovieFrames::new(folder.path(), codec, alpha);
            frames.write(1234, &shown, &plain, Some("of this")).unwrap();
            let path = frames.path(1234);
            assert!(path.ends_with("000001/000001234.png"), "{}", path.display());
            let fed = frame_bytes(&path, (codec, alpha), &plain, &shown).unwrap();
            assert!(!seen.contains(&fed), "{codec:?} {alpha:?}");
            assert_eq!(frames.read(1234, (7, 5)).unwrap(), fed, "{codec:?} {alpha:?}");
            assert_eq!(super::super::provenance_of(&path).as_deref(), Some("of this"));
            assert!(frames.read(1234, (9, 5)).is_err(), "another size");
            let whole = std::fs::read(&path).unwrap();
            std::fs::write(&path, &whole[..whole.len() * 2 / 3]).unwrap();
            assert!(frames.read(1234, (7, 5)).is_err(), "half a frame");
            seen.push(fed);
        }
    }
}
