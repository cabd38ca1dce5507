//! Background behind the subject.

use serde::{Deserialize, Serialize};
use std::hash::{Hash, Hasher};
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Background behind the subject.
#[derive(Clone, Debug, Default, PartialEq, Hash, Serialize, Deserialize)]
pub enum Background {
    /// The environment from the interview camera's view.
    #[default]
    Environment,
    /// None: black, and zero alpha if the output has alpha.
    None,
    /// The interview's plate, as filmed.
    Plate,
    /// An even colour in sRGB codes; linear light before exposure and tone curve.
    Color([u8; 3]),
    /// Grey squares, a sixteenth of the picture's height wide.
    Checker,
    /// A still or a movie.
    File(BackgroundFile),
}

/// Still or movie behind the subject, centred and just covering the picture at scale 1. A movie starts with the interview
/// and repeats.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BackgroundFile {
    /// Still, movie, or pattern of numbered stills (`sky.%04d.exr`).
    pub file: PathBuf,
    /// Offset to the right and up, as shares of the relit picture's width and height.
    #[serde(default)]
    pub offset: [f32; 2],
    #[serde(default = "one")]
    pub scale: f32,
    /// Exposure of the background alone, in stops.
    #[serde(default)]
    pub exposure_stops: f32,
}

fn one() -> f32 {
    1.0
}

impl Default for BackgroundFile {
    fn default() -> Self {
        Self::new("")
    }
}

impl BackgroundFile {
    pub const OFFSETS: RangeInclusive<f32> = -2.0..=2.0;
    pub const SCALES: RangeInclusive<f32> = 0.1..=10.0;

    /// A file as it is: centred, at scale 1.
    pub fn new(file: impl Into<PathBuf>) -> Self {
        Self { file: file.into(), offset: [0.0; 2], scale: 1.0, exposure_stops: 0.0 }
    }

    /// Offset to the right, offset up, scale and exposure, each within its range.
    fn numbers(&self) -> [f32; 4] {
        let within = |value: f32, range: RangeInclusive<f32>, otherwise| {
            if value.is_nan() { otherwise } else { value.clamp(*range.start(), *range.end()) }
        };
        let [x, y] = self.offset.map(|share| within(share, Self::OFFSETS, 0.0));
        let scale = within(self.scale, Self::SCALES, 1.0);
        [x, y, scale, within(self.exposure_stops, super::EXPOSURE_STOPS, 0.0)]
    }

    /// The same with each number within its range; NaN becomes that of a new background.
    #[must_use]
    pub fn bounded(self) -> Self {
        let [x, y, scale, exposure_stops] = self.numbers();
        Self { offset: [x, y], scale, exposure_stops, ..self }
    }
}

impl Hash for BackgroundFile {
    fn hash<H: Hasher>(&self, state: &mut H) {
        let Self { file, offset: [x, y], scale, exposure_stops } = self;
        file.hash(state);
        [x, y, scale, exposure_stops].map(|value| value.to_bits()).hash(state);
    }
}

impl Background {
    /// The file of a still or movie.
    pub fn file(&self) -> Option<&Path> {
        match self {
            Self::File(placed) => Some(&placed.file),
            _ => None,
        }
    }

    /// The same with the numbers of a file within their ranges.
    #[must_use]
    pub fn bounded(self) -> Self {
        match self {
            Self::File(placed) => Self::File(placed.bounded()),
            other => other,
        }
    }

    /// The same with another file, if it has one.
    #[must_use]
    pub fn with_file(self, file: impl Into<PathBuf>) -> Self {
        match self {
            Self::File(placed) => Self::File(BackgroundFile { file: file.into(), ..placed }),
            other => other,
        }
    }
}

impl FromStr for Background {
    type Err = String;

    /// `environment`, `none`, `plate`, `checker`, a colour `#RRGGBB`, or `FILE[,X,Y[,SCALE[,STOPS]]]`: a file's name has a dot.
    fn from_str(text: &str) -> Result<Self, String> {
        let code = |digits: &str| u8::from_str_radix(digits, 16).ok();
        let color = text.strip_prefix('#').filter(|hex| hex.len() == 6 && hex.is_ascii());
        let color = color.and_then(|hex| Some([code(&hex[..2])?, code(&hex[2..4])?, code(&hex[4..])?]));
        match (text, color) {
            (_, Some(color)) => Ok(Self::Color(color)),
            ("environment", _) => Ok(Self::Environment),
            ("none", _) => Ok(Self::None),
            ("plate", _) => Ok(Self::Plate),
            ("checker", _) => Ok(Self::Checker),
            _ if text.contains(['.', '/', '\\']) => file(text).map(Self::File),
            _ => Err(format!(
                "expected environment, plate, checker, none, a colour such as #1a2b3c or a file, found {text:?}"
            )),
        }
    }
}

/// Reads `FILE[,X,Y[,SCALE[,STOPS]]]`. The file's name may contain commas.
fn file(text: &str) -> Result<BackgroundFile, String> {
    let mut numbers = Vec::new();
    let mut name = text;
    while let Some((before, last)) = name.rsplit_once(',')
        && let Ok(number) = last.trim().parse::<f32>()
    {
        numbers.insert(0, number);
        name = before;
    }
    let placed = BackgroundFile::new(name);
    let placed = match numbers[..] {
        [] => placed,
        [x, y] => BackgroundFile { offset: [x, y], ..placed },
        [x, y, scale] => BackgroundFile { offset: [x, y], scale, ..placed },
        [x, y, scale, exposure_stops] => BackgroundFile { offset: [x, y], scale, exposure_stops, ..placed },
        _ => {
            return Err(format!("expected FILE, FILE,X,Y, FILE,X,Y,SCALE or FILE,X,Y,SCALE,STOPS, found {text:?}"));
        }
    };
    if placed.clone().bounded() == placed {
        Ok(placed)
    } else {
        Err(format!(
            "expected offsets from -2 to 2, a scale from 0.1 to 10 and an exposure from -10 to 10 stops, found {text:?}"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn backgrounds_are_read_by_name_as_colours_and_as_files() {
        let sky = BackgroundFile::new("a/sky,1.exr");
        let placed = BackgroundFile { offset: [0.5, -0.25], ..sky.clone() };
        let scaled = BackgroundFile { scale: 2.0, ..placed.clone() };
        let darker = BackgroundFile { exposure_stops: -1.5, ..scaled.clone() };
        for (text, background) in [
            ("environment", Background::Environment),
            ("plate", Background::Plate),
            ("checker", Background::Checker),
            ("none", Background::None),
            ("#1a2B3c", Background::Color([26, 43, 60])),
            ("a/sky,1.exr", Background::File(sky)),
            ("a/sky,1.exr,0.5,-0.25", Background::File(placed)),
            ("a/sky,1.exr,0.5,-0.25,2", Background::File(scaled)),
            ("a/sky,1.exr,0.5, -0.25,2,-1.5", Background::File(darker)),
        ] {
            assert_eq!(text.parse(), Ok(background.clone()));
            let stored = serde_json::to_string(&background).unwrap();
            assert_eq!(serde_json::from_str::<Background>(&stored).unwrap(), background);
        }
        for text in ["", "#12345", "#12345g", "#äöü", "sky"] {
            assert!(text.parse::<Background>().unwrap_err().contains("#1a2b3c"), "{text}");
        }
        for text in ["a.png,1", "a.png,0,0,1,0,0", "a.png,3,0", "a.png,0,nan", "a.png,0,0,0"] {
            assert!(text.parse::<Background>().unwrap_err().contains("found"), "{text}");
        }
    }

    #[test]
    fn a_file_alone_is_centred_and_numbers_of_other_files_are_bounded() {
        let stored = r#"{"File":{"file":"sky.png"}}"#;
        let read: Background = serde_json::from_str(stored).unwrap();
        assert_eq!(read, Background::File(BackgroundFile::new("sky.png")));
        let wild = BackgroundFile {
            offset: [f32::NAN, 9.0],
            scale: f32::INFINITY,
            exposure_stops: f32::NAN,
            ..BackgroundFile::new("sky.png")
        };
        let bounded = BackgroundFile { offset: [0.0, 2.0], scale: 10.0, ..BackgroundFile::new("sky.png") };
        assert_eq!(wild.bounded(), bounded);
    }
}
