//! Comparison of the measured rig with the layout: swapped and displaced lamps.

use super::finding::{Fault, Finding, names};
use base::median::median;
use glam::{Mat3, Quat, Vec3};
use light::{Lamp, Rig};

/// Comparison of a rig with its layout.
pub(super) struct LayoutComparison {
    /// Expected direction of each lamp, rotated to the rig; empty if unknown.
    places: Vec<Vec3>,
    outcome: Outcome,
}

enum Outcome {
    /// Nothing to compare.
    Nothing,
    /// Lamps at another lamp's place (lamp, whose place), and lamps at no lamp's place.
    Placed { moved: Vec<(usize, usize)>, lost: Vec<usize> },
    /// All lamps at some lamp's place, but with other names (lamp, whose place).
    Reordered(Vec<(usize, usize)>),
    /// Left and right are exchanged.
    Mirrored,
    /// No rotation aligns the layout with the rig; the median angle between both in degrees.
    OtherDome(f32),
    /// Number of directions in a layout that differs from the rig's number of lamps.
    WrongCount(usize),
}

/// Compares clearly seen lamps with the layout. Excludes `duplicates`, one of which is wrong.
pub(super) fn compare(lamps: &[Lamp], layout: &[Vec3], duplicates: &[usize]) -> LayoutComparison {
    let nothing = |outcome| LayoutComparison { places: vec![], outcome };
    if layout.is_empty() {
        return nothing(Outcome::Nothing);
    }
    if layout.len() != lamps.len() || !layout.iter().all(|d| d.is_normalized()) {
        return nothing(Outcome::WrongCount(layout.len()));
    }
    let seen: Vec<usize> = (0..lamps.len()).filter(|&i| lamps[i].is_usable() && lamps[i].confidence >= 0.5).collect();
    let spacings = spacings(layout);
    let tolerance = tolerance(median(spacings.iter().copied()));
    let plain = Alignment::find(lamps, layout, &seen, tolerance);
    let flipped: Vec<Vec3> = layout.iter().map(|d| d.with_x(-d.x)).collect();
    let mirrored = Alignment::find(lamps, &flipped, &seen, tolerance);
    // One lamp in a hundred is within the tolerance of its place by chance, and the pair that suggested the
    // rotation always is: more than half of all lamps cannot be chance. In a small rig two swapped lamps are two
    // fewer.
    let enough = if seen.len() < 8 { seen.len().saturating_sub(2).max(3) } else { seen.len() / 2 + 1 };
    if mirrored.matches >= enough && mirrored.matches > plain.matches + seen.len() / 4 {
        return nothing(Outcome::Mirrored);
    }
    if seen.len() < 3 {
        return nothing(Outcome::Nothing);
    }
    if plain.matches < enough {
        return nothing(without_names(lamps, layout, &seen, tolerance));
    }
    let places: Vec<Vec3> = layout.iter().map(|d| plain.rotation * *d).collect();
    let off = |lamp: usize, place: usize| lamps[lamp].direction.angle_between(places[place]);
    // A place is free if its own lamp is elsewhere or unseen.
    let displaced: Vec<usize> = seen
        .iter()
        .copied()
        .filter(|&i| off(i, i) > tolerance.min(self::tolerance(spacings[i])) && !duplicates.contains(&i))
        .collect();
    let free: Vec<usize> =
        (0..lamps.len()).filter(|i| displaced.contains(i) || !seen.contains(i) || duplicates.contains(i)).collect();
    let (mut moved, mut lost) = (vec![], vec![]);
    for &lamp in &displaced {
        let near = free.iter().copied().filter(|&p| p != lamp && off(lamp, p) <= tolerance);
        match near.min_by(|&a, &b| off(lamp, a).total_cmp(&off(lamp, b))) {
            Some(place) => moved.push((lamp, place)),
            None => lost.push(lamp),
        }
    }
    LayoutComparison { places, outcome: Outcome::Placed { moved, lost } }
}

/// Allowed distance in radians of a lamp from its place, with the next place `spacing` away: a third of that, so
/// that the lamp is clearly nearer to its own; at least 2°, for a small ball's pixels, and at most 12°.
fn tolerance(spacing: f32) -> f32 {
    (spacing / 3.0).clamp(2f32.to_radians(), 12f32.to_radians())
}

/// Angle in radians from each place to the next.
fn spacings(layout: &[Vec3]) -> Vec<f32> {
    let nearest = |(i, a): (usize, &Vec3)| {
        let others = layout.iter().enumerate().filter(|(j, _)| *j != i);
        others.map(|(_, b)| a.angle_between(*b)).fold(std::f32::consts::PI, f32::min)
    };
    layout.iter().enumerate().map(nearest).collect()
}

/// Comparison ignoring names: each lamp against all places.
fn without_names(lamps: &[Lamp], layout: &[Vec3], seen: &[usize], tolerance: f32) -> Outcome {
    let off = |lamp: usize, place: usize| lamps[lamp].direction.angle_between(layout[place]);
    let mut moved = Vec::new();
    for &lamp in seen {
        let nearest = (0..layout.len()).min_by(|&a, &b| off(lamp, a).total_cmp(&off(lamp, b)));
        moved.extend(nearest.filter(|&p| off(lamp, p) <= tolerance).map(|p| (lamp, p)));
    }
    let mut places: Vec<usize> = moved.iter().map(|(_, place)| *place).collect();
    places.sort_unstable();
    places.dedup();
    if places.len() as f32 >= 0.9 * seen.len() as f32 {
        moved.retain(|(lamp, place)| lamp != place);
        return Outcome::Reordered(moved);
    }
    Outcome::OtherDome(median(seen.iter().map(|&i| off(i, i))).to_degrees())
}

/// A rotation of the layout, and the number of lamps near their places under it.
struct Alignment {
    rotation: Quat,
    matches: usize,
}

impl Alignment {
    /// Rotation with the most agreement: each pair of lamps suggests one (the TRIAD method, Black 1964). Swapped or
    /// displaced lamps suggest other rotations.
    fn find(lamps: &[Lamp], layout: &[Vec3], seen: &[usize], tolerance: f32) -> Self {
        /// Number of pairs tried. With half of the lamps wrong, a quarter of the pairs are right.
        const PAIRS: usize = 400;
        let n = seen.len();
        // A lamp counts by its distance (MSAC, Torr and Zisserman 2000): by number alone, many lamps near by chance
        // would beat fewer that fit.
        let judge = |rotation: Quat| {
            let off = seen.iter().map(|&i| lamps[i].direction.angle_between(rotation * layout[i]));
            let near: Vec<f32> = off.filter(|off| *off <= tolerance).collect();
            let score: f32 = near.iter().map(|off| 1.0 - (off / tolerance).powi(2)).sum();
            (score, near.len())
        };
        let mut best = (Quat::IDENTITY, judge(Quat::IDENTITY));
        let pairs = (1..n).flat_map(|step| (0..n).map(move |i| (i, (i + step) % n)));
        // All pairs of a small rig; evenly spread pairs of a large one.
        let stride = (n * n.saturating_sub(1) / PAIRS).max(1);
        for (i, j) in pairs.step_by(stride) {
            let (i, j) = (seen[i], seen[j]);
            let frames = (frame(lamps[i].direction, lamps[j].direction), frame(layout[i], layout[j]));
            if let (Some(measured), Some(planned)) = frames {
                let rotation = Quat::from_mat3(&(measured * planned.transpose())).normalize();
                let score = judge(rotation);
                if score.0 > best.1.0 {
                    best = (rotation, score);
                }
            }
        }
        let rotation = refine(lamps, layout, seen, tolerance, best.0);
        let refined = judge(rotation);
        let (rotation, (_, matches)) = if refined.0 < best.1.0 { best } else { (rotation, refined) };
        Self { rotation, matches }
    }
}

/// Orthonormal axes defined by two directions; `None` if they are nearly collinear.
fn frame(a: Vec3, b: Vec3) -> Option<Mat3> {
    let normal = a.cross(b);
    (normal.length() > 0.2).then(|| {
        let normal = normal.normalize();
        Mat3::from_cols(a, normal.cross(a), normal)
    })
}

/// Least-squares rotation for the lamps near their places, by Gauss–Newton steps.
fn refine(lamps: &[Lamp], layout: &[Vec3], seen: &[usize], tolerance: f32, mut rotation: Quat) -> Quat {
    for _ in 0..10 {
        let (mut torque, mut inertia) = (Vec3::ZERO, Mat3::ZERO);
        for &i in seen {
            let (place, lamp) = (rotation * layout[i], lamps[i].direction);
            if place.angle_between(lamp) <= tolerance {
                torque += place.cross(lamp);
                let outer = Mat3::from_cols(place * place.x, place * place.y, place * place.z);
                inertia += Mat3::IDENTITY - outer;
            }
        }
        // Lamps in one direction do not determine the rotation about it.
        if inertia.determinant() < 1e-3 {
            break;
        }
        rotation = (Quat::from_scaled_axis(inertia.inverse() * torque) * rotation).normalize();
    }
    rotation
}

impl LayoutComparison {
    /// Place of lamp `i` in the layout, if known.
    pub fn place(&self, i: usize) -> Option<Vec3> {
        self.places.get(i).copied()
    }

    /// Faults found, if any.
    pub fn findings(&self, rig: &Rig) -> Vec<Finding> {
        let name = |i: usize| rig.lamps[i].name.as_str();
        let chain = |moved: &[(usize, usize)]| {
            let links = moved.iter().take(8);
            let links: Vec<String> = links.map(|&(a, b)| format!("{} shows {}", name(a), name(b))).collect();
            let more = moved.len().saturating_sub(8);
            let more = if more > 0 { format!(" and {more} more") } else { String::new() };
            format!("{}{more}", links.join(", "))
        };
        let whole = |sentence: String| {
            vec![Finding { fault: Fault::WrongLayout, lamps: (0..rig.lamps.len()).collect(), sentence }]
        };
        match &self.outcome {
            Outcome::Nothing => vec![],
            Outcome::WrongCount(count) => whole(format!(
                "The list of lamps has {count} directions for {} lamps and was not checked. Correct the list (.lp, or the \
                 manifest's directions) and import again",
                rig.lamps.len()
            )),
            Outcome::Mirrored => whole(
                "The list of lamps is the mirror image of the measured lamps: left and right are swapped in it, or the \
                 pictures are flopped. Change the sign of x in the list (.lp, or the manifest's directions), or flop the pictures"
                    .into(),
            ),
            Outcome::OtherDome(median_deg) => whole(format!(
                "The measured lamps are {median_deg:.0}° (median) away from their places in the list of lamps, and no \
                 rotation of the list helps. Check that the list (.lp, or the manifest's directions) belongs to this dome and \
                 uses the axes +X right, +Y up, +Z to the camera"
            )),
            Outcome::Reordered(moved) => {
                let mut lamps: Vec<usize> = moved.iter().map(|(lamp, _)| *lamp).collect();
                lamps.sort_unstable();
                vec![Finding {
                    fault: Fault::Swapped,
                    lamps,
                    sentence: format!(
                        "The lamps match the layout, but in another order: {}. Rename the OLATs and \
                         balls to follow the layout, or correct the order in the manifest",
                        chain(moved)
                    ),
                }]
            }
            Outcome::Placed { moved, lost } => {
                let mut findings = Vec::new();
                let mut rest = Vec::new();
                for &(a, b) in moved {
                    if !moved.contains(&(b, a)) {
                        rest.push((a, b));
                    } else if a < b {
                        findings.push(Finding {
                            fault: Fault::Swapped,
                            lamps: vec![a, b],
                            sentence: format!(
                                "{} and {} are swapped compared with the layout. Swap their names, \
                                 for the balls and for the OLATs of every pose",
                                name(a),
                                name(b)
                            ),
                        });
                    }
                }
                if !rest.is_empty() {
                    findings.push(Finding {
                        fault: Fault::Swapped,
                        lamps: rest.iter().map(|(lamp, _)| *lamp).collect(),
                        sentence: format!(
                            "According to the layout, {}. Look for a missing or repeated OLAT that \
                             shifts all later names by one, then rename them",
                            chain(&rest)
                        ),
                    });
                }
                if !lost.is_empty() {
                    findings.push(Finding {
                        fault: Fault::Misplaced,
                        lamps: lost.clone(),
                        sentence: format!(
                            "{}: no lamp in this direction in the layout. Check whether the lamp was moved, or \
                             whether its ball shows a reflection in the room instead",
                            names(rig, lost)
                        ),
                    });
                }
                findings
            }
        }
    }
}
