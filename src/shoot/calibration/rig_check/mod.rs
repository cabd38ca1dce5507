//! Faults of the rig, each reported with its lamps and a remedy.

mod finding;
mod layout;

pub use finding::{Fault, Finding};

use base::error::{Error, Result};
use base::files;
use base::median::median;
use finding::names;
use glam::Vec3;
use imaging::color::luminance;
use light::{Lamp, Rig};
use project::{Picture, Project};
use std::collections::BTreeMap;
use std::io::Read;
use std::path::Path;

/// Largest share of the median energy of a dark lamp. Its OLAT's noise is amplified at least fifty times as much as
/// the others'.
const DARK: f32 = 0.02;
/// Smallest clipped share of the energy of a clipped lamp. Below it, a clipped core loses less light than lamps
/// vary from frame to frame.
const CLIPPED: f32 = 0.05;
/// Largest angle between two OLATs of one lamp, together with [`SAME_ENERGY`]. Two lamps of different colour in one
/// housing differ in energy.
const SAME_DEG: f32 = 1.0;
const SAME_ENERGY: f32 = 0.1;

/// Finds every fault of a measured rig; empty for a good one. `blind_half_angle_deg` is
/// [`super::mirror_ball::MirrorBall::blind_half_angle_deg`]. `layout` holds the intended direction of each lamp, in
/// the rig's order; it may be rotated as a whole against the rig and is empty if unknown.
pub fn check(rig: &Rig, blind_half_angle_deg: f32, layout: &[Vec3]) -> Vec<Finding> {
    let lamps = &rig.lamps;
    let duplicates = same_lamps(lamps);
    let in_layout = layout::compare(lamps, layout, &duplicates.concat());
    let mut findings = Vec::new();
    let mut add = |fault, lamps: Vec<usize>, sentence: &dyn Fn(&str) -> String| {
        if !lamps.is_empty() {
            let sentence = sentence(&names(rig, &lamps));
            findings.push(Finding { fault, lamps, sentence });
        }
    };
    let all = || 0..lamps.len();
    let spread = spread_deg(lamps);
    let is_behind = |direction: Vec3, spread_deg: f32| {
        // A uniform disc reaches √2 times its root-mean-square radius.
        let reach = blind_half_angle_deg + std::f32::consts::SQRT_2 * spread_deg;
        direction.angle_between(Vec3::NEG_Z).to_degrees() < reach
    };
    // Only the layout can tell if an unseen lamp is fully behind the ball.
    let (hidden, unseen): (Vec<usize>, Vec<usize>) = all()
        .filter(|&i| !lamps[i].is_usable())
        .partition(|&i| in_layout.place(i).is_some_and(|place| is_behind(place, 0.0)));
    add(Fault::NotSeen, unseen, &|names| {
        format!(
            "{names}: not visible on the mirror ball, or missing in one colour channel; relit pictures cannot \
             use it. Check that the lamp was on and not blocked, and photograph its ball and OLATs again"
        )
    });
    let median = median(lamps.iter().filter(|l| l.is_usable()).map(|l| luminance(l.energy)));
    let dark = |i: &usize| lamps[*i].is_usable() && luminance(lamps[*i].energy) < DARK * median;
    add(Fault::Dark, all().filter(dark).collect(), &|names| {
        format!(
            "{names}: below {:.0} % of the median lamp's light; the OLAT's noise is amplified more than \
             {:.0} times. Check the lamp and its shutter, or photograph it again with all its banks on",
            100.0 * DARK,
            1.0 / DARK
        )
    });
    let clipped = |i: &usize| lamps[*i].is_usable() && lamps[*i].clipped > CLIPPED;
    add(Fault::Clipped, all().filter(clipped).collect(), &|names| {
        format!(
            "{names}: clipped on the mirror ball. The direction is right, but the lamp is brighter than measured, \
             so relit pictures get too much of its light. Photograph the balls again with a shorter exposure or a \
             denser filter"
        )
    });
    let behind = |i: &usize| {
        let lamp = &lamps[*i];
        let seen = lamp.is_usable() && is_behind(lamp.direction, lamp.spread_deg.max(spread));
        seen || hidden.contains(i)
    };
    add(Fault::BehindBall, all().filter(behind).collect(), &|names| {
        format!(
            "{names}: hidden, at least in part, behind the mirror ball (within {blind_half_angle_deg:.0}° of \
                 its axis); direction and energy are estimates. Photograph the ball again from the side for \
                 these lamps"
        )
    });
    for duplicates in duplicates {
        add(Fault::SameLamp, duplicates, &|names| {
            format!(
                "{names} show the same lamp: same direction, same energy. Check whether a picture was copied or \
                 the lamp control got stuck, and photograph the missing lamps"
            )
        });
    }
    findings.extend(in_layout.findings(rig));
    findings
}

/// Faults of a project's lamps, each with its sentence.
///
/// # Errors
/// When a picture cannot be read.
pub(super) fn check_project(project: &Project, rig: &Rig, blind_half_angle_deg: f32) -> Result<Vec<(Fault, String)>> {
    let layout = &project.settings.shoot.lamp_layout;
    let findings = check(rig, blind_half_angle_deg, layout);
    let mut found: Vec<(Fault, String)> = findings.into_iter().map(|f| (f.fault, f.sentence)).collect();
    // The first is the interview's ball.
    let balls = project.probe_pictures();
    for same in same_pictures(balls.get(1..).unwrap_or_default())? {
        let names: Vec<&str> = same.iter().map(|&lamp| rig.lamps[lamp].name.as_str()).collect();
        let sentence = format!(
            "the mirror balls of {} are copies of one picture. Give each lamp its own photograph",
            names.join(", ")
        );
        found.push((Fault::SamePicture, sentence));
    }
    let shoot = &project.settings.shoot;
    let mut olats = BTreeMap::<Vec<usize>, Vec<&str>>::new();
    for (pose, name) in shoot.poses.iter().enumerate() {
        let lamps = project.pose_lamps(pose);
        let olat = |&lamp: &usize| project.olat_picture(pose, lamp);
        let pictures: Vec<Picture> = lamps.iter().map(olat).collect();
        for same in same_pictures(&pictures)? {
            let same = same.into_iter().map(|place| lamps[place]).collect();
            olats.entry(same).or_default().push(name);
        }
    }
    for (same, poses) in olats {
        let sentence = format!(
            "{} of {} are copies of one picture. Give each lamp its own OLAT, or leave these lamps out",
            same.iter().map(|&lamp| shoot.lamp(lamp).as_str()).collect::<Vec<_>>().join(", "),
            poses.join(", ")
        );
        found.push((Fault::SamePicture, sentence));
    }
    Ok(found)
}

/// Groups of byte-identical pictures under several names, as indices into `pictures`.
///
/// # Errors
/// When a file cannot be read.
pub fn same_pictures(pictures: &[Picture]) -> Result<Vec<Vec<usize>>> {
    let refuse = |path: &Path, e: std::io::Error| Error::io("read", path, e, "Check that the shoot is complete");
    // Few files have the same length, so few are read.
    let mut by_length = BTreeMap::<u64, Vec<usize>>::new();
    let mut by_frame = BTreeMap::<&Picture, Vec<usize>>::new();
    for (i, mut picture) in pictures.iter().enumerate() {
        // Mirror images of one picture are alike.
        while let Picture::Mirrored(original, _) = picture {
            picture = original;
        }
        match picture {
            Picture::File(path) => {
                let length = std::fs::metadata(path).map_err(|e| refuse(path, e))?.len();
                by_length.entry(length).or_default().push(i);
            }
            _ => by_frame.entry(picture).or_default().push(i),
        }
    }
    let mut groups: Vec<Vec<usize>> = by_frame.into_values().collect();
    for candidates in by_length.into_values().filter(|c| c.len() > 1) {
        let mut by_content = BTreeMap::<Vec<u8>, Vec<usize>>::new();
        for i in candidates {
            let (path, mut bytes) = (pictures[i].file(), Vec::new());
            files::open(path).and_then(|mut file| file.read_to_end(&mut bytes)).map_err(|e| refuse(path, e))?;
            by_content.entry(bytes).or_default().push(i);
        }
        groups.extend(by_content.into_values());
    }
    groups.retain(|same| same.len() > 1);
    groups.sort();
    Ok(groups)
}

/// Groups of OLATs that show the same lamp.
fn same_lamps(lamps: &[Lamp]) -> Vec<Vec<usize>> {
    // Neighbours on a dense dome may be closer than duplicates on a sparse one.
    let usable: Vec<usize> = (0..lamps.len()).filter(|&i| lamps[i].is_usable()).collect();
    let angle = |i: usize, j: usize| lamps[i].direction.angle_between(lamps[j].direction).to_degrees();
    let nearest = usable.iter().map(|&i| {
        let others = usable.iter().filter(|&&j| j != i);
        others.map(|&j| angle(i, j)).fold(180.0, f32::min)
    });
    // A quarter of the median spacing. Duplicates have zero spacing and are left out.
    let spacing = median(nearest.filter(|a| *a > 0.1));
    let limit = SAME_DEG.min(if spacing > 0.0 { 0.25 * spacing } else { SAME_DEG });
    let same = |i: usize, j: usize| {
        let energy = lamps[i].energy.iter().zip(lamps[j].energy);
        angle(i, j) < limit && energy.into_iter().all(|(a, b)| (a - b).abs() < SAME_ENERGY * a.max(b))
    };
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for &lamp in &usable {
        match groups.iter_mut().find(|group| same(group[0], lamp)) {
            Some(group) => group.push(lamp),
            None => groups.push(vec![lamp]),
        }
    }
    groups.retain(|group| group.len() > 1);
    groups
}

/// Median spread of the lamps in degrees. A partly hidden lamp looks narrower.
fn spread_deg(lamps: &[Lamp]) -> f32 {
    median(lamps.iter().filter(|l| l.is_usable()).map(|l| l.spread_deg))
}

#[cfg(test)]
mod tests;
