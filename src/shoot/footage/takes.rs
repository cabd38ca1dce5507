//! Poses and mirror balls as movies: the frame of each lamp.

use super::round::{self, Round};
use base::error::{Error, Result};
use base::progress::Progress;
use imaging::Raster;
use imaging::color::{linear_from_srgb, luminance};
use imaging::resample::resize_area;
use movies::{Series, Source};
use project::Take;
use std::collections::{BTreeMap, HashMap};
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A movie or sequence of a lamp cycle.
#[derive(Clone, Debug, Default)]
pub struct Rounds {
    /// Path of the movie, relative to the shoot's folder.
    pub movie: PathBuf,
    /// First and last frame; `None` for all.
    pub range: Option<[u64; 2]>,
    /// Frame of each single lamp, in lamp order; empty if unknown.
    pub lamps: Vec<u64>,
    /// Fully lit frames; empty if unknown.
    pub tracking: Vec<u64>,
}

impl Rounds {
    /// All frames of a movie.
    pub fn from_movie(movie: impl Into<PathBuf>) -> Self {
        Self { movie: movie.into(), ..Self::default() }
    }

    /// The same frames by the pattern of a folder's series, unless frames are given: those count all pictures of the
    /// folder.
    ///
    /// # Errors
    /// When the folder cannot be read or holds several series.
    pub fn with_series(self, shoot: &Path, progress: &Progress) -> Result<Self> {
        if self.range.is_some() || !self.lamps.is_empty() || !self.tracking.is_empty() {
            return Ok(self);
        }
        Ok(Self { movie: series_path(shoot, &self.movie, progress)?, ..self })
    }

    /// Finds the lamps' frames; reads all frames unless they are known. `expected` is the number of lamps, if
    /// known, and `names` are their names. Pictures of exactly these names are the lamps', in whatever order they are.
    ///
    /// # Errors
    /// When the movie cannot be read, the frames do not exist, or the number of lamps differs.
    pub fn find(
        &self,
        shoot: &Path,
        expected: Option<usize>,
        names: &[String],
        progress: &Progress,
    ) -> Result<(Round, Arc<Source>)> {
        let path = shoot.join(&self.movie);
        let source = movies::open(&path)?;
        let refuse = |why: String| {
            Error::invalid(
                format!("{}: {why}", path.display()),
                (
                    "Give the frames of the lamps in a TOML map: `frames`, or `lamps` frame by frame",
                    "afterlight import --help",
                ),
            )
        };
        let (first, count) = (source.first(), source.count()?);
        let end = first + count.saturating_sub(1);
        let [start, last] = self.range.unwrap_or([first, end]);
        let mut named = self.lamps.iter().chain(&self.tracking).chain([&start, &last]);
        if let Some(beyond) = named.find(|&&frame| frame < first || frame > end) {
            return Err(refuse(format!("no frame {beyond}: the movie has frames {first} to {end}")));
        }
        if !self.lamps.is_empty() {
            if let Some(lamps) = expected.filter(|&lamps| lamps != self.lamps.len()) {
                return Err(refuse(format!("{} frames for {lamps} lamps", self.lamps.len())));
            }
            let round = Round { lamps: self.lamps.clone(), tracking: self.tracking.clone() };
            return Ok((round, source));
        }
        if start > last || last - start >= MOST_SEARCHED {
            return Err(refuse(format!("frames {start} to {last} are empty or too many to search for lamps")));
        }
        let mut light = Vec::new();
        for frame in start..=last {
            progress.check("no project was made")?;
            let name = self.movie.display().to_string();
            progress.step("looking for lamps", frame - start + 1, last - start + 1, name);
            light.push(mean_light(&source, frame)?);
        }
        let found = round::find(&light, start, expected);
        let mut round = match named_frames(&source, start..=last, names) {
            Some(lamps) => {
                let mut tracking = found.map_or(vec![], |round| round.tracking);
                tracking.retain(|frame| !lamps.contains(frame));
                Round { lamps, tracking }
            }
            None => found.map_err(refuse)?,
        };
        if !self.tracking.is_empty() {
            round.tracking.clone_from(&self.tracking);
        }
        Ok((round, source))
    }

    /// Take of a movie with these lamps found in it.
    pub fn take(&self, (round, source): (Round, Arc<Source>), lamps: &[String]) -> Take {
        Take {
            movie: self.movie.clone(),
            alpha: source.has_alpha(),
            tracking: round.tracking,
            lamps: lamps.iter().cloned().zip(round.lamps).collect::<BTreeMap<_, _>>(),
        }
    }
}

/// Frame of each name in a sequence whose pictures have these names; `None` if it lacks one, for a movie, and without
/// names.
fn named_frames(source: &Source, frames: RangeInclusive<u64>, names: &[String]) -> Option<Vec<u64>> {
    let Source::Sequence(sequence) = source else { return None };
    let named = |frame| Some((sequence.file(frame)?.file_stem()?.to_str()?.to_owned(), frame));
    let frames: HashMap<String, u64> = frames.filter_map(named).collect();
    let found: Vec<u64> = names.iter().map(|name| frames.get(name).copied()).collect::<Option<_>>()?;
    (!found.is_empty()).then_some(found)
}

/// The address of a movie, or of the series in a folder, relative to the shoot's folder. Reports pictures beside the
/// series.
///
/// # Errors
/// When the folder cannot be read or holds several series.
pub(super) fn series_path(shoot: &Path, movie: &Path, progress: &Progress) -> Result<PathBuf> {
    let folder = shoot.join(movie);
    if !folder.is_dir() {
        return Ok(movie.to_path_buf());
    }
    let series = Series::find(&folder)?;
    series.left_out_note().into_iter().for_each(|note| progress.say(note));
    Ok(series.pattern.map_or_else(|| movie.to_path_buf(), |pattern| movie.join(pattern)))
}

/// Largest number of frames searched in one movie. A cycle takes seconds.
const MOST_SEARCHED: u64 = 100_000;

/// Light of a frame, linear, assuming sRGB encoding.
pub(super) struct FrameLight {
    /// Mean of every third pixel of every third row.
    pub mean: f32,
    /// Middle of the brightest spot, as shares of the longer side, from the upper left corner; `None` for a frame without
    /// a spot that is much brighter than the rest.
    pub spot: Option<[f32; 2]>,
}

/// Smallest ratio of the brightest spot to the mean of its frame.
const SPOT: f32 = 4.0;
/// Number of spots along the longer side.
const SPOTS: usize = 128;

/// The mean light of a frame, and its brightest spot.
pub(super) fn frame_light(source: &Source, frame: u64) -> Result<FrameLight> {
    let picture = source.frame(frame)?.encoded().0;
    let mean = mean_luminance(&picture);
    let (width, height) = picture.size();
    let longer = width.max(height);
    let side = |side: usize| (side * SPOTS.min(longer) / longer).max(1);
    let light = picture.map(|pixel| luminance(pixel.map(linear_from_srgb)));
    let small = resize_area(&light, side(width), side(height));
    let brightest = small.pixels.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1));
    let spot = brightest.filter(|&(_, &most)| most > SPOT * mean).map(|(i, _)| {
        let at = [i % small.width, i / small.width];
        at.map(|cell| (cell as f32 + 0.5) / SPOTS.min(longer) as f32)
    });
    Ok(FrameLight { mean, spot })
}

/// Mean linear light of a frame, assuming sRGB encoding.
pub(super) fn mean_light(source: &Source, frame: u64) -> Result<f32> {
    Ok(mean_luminance(&source.frame(frame)?.encoded().0))
}

fn mean_luminance(picture: &Raster<[f32; 3]>) -> f32 {
    // Every third pixel of every third row is enough.
    let (width, height) = picture.size();
    let rows = (0..height).step_by(3).flat_map(|y| (0..width).step_by(3).map(move |x| (x, y)));
    let (mut sum, mut count) = (0.0, 0);
    for (x, y) in rows {
        sum += f64::from(luminance(picture.at(x, y).map(linear_from_srgb)));
        count += 1;
    }
    (sum / f64::from(count.max(1))) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use imaging::Encoded;

    #[test]
    fn pictures_are_matched_with_a_list_by_name_and_not_by_place() {
        let folder = tempfile::tempdir().unwrap();
        // Fully lit before and after, in the order of the names; one lamp leaves the subject dark.
        for (name, level) in [("a_all", 0.9), ("back", 0.3), ("key", 0.0), ("rim", 0.4), ("z_all", 0.9)] {
            let path = folder.path().join("pose").join(format!("{name}.png"));
            imaging::file::write_png(&path, &Encoded(Raster::filled(4, 4, [level; 3]))).unwrap();
        }
        let find = |names: &[&str]| {
            let names: Vec<String> = names.iter().map(|&name| name.to_owned()).collect();
            let found = Rounds::from_movie("pose").find(folder.path(), Some(names.len()), &names, &Progress::silent());
            found.map(|(round, _)| (round.lamps, round.tracking)).map_err(|e| e.to_string())
        };
        for (names, lamps) in [
            (["rim", "key", "back"], [3, 2, 1]),
            (["back", "key", "rim"], [1, 2, 3]),
            (["key", "rim", "back"], [2, 3, 1]),
            // One of them is no picture: the order counts.
            (["rim", "key", "top"], [1, 2, 3]),
        ] {
            let (found, tracking) = find(&names).unwrap();
            assert_eq!(found, lamps, "{names:?}");
            assert_eq!(tracking, [0, 4], "{names:?}");
        }
        assert!(find(&["a", "b", "c", "d"]).unwrap_err().contains("4 lamps"));
    }
}
