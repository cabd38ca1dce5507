//! Colours of a region as a mixture of five normal distributions.

/// Number of distributions in a mixture (Rother et al. 2004).
const COMPONENTS: usize = 5;
/// Variance added to every channel, in code values squared: that of rounding to codes (1/12) and a little noise. It
/// keeps a uniform colour's covariance invertible.
const LEAST_VARIANCE: f64 = 0.25;
type Matrix = [[f64; 3]; 3];

/// Count, sum and sum of products of colours.
#[derive(Clone, Copy, Default)]
struct Moments {
    count: f64,
    sum: [f64; 3],
    products: Matrix,
}

impl Moments {
    fn add(&mut self, color: [f64; 3]) {
        self.count += 1.0;
        for i in 0..3 {
            self.sum[i] += color[i];
            for j in 0..3 {
                self.products[i][j] += color[i] * color[j];
            }
        }
    }

    fn mean(&self) -> [f64; 3] {
        self.sum.map(|sum| sum / self.count)
    }

    fn covariance(&self) -> Matrix {
        let mean = self.mean();
        let mut covariance = self.products;
        for i in 0..3 {
            for j in 0..3 {
                covariance[i][j] = covariance[i][j] / self.count - mean[i] * mean[j];
            }
        }
        covariance
    }
}

#[derive(Clone)]
struct Normal {
    mean: [f64; 3],
    /// Inverse of the covariance.
    precision: Matrix,
    /// Logarithm of weight / √determinant.
    level: f64,
}

impl Normal {
    fn new(moments: &Moments, total: f64) -> Self {
        let mut c = moments.covariance();
        for (i, row) in c.iter_mut().enumerate() {
            row[i] += LEAST_VARIANCE;
        }
        let minor = |r: [usize; 2], k: [usize; 2]| c[r[0]][k[0]] * c[r[1]][k[1]] - c[r[0]][k[1]] * c[r[1]][k[0]];
        let others = [[1, 2], [0, 2], [0, 1]];
        let sign = |i: usize, j: usize| if (i + j).is_multiple_of(2) { 1.0 } else { -1.0 };
        let determinant: f64 = (0..3).map(|j| sign(0, j) * c[0][j] * minor([1, 2], others[j])).sum();
        // A covariance with this much on its diagonal is no smaller; rounding of large sums may violate that.
        let determinant = determinant.max(LEAST_VARIANCE.powi(3));
        let mut precision = Matrix::default();
        for (i, row) in precision.iter_mut().enumerate() {
            for (j, entry) in row.iter_mut().enumerate() {
                *entry = sign(i, j) * minor(others[j], others[i]) / determinant;
            }
        }
        Self { mean: moments.mean(), precision, level: (moments.count / total).ln() - 0.5 * determinant.ln() }
    }

    /// Logarithm of the weighted density, up to a constant.
    fn log(&self, color: [f64; 3]) -> f64 {
        let d = [0, 1, 2].map(|i| color[i] - self.mean[i]);
        let distance: f64 = (0..3).map(|i| d[i] * (0..3).map(|j| self.precision[i][j] * d[j]).sum::<f64>()).sum();
        self.level - 0.5 * distance.max(0.0)
    }
}

/// A mixture of normal distributions of colours, in code values from 0 to 255.
#[derive(Clone)]
pub struct Mixture(Vec<Normal>);

impl Mixture {
    /// Mixture of the groups of [`split`]. None without colours.
    pub fn split(colors: &[[f64; 3]]) -> Option<Self> {
        Self::from_groups(&split(colors))
    }

    /// Mixture refitted after assigning each colour to its currently most likely component. None without colours.
    pub fn refitted(&self, colors: impl Iterator<Item = [f64; 3]>) -> Option<Self> {
        let mut groups = vec![Moments::default(); self.0.len()];
        for color in colors {
            let likeliest = (self.0.iter().map(|normal| normal.log(color)).enumerate())
                .max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)));
            if let Some((place, _)) = likeliest {
                groups[place].add(color);
            }
        }
        Self::from_groups(&groups)
    }

    fn from_groups(groups: &[Moments]) -> Option<Self> {
        let total: f64 = groups.iter().map(|group| group.count).sum();
        let normals: Vec<_> =
            (groups.iter().filter(|group| group.count > 0.0)).map(|group| Normal::new(group, total)).collect();
        (!normals.is_empty()).then_some(Self(normals))
    }

    /// Minus the logarithm of the colour's density, up to a constant.
    pub fn cost(&self, color: [f64; 3]) -> f64 {
        let logs = || self.0.iter().map(|normal| normal.log(color));
        let most = logs().fold(f64::NEG_INFINITY, f64::max);
        -(most + logs().map(|log| (log - most).exp()).sum::<f64>().ln())
    }
}

/// Colours in at most five groups, splitting the widest group across its widest direction each time (Orchard and
/// Bouman 1991).
fn split(colors: &[[f64; 3]]) -> Vec<Moments> {
    if colors.is_empty() {
        return Vec::new();
    }
    let mut groups = vec![colors.to_vec()];
    while groups.len() < COMPONENTS {
        let axes = groups.iter().map(|group| principal(&moments(group)));
        let widest = axes.enumerate().max_by(|a, b| a.1.1.total_cmp(&b.1.1).then(b.0.cmp(&a.0)));
        let Some((place, (axis, variance))) = widest else { break };
        if variance <= LEAST_VARIANCE {
            break;
        }
        let group = groups.swap_remove(place);
        let middle = dot(axis, moments(&group).mean());
        let (low, high): (Vec<_>, Vec<_>) = group.into_iter().partition(|&color| dot(axis, color) <= middle);
        groups.extend([low, high].into_iter().filter(|group| !group.is_empty()));
    }
    groups.iter().map(|group| moments(group)).collect()
}

/// OpenCV's 65 numbers of the mixture from `split`, for pictures in its order of channels: five weights, means and
/// covariances.
#[cfg(test)]
pub fn start_for_opencv(colors: &[[f64; 3]]) -> Vec<f64> {
    let turned: Vec<_> = colors.iter().map(|&[r, g, b]| [b, g, r]).collect();
    let mut groups = split(&turned);
    groups.resize(COMPONENTS, Moments::default());
    let mut weights = Vec::new();
    let (mut means, mut covariances) = (Vec::new(), Vec::new());
    for group in &groups {
        let some = Moments { count: group.count.max(1.0), ..*group };
        weights.push(group.count / colors.len() as f64);
        means.extend(some.mean());
        let mut covariance = some.covariance();
        for (i, row) in covariance.iter_mut().enumerate() {
            row[i] += LEAST_VARIANCE;
        }
        covariances.extend(covariance.into_iter().flatten());
    }
    [weights, means, covariances].concat()
}

fn moments(colors: &[[f64; 3]]) -> Moments {
    let mut moments = Moments::default();
    colors.iter().for_each(|&color| moments.add(color));
    moments
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Direction of the largest variance of the colours, and that variance, by power iteration.
fn principal(moments: &Moments) -> ([f64; 3], f64) {
    let c = moments.covariance();
    let mut axis = [0.5, 0.7, 0.51];
    let mut variance = 0.0;
    for _ in 0..32 {
        let next = c.map(|row| dot(row, axis));
        let length = dot(next, next).sqrt();
        if length.is_nan() || length <= 1e-9 {
            return (axis, 0.0);
        }
        (axis, variance) = (next.map(|v| v / length), length);
    }
    (axis, variance)
}
