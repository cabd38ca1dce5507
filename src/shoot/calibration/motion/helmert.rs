//! Helmert matrix: an orthonormal n × n matrix with a constant first row, so that the other rows exclude the mean.

/// Row `row`, column `column` of the n × n matrix.
pub fn turn(row: usize, column: usize, n: usize) -> f64 {
    match row {
        0 => 1.0 / (n as f64).sqrt(),
        _ => {
            let scale = 1.0 / ((row * (row + 1)) as f64).sqrt();
            match column.cmp(&row) {
                std::cmp::Ordering::Less => scale,
                std::cmp::Ordering::Equal => -(row as f64) * scale,
                std::cmp::Ordering::Greater => 0.0,
            }
        }
    }
}

/// All rows but the first, times `values`: the values without their mean.
pub fn contrasts(values: &[f64]) -> Vec<f64> {
    let (n, mut sum) = (values.len(), 0.0);
    (1..n)
        .map(|row| {
            sum += values[row - 1];
            turn(row, 0, n) * sum + turn(row, row, n) * values[row]
        })
        .collect()
}

/// Covariance of the contrasts of values with covariance `matrix`, n × n.
pub fn contrasted(matrix: &[f64], n: usize) -> Vec<f64> {
    let half: Vec<Vec<f64>> = matrix.chunks(n).map(contrasts).collect();
    let columns: Vec<Vec<f64>> =
        (0..n - 1).map(|j| contrasts(&half.iter().map(|row| row[j]).collect::<Vec<_>>())).collect();
    (0..n - 1).flat_map(|i| columns.iter().map(move |column| column[i])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contrasts_leave_the_mean_out_and_keep_the_rest() {
        let values = [3.0, -1.0, 4.0, 1.5];
        let shifted = values.map(|v| v + 7.0);
        let (plain, moved) = (contrasts(&values), contrasts(&shifted));
        let mean = values.iter().sum::<f64>() / 4.0;
        let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
        for (row, (a, b)) in plain.iter().zip(&moved).enumerate() {
            assert!((a - b).abs() < 1e-12);
            let whole: f64 = (0..4).map(|i| turn(row + 1, i, 4) * values[i]).sum();
            assert!((a - whole).abs() < 1e-12);
        }
        assert!((plain.iter().map(|v| v * v).sum::<f64>() - squares).abs() < 1e-12);
        // Independent values have independent contrasts.
        let unit: Vec<f64> = (0..16).map(|i| f64::from(i % 5 == 0)).collect();
        for (i, v) in contrasted(&unit, 4).iter().enumerate() {
            assert!((v - f64::from(i % 4 == 0)).abs() < 1e-12, "{i}: {v}");
        }
    }
}
