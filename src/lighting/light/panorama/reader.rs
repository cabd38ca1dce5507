//! A panorama file while it is read: its shape, the canvas for its pixels, and what to say about it.

use super::canvas::Canvas;
use crate::environment::Environment;
use crate::mapping::{self, Mapping};
use base::error::{Error, Result};
use imaging::file;
use std::path::Path;

/// Settings for reading a panorama file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReadSettings {
    /// The most columns, at least 2: a wider panorama is averaged down to them.
    pub width: usize,
    /// The picture's mapping. With `None`, a picture of about 2:1 or wider is a lat-long, a square is refused, and
    /// anything else is stretched over the sphere, with a note.
    pub mapping: Option<Mapping>,
}

impl Default for ReadSettings {
    /// 4096 columns, 100 MB of light: 0.09° a texel, sharper than any lamp's shadow, and enough for a background
    /// out of focus.
    fn default() -> Self {
        Self { width: 4096, mapping: None }
    }
}

/// An environment, and notes about how it was read.
#[derive(Clone, Debug)]
pub struct Panorama {
    pub environment: Environment,
    /// Columns and rows of the file.
    pub file_size: (usize, usize),
    /// Sentences about guesses, repairs, and what is clipped or left out; empty for an ordinary panorama.
    pub notes: Vec<String>,
}

/// Advice about a file that ends early or is damaged.
pub(super) const COMPLETE: &str = "Check that the file exists and is a complete picture";

/// A file that is being read.
pub(super) struct PanoramaReader<'a> {
    pub path: &'a Path,
    settings: &'a ReadSettings,
    pub notes: Vec<String>,
    /// Columns and rows of the file.
    size: (usize, usize),
}

impl<'a> PanoramaReader<'a> {
    pub fn new(path: &'a Path, settings: &'a ReadSettings) -> Self {
        Self { path, settings, notes: Vec::new(), size: (0, 0) }
    }

    /// The error of a damaged file.
    pub fn broken(&self, cause: impl std::fmt::Display) -> Error {
        Error::codec("read", self.path, cause, COMPLETE)
    }

    /// The canvas for the picture's light, and how many rows of the sphere are above the picture.
    pub fn canvas(&mut self, size: (usize, usize)) -> Result<(Canvas, usize)> {
        let (width, height) = size;
        self.size = size;
        let texels = width.saturating_mul(height);
        if texels == 0 || texels > 1 << 32 || width.max(height) > 1 << 20 {
            return Err(Error::invalid(
                format!(
                    "{} has {width} × {height} pixels; a panorama may have up to a million on each side, and \
                     65536 × 65536 in total",
                    self.path.display()
                ),
                "Check the file, or make it smaller",
            ));
        }
        match self.settings.mapping {
            Some(Mapping::LatLong) => return Ok((self.lat_long(size)?, 0)),
            Some(mapping) => {
                mapping.projection(size)?;
                self.check_kept(size)?;
                return Ok((Canvas::whole(size), 0));
            }
            None if width.abs_diff(2 * height) <= 2.max(width / 100) => {
                return Ok((self.lat_long(size)?, 0));
            }
            None => {}
        }
        if width == height {
            return Err(Error::invalid(
                format!(
                    "{} is a square of {width}×{height} pixels; a lat-long panorama is twice as wide as high",
                    self.path.display()
                ),
                "Choose mirror ball or angular map (light probe) as its mapping, or convert it to a lat-long",
            ));
        }
        let other = match (3 * width == 4 * height, width == 6 * height) {
            (true, _) => " If it is a cube cross, choose that mapping.",
            (_, true) => " If it is a cube strip (six faces side by side), choose that mapping.",
            _ => "",
        };
        if width > 2 * height {
            let full = (width, width / 2);
            self.notes.push(format!(
                "{width}×{height} pixels are wider than 2:1, so they are taken for a strip around the horizon, \
                 {:.0}° in height. Above and below it the edge's mean colour continues.{other}",
                360.0 * height as f64 / width as f64
            ));
            let mut canvas = self.lat_long(full)?;
            canvas.extend = true;
            return Ok((canvas, (full.1 - height) / 2));
        }
        self.notes.push(format!(
            "{width}×{height} pixels are not 2:1, so they are stretched over the whole sphere.{other}"
        ));
        Ok((self.lat_long(size)?, 0))
    }

    fn lat_long(&self, size: (usize, usize)) -> Result<Canvas> {
        let most = self.settings.width.max(2);
        self.check_kept(Canvas::kept(size, most))?;
        Ok(Canvas::lat_long(size, most))
    }

    /// Refuses to keep more light than [`file::MAX_PIXELS`], before any memory is taken.
    fn check_kept(&self, (width, height): (usize, usize)) -> Result<()> {
        let [columns, rows] = [self.size.0, self.size.1];
        if width.saturating_mul(height) <= file::MAX_PIXELS {
            return Ok(());
        }
        Err(Error::invalid(
            format!(
                "{} has {columns} × {rows} pixels, of which {width} × {height} would have to be kept at once; at most \
                 {} can be",
                self.path.display(),
                file::MAX_PIXELS
            ),
            "Check the file, or make it smaller",
        ))
    }

    pub fn finish(mut self, canvas: Canvas) -> Result<Panorama> {
        let name = self.path.file_stem().unwrap_or(self.path.as_os_str());
        let mut environment = canvas.finish(&name.to_string_lossy());
        if let Some(from) = self.settings.mapping.filter(|m| *m != Mapping::LatLong) {
            let width = (2 * environment.radiance.height).min(self.settings.width.max(2));
            let to = (width, (width / 2).max(1));
            let sphere = mapping::convert(&environment.radiance, from, Mapping::LatLong, to)?;
            environment.radiance = sphere.image;
        }
        if environment.repaired_texels > 0 {
            self.notes.push(format!(
                "{} pixels were NaN, infinite or negative and have been repaired.",
                environment.repaired_texels
            ));
        }
        Ok(Panorama { environment, file_size: self.size, notes: self.notes })
    }
}
