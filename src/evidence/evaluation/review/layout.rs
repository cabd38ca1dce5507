//! Contact sheet with each picture at its lamp's position.

use glam::Vec3;
use light::latlong::uv_from_direction;

/// The sheet: squares on a plane with origin (0, 0) at the top left.
#[derive(Clone, Debug, PartialEq)]
pub struct SheetLayout {
    /// Side of each square.
    pub side: f32,
    /// Top left corner of each lamp's square, in lamp order.
    pub corners: Vec<[f32; 2]>,
}

/// Lays out squares over `width × height` as a lat-long panorama of their directions, as large as possible without
/// overlap: azimuth to the right, with the camera's view in the middle, and up at the top. Lamps of similar elevation
/// share a row and keep their order, as close to their azimuth as their neighbours allow. A lamp without a direction
/// goes in the last row.
pub fn place_by_direction(directions: &[Vec3], width: f32, height: f32) -> SheetLayout {
    let places: Vec<[f32; 2]> = directions
        .iter()
        .map(|&d| if d.is_finite() && d != Vec3::ZERO { uv_from_direction(d).into() } else { [0.5, 1.0] })
        .collect();
    let (top, bottom) = (places.iter().map(|p| p[1])).fold((1.0f32, 0.0f32), |(a, b), v| (a.min(v), b.max(v)));
    let row_index = |v: f32, rows: usize| {
        let share = (v - top) / (bottom - top).max(1e-6);
        ((share * rows as f32) as usize).min(rows - 1)
    };
    let cell_side = |rows: usize| {
        let mut counts = vec![0usize; rows];
        places.iter().for_each(|p| counts[row_index(p[1], rows)] += 1);
        let most = counts.into_iter().max().unwrap_or(1).max(1);
        (width / most as f32).min(height / rows as f32)
    };
    let rows =
        (1..=places.len().max(1)).max_by(|&a, &b| cell_side(a).total_cmp(&cell_side(b)).then(a.cmp(&b))).unwrap_or(1);
    let side = cell_side(rows);
    let mut corners = vec![[0.0; 2]; places.len()];
    for row in 0..rows {
        let mut lamps: Vec<usize> = (0..places.len()).filter(|&i| row_index(places[i][1], rows) == row).collect();
        lamps.sort_by(|&a, &b| places[a][0].total_cmp(&places[b][0]));
        let y = (row as f32 + 0.5) * height / rows as f32 - 0.5 * side;
        // Push each square right of its predecessor, then back from the edge, left of its successor.
        let mut free = 0.0f32;
        for &lamp in &lamps {
            let x = (places[lamp][0] * width - 0.5 * side).max(free);
            corners[lamp] = [x, y];
            free = x + side;
        }
        let mut free = width;
        for &lamp in lamps.iter().rev() {
            corners[lamp][0] = corners[lamp][0].min(free - side);
            free = corners[lamp][0];
        }
    }
    SheetLayout { side, corners }
}

#[cfg(test)]
mod tests {
    use super::*;
    use light::latlong::direction_from_uv;
    use proptest::prelude::*;

    fn direction() -> impl Strategy<Value = Vec3> {
        (0.001f32..0.999, 0.001f32..0.999).prop_map(|(u, v)| direction_from_uv(u, v))
    }

    proptest! {
        #[test]
        fn nothing_covers_another_or_leaves_the_sheet(
            directions in prop::collection::vec(direction(), 0..120),
            width in 50f32..2000.0,
            height in 50f32..2000.0,
        ) {
            let SheetLayout { side, corners } = place_by_direction(&directions, width, height);
            let slack = 1e-3 * width.max(height);
            for (i, [x, y]) in corners.iter().copied().enumerate() {
                prop_assert!(x >= -slack && x + side <= width + slack);
                prop_assert!(y >= -slack && y + side <= height + slack);
                for [x2, y2] in corners[..i].iter().copied() {
                    prop_assert!((x - x2).abs() >= side - slack || (y - y2).abs() >= side - slack);
                }
            }
        }
    }

    #[test]
    fn lamps_stand_where_they_are() {
        let directions = [Vec3::NEG_X, Vec3::NEG_Z, Vec3::X, Vec3::Y];
        let SheetLayout { side, corners } = place_by_direction(&directions, 400.0, 200.0);
        let middle = |i: usize| [corners[i][0] + 0.5 * side, corners[i][1] + 0.5 * side];
        assert_eq!([0, 1, 2].map(|i| middle(i)[0]), [100.0, 200.0, 300.0]);
        assert_eq!((side, middle(3)[1], middle(1)[1]), (100.0, 50.0, 150.0));
        let unseen = [Vec3::Y, Vec3::ZERO, Vec3::NAN];
        let corners = place_by_direction(&unseen, 100.0, 300.0).corners;
        assert!(corners[1][1] > corners[0][1] && corners[2][1] > corners[0][1]);
    }
}
