//! Lamps of one bank, told from reflections.

use super::{BANK, Part};
use glam::Vec3;

/// Lamps of a bank have at least this share of the main one's inner radius. By their light they cannot be told from
/// reflections, because near the rim some of them melt together.
pub(super) const SAME_BANK: f32 = 0.45;
/// Lamps of a bank are at most this far apart, edge to edge.
const BANK_GAP_DEG: f32 = 15.0;
/// Lamps of one bank that are far apart have at least this share of the light of the one with the most. Reflections
/// have less, but one or two of them may come near it.
const SAME_GLINT: f32 = 0.25;

impl Part {
    /// True if a part of the given middle and radius is so near that both can be lamps of one bank.
    pub fn is_near(&self, direction: Vec3, radius_deg: f32) -> bool {
        let apart = self.direction.angle_between(direction).to_degrees();
        apart - self.radius_deg - radius_deg < BANK_GAP_DEG
    }
}

/// The parts that may be lamps of one bank with the first.
pub(super) fn alike(mut parts: Vec<Part>) -> Vec<Part> {
    if let Some(first) = parts.first() {
        let (energy, radius) = (SAME_GLINT * first.energy, SAME_BANK * first.inner_radius);
        parts.retain(|part| part.energy >= energy && part.inner_radius >= radius);
    }
    parts
}

/// The strongest part with those that form a bank with it, and the others. Parts are sorted by their light.
pub(super) fn bank(parts: Vec<&Part>) -> (Vec<&Part>, Vec<&Part>) {
    let least = SAME_BANK * parts[0].inner_radius;
    let (alike, unlike): (Vec<&Part>, Vec<&Part>) =
        (parts.into_iter()).partition(|part| part.inner_radius >= least);
    let mut others = alike;
    let mut bank = vec![others.remove(0)];
    gather(&mut bank, &mut others);
    others.extend(unlike);
    // Near the rim lamps of a bank are thin, and what the ball hides of them makes them thinner.
    if bank.len() >= BANK {
        gather(&mut bank, &mut others);
    }
    (bank, others)
}

/// Moves those of the others that are near some of the bank to the bank.
fn gather<'a>(bank: &mut Vec<&'a Part>, others: &mut Vec<&'a Part>) {
    let mut next = 0;
    while next < bank.len() {
        let from = bank[next];
        let near = others.extract_if(.., |part| from.is_near(part.direction, part.radius_deg));
        bank.extend(near);
        next += 1;
    }
}
