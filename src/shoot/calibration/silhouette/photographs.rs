//! The average of photographs of the balls by one fixed camera.

use base::error::{Error, Result};
use base::progress::Progress;
use imaging::color::unit;
use imaging::{Encoded, Raster};
use project::Picture;
use rayon::prelude::*;
use std::fmt::Display;

/// Average of photographs by one fixed camera. It takes the memory of one photograph.
///
/// Encoded values are averaged, not light: a lamp's highlight, thousands of times as bright as the rest, would
/// drown the ball's dark rim.
#[derive(Clone, Debug)]
pub struct Photographs {
    average: Raster<[f32; 3]>,
    count: usize,
    /// Name of the first photograph, for messages.
    first: String,
}

/// Number of photographs decoded at once, at twelve bytes per pixel.
const AT_ONCE: usize = 4;
/// Black level on a scale of 0 to 1 (two 8-bit code values).
const BLACK: f32 = 2.5 / 255.0;
/// Clipping level: the highest 8-bit code value, and values that round to it.
const CLIPPED: f32 = 254.5 / 255.0;

impl Photographs {
    /// Starts from one photograph; `name` (its file) appears in messages.
    ///
    /// # Errors
    /// When the picture is too small to show a ball.
    pub fn one(name: impl Display, picture: &Encoded) -> Result<Self> {
        let (width, height) = picture.0.size();
        if width < 16 || height < 16 || picture.0.pixels.len() != width * height {
            return Err(Error::invalid(
                format!("{} has {width} × {height} pixels, fewer than 16 × 16", name),
                "Use the mirror ball's photographs at their full size",
            ));
        }
        Ok(Self { average: picture.0.map(|pixel| pixel.map(unit)), count: 1, first: name.to_string() })
    }

    /// Adds a photograph by the same camera.
    ///
    /// # Errors
    /// When its size differs from the others'.
    pub fn add(&mut self, name: impl Display, picture: &Encoded) -> Result<()> {
        let first = (self.first.as_str(), self.average.size());
        same_size((name, picture.0.size()), first)?;
        self.count += 1;
        let share = 1.0 / self.count as f32;
        self.average.pixels.par_iter_mut().with_min_len(1 << 14).zip(&picture.0.pixels).for_each(|(mean, pixel)| {
            for (mean, value) in mean.iter_mut().zip(pixel) {
                *mean += share * (unit(*value) - *mean);
            }
        });
        Ok(())
    }

    /// Reads and averages photographs, a few at a time.
    ///
    /// # Errors
    /// When there are none, one cannot be read or differs in size from the others, or the job was stopped.
    pub fn read(pictures: &[Picture], progress: &Progress) -> Result<Self> {
        let mut photographs: Option<Self> = None;
        for (chunk, group) in pictures.chunks(AT_ONCE).enumerate() {
            progress.check("nothing was changed")?;
            let read = group.par_iter().map(footage::read_picture).collect::<Result<Vec<_>>>()?;
            for (address, picture) in group.iter().zip(&read) {
                match &mut photographs {
                    Some(photographs) => photographs.add(address.display(), picture)?,
                    None => photographs = Some(Self::one(address.display(), picture)?),
                }
            }
            let done = chunk * AT_ONCE + group.len();
            progress.step("mirror balls", done as u64, pictures.len() as u64, "");
        }
        photographs.ok_or_else(|| {
            Error::missing(
                "no photographs of the mirror ball",
                "Choose the photographs of the ball: the interview's, and one under each lamp",
            )
        })
    }

    /// Averaged picture, encoded, in `[0, 1]`, for display behind the circle.
    pub fn average(&self) -> &Raster<[f32; 3]> {
        &self.average
    }

    /// The photographs' name in messages.
    pub(super) fn place(&self) -> String {
        match self.count {
            1 => self.first.clone(),
            more => format!("{} and {} other photographs", self.first, more - 1),
        }
    }

    /// Smallest change of the average that can be a rim: two thirds of an 8-bit code value (the measured part of a
    /// full edge), less if noise in many photographs dithers smaller ones. Fainter steps are contours of smooth
    /// light, where one channel's code value changes before the others'.
    pub(super) fn faintest_step(&self) -> f64 {
        2.0 / 3.0 / 255.0 / (self.count as f64).sqrt()
    }

    /// Refuses photographs that are black or clipped everywhere.
    pub(super) fn check_exposure(&self) -> Result<()> {
        let values = || self.average.pixels.iter().flatten().copied();
        // In an average of n photographs, a highlight in one of them is n times fainter.
        let brightest = self.count as f32 * values().fold(0.0, f32::max);
        let darkest = values().fold(1.0, f32::min);
        let (found, remedy) = if brightest < BLACK {
            ("black everywhere", "Photograph the ball with more light or a longer exposure")
        } else if darkest >= CLIPPED {
            ("clipped to white everywhere", "Photograph the ball with a denser filter or a shorter exposure")
        } else {
            return Ok(());
        };
        Err(Error::invalid(format!("{}: no mirror ball visible; the picture is {found}", self.place()), remedy))
    }
}

/// Refuses a photograph that differs in size from the `first` by the same camera.
///
/// # Errors
/// When the sizes differ.
pub(crate) fn same_size(
    (picture, size): (impl Display, (usize, usize)),
    (first, expected): (impl Display, (usize, usize)),
) -> Result<()> {
    if size == expected {
        return Ok(());
    }
    Err(Error::other_size(
        (picture, size),
        (first, expected),
        "Use uncropped photographs of the mirror ball from one camera",
    ))
}
