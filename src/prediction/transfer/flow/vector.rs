//! Values of neighbouring pixels.

/// Side of a patch in pixels: one vector of the processor.
pub const PATCH: usize = 8;
/// Rounding of the robust norm near 0 (the value of `OpenCV`).
const EPSILON: f32 = 1e-3;

/// Values of neighbouring pixels. Its loops become the processor's vectors.
#[derive(Clone, Copy, Default)]
pub struct Vector(pub [f32; PATCH]);

pub type Block = [Vector; PATCH];

macro_rules! by_element {
    ($($operator:ident $name:ident $symbol:tt),*) => {$(
        impl std::ops::$operator for Vector {
            type Output = Self;

            #[inline(always)]
            fn $name(mut self, other: Self) -> Self {
                for (a, b) in self.0.iter_mut().zip(other.0) {
                    *a $symbol b;
                }
                self
            }
        }
    )*};
}

by_element!(Add add +=, Sub sub -=, Mul mul *=, Div div /=);

impl Vector {
    #[inline(always)]
    pub fn all(value: f32) -> Self {
        Self([value; PATCH])
    }

    #[inline(always)]
    pub fn read(row: &[f32], at: usize) -> Self {
        let mut out = Self::default();
        out.0.copy_from_slice(&row[at..][..PATCH]);
        out
    }

    #[inline(always)]
    pub fn write(self, row: &mut [f32], at: usize) {
        row[at..][..PATCH].copy_from_slice(&self.0);
    }

    #[inline(always)]
    pub fn square_root(mut self) -> Self {
        for a in &mut self.0 {
            *a = a.sqrt();
        }
        self
    }

    /// Magnitudes of at least 1.
    #[inline(always)]
    pub fn magnitude(mut self) -> Self {
        for a in &mut self.0 {
            *a = a.abs().max(1.0);
        }
        self
    }

    /// `weight` divided by a vector's length, rounded near 0.
    #[inline(always)]
    pub fn robust(self, weight: f32) -> Self {
        Self::all(weight) / (self + Self::all(EPSILON * EPSILON)).square_root()
    }
}

/// Sums of the vectors' elements. Inlined, it would keep the compiler from using whole vectors
/// before it.
#[inline(never)]
pub fn sums<const N: usize>(vectors: &[Vector; N]) -> [f32; N] {
    vectors.map(|Vector(v)| ((v[0] + v[4]) + (v[2] + v[6])) + ((v[1] + v[5]) + (v[3] + v[7])))
}
