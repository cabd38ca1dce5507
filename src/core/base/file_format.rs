//! Formats of files by the extensions of their names, and what reads and writes them.

use std::path::Path;

/// Format of a file, by the extension of its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileFormat {
    OpenExr,
    Radiance,
    Png,
    Jpeg,
    Tiff,
    Dpx,
    /// A movie that ffmpeg reads.
    Movie,
    /// A camera's raw movie: recognised and refused.
    RawMovie,
    /// A camera's raw still: recognised and refused.
    RawStill,
}

/// Extensions of each format, in lower case.
const EXTENSIONS: [(FileFormat, &[&str]); 9] = [
    (FileFormat::OpenExr, &["exr"]),
    (FileFormat::Radiance, &["hdr", "pic"]),
    (FileFormat::Png, &["png"]),
    (FileFormat::Jpeg, &["jpg", "jpeg"]),
    (FileFormat::Tiff, &["tif", "tiff"]),
    (FileFormat::Dpx, &["dpx"]),
    (
        FileFormat::Movie,
        &[
            "mov", "mp4", "m4v", "mxf", "mkv", "webm", "avi", "mts", "m2ts", "ts", "mpg", "mpeg", "ogv", "wmv", "3gp",
            "nut",
        ],
    ),
    (FileFormat::RawMovie, &["r3d", "braw", "ari", "arx", "crm"]),
    (
        FileFormat::RawStill,
        &[
            "3fr", "arw", "cr2", "cr3", "crw", "dcr", "dng", "erf", "gpr", "iiq", "kdc", "mef", "mrw", "nef", "nrw",
            "orf", "pef", "raf", "rw2", "srw",
        ],
    ),
];

impl FileFormat {
    /// Format of a file's name; None if its extension is unknown.
    pub fn from_path(path: &Path) -> Option<Self> {
        let is_its = |(_, known): &&(Self, &[&str])| known.iter().any(|e| has_extension(path, e));
        EXTENSIONS.iter().find(is_its).map(|(format, _)| *format)
    }

    /// Extensions of the formats for which `wanted` holds.
    pub fn extensions(wanted: fn(Self) -> bool) -> Vec<&'static str> {
        let formats = EXTENSIONS.iter().filter(|(format, _)| wanted(*format));
        formats.flat_map(|(_, extensions)| *extensions).copied().collect()
    }

    /// True if it is read as a picture file: panorama, photograph or matte.
    pub fn is_picture(self) -> bool {
        matches!(self, Self::OpenExr | Self::Radiance | Self::Png | Self::Jpeg | Self::Tiff)
    }

    /// True if it is read as a picture of a sequence.
    pub fn is_sequence(self) -> bool {
        matches!(self, Self::OpenExr | Self::Png | Self::Jpeg | Self::Tiff | Self::Dpx)
    }

    /// True if it is written as a still.
    pub fn is_still(self) -> bool {
        matches!(self, Self::OpenExr | Self::Png | Self::Tiff)
    }

    /// True for movies, including raw ones that cannot be read.
    pub fn is_movie(self) -> bool {
        matches!(self, Self::Movie | Self::RawMovie)
    }
}

/// True if a file's name has this extension, in any case.
pub fn has_extension(path: &Path, wanted: &str) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(wanted))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_has_the_format_of_its_extension() {
        for (name, format) in [
            ("a.EXR", Some(FileFormat::OpenExr)),
            ("a.b/c.tiff", Some(FileFormat::Tiff)),
            ("a.pic", Some(FileFormat::Radiance)),
            ("a.M2TS", Some(FileFormat::Movie)),
            ("a.braw", Some(FileFormat::RawMovie)),
            ("a.cr3", Some(FileFormat::RawStill)),
            (".png", None),
            ("png", None),
            ("a.txt", None),
        ] {
            assert_eq!(FileFormat::from_path(Path::new(name)), format, "{name}");
        }
        let panoramas = ["exr", "hdr", "pic", "png", "jpg", "jpeg", "tif", "tiff"];
        assert_eq!(FileFormat::extensions(FileFormat::is_picture), panoramas);
        let sequences = ["exr", "png", "jpg", "jpeg", "tif", "tiff", "dpx"];
        assert_eq!(FileFormat::extensions(FileFormat::is_sequence), sequences);
        let stills = ["exr", "png", "tif", "tiff"];
        assert_eq!(FileFormat::extensions(FileFormat::is_still), stills);
    }
}
