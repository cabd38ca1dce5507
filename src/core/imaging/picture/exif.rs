//! Colour by EXIF, as cameras note it in a JPEG without ICC profile (CIPA DC-008, tag ColorSpace; DCF 2.0, option file).

use super::profile::{self, Named};

const EXIF: u16 = 0x8769;
const COLOR_SPACE: u16 = 0xa001;
const INTEROPERABILITY: u16 = 0xa005;
const INTEROPERABILITY_INDEX: u16 = 1;

/// Colour that EXIF names: sRGB, or Adobe RGB of an option file. None if it leaves it open.
pub(super) fn color(exif: &[u8]) -> Option<Named> {
    let file = Tiff::new(exif)?;
    let directory = file.long(file.entry(file.first()?, EXIF)?)?;
    let space = file.entry(directory, COLOR_SPACE).and_then(|entry| file.short(entry));
    let index = || {
        let directory = file.long(file.entry(directory, INTEROPERABILITY)?)?;
        // Four characters fit into the entry itself.
        exif.get(file.entry(directory, INTEROPERABILITY_INDEX)? + 8..)?.get(..3)
    };
    match space? {
        1 => Some(Named::srgb("EXIF")),
        // 2 is no value of EXIF, but some programs write it.
        2 => Some(profile::adobe_rgb()),
        0xffff if index() == Some(b"R03") => Some(profile::adobe_rgb()),
        _ => None,
    }
}

/// Directories in the format of TIFF; places count from its first byte.
struct Tiff<'a> {
    bytes: &'a [u8],
    is_big_endian: bool,
}

impl<'a> Tiff<'a> {
    fn new(bytes: &'a [u8]) -> Option<Self> {
        let is_big_endian = match bytes.get(..4)? {
            b"MM\0*" => true,
            b"II*\0" => false,
            _ => return None,
        };
        Some(Self { bytes, is_big_endian })
    }

    fn number<const N: usize>(&self, at: usize) -> Option<[u8; N]> {
        let mut bytes: [u8; N] = self.bytes.get(at..)?.first_chunk().copied()?;
        if !self.is_big_endian {
            bytes.reverse();
        }
        Some(bytes)
    }

    /// First directory.
    fn first(&self) -> Option<usize> {
        Some(u32::from_be_bytes(self.number(4)?) as usize)
    }

    /// Place of a tag's entry in a directory.
    fn entry(&self, directory: usize, tag: u16) -> Option<usize> {
        let count = usize::from(u16::from_be_bytes(self.number(directory)?));
        let mut entries = (0..count).map(|i| directory + 2 + 12 * i);
        entries.find(|at| self.number(*at).map(u16::from_be_bytes) == Some(tag))
    }

    /// Value of an entry of 16 bits.
    fn short(&self, entry: usize) -> Option<u16> {
        Some(u16::from_be_bytes(self.number(entry + 8)?))
    }

    /// Value of an entry of 32 bits.
    fn long(&self, entry: usize) -> Option<usize> {
        Some(u32::from_be_bytes(self.number(entry + 8)?) as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// EXIF of a colour space and an index, as cameras write it.
    fn exif(big: bool, space: u16, index: &[u8; 4]) -> Vec<u8> {
        let two = |v: u16| if big { v.to_be_bytes() } else { v.to_le_bytes() };
        let four = |v: u32| if big { v.to_be_bytes() } else { v.to_le_bytes() };
        let mut file = if big { b"MM\0*".to_vec() } else { b"II*\0".to_vec() };
        file.extend(four(8));
        let mut directory = |entries: &[(u16, u16, u32, [u8; 4])]| {
            file.extend(two(entries.len() as u16));
            for (tag, kind, count, value) in entries {
                file.extend([two(*tag), two(*kind)].concat());
                file.extend([four(*count), *value].concat());
            }
            file.extend(four(0));
        };
        directory(&[(EXIF, 4, 1, four(26))]);
        let mut short = [0; 4];
        short[..2].copy_from_slice(&two(space));
        directory(&[(COLOR_SPACE, 3, 1, short), (INTEROPERABILITY, 4, 1, four(56))]);
        directory(&[(INTEROPERABILITY_INDEX, 2, 4, *index)]);
        file
    }

    #[test]
    fn color_space_and_index_name_the_colour() {
        let name = |exif: &[u8]| color(exif).map(|named| named.origin.name);
        for big in [true, false] {
            for (space, index, right) in [
                (1, b"R98\0", Some("sRGB")),
                (0xffff, b"R03\0", Some("Adobe RGB (1998)")),
                (2, b"R98\0", Some("Adobe RGB (1998)")),
                (0xffff, b"R98\0", None),
                (0xffff, b"THM\0", None),
                (7, b"R03\0", None),
            ] {
                let whole = exif(big, space, index);
                assert_eq!(name(&whole).as_deref(), right, "{space} {index:?}");
                for end in 0..whole.len() {
                    // Cut files are read as far as they go.
                    let _ = name(&whole[..end]);
                }
            }
        }
    }
}
