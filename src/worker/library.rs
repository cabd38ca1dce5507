//! Reads panoramas beside the window's thread, one after the other, and makes their thumbnails.

use super::latest::doorbell;
use base::error::Result;
use base::progress::Control;
use glam::Quat;
use imaging::Image;
use imaging::color::{byte_from_unit, luminance, srgb_from_linear};
use imaging::resample::resize_area;
use light::brightest::{self, Area};
use light::built_in::BuiltIn;
use light::panorama::{self, ReadSettings};
use light::{Environment, latlong};
use std::collections::VecDeque;
use std::fmt;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

/// Panoramas that have been read and not been taken yet.
const MOST_WAITING: usize = 4;

/// Where a panorama comes from.
#[derive(Clone, Debug)]
pub enum Origin {
    File(PathBuf),
    BuiltIn(&'static BuiltIn),
}

impl PartialEq for Origin {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::File(a), Self::File(b)) => a == b,
            (Self::BuiltIn(a), Self::BuiltIn(b)) => a.name == b.name,
            _ => false,
        }
    }
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::File(path) => write!(f, "{}", path.display()),
            Self::BuiltIn(own) => f.write_str(own.describe),
        }
    }
}

/// A panorama as the window wants it.
#[derive(Clone, Debug)]
pub struct Panorama {
    pub environment: Arc<Environment>,
    pub thumbnail: Thumbnail,
    /// Its brightest areas, the one with most energy first.
    pub areas: Vec<Area>,
    /// What had to be guessed or mended, a sentence each.
    pub notes: Vec<String>,
}

/// A small tone-mapped picture of a panorama.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Thumbnail {
    pub width: usize,
    pub height: usize,
    /// sRGB codes, three bytes a pixel, row by row.
    pub rgb: Vec<u8>,
}

/// The reading thread. Dropping it stops it after the file in hand.
pub struct Library {
    wanted: Arc<Mutex<VecDeque<Origin>>>,
    read: Option<Receiver<(Origin, Result<Panorama>)>>,
    ring: Box<dyn Fn() + Send>,
    stop: Control,
    thread: Option<JoinHandle<()>>,
}

impl Library {
    /// Starts the thread; `wake` is called after each file.
    pub fn start(wake: impl Fn() + Send + 'static) -> Self {
        let wanted = Arc::new(Mutex::new(VecDeque::<Origin>::new()));
        let (send, read) = sync_channel(MOST_WAITING);
        let (ring, rung) = doorbell();
        let stop = Control::default();
        let (queue, stopped) = (wanted.clone(), stop.clone());
        let thread = std::thread::spawn(move || {
            while !stopped.stopped() {
                let next = queue
                    .lock()
                    .unwrap_or_else(PoisonError::into_inner)
                    .pop_front();
                let Some(source) = next else {
                    if rung.recv().is_err() {
                        break;
                    }
                    continue;
                };
                let panorama = Panorama::load(&source);
                if send.send((source, panorama)).is_err() {
                    break;
                }
                wake();
            }
        });
        Self {
            wanted,
            read: Some(read),
            ring: Box::new(ring),
            stop,
            thread: Some(thread),
        }
    }

    /// Asks for a file.
    pub fn load(&self, source: Origin) {
        self.wanted
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .push_back(source);
        (self.ring)();
    }

    /// The files that have been read since the last call, in the order in which they were asked for.
    pub fn loaded(&self) -> impl Iterator<Item = (Origin, Result<Panorama>)> {
        self.read.iter().flat_map(|read| read.try_iter())
    }
}

impl Drop for Library {
    fn drop(&mut self) {
        self.stop.stop();
        // Without a receiver, a thread that waits to hand over a panorama goes on and ends.
        drop(self.read.take());
        (self.ring)();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

impl Panorama {
    /// How many of the brightest areas are looked for.
    const AREAS: usize = 5;

    /// Reads a panorama, or makes it.
    ///
    /// # Errors
    /// When the file cannot be read or is no panorama.
    pub fn load(source: &Origin) -> Result<Self> {
        let (environment, notes) = match source {
            Origin::File(path) => {
                let read = panorama::read(path, &ReadSettings::default())?;
                (Arc::new(read.environment), read.notes)
            }
            Origin::BuiltIn(own) => (own.environment(), vec![]),
        };
        Ok(Self {
            thumbnail: Thumbnail::of(&environment.radiance),
            areas: brightest::areas(&environment, Self::AREAS),
            environment,
            notes,
        })
    }
}

impl Thumbnail {
    /// Columns of a thumbnail: sharp in a panel of 240 points on a screen of two pixels a point.
    const WIDTH: usize = 480;
    /// Columns of a turned one: few enough to be made anew at every step of a drag, in about 3 ms.
    const TURNED_WIDTH: usize = 256;

    /// A panorama of a photograph's light, as bright as the photograph: 1 is white, and noise stays dark.
    pub fn as_exposed(light: &Image) -> Self {
        Self::encoded(&Self::reduced(light), |pixel| pixel)
    }

    /// A panorama at a glance: its log-average luminance at middle grey, highlights rolled off
    /// (Reinhard et al., SIGGRAPH 2002, equations 1 to 4).
    pub fn of(radiance: &Image) -> Self {
        let small = Self::reduced(radiance);
        // Black texels say nothing about exposure; they would pull the average to nothing.
        let lit: Vec<f32> = small
            .pixels
            .iter()
            .map(|&p| luminance(p))
            .filter(|&y| y > 0.0)
            .collect();
        let log_sum: f64 = lit.iter().map(|&y| f64::from(y).ln()).sum();
        let average = (log_sum / lit.len().max(1) as f64).exp() as f32;
        let white = lit.iter().copied().fold(0.0, f32::max) * 0.18 / average;
        Self::encoded(&small, |pixel| {
            let y = luminance(pixel) * 0.18 / average;
            let shown = (1.0 + y / (white * white).max(1.0)) / (1.0 + y) * 0.18 / average;
            pixel.map(|v| v * shown)
        })
    }

    /// The same for an environment that is turned, at up to `TURNED_WIDTH` columns; see
    /// [`light::weights::rotation`].
    pub fn turned(&self, turn: Quat) -> Self {
        let codes = self.rgb.chunks_exact(3);
        let codes = Image {
            width: self.width,
            height: self.height,
            pixels: codes.map(|c| [c[0], c[1], c[2]].map(f32::from)).collect(),
        };
        let codes = Environment::from_radiance("", codes);
        let width = self.width.min(Self::TURNED_WIDTH);
        let height = (width / 2).max(1);
        let back = turn.inverse();
        // One thread, for the window waits: others may be busy with a job.
        let rgb = (0..width * height).flat_map(|i| {
            let direction = latlong::texel_direction(i % width, i / width, width, height);
            codes.radiance(back * direction).map(|v| v.round() as u8)
        });
        Self {
            width,
            height,
            rgb: rgb.collect(),
        }
    }

    fn reduced(radiance: &Image) -> Image {
        let (width, height) = (
            Self::WIDTH.min(radiance.width),
            (Self::WIDTH / 2).min(radiance.height),
        );
        resize_area(radiance, width, height)
    }

    fn encoded(small: &Image, shown: impl Fn([f32; 3]) -> [f32; 3]) -> Self {
        let codes = |pixel: &[f32; 3]| shown(*pixel).map(|v| byte_from_unit(srgb_from_linear(v)));
        Self {
            width: small.width,
            height: small.height,
            rgb: small.pixels.iter().flat_map(codes).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use light::weights::rotation;

    #[test]
    fn a_thumbnail_does_not_depend_on_the_panoramas_units() {
        let picture = Image::from_fn(64, 32, |x, y| [x as f32 / 64.0, y as f32 / 32.0, 0.3]);
        let brighter = picture.map(|p| p.map(|v| v * 1024.0));
        let (a, b) = (Thumbnail::of(&picture), Thumbnail::of(&brighter));
        let worst = a.rgb.iter().zip(&b.rgb).map(|(a, b)| a.abs_diff(*b)).max();
        assert!(worst <= Some(1), "{worst:?}");
    }

    #[test]
    fn black_panoramas_and_suns_have_thumbnails() {
        assert!(
            Thumbnail::of(&Image::filled(4, 2, [0.0; 3]))
                .rgb
                .iter()
                .all(|&v| v == 0)
        );
        let sun = Image::from_fn(64, 32, |x, y| [if (x, y) == (9, 9) { 1e6 } else { 0.5 }; 3]);
        let grey = Thumbnail::of(&sun).rgb[0];
        assert!((80..160).contains(&grey), "a sun leaves the sky at {grey}");
    }

    #[test]
    fn a_turned_thumbnail_shows_what_the_turn_brings_there() {
        let bright = |x: usize, y: usize| (96..104).contains(&x) && (60..68).contains(&y);
        let picture = Image::from_fn(256, 128, |x, y| [if bright(x, y) { 4.0 } else { 0.2 }; 3]);
        let flat = Thumbnail::of(&picture);
        let brightest = |shown: &Thumbnail| {
            let sum = |i: &usize| {
                shown.rgb[3 * i..3 * i + 3]
                    .iter()
                    .map(|&v| u32::from(v))
                    .sum::<u32>()
            };
            let i = (0..shown.width * shown.height).max_by_key(sum).unwrap();
            latlong::texel_direction(i % shown.width, i / shown.width, shown.width, shown.height)
        };
        let spot = latlong::direction_from_uv(100.0 / 256.0, 64.0 / 128.0);
        for (yaw, pitch, roll) in [(0.0, 0.0, 0.0), (70.0, 40.0, 0.0), (-20.0, -130.0, 75.0)] {
            let turn = rotation(yaw, pitch, roll);
            let seen = brightest(&flat.turned(turn));
            let off = seen.angle_between(turn * spot).to_degrees();
            // The spot is 11° across.
            assert!(off < 8.0, "{yaw}, {pitch}, {roll}: {off}° off");
        }
        assert_eq!(flat.turned(Quat::IDENTITY), flat);
    }

    #[test]
    fn files_come_back_in_order_and_broken_ones_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let good = folder.path().join("good.exr");
        imaging::file::write_exr(&good, &Image::filled(8, 4, [1.0; 3])).unwrap();
        let (wake, woken) = std::sync::mpsc::channel();
        let library = Library::start(move || wake.send(()).unwrap());
        library.load(Origin::File(folder.path().join("missing.exr")));
        library.load(Origin::File(good));
        (0..2).for_each(|_| woken.recv().unwrap());
        let loaded: Vec<_> = library.loaded().collect();
        assert!(
            loaded[0]
                .1
                .as_ref()
                .unwrap_err()
                .to_string()
                .contains("missing.exr")
        );
        assert_eq!(
            loaded[1].1.as_ref().unwrap().environment.radiance.size(),
            (8, 4)
        );
    }
}
