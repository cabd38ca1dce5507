//! A panorama file while it is read: its shape, the canvas for its pixels, and notes about it.

use super::canvas::Canvas;
use crate::environment::Environment;
use crate::mapping::{self, Mapping};
use base::error::{Error, Result};
use imaging::file;
use imaging::picture::{About, Coding, Sink};
use std::path::Path;

/// Settings for reading a panorama file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReadSettings {
    /// Largest width in columns, at least 2; wider panoramas are reduced to it.
    pub width: usize,
    /// Mapping of the picture. With `None`, a picture of about 2:1 or wider is a lat-long, a square is an error,
    /// and any other shape is stretched over the sphere, with a note.
    pub mapping: Option<Mapping>,
}

impl Default for ReadSettings {
    /// 4096 columns, 100 MB: 0.09° a texel, sharper than any lamp's shadow, and enough for a background out of
    /// focus.
    fn default() -> Self {
        Self { width: 4096, mapping: None }
    }
}

/// An environment and notes about reading it.
#[derive(Clone, Debug)]
pub struct Panorama {
    pub environment: Environment,
    /// Width and height of the file.
    pub file_size: (usize, usize),
    /// Notes about guesses, repairs, clipping and omissions; empty for an ordinary panorama.
    pub notes: Vec<String>,
}

/// A file while it is read.
pub(super) struct PanoramaReader<'a> {
    path: &'a Path,
    settings: &'a ReadSettings,
    notes: Vec<String>,
    /// Width and height of the file.
    size: (usize, usize),
    /// The canvas, and how many rows of the sphere are above the picture.
    canvas: Option<(Canvas, usize)>,
    coding: Coding,
    bits: u8,
    /// Light below zero is from other primaries, not damage.
    is_converted: bool,
    /// Pixels with a channel at the highest code.
    clipped: usize,
    row: Vec<[f32; 3]>,
}

impl Sink for PanoramaReader<'_> {
    fn begin(&mut self, about: &About) -> Result<bool> {
        self.notes.clone_from(&about.notes);
        self.coding = about.coding.clone();
        (self.bits, self.is_converted) = (about.bits, about.is_converted);
        let (mut canvas, top) = self.canvas(about.size)?;
        // Missing parts are black, not a continuation of the edge.
        canvas.extend &= about.is_whole;
        self.canvas = Some((canvas, top));
        Ok(true)
    }

    fn run(&mut self, x: usize, y: usize, light: &[[f32; 3]], _: &[f32]) {
        let Some((canvas, top)) = &mut self.canvas else { return };
        if !matches!(self.coding, Coding::Light(_)) {
            let is_clipped = |texel: &&[f32; 3]| texel.iter().any(|v| *v >= 0.999_99);
            self.clipped += light.iter().filter(is_clipped).count();
        }
        if self.is_converted {
            self.row.clear();
            self.row.extend(light.iter().map(|texel| texel.map(|v| if v < 0.0 { 0.0 } else { v })));
            canvas.paint(x, *top + y, &self.row);
        } else {
            canvas.paint(x, *top + y, light);
        }
    }

    /// Some tools leave the display window of the shot that the panorama was made for.
    fn takes_data_window(&self, data: (usize, usize), display: (usize, usize)) -> bool {
        let is_panorama = |(width, height): (usize, usize)| width.abs_diff(2 * height) <= 2;
        is_panorama(data) && !is_panorama(display)
    }
}

impl<'a> PanoramaReader<'a> {
    pub fn new(path: &'a Path, settings: &'a ReadSettings) -> Self {
        Self {
            path,
            settings,
            notes: Vec::new(),
            size: (0, 0),
            canvas: None,
            coding: Coding::Open,
            bits: 0,
            is_converted: false,
            clipped: 0,
            row: Vec::new(),
        }
    }

    /// Canvas for the picture's light, and the number of the sphere's rows above the picture.
    fn canvas(&mut self, size: (usize, usize)) -> Result<(Canvas, usize)> {
        let (width, height) = size;
        self.size = size;
        let texels = width.saturating_mul(height);
        if texels == 0 || texels > 1 << 32 || width.max(height) > 1 << 20 {
            return Err(Error::invalid(
                format!(
                    "{} has {width} × {height} pixels; the limit is a million on each side and \
                     65536 × 65536 in total",
                    self.path.display()
                ),
                "Check the file or reduce it",
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
                format!("{} is square, {width}×{height} pixels; a lat-long panorama is 2:1", self.path.display()),
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
                "{width}×{height} pixels are wider than 2:1 and are read as a strip around the horizon, \
                 {:.0}° in height. Above and below it the edge's mean colour continues.{other}",
                360.0 * height as f64 / width as f64
            ));
            let mut canvas = self.lat_long(full)?;
            canvas.extend = true;
            return Ok((canvas, (full.1 - height) / 2));
        }
        self.notes.push(format!("{width}×{height} pixels are not 2:1 and are stretched over the whole sphere.{other}"));
        Ok((self.lat_long(size)?, 0))
    }

    fn lat_long(&self, size: (usize, usize)) -> Result<Canvas> {
        let most = self.settings.width.max(2);
        self.check_kept(Canvas::kept(size, most))?;
        Ok(Canvas::lat_long(size, most))
    }

    /// Refuses a canvas larger than [`file::MAX_PIXELS`] before any memory is allocated.
    fn check_kept(&self, (width, height): (usize, usize)) -> Result<()> {
        let [columns, rows] = [self.size.0, self.size.1];
        if width.saturating_mul(height) <= file::MAX_PIXELS {
            return Ok(());
        }
        Err(Error::invalid(
            format!(
                "{} has {columns} × {rows} pixels and needs {width} × {height} in memory at once; the limit is \
                 {} pixels",
                self.path.display(),
                file::MAX_PIXELS
            ),
            "Check the file or reduce it",
        ))
    }

    pub fn finish(mut self) -> Result<Panorama> {
        let canvas = self.canvas.take().map_or_else(|| Canvas::whole((1, 1)), |(canvas, _)| canvas);
        let curve = match &self.coding {
            Coding::Light(_) => None,
            Coding::Named(origin) => Some(origin.name.as_str()),
            Coding::Open => Some("sRGB"),
        };
        if let Some(curve) = curve {
            self.notes.push(format!(
                "{} bits per channel cannot hold bright lights: the file was linearised from {curve}, and {:.1} % of its \
                 pixels are clipped. Its suns and lamps are too dark; place lights by hand there.",
                self.bits,
                100.0 * self.clipped as f64 / (self.size.0 * self.size.1).max(1) as f64
            ));
        }
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
                "{} pixels were NaN, infinite or negative; repaired from their neighbours.",
                environment.repaired_texels
            ));
        }
        Ok(Panorama { environment, file_size: self.size, notes: self.notes })
    }
}
