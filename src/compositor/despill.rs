//! Pass `despill`: takes out the green or blue that a coloured screen has thrown onto the subject's rim.
//! A pixel's green is limited to what the mean of its red and blue allows (the "average" rule of
//! keyers, after Vlahos, US patent 4 100 569), times what is natural for this subject: the same ratio in
//! its middle, so that green light and green clothes are no spill.

use super::background_blur::defocused;
use super::pyramid::Rgba;
use crate::imaging::{Image, Mask, color::luminance};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// How far spill reaches inwards from the matte's edge, as a share of the picture's height.
const REACH: f32 = 1.0 / 48.0;

/// A screen's colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Screen {
    Green,
    Blue,
}

/// Spill as it was measured in a subject's rim.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spill {
    /// The colour of which there is more.
    pub screen: Screen,
    /// What taking all of it out takes from the rim, as a share of the rim's luminance.
    pub excess: f32,
    /// Green (or blue) over the mean of the other two that is natural for this subject, 1 or more.
    pub natural: f32,
}

impl Screen {
    /// The channel of this colour.
    pub fn channel(self) -> usize {
        match self {
            Self::Green => 1,
            Self::Blue => 2,
        }
    }
}

/// How much each pixel belongs to the matte's rim, `[0, 1]`: 1 along its edge, 0 far inside and outside.
pub fn rim(mask: &Mask) -> Mask {
    let radius = (REACH * mask.height as f32).max(1.0);
    let open = Rgba {
        width: mask.width,
        height: mask.height,
        pixels: mask
            .pixels
            .iter()
            .map(|a| [1.0 - a, 0.0, 0.0, 0.0])
            .collect(),
    };
    let open = if open.pixels.is_empty() {
        open
    } else {
        defocused(open, radius)
    };
    let pixels = open.pixels.iter().zip(&mask.pixels);
    Mask {
        width: mask.width,
        height: mask.height,
        pixels: pixels
            .map(|(open, &alpha)| {
                if alpha > 0.0 {
                    (2.0 * open[0]).min(1.0)
                } else {
                    0.0
                }
            })
            .collect(),
    }
}

/// Measures the spill of a premultiplied subject. `rim` is as [`rim`] makes it.
pub fn spill(subject: &Image, mask: &Mask, rim: &Mask) -> Spill {
    let green = spill_of(Screen::Green, subject, mask, rim);
    let blue = spill_of(Screen::Blue, subject, mask, rim);
    if blue.excess > green.excess {
        blue
    } else {
        green
    }
}

fn spill_of(screen: Screen, subject: &Image, mask: &Mask, rim: &Mask) -> Spill {
    let channel = screen.channel();
    let pixels = || {
        let weights = mask.pixels.iter().zip(&rim.pixels);
        let finite = |p: &&[f32; 3]| p.iter().all(|v| v.is_finite());
        subject
            .pixels
            .iter()
            .zip(weights)
            .filter(move |(p, _)| finite(p))
    };
    let (mut own, mut others) = (0f64, 0f64);
    for (pixel, (&alpha, &rim)) in pixels() {
        if alpha > 0.0 && rim == 0.0 {
            own += f64::from(pixel[channel]);
            others += f64::from(mean_of_others(*pixel, channel));
        }
    }
    let natural = if own > others && others > 0.0 {
        (own / others) as f32
    } else {
        1.0
    };
    let (mut excess, mut light) = (0f64, 0f64);
    for (pixel, (_, &rim)) in pixels().filter(|(_, (_, rim))| **rim > 0.0) {
        let mut lost = [0.0; 3];
        lost[channel] = surplus(*pixel, channel, natural);
        excess += f64::from(rim * luminance(lost));
        light += f64::from(rim * luminance(*pixel));
    }
    Spill {
        screen,
        excess: if light > 0.0 {
            (excess / light) as f32
        } else {
            0.0
        },
        natural,
    }
}

/// Takes `amount` (`[0, 1]`) of the spill out of a subject, premultiplied or not.
pub fn despill(subject: &mut Image, rim: &Mask, spill: &Spill, amount: f32) {
    let channel = spill.screen.channel();
    let pairs = subject.pixels.par_iter_mut().zip(&rim.pixels);
    pairs.with_min_len(4096).for_each(|(pixel, &rim)| {
        if rim > 0.0 {
            pixel[channel] -= amount * rim * surplus(*pixel, channel, spill.natural);
        }
    });
}

fn mean_of_others(pixel: [f32; 3], channel: usize) -> f32 {
    let sum = if channel == 1 {
        pixel[0] + pixel[2]
    } else {
        pixel[0] + pixel[1]
    };
    0.5 * sum
}

/// What a pixel has of the colour beyond what is natural.
fn surplus(pixel: [f32; 3], channel: usize, natural: f32) -> f32 {
    (pixel[channel] - natural * mean_of_others(pixel, channel)).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::super::compose::tests::disc;
    use super::*;

    /// Skin before a screen whose light has reached its rim.
    fn spilt(size: usize, channel: usize, much: f32) -> (Image, Mask, Mask) {
        let mask = disc(size);
        let rim = rim(&mask);
        let mut subject = mask.map(|a| [0.5 * a, 0.35 * a, 0.3 * a]);
        for (i, pixel) in subject.pixels.iter_mut().enumerate() {
            pixel[channel] += much * rim.pixels[i] * mask.pixels[i];
        }
        (subject, mask, rim)
    }

    #[test]
    fn spill_is_measured_named_and_taken_out() {
        for (channel, screen) in [(1, Screen::Green), (2, Screen::Blue)] {
            let (mut subject, mask, rim) = spilt(96, channel, 0.3);
            let measured = spill(&subject, &mask, &rim);
            assert_eq!(measured.screen, screen);
            assert!(measured.excess > 0.01, "{measured:?}");
            let middle = subject.at(48, 48);
            despill(&mut subject, &rim, &measured, 1.0);
            assert_eq!(subject.at(48, 48), middle);
            // Within the rim, where it weighs wholly, nothing is left beyond the rule.
            for (pixel, _) in subject
                .pixels
                .iter()
                .zip(&rim.pixels)
                .filter(|(_, r)| **r == 1.0)
            {
                assert!(surplus(*pixel, channel, measured.natural) < 1e-6);
            }
        }
    }

    #[test]
    fn clean_skin_and_green_light_are_no_spill() {
        let (clean, mask, rim) = spilt(96, 1, 0.0);
        assert!(spill(&clean, &mask, &rim).excess < 1e-6);
        let green = clean.map(|[r, g, b]| [0.2 * r, g, 0.4 * b]);
        let measured = spill(&green, &mask, &rim);
        assert!(
            measured.excess < 1e-6 && measured.natural > 2.0,
            "{measured:?}"
        );
    }

    #[test]
    fn hard_mattes_and_values_are_no_spill() {
        for size in [1, 16] {
            for alpha in [0.0, 0.5, 1.0] {
                for value in [f32::NAN, f32::INFINITY, 0.0, 1e6] {
                    let mask = Mask::filled(size, size, alpha);
                    let rim = rim(&mask);
                    let mut subject = Image::filled(size, size, [value; 3]);
                    let measured = spill(&subject, &mask, &rim);
                    assert_eq!(measured.excess, 0.0);
                    despill(&mut subject, &rim, &measured, 1.0);
                }
            }
        }
        assert!(rim(&Mask::filled(0, 0, 1.0)).pixels.is_empty());
        // A matte without a rim: the subject fills the picture.
        assert!(
            rim(&Mask::filled(8, 8, 1.0))
                .pixels
                .iter()
                .all(|&r| r == 0.0)
        );
    }
}
