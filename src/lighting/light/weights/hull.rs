//! The convex hull of points on the unit sphere: triangles that partition the sphere.

use glam::{DMat3, DVec3};

/// Triangles between points on the sphere. Seen from the origin they cover every direction once.
pub(super) struct Hull {
    pub facets: Vec<Facet>,
}

/// One triangle of the hull.
pub(super) struct Facet {
    /// Indices of its points.
    pub corners: [usize; 3],
    /// Maps a direction to its coordinates in the basis of the three corners.
    pub coordinates: DMat3,
}

impl Hull {
    /// The hull of distinct unit vectors that leave no half of the sphere empty, so there are at least four and the
    /// origin is strictly inside. Built point by point.
    pub fn from_points(points: &[DVec3]) -> Self {
        // Lamps often stand in rings, so four or more may lie in one plane, where "above the plane" is undefined. A
        // displacement by a millionth of a radian decides the facets; shares come from the points themselves. Points
        // on a sphere are all corners of their hull.
        let given = points;
        let points: Vec<DVec3> =
            points.iter().enumerate().map(|(i, p)| (*p + 1e-6 * displacement(i)).normalize()).collect();
        let first = tetrahedron(&points);
        let inside = first.iter().map(|&i| points[i]).sum::<DVec3>() / 4.0;
        let normal = |[a, b, c]: [usize; 3]| (points[b] - points[a]).cross(points[c] - points[a]);
        let outward = |[a, b, c]: [usize; 3]| {
            if normal([a, b, c]).dot(points[a] - inside) > 0.0 { [a, b, c] } else { [a, c, b] }
        };
        let [a, b, c, d] = first;
        let mut facets: Vec<[usize; 3]> = [[a, b, c], [a, b, d], [a, c, d], [b, c, d]].map(outward).to_vec();
        for p in (0..points.len()).filter(|p| !first.contains(p)) {
            let (seen, hidden): (Vec<_>, Vec<_>) =
                facets.iter().partition(|&&facet| normal(facet).dot(points[p] - points[facet[0]]) > 0.0);
            let edges: Vec<[usize; 2]> =
                seen.iter().flat_map(|&[a, b, c]: &[usize; 3]| [[a, b], [b, c], [c, a]]).collect();
            // Neighbours traverse their common edge in opposite directions; an edge of the horizon belongs to only
            // one of them.
            let horizon = edges.iter().filter(|[a, b]| !edges.contains(&[*b, *a]));
            facets = hidden;
            facets.extend(horizon.map(|&[a, b]| [a, b, p]));
        }
        let facets = facets
            .into_iter()
            .map(|corners| {
                let [a, b, c] = corners.map(|i| given[i]);
                Facet { corners, coordinates: DMat3::from_cols(a, b, c).inverse() }
            })
            .collect();
        Self { facets }
    }

    /// The facet that a direction passes through and the shares of its three corners, none negative, with sum 1:
    /// the barycentric coordinates of the point where the direction leaves the hull.
    pub fn locate(&self, direction: DVec3) -> (&Facet, [f64; 3]) {
        let mut best = (&self.facets[0], f64::NEG_INFINITY, DVec3::ONE);
        for facet in &self.facets {
            let coordinates = facet.coordinates * direction;
            let least = coordinates.min_element() / coordinates.abs().max_element();
            if least > best.1 {
                best = (facet, least, coordinates);
            }
            if least >= 0.0 {
                break;
            }
        }
        // Rounding may leave a corner at −1e-16 on an edge.
        let shares = best.2.max(DVec3::ZERO);
        (best.0, (shares / shares.element_sum()).to_array())
    }
}

/// A fixed, irregular vector of length about 1 for each index.
fn displacement(i: usize) -> DVec3 {
    let t = i as f64 + 1.0;
    DVec3::new((t * 12.9898).sin(), (t * 78.233).sin(), (t * 37.719).sin())
}

/// Four points that span a volume, chosen far apart.
fn tetrahedron(points: &[DVec3]) -> [usize; 4] {
    let farthest = |distance: &dyn Fn(DVec3) -> f64| {
        (0..points.len()).max_by(|&i, &j| distance(points[i]).total_cmp(&distance(points[j]))).unwrap_or(0)
    };
    let a = 0;
    let b = farthest(&|p| p.distance_squared(points[a]));
    let line = points[b] - points[a];
    let c = farthest(&|p| (p - points[a]).cross(line).length_squared());
    let plane = line.cross(points[c] - points[a]);
    let d = farthest(&|p| (p - points[a]).dot(plane).abs());
    [a, b, c, d]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `n` directions evenly spaced over the sphere (a Fibonacci lattice).
    fn lattice(n: usize) -> Vec<DVec3> {
        (0..n)
            .map(|i| {
                let (y, turn) = (1.0 - (2.0 * i as f64 + 1.0) / n as f64, i as f64 * 2.399_963_229_728_653);
                DVec3::new((1.0 - y * y).sqrt() * turn.cos(), y, (1.0 - y * y).sqrt() * turn.sin())
            })
            .collect()
    }

    fn cube() -> Vec<DVec3> {
        (0..8)
            .map(|i| DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64) * 2.0 - 1.0)
            .map(DVec3::normalize)
            .collect()
    }

    #[test]
    fn a_hull_has_the_facets_that_euler_counts() {
        for points in [cube(), lattice(4), lattice(41), lattice(200)] {
            assert_eq!(Hull::from_points(&points).facets.len(), 2 * points.len() - 4);
        }
    }

    #[test]
    fn every_direction_is_the_mean_of_its_corners() {
        for points in [cube(), lattice(41)] {
            let hull = Hull::from_points(&points);
            for direction in lattice(1000) {
                let (facet, shares) = hull.locate(direction);
                assert!(shares.iter().all(|s| *s >= 0.0) && (shares.iter().sum::<f64>() - 1.0).abs() < 1e-12);
                let mean: DVec3 = facet.corners.iter().zip(shares).map(|(&i, s)| points[i] * s).sum();
                assert!(mean.normalize().distance(direction) < 1e-12);
            }
        }
    }

    #[test]
    fn a_point_has_its_own_direction_to_itself() {
        let points = lattice(146);
        let hull = Hull::from_points(&points);
        for (i, point) in points.iter().enumerate() {
            let (facet, shares) = hull.locate(*point);
            let own = facet.corners.iter().position(|&c| c == i).expect("the facet touches the point");
            assert!(shares[own] > 1.0 - 1e-12);
        }
    }
}
