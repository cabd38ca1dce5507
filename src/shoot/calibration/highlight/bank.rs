//! Separation of a bank's lamps from reflections.

use glam::Vec3;

/// Smallest number of parts in a bank. Its parts are not opened, because the joints are wider than the parts.
pub(super) const BANK: usize = 3;
/// Smallest inner radius of a bank's lamps, relative to the main one. Light cannot separate them from reflections,
/// because near the rim some of them merge.
pub(super) const SAME_BANK: f32 = 0.45;
/// Largest gap between lamps of a bank, edge to edge.
const BANK_GAP_DEG: f32 = 15.0;
/// Smallest light of a bank's distant lamps, relative to the strongest. Reflections have less, but one or two of
/// them may come near it.
const SAME_GLINT: f32 = 0.25;

/// A connected bright part.
pub(super) struct Part {
    pub cells: Vec<u32>,
    pub energy: f32,
    pub direction: Vec3,
    /// Radius in degrees of a uniform disc with this root-mean-square angle.
    pub radius_deg: f32,
    /// Radius in cells of its largest inner disc.
    pub inner_radius: f32,
    /// Middle and radius in degrees without streaks.
    pub core: Vec3,
    pub core_radius_deg: f32,
}

impl Part {
    /// True if a part with this middle and radius is near enough to belong to the same bank.
    pub fn is_near(&self, direction: Vec3, radius_deg: f32) -> bool {
        let apart = self.direction.angle_between(direction).to_degrees();
        apart - self.radius_deg - radius_deg < BANK_GAP_DEG
    }
}

/// Parts that may be lamps of one bank with the first.
pub(super) fn alike(mut parts: Vec<Part>) -> Vec<Part> {
    if let Some(first) = parts.first() {
        let (energy, radius) = (SAME_GLINT * first.energy, SAME_BANK * first.inner_radius);
        parts.retain(|part| part.energy >= energy && part.inner_radius >= radius);
    }
    parts
}

/// The strongest part with those that form a bank with it, and the others. Parts are sorted by light.
pub(super) fn bank(parts: Vec<&Part>) -> (Vec<&Part>, Vec<&Part>) {
    let least = SAME_BANK * parts[0].inner_radius;
    let (alike, unlike): (Vec<&Part>, Vec<&Part>) = (parts.into_iter()).partition(|part| part.inner_radius >= least);
    let mut others = alike;
    let mut bank = vec![others.remove(0)];
    gather(&mut bank, &mut others);
    others.extend(unlike);
    // Near the rim lamps of a bank are thin, and hidden parts make them thinner.
    if bank.len() >= BANK {
        gather(&mut bank, &mut others);
    }
    (bank, others)
}

/// Moves the others that are near some of the bank into the bank.
fn gather<'a>(bank: &mut Vec<&'a Part>, others: &mut Vec<&'a Part>) {
    let mut next = 0;
    while next < bank.len() {
        let from = bank[next];
        let near = others.extract_if(.., |part| from.is_near(part.direction, part.radius_deg));
        bank.extend(near);
        next += 1;
    }
}
