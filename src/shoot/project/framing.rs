//! Square crop of a shoot's pictures.

use base::error::{Error, Result};
use serde::{Deserialize, Serialize};

/// A square crop of pictures of one size, in their pixels. Padded beyond their edges.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Framing {
    /// Columns and rows of the pictures.
    pub source: [usize; 2],
    /// Left edge of the square, in pixels from the pictures' left edge.
    pub x: i32,
    /// Upper edge of the square, in pixels from the pictures' upper edge.
    pub y: i32,
    /// Side of the square in pixels.
    pub side: usize,
    /// Fill beyond the pictures' edges. The matte is always empty there.
    #[serde(default)]
    pub padding: Padding,
}

/// Fill of a picture beyond its edges.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Padding {
    /// Black.
    #[default]
    Black,
    /// The nearest pixel on the edge.
    Edge,
}

impl Padding {
    /// All paddings.
    pub const ALL: [Self; 2] = [Self::Black, Self::Edge];

    /// Name in sentences.
    pub fn name(self) -> &'static str {
        match self {
            Self::Black => "black",
            Self::Edge => "edge",
        }
    }
}

impl Framing {
    /// The largest square in the middle of pictures of `width × height` pixels.
    pub fn largest((width, height): (usize, usize)) -> Self {
        Self::centred((width, height), width.min(height))
    }

    /// The smallest square that contains pictures of `width × height` pixels.
    pub fn whole((width, height): (usize, usize)) -> Self {
        Self::centred((width, height), width.max(height))
    }

    fn centred((width, height): (usize, usize), side: usize) -> Self {
        let middle = |length: usize| {
            let free = (length.min(LONGEST_SIDE) as i32) - (side.min(LONGEST_SIDE) as i32);
            free.div_euclid(2)
        };
        Self { source: [width, height], x: middle(width), y: middle(height), side, padding: Padding::default() }
    }

    /// The same square of the same pictures at another resolution; None if its edges fall inside pixels there.
    #[must_use]
    pub fn scaled(&self, (width, height): (usize, usize)) -> Option<Self> {
        let [from, _] = self.source.map(|length| length as i64);
        let scaled = |length: i64| {
            let length = length * width as i64;
            (length % from == 0).then(|| length / from)
        };
        Some(Self {
            source: [width, height],
            x: i32::try_from(scaled(self.x.into())?).ok()?,
            y: i32::try_from(scaled(self.y.into())?).ok()?,
            side: usize::try_from(scaled(self.side as i64)?).ok()?,
            ..*self
        })
    }

    /// The square moved and resized so that [`Self::check`] passes; the source is unchanged.
    pub fn bounded(self) -> Self {
        let [width, height] = self.source.map(|length| length.clamp(1, LONGEST_SIDE));
        let side = self.side.clamp(1, MAX_SIDES * width.max(height));
        let within = |at: i32, length: usize| at.clamp(1 - side as i32, length as i32 - 1);
        Self { x: within(self.x, width), y: within(self.y, height), side, ..self }
    }

    /// Rejects a square that shows no part of the pictures, or is far larger than they are.
    ///
    /// # Errors
    /// When the square does not fit.
    pub fn check(&self) -> Result<()> {
        let is_picture = |length: &usize| (1..=LONGEST_SIDE).contains(length);
        if *self == self.bounded() && self.source.iter().all(is_picture) {
            return Ok(());
        }
        let [width, height] = self.source;
        Err(Error::invalid(
            format!(
                "the framing, {} pixels from {}, {}, does not fit a picture of {width} × {height} pixels: it must show \
                 a part of it and be at most {MAX_SIDES} times as large",
                self.side, self.x, self.y
            ),
            "Correct `framing` in project.toml, whose `source` is the picture's size, up to a million on each side, or remove it to use the largest square in the middle",
        ))
    }
}

/// Longest side of a picture in pixels.
const LONGEST_SIDE: usize = 1 << 20;
/// Largest side of a square, as a multiple of the pictures' longer side.
const MAX_SIDES: usize = 4;

/// The framings of a project: at most one per picture size.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Framings(Vec<Framing>);

impl Framings {
    /// The framing of pictures of `width × height` pixels: the chosen one, or the largest square in the middle.
    pub fn for_size(&self, size: (usize, usize)) -> Framing {
        let chosen = self.0.iter().find(|framing| framing.source == [size.0, size.1]);
        chosen.copied().unwrap_or_else(|| Framing::largest(size))
    }

    /// Sets the framing for pictures of its size.
    pub fn set(&mut self, framing: Framing) {
        let [width, height] = framing.source;
        self.0.retain(|one| one.source != framing.source);
        if framing != Framing::largest((width, height)) {
            self.0.push(framing);
        }
    }

    /// True if no framing was chosen.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Checks every framing, see [`Framing::check`].
    ///
    /// # Errors
    /// When a framing does not fit its pictures.
    pub fn check(&self) -> Result<()> {
        self.0.iter().try_for_each(Framing::check)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_size_has_its_framing_and_the_plain_one_is_not_kept() {
        let mut framings = Framings::default();
        let wide = Framing { x: 100, padding: Padding::Edge, ..Framing::whole((1920, 1080)) };
        assert_eq!((wide.y, wide.side), (-420, 1920));
        framings.set(wide);
        assert_eq!(framings.for_size((1920, 1080)), wide);
        assert_eq!(framings.for_size((58, 32)), Framing::largest((58, 32)));
        let text = toml::to_string(&Kept { framing: framings.clone() }).unwrap();
        assert!(text.starts_with("[[framing]]"), "{text}");
        assert_eq!(toml::from_str::<Kept>(&text).unwrap().framing, framings);
        framings.set(Framing::largest((1920, 1080)));
        assert!(framings.is_empty());
    }

    #[test]
    fn a_square_is_the_same_at_another_resolution_if_its_edges_fall_between_pixels() {
        let portrait = Framing::whole((540, 960));
        assert_eq!((portrait.x, portrait.y, portrait.side), (-210, 0, 960));
        assert_eq!(portrait.scaled((180, 320)), Some(Framing::whole((180, 320))));
        assert_eq!(portrait.scaled((540, 960)), Some(portrait));
        assert_eq!(portrait.scaled((135, 240)), None);
    }

    #[derive(Serialize, Deserialize)]
    struct Kept {
        framing: Framings,
    }

    #[test]
    fn a_square_beside_the_picture_is_refused_and_brought_back() {
        let good = Framing::largest((40, 30));
        good.check().unwrap();
        for bad in [
            Framing { x: 40, ..good },
            Framing { y: -30, ..good },
            Framing { side: 0, ..good },
            Framing { side: 161, ..good },
            Framing { x: i32::MIN, ..good },
            Framing { side: usize::MAX, ..good },
        ] {
            assert!(bad.check().is_err(), "{bad:?}");
            bad.bounded().check().unwrap();
        }
        for source in [[1 << 62, 1], [usize::MAX; 2], [0, 1]] {
            let bad = Framing { source, ..good };
            let said = bad.check().unwrap_err().to_string();
            assert!(said.contains("project.toml"), "{said}");
            bad.bounded();
            Framing::largest((source[0], source[1]));
            Framing::whole((source[0], source[1]));
        }
        test_support::shown!(Strangers, "`framing` in project.toml for pictures of 2^62 pixels", done: "refused, with the largest size");
        Framing { x: -29, y: 29, ..good }.check().unwrap();
    }
}
