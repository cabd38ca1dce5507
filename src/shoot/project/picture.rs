//! Address of a picture: a file, or one frame of a movie.

use super::Axis;
use std::fmt;
use std::path::{Path, PathBuf};

/// The address of one picture.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Picture {
    /// A separate file.
    File(PathBuf),
    /// One frame of a movie.
    Movie {
        /// The movie's file, or the pattern of a sequence's files (`shot.%04d.exr`, `shot.####.exr`, a folder).
        file: PathBuf,
        /// The frame: counted from 0 in presentation order in a movie, the number in the file's name in a
        /// sequence.
        frame: u64,
    },
    /// The mirror image of a picture.
    Mirrored(Box<Picture>, Axis),
}

/// The address of a matte: the subject's coverage of each pixel.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Matte {
    /// The brightness of a grey picture.
    Grey(Picture),
    /// The alpha of the picture itself.
    Alpha(Picture),
}

impl Picture {
    /// The file; for a frame, its movie or its sequence's pattern.
    pub fn file(&self) -> &Path {
        match self {
            Self::File(file) | Self::Movie { file, .. } => file,
            Self::Mirrored(picture, _) => picture.file(),
        }
    }

    /// Name in sentences.
    pub fn display(&self) -> impl fmt::Display + '_ {
        Shown(self)
    }
}

impl Matte {
    /// The picture that contains the matte.
    pub fn picture(&self) -> &Picture {
        match self {
            Self::Grey(picture) | Self::Alpha(picture) => picture,
        }
    }

    /// The file that contains the matte.
    pub fn file(&self) -> &Path {
        self.picture().file()
    }

    /// Name in sentences.
    pub fn display(&self) -> impl fmt::Display + '_ {
        let prefix = match self {
            Self::Grey(_) => "",
            Self::Alpha(_) => "the alpha of ",
        };
        fmt::from_fn(move |f| write!(f, "{prefix}{}", self.picture().display()))
    }
}

struct Shown<'a>(&'a Picture);

impl fmt::Display for Shown<'_> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self.0 {
            Picture::File(file) => write!(f, "{}", file.display()),
            Picture::Movie { file, frame } => write!(f, "frame {frame} of {}", file.display()),
            Picture::Mirrored(picture, _) => write!(f, "{}", picture.display()),
        }
    }
}

impl From<PathBuf> for Picture {
    fn from(file: PathBuf) -> Self {
        Self::File(file)
    }
}

impl AsRef<Path> for Picture {
    fn as_ref(&self) -> &Path {
        self.file()
    }
}

impl AsRef<Path> for Matte {
    fn as_ref(&self) -> &Path {
        self.file()
    }
}
