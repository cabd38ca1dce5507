//! Pictures behind the subject: a still, or frames of a movie.

use super::framed::read_light;
use base::FileFormat;
use base::error::Result;
use imaging::{Image, Response};
use movies::Source;
use project::Picture;
use std::path::Path;
use std::sync::Arc;
use std::time::SystemTime;

/// Reads the pictures behind a clip and keeps the last one.
#[derive(Debug, Default)]
pub struct BehindReader {
    last: Option<ReadPicture>,
    reads: u64,
}

/// A picture that was read.
#[derive(Debug)]
struct ReadPicture {
    picture: Picture,
    /// Time of change of its file, if known.
    changed: Option<SystemTime>,
    light: Arc<Image>,
}

impl BehindReader {
    /// Light of the picture that `file` shows behind the interview's frame `frame`, `rate` frames a second, and a number
    /// that changes with the picture. A movie's codes, and a still's without a curve of their own, are sRGB; alpha is ignored.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn read(&mut self, file: &Path, frame: usize, rate: f64) -> Result<(u64, Arc<Image>)> {
        let picture = picture_behind(file, frame, rate)?;
        let changed = changed(&picture);
        if let Some(last) = &self.last
            && last.picture == picture
            && last.changed == changed
        {
            return Ok((self.reads, last.light.clone()));
        }
        let light = Arc::new(read_light(&picture, &Response::Srgb)?);
        self.reads += 1;
        self.last = Some(ReadPicture { picture, changed, light: light.clone() });
        Ok((self.reads, light))
    }
}

/// Time of change of a picture's own file, if known.
fn changed(picture: &Picture) -> Option<SystemTime> {
    let still = match picture {
        Picture::Movie { file, frame } => match &*movies::open(file).ok()? {
            Source::Sequence(stills) => stills.file(*frame),
            Source::Movie(_) => None,
        },
        Picture::File(_) | Picture::Mirrored(..) => None,
    };
    let about = still.as_deref().unwrap_or(picture.file()).metadata().ok()?;
    about.modified().ok()
}

/// Picture that `file` shows behind the interview's frame `frame`, `rate` frames a second: a movie starts with the interview,
/// keeps its own rate and repeats; numbered stills change with each frame, and one stands for missing ones after it.
///
/// # Errors
/// When a movie or sequence cannot be opened.
pub fn picture_behind(file: &Path, frame: usize, rate: f64) -> Result<Picture> {
    let is_dpx = FileFormat::from_path(file) == Some(FileFormat::Dpx);
    if file.is_file() && !movies::is_movie(file) && !is_dpx {
        return Ok(Picture::File(file.to_path_buf()));
    }
    let source = movies::open(file)?;
    let own = match source.frame_rate() {
        // A time on a frame's border, less its rounding, belongs to the frame.
        Some(own) if rate > 0.0 => (frame as f64 / rate * own + 1e-6) as u64,
        _ => frame as u64,
    };
    let mut frame = source.first() + own % source.count()?.max(1);
    if let Source::Sequence(stills) = &*source
        && let Some(gap) = stills.gaps().into_iter().find(|gap| gap.contains(&frame))
    {
        frame = gap.start() - 1;
    }
    Ok(Picture::Movie { file: file.to_path_buf(), frame })
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{Rgb, RgbImage};
    use imaging::color::srgb_from_linear;

    #[test]
    fn a_still_stays_numbered_stills_go_on_and_repeat_and_a_changed_file_is_read_again() {
        let folder = tempfile::tempdir().unwrap();
        let grey = |name: &str, code: u8| {
            let file = folder.path().join(name);
            RgbImage::from_pixel(3, 2, Rgb([code; 3])).save(&file).unwrap();
            file
        };
        let still = grey("sky.png", 51);
        for (number, code) in [(7, 10), (8, 20), (9, 30)] {
            grey(&format!("street.{number:04}.png"), code);
        }
        let pattern = folder.path().join("street.%04d.png");
        let mut reader = BehindReader::default();
        let mut light = |file: &Path, frame| {
            let (number, picture) = reader.read(file, frame, 24.0).unwrap();
            assert_eq!(picture.size(), (3, 2));
            (number, (255.0 * srgb_from_linear(picture.pixels[0][0])).round())
        };
        assert_eq!(light(&still, 0), (1, 51.0));
        assert_eq!(light(&still, 9), (1, 51.0));
        let codes = [0, 1, 2, 3, 4].map(|frame| light(&pattern, frame).1);
        assert_eq!(codes, [10.0, 20.0, 30.0, 10.0, 20.0]);
        let (before, _) = light(&still, 0);
        grey("sky.png", 60);
        let later = SystemTime::now() + std::time::Duration::from_secs(3);
        std::fs::File::options().write(true).open(&still).unwrap().set_modified(later).unwrap();
        assert_eq!(light(&still, 0), (before + 1, 60.0));
        // A gap shows the still before it, stills rendered later join in, and a changed still is read again.
        std::fs::remove_file(folder.path().join("street.0008.png")).unwrap();
        grey("street.0010.png", 40);
        let codes = [0, 1, 2, 3, 4].map(|frame| light(&pattern, frame).1);
        assert_eq!(codes, [10.0, 10.0, 30.0, 40.0, 10.0]);
        let first = grey("street.0007.png", 70);
        let file = std::fs::File::options().write(true).open(first).unwrap();
        file.set_modified(later).unwrap();
        assert_eq!(light(&pattern, 0).1, 70.0);
        let missing = folder.path().join("none.png");
        let error = reader.read(&missing, 0, 24.0).unwrap_err().to_string();
        assert!(error.contains("none.png"), "{error}");
    }
}
