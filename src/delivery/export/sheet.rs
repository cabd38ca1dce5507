//! A contact sheet: labelled pictures in a grid.

use super::lettering::{ADVANCE, HEIGHT, dots};
use base::error::{Error, Result};
use imaging::{Encoded, Raster};

/// Pixels between tiles, around them, and above and below a label.
const GAP: usize = 4;
/// Display codes of the sheet and of its letters.
const PAPER: [f32; 3] = [0.09; 3];
const INK: [f32; 3] = [0.85; 3];
/// Pixels of a tile's width per step of the letters' size.
const WIDTH_PER_LETTER_SIZE: usize = 160;

/// One picture of a sheet.
#[derive(Clone, Copy, Debug)]
pub struct Tile<'a> {
    /// Label under the picture, cut to the available room. May be empty.
    pub label: &'a str,
    pub picture: &'a Encoded,
}

/// Lays tiles out in rows of `columns` (at least 1), each in a cell of the largest tile's size.
///
/// # Errors
/// When there is no tile, or no tile has pixels.
pub fn contact_sheet(tiles: &[Tile], columns: usize) -> Result<Encoded> {
    let width = tiles.iter().map(|t| t.picture.0.width).max().unwrap_or(0);
    let height = tiles.iter().map(|t| t.picture.0.height).max().unwrap_or(0);
    if width == 0 || height == 0 {
        return Err(Error::invalid("a contact sheet needs at least one picture", "Choose some frames"));
    }
    let columns = columns.clamp(1, tiles.len());
    let size = (width / WIDTH_PER_LETTER_SIZE).max(1);
    let labelled = tiles.iter().any(|t| !t.label.is_empty());
    let label_height = if labelled { GAP + size * HEIGHT } else { 0 };
    let cell = (width + GAP, height + label_height + GAP);
    let rows = tiles.len().div_ceil(columns);
    let mut sheet = Raster::filled(GAP + columns * cell.0, GAP + rows * cell.1, PAPER);
    for (i, tile) in tiles.iter().enumerate() {
        let (left, top) = (GAP + i % columns * cell.0, GAP + i / columns * cell.1);
        let picture = &tile.picture.0;
        for (y, row) in picture.pixels.chunks(picture.width.max(1)).enumerate() {
            let start = (top + y) * sheet.width + left;
            sheet.pixels[start..start + row.len()].copy_from_slice(row);
        }
        let letters = (width + size) / (size * ADVANCE);
        let label: String = tile.label.chars().take(letters).collect();
        for (x, y) in dots(&label) {
            for dot in 0..size * size {
                let column = left + x * size + dot % size;
                let row = top + height + GAP + y * size + dot / size;
                sheet.pixels[row * sheet.width + column] = INK;
            }
        }
    }
    Ok(Encoded(sheet))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_lie_in_rows_with_their_labels_below() {
        let pictures: Vec<Encoded> = (0..5).map(|i| Encoded(Raster::filled(40, 30 - i, [0.1 * i as f32; 3]))).collect();
        let tiles: Vec<Tile> = pictures.iter().map(|picture| Tile { label: "frame 12: 30.9 db", picture }).collect();
        let sheet = contact_sheet(&tiles, 3).unwrap().0;
        let cell = (44, 30 + GAP + HEIGHT + GAP);
        assert_eq!(sheet.size(), (GAP + 3 * cell.0, GAP + 2 * cell.1));
        assert_eq!(sheet.at(GAP + cell.0, GAP + cell.1), [0.4; 3]);
        assert_eq!(sheet.at(GAP - 1, GAP), PAPER);
        assert!(sheet.pixels.contains(&INK));
    }

    #[test]
    fn any_tiles_fit_or_are_refused() {
        assert!(contact_sheet(&[], 3).is_err());
        for (width, columns) in [(1, 0), (3, 9), (700, 1)] {
            let picture = Encoded(Raster::filled(width, 2, [1.0; 3]));
            contact_sheet(&[Tile { label: "a label that is far too long for it", picture: &picture }], columns)
                .unwrap();
        }
    }
}
