//! Layout of sums and factors in tiles and in memory.

/// Rows of a tile, and sums per row.
pub const SIDE: usize = 16;
/// Number of sums or words in a tile.
pub const TILE: usize = SIDE * SIDE;

/// Four blocks of sums, row by row.
pub type Blocks = [[f32; TILE]; 4];

/// Four such blocks, aligned so that they share no cache line with other data.
#[repr(C, align(64))]
pub struct Sums(pub Blocks);

/// Arrangement of the four blocks of sums: tiles of the left factor × tiles of the right.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Blocking {
    /// 2 × 2, in the order (0, 0), (0, 1), (1, 0), (1, 1).
    Square,
    /// 1 × 4.
    Wide,
    /// 4 × 1.
    Tall,
}

impl Blocking {
    /// Tiles of the left factor and of the right.
    pub fn tiles(self) -> [usize; 2] {
        match self {
            Self::Square => [2, 2],
            Self::Wide => [1, 4],
            Self::Tall => [4, 1],
        }
    }
}

/// Positions of a factor's tiles. All distances are in bytes.
///
/// A tile of the left factor has 16 rows of `2 · pairs` bf16, a tile of the right factor has `pairs` rows of 16
/// pairs of bf16.
#[derive(Clone, Copy)]
pub struct Factor<'a> {
    pub bytes: &'a [u8],
    pub start: usize,
    /// Distance between a tile's rows.
    pub row: usize,
    /// Distance between tiles that are used together.
    pub next: usize,
}

impl Factor<'_> {
    /// End of the bytes read by `tiles` tiles of `rows` rows of `length` bytes, of which the farthest step is `farthest`
    /// bytes after the start.
    pub fn end(&self, tiles: usize, [rows, length]: [usize; 2], farthest: usize) -> Option<usize> {
        let next = self.next.checked_mul(tiles - 1)?;
        let row = self.row.checked_mul(rows - 1)?;
        [farthest, next, row, length].into_iter().try_fold(self.start, usize::checked_add)
    }
}

/// Steps of a sum: offsets of the tiles of both factors, in bytes.
pub struct Steps {
    pub offsets: Vec<[usize; 2]>,
    pub farthest: [usize; 2],
    /// Pairs of elements per step, 1 to 16.
    pub pairs: usize,
}

impl Steps {
    pub fn new(offsets: Vec<[usize; 2]>, pairs: usize) -> Self {
        let farthest = [0, 1].map(|side| offsets.iter().map(|o| o[side]).max().unwrap_or(0));
        Self { offsets, farthest, pairs }
    }
}
