//! RGB colour spaces, and the matrices between them for linear light.
//!
//! The program works in linear Rec. 709. A matrix follows from primaries and white (SMPTE RP 177-1993); between
//! different whites light is adapted with Bradford's matrix (Lam 1985, as in ICC.1:2022 annex E).

/// Rows of a matrix that multiplies a column of R, G and B.
pub type Matrix = [[f64; 3]; 3];

/// Primaries and white.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ColorSpace {
    /// ITU-R BT.709, D65: the working space. sRGB has the same primaries.
    #[default]
    Rec709,
    /// SMPTE EG 432-1 with D65, as used by displays.
    P3D65,
    /// ITU-R BT.2020, D65.
    Rec2020,
    /// AP1 of the Academy (S-2014-004) with its white near D60.
    AcesCg,
}

/// CIE 1931 (x, y) of red, green, blue and white.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Primaries {
    pub red: [f64; 2],
    pub green: [f64; 2],
    pub blue: [f64; 2],
    pub white: [f64; 2],
}

const D65: [f64; 2] = [0.3127, 0.3290];
const BRADFORD: Matrix = [[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]];

impl ColorSpace {
    /// Chromaticities of its corners and its white.
    pub fn primaries(self) -> Primaries {
        let primaries = |red, green, blue, white| Primaries { red, green, blue, white };
        match self {
            Self::Rec709 => primaries([0.64, 0.33], [0.30, 0.60], [0.15, 0.06], D65),
            Self::P3D65 => primaries([0.68, 0.32], [0.265, 0.69], [0.15, 0.06], D65),
            Self::Rec2020 => primaries([0.708, 0.292], [0.170, 0.797], [0.131, 0.046], D65),
            Self::AcesCg => primaries([0.713, 0.293], [0.165, 0.830], [0.128, 0.044], [0.32168, 0.33767]),
        }
    }

    /// The matrix from linear light of this space to that of `other`.
    pub fn matrix_to(self, other: Self) -> Matrix {
        if self == other {
            return [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        }
        self.primaries().matrix_to(other.primaries())
    }
}

impl Primaries {
    /// True if the corners span a triangle and the white is a valid colour.
    pub fn is_usable(self) -> bool {
        let Self { red, green, blue, white } = self;
        let corners = [red, green, blue, white];
        let area = (green[0] - red[0]) * (blue[1] - red[1]) - (blue[0] - red[0]) * (green[1] - red[1]);
        corners.iter().flatten().all(|v| v.is_finite() && v.abs() < 2.0) && area.abs() > 1e-4 && white[1] > 1e-3
    }

    /// The matrix from linear light of these primaries to `to`, with the white adapted.
    pub fn matrix_to(self, to: Self) -> Matrix {
        let adapted = if self.white == to.white {
            self.to_xyz()
        } else {
            product(adaptation(self.white, to.white), self.to_xyz())
        };
        product(inverse(to.to_xyz()), adapted)
    }

    /// The matrix to linear Rec. 709; None if these are Rec. 709's own, to three digits.
    pub fn to_rec709(self) -> Option<Matrix> {
        let own = ColorSpace::Rec709.primaries();
        (!self.is_like(own)).then(|| self.matrix_to(own))
    }

    /// True if corners and white agree to three digits.
    fn is_like(self, other: Self) -> bool {
        let corners = |p: Self| [p.red, p.green, p.blue, p.white];
        let pairs = corners(self).into_iter().flatten().zip(corners(other).into_iter().flatten());
        pairs.into_iter().all(|(a, b)| (a - b).abs() < 1.5e-3)
    }

    /// Name of the colour space with these primaries; "other primaries" if none of the usual ones has them.
    pub fn name(self) -> &'static str {
        let primaries = |red, green, blue, white| Self { red, green, blue, white };
        let spaces = [
            ("Rec. 709", ColorSpace::Rec709.primaries()),
            ("P3 D65", ColorSpace::P3D65.primaries()),
            ("Rec. 2020", ColorSpace::Rec2020.primaries()),
            ("ACEScg", ColorSpace::AcesCg.primaries()),
            // SMPTE ST 2065-1.
            ("ACES2065-1", primaries([0.7347, 0.2653], [0.0, 1.0], [0.0001, -0.077], [0.32168, 0.33767])),
            ("CIE XYZ", primaries([1.0, 0.0], [0.0, 1.0], [0.0, 0.0], [1.0 / 3.0, 1.0 / 3.0])),
        ];
        let known = spaces.into_iter().find(|(_, space)| self.is_like(*space));
        known.map_or("other primaries", |(name, _)| name)
    }

    /// The matrix from linear RGB to CIE XYZ, white with Y = 1.
    pub fn to_xyz(self) -> Matrix {
        // Not divided by y, which is 0 for two corners of XYZ itself.
        let corners = [self.red, self.green, self.blue].map(|[x, y]| [x, y, 1.0 - x - y]);
        let columns: Matrix = std::array::from_fn(|row| corners.map(|corner| corner[row]));
        let gains = applied(inverse(columns), xyz(self.white));
        columns.map(|row| std::array::from_fn(|c| row[c] * gains[c]))
    }
}

/// Linear RGB times a matrix.
pub fn transformed(matrix: &Matrix, rgb: [f32; 3]) -> [f32; 3] {
    applied(*matrix, rgb.map(f64::from)).map(|v| v as f32)
}

/// XYZ with Y = 1 of a chromaticity.
fn xyz([x, y]: [f64; 2]) -> [f64; 3] {
    [x / y, 1.0, (1.0 - x - y) / y]
}

/// XYZ adapted from one white to another with Bradford's matrix.
pub fn adapted(color: [f64; 3], from: [f64; 2], to: [f64; 2]) -> [f64; 3] {
    applied(adaptation(from, to), color)
}

/// Bradford's adaptation of XYZ from one white to another.
fn adaptation(from: [f64; 2], to: [f64; 2]) -> Matrix {
    let (from, to) = (applied(BRADFORD, xyz(from)), applied(BRADFORD, xyz(to)));
    let scaled = std::array::from_fn(|row| BRADFORD[row].map(|v| v * to[row] / from[row]));
    product(inverse(BRADFORD), scaled)
}

fn applied(matrix: Matrix, v: [f64; 3]) -> [f64; 3] {
    matrix.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

fn product(a: Matrix, b: Matrix) -> Matrix {
    a.map(|row| std::array::from_fn(|c| (0..3).map(|k| row[k] * b[k][c]).sum()))
}

fn inverse(m: Matrix) -> Matrix {
    let cofactor = |r: usize, c: usize| {
        let [r1, r2, c1, c2] = [(r + 1) % 3, (r + 2) % 3, (c + 1) % 3, (c + 2) % 3];
        m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1]
    };
    let determinant: f64 = (0..3).map(|c| m[0][c] * cofactor(0, c)).sum();
    std::array::from_fn(|r| std::array::from_fn(|c| cofactor(c, r) / determinant))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(found: Matrix, wanted: Matrix, within: f64) {
        for (found, wanted) in found.iter().flatten().zip(wanted.iter().flatten()) {
            assert!((found - wanted).abs() < within, "{found} is not {wanted}");
        }
    }

    #[test]
    fn matrices_are_those_that_others_publish() {
        // OpenColorIO's own configurations for ACES 1.3 (Bradford), ITU-R BT.2087-0 and Display P3.
        let published = [
            (
                ColorSpace::AcesCg,
                [
                    [0.613_097_402_4, 0.339_523_146_2, 0.047_379_451_4],
                    [0.070_193_722_5, 0.916_353_879_1, 0.013_452_398_5],
                    [0.020_615_592_9, 0.109_569_772_9, 0.869_814_634_2],
                ],
            ),
            (
                ColorSpace::Rec2020,
                [
                    [0.627_403_895_9, 0.329_283_038_4, 0.043_313_065_7],
                    [0.069_097_289_4, 0.919_540_395_1, 0.011_362_315_6],
                    [0.016_391_438_9, 0.088_013_307_9, 0.895_595_253_2],
                ],
            ),
            (
                ColorSpace::P3D65,
                [
                    [0.822_461_968_7, 0.177_538_031_3, 0.0],
                    [0.033_194_198_9, 0.966_805_801_1, 0.0],
                    [0.017_082_630_7, 0.072_397_440_7, 0.910_519_928_7],
                ],
            ),
        ];
        for (space, matrix) in published {
            near(ColorSpace::Rec709.matrix_to(space), matrix, 1e-8);
        }
    }

    #[test]
    fn white_stays_white_and_the_way_back_is_the_inverse() {
        let all = [ColorSpace::Rec709, ColorSpace::P3D65, ColorSpace::Rec2020, ColorSpace::AcesCg];
        for from in all {
            for to in all {
                let there = from.matrix_to(to);
                let white = applied(there, [1.0; 3]);
                assert!(white.iter().all(|v| (v - 1.0).abs() < 1e-12), "{white:?}");
                let both = product(to.matrix_to(from), there);
                near(both, ColorSpace::Rec709.matrix_to(ColorSpace::Rec709), 1e-12);
            }
        }
    }
}
