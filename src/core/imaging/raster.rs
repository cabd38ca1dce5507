//! A rectangle of pixels in row order, top row first.

/// `width × height` pixels, row by row from the top left.
#[derive(Clone, Debug, PartialEq)]
pub struct Raster<T> {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `width · height` pixels; pixel (x, y) is at `y · width + x`.
    pub pixels: Vec<T>,
}

/// Scene-linear RGB radiance, Rec.709 primaries, unbounded.
pub type Image = Raster<[f32; 3]>;

/// Linear coverage in `[0, 1]`.
pub type Mask = Raster<f32>;

/// RGB as encoded by a camera or for a display, in `[0, 1]`. It cannot be summed or averaged as light: decode it
/// first, with the response that made it.
#[derive(Clone, Debug, PartialEq)]
pub struct Encoded(pub Raster<[f32; 3]>);

impl<T: Copy> Raster<T> {
    /// A raster of one value.
    pub fn filled(width: usize, height: usize, value: T) -> Self {
        Self { width, height, pixels: vec![value; width * height] }
    }

    /// A raster from a function of column and row.
    pub fn from_fn(width: usize, height: usize, mut pixel: impl FnMut(usize, usize) -> T) -> Self {
        let mut pixels = Vec::with_capacity(width * height);
        for y in 0..height {
            for x in 0..width {
                pixels.push(pixel(x, y));
            }
        }
        Self { width, height, pixels }
    }

    /// The pixel in column `x` and row `y`.
    pub fn at(&self, x: usize, y: usize) -> T {
        self.pixels[y * self.width + x]
    }

    /// Columns and rows.
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// A raster of the same size with every pixel mapped by `f`.
    pub fn map<U>(&self, f: impl FnMut(T) -> U) -> Raster<U> {
        Raster { width: self.width, height: self.height, pixels: self.pixels.iter().copied().map(f).collect() }
    }
}
