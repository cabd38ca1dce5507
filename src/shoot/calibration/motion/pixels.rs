//! Sums over pixels.

/// Σ shares_j · picture(others_j).
pub fn combined<'a>(others: &[usize], shares: &[f64], picture: impl Fn(usize) -> &'a Vec<f32>) -> Vec<f32> {
    let mut sum = vec![0.0f32; picture(others[0]).len()];
    for (&j, &share) in others.iter().zip(shares) {
        sum.iter_mut().zip(picture(j)).for_each(|(sum, v)| *sum += share as f32 * v);
    }
    sum
}

/// Product pixel by pixel.
pub fn product(a: &[f32], b: &[f32]) -> Vec<f32> {
    a.iter().zip(b).map(|(a, b)| a * b).collect()
}

/// Σ a·b in eight partial sums.
pub fn dot(a: &[f32], b: &[f32]) -> f64 {
    let mut sums = [0.0f32; 8];
    let (blocks, rest) = (a.chunks_exact(8).zip(b.chunks_exact(8)), a.len() / 8 * 8);
    for (a, b) in blocks {
        for k in 0..8 {
            sums[k] += a[k] * b[k];
        }
    }
    let tail: f32 = a[rest..].iter().zip(&b[rest..]).map(|(a, b)| a * b).sum();
    f64::from(sums.iter().sum::<f32>() + tail)
}

/// Light between four pixels; the edge is repeated outside.
pub fn between(picture: &[f32], side: usize, x: f32, y: f32) -> f32 {
    let last = (side - 1) as f32;
    let (x, y) = (x.clamp(0.0, last), y.clamp(0.0, last));
    let (left, top) = (x as usize, y as usize);
    let (right, below) = ((left + 1).min(side - 1), (top + 1).min(side - 1));
    let (fx, fy) = (x - left as f32, y - top as f32);
    let row = |y: usize| {
        let (a, b) = (picture[y * side + left], picture[y * side + right]);
        a + (b - a) * fx
    };
    row(top) + (row(below) - row(top)) * fy
}
