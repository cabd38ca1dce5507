//! Frames worth photographing as poses.

use super::poses::root_mean;

/// Mean squares of a frame's subject cells, by cell number.
pub type Squares = Vec<(usize, f64)>;

/// Frames that, photographed as poses one after the other, would leave the least unexplained: each is the farthest from
/// the poses and from those chosen before it (Gonzalez 1985). `frames` are identified by index; `apart(a, chosen)` is
/// the distance of frame `a` from a chosen one.
///
/// # Errors
/// Those of `apart`.
pub fn missing<E>(
    mut frames: Vec<Squares>,
    count: usize,
    mut apart: impl FnMut(usize, usize) -> Result<Squares, E>,
) -> Result<Vec<usize>, E> {
    // A frame that shows little of the subject has a bad matte.
    let mut counts: Vec<usize> = frames.iter().map(Vec::len).collect();
    counts.sort_unstable();
    let usual = counts.get(counts.len() / 2).copied().unwrap_or(0);
    let usable: Vec<usize> = (0..frames.len()).filter(|&frame| 2 * frames[frame].len() > usual).collect();
    let distance = |frame: &Squares| root_mean(frame.iter().map(|(_, square)| *square));
    let mut chosen = Vec::new();
    while chosen.len() < count {
        let left = usable.iter().filter(|frame| !chosen.contains(*frame));
        let far = |frame: &&usize| distance(&frames[**frame]);
        let Some(&farthest) = left.max_by(|a, b| far(a).total_cmp(&far(b))) else { break };
        if distance(&frames[farthest]) <= 0.0 {
            break;
        }
        chosen.push(farthest);
        if chosen.len() == count {
            break;
        }
        for &frame in usable.iter().filter(|&&frame| frame != farthest) {
            let nearer = apart(frame, farthest)?;
            for (known, new) in frames[frame].iter_mut().zip(nearer) {
                known.1 = known.1.min(new.1);
            }
        }
    }
    Ok(chosen)
}
