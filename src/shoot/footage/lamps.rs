//! Corrections of a shoot's lamps: OLATs and lamps left out, exchanged OLATs, mirrored balls. The files stay as they are.

use super::framed::dimensions;
use super::missing_olats::lacks;
use super::scan::counted;
use base::error::{Error, Result};
use base::files::natural_order;
use base::shell::quoted;
use project::{Axis, Project};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

/// Corrections of a shoot's lamps.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, clap::Args)]
pub struct LampSettings {
    /// Lamp to leave out of --pose, where its other lamps stand in; without --pose, of the shoot. Can be given several times.
    #[arg(long, value_name = "LAMP")]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub leave_out: Vec<String>,
    /// Two lamps whose OLATs to exchange. Can be given several times.
    #[arg(long, value_name = "LAMP,LAMP", value_parser = pair)]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub exchange: Vec<[String; 2]>,
    /// First and last lamp, by name, whose OLATs to shift: each to the next lamp, or with the last named first to the lamp
    /// before. The last of them takes the free place.
    #[arg(long, value_name = "LAMP,LAMP", value_parser = pair)]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shift: Option<[String; 2]>,
    /// Mirror the photographs of the mirror balls, or the directions of a list of lamps.
    #[arg(long, value_enum, value_name = "AXIS")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mirror_balls: Option<Axis>,
    /// Poses whose OLATs to correct [default: all]. Can be given several times.
    #[arg(long, value_name = "POSE")]
    #[serde(rename = "poses")]
    pub pose: Vec<String>,
}

/// A shoot's lamps, and their corrections.
#[derive(Clone, Debug, Serialize)]
pub struct LampReport {
    /// Names of all lamps.
    pub lamps: Vec<String>,
    /// Lamps without an OLAT, by pose.
    pub missing: BTreeMap<String, BTreeSet<String>>,
    /// Files of exchanged OLATs, by pose and lamp.
    pub exchanged: BTreeMap<String, BTreeMap<String, String>>,
    /// Axes along which the photographs of the mirror balls are mirrored back.
    pub mirrored_balls: BTreeSet<Axis>,
    /// Folder with the previous calibration and network, if they existed.
    pub aside: Option<PathBuf>,
}

/// Parses two names.
fn pair(text: &str) -> std::result::Result<[String; 2], String> {
    match text.split_once(',').map(|(a, b)| [a.trim(), b.trim()]) {
        Some([a, b]) if !a.is_empty() && !b.is_empty() && a != b => Ok([a, b].map(str::to_owned)),
        _ => Err("give two different lamps, such as olat_07,olat_08".to_owned()),
    }
}

impl LampSettings {
    /// Corrects the project's lamps, or only reports them. For [`Project::change`].
    ///
    /// # Errors
    /// When a lamp or pose does not exist, a pose or the shoot would keep too few lamps, or a folder cannot be written.
    pub fn run(&self, project: &mut Project) -> Result<LampReport> {
        let mut corrected = project.clone();
        self.correct(&mut corrected)?;
        let aside = if corrected == *project { None } else { project.put_aside()? };
        *project = corrected;
        let shoot = &project.settings.shoot;
        let corrections = shoot.corrections.clone();
        Ok(LampReport {
            lamps: shoot.all_lamps().cloned().collect(),
            missing: corrections.missing,
            exchanged: corrections.exchanged,
            mirrored_balls: corrections.balls,
            aside,
        })
    }

    fn correct(&self, project: &mut Project) -> Result<()> {
        let poses = self.poses(project)?;
        for [a, b] in &self.exchange {
            exchange(project, &poses, &[known(project, a)?, known(project, b)?]);
        }
        if let Some([first, last]) = &self.shift {
            let [first, last] = [known(project, first)?, known(project, last)?];
            shift(project, &poses, &first, &last);
        }
        for lamp in &self.leave_out {
            leave_out(project, &poses, &known(project, lamp)?)?;
        }
        match self.mirror_balls {
            Some(axis) => mirror_balls(project, axis),
            None => Ok(()),
        }
    }

    /// The corrected poses.
    fn poses(&self, project: &Project) -> Result<Vec<String>> {
        let all = &project.settings.shoot.poses;
        if self.pose.is_empty() {
            return Ok(all.clone());
        }
        match self.pose.iter().find(|pose| !all.contains(pose)) {
            Some(pose) => {
                Err(Error::missing(format!("the shoot has no pose {pose}"), format!("Choose from {}", all.join(", "))))
            }
            None => Ok(self.pose.clone()),
        }
    }

    /// The corrections as arguments of `afterlight lamps PROJECT`.
    pub fn arguments(&self) -> String {
        let leave_out = self.leave_out.iter().map(|lamp| ("leave-out", lamp.clone()));
        let exchange = self.exchange.iter().map(|pair| ("exchange", pair.join(",")));
        let shift = self.shift.iter().map(|pair| ("shift", pair.join(",")));
        let mirror = self.mirror_balls.iter().map(|axis| match axis {
            Axis::LeftRight => ("mirror-balls", "left-right".to_owned()),
            Axis::UpDown => ("mirror-balls", "up-down".to_owned()),
        });
        let pose = self.pose.iter().map(|pose| ("pose", pose.clone()));
        let all = leave_out.chain(exchange).chain(shift).chain(mirror).chain(pose);
        let all: Vec<String> = all.map(|(name, value)| format!("--{name} {}", quoted(&value))).collect();
        all.join(" ")
    }

    /// The corrections as a button's words.
    pub fn words(&self) -> String {
        let mut words = Vec::new();
        if !self.leave_out.is_empty() {
            words.push(format!("Leave out {}", self.leave_out.join(", ")));
        }
        words.extend(self.exchange.iter().map(|[a, b]| format!("Exchange {a} and {b}")));
        words.extend(self.shift.iter().map(|[a, b]| format!("Shift OLATs from {a} to {b}")));
        words.extend(self.mirror_balls.iter().map(|axis| match axis {
            Axis::LeftRight => "Mirror left and right".to_owned(),
            Axis::UpDown => "Mirror up and down".to_owned(),
        }));
        if !self.pose.is_empty() {
            words.push(format!("in {}", self.pose.join(", ")));
        }
        words.join(" ")
    }
}

impl LampReport {
    /// Sentences on the lamps and their corrections.
    pub fn sentence(&self) -> String {
        let mut lines = vec![format!("{}: {}", counted(self.lamps.len(), "lamp"), self.lamps.join(", "))];
        lines.extend(lacks(&self.missing));
        for (pose, files) in &self.exchanged {
            let files: Vec<String> = files.iter().map(|(lamp, file)| format!("{lamp} from {file}")).collect();
            lines.push(format!("{pose} exchanged: {}", files.join(", ")));
        }
        for axis in &self.mirrored_balls {
            lines.push(match axis {
                Axis::LeftRight => "Mirror balls: left and right exchanged".to_owned(),
                Axis::UpDown => "Mirror balls: up and down exchanged".to_owned(),
            });
        }
        if let Some(aside) = &self.aside {
            lines.push(format!("The previous calibration and network are in {}. Calibrate again", aside.display()));
        }
        lines.join("\n")
    }
}

/// The lamp of this name.
fn known(project: &Project, name: &str) -> Result<String> {
    let shoot = &project.settings.shoot;
    shoot.all_lamps().find(|lamp| *lamp == name).cloned().ok_or_else(|| {
        Error::missing(format!("the shoot has no lamp {name}"), ("List its lamps", "afterlight lamps PROJECT"))
    })
}

/// Gives each of these lamps the OLAT of the next one, and the last that of the first.
fn exchange(project: &mut Project, poses: &[String], lamps: &[String]) {
    let corrections = &mut project.settings.shoot.corrections;
    for pose in poses {
        let file = |lamp: &String| corrections.file(pose, lamp).to_owned();
        let mut files: Vec<String> = lamps.iter().map(file).collect();
        let mut lacks: Vec<bool> = lamps.iter().map(|lamp| corrections.lacks(pose, lamp)).collect();
        files.rotate_left(1);
        lacks.rotate_left(1);
        let exchanged = corrections.exchanged.entry(pose.clone()).or_default();
        for (lamp, file) in lamps.iter().zip(files) {
            if *lamp == file {
                exchanged.remove(lamp)
            } else {
                exchanged.insert(lamp.clone(), file)
            };
        }
        let missing = corrections.missing.entry(pose.clone()).or_default();
        for (lamp, lacks) in lamps.iter().zip(lacks) {
            if lacks {
                missing.insert(lamp.clone())
            } else {
                missing.remove(lamp)
            };
        }
    }
    corrections.exchanged.retain(|_, files| !files.is_empty());
    corrections.missing.retain(|_, lamps| !lamps.is_empty());
}

/// Moves the OLATs from lamp `first` to lamp `last` by one place towards `last`; that of `last` goes to `first`.
fn shift(project: &mut Project, poses: &[String], first: &String, last: &String) {
    let mut lamps: Vec<String> = project.settings.shoot.all_lamps().cloned().collect();
    lamps.sort_by(|a, b| natural_order(a, b));
    let place = |name: &String| lamps.iter().position(|lamp| lamp == name).unwrap_or(0);
    let (from, to) = (place(first), place(last));
    let mut shifted = lamps[from.min(to)..=from.max(to)].to_vec();
    if from < to {
        shifted.reverse();
    }
    exchange(project, poses, &shifted);
}

/// Leaves a lamp out of some poses; out of the shoot, if no pose keeps it.
fn leave_out(project: &mut Project, poses: &[String], lamp: &String) -> Result<()> {
    const FEWEST: usize = 2;
    let shoot = &mut project.settings.shoot;
    let corrections = &mut shoot.corrections;
    for pose in poses {
        corrections.missing.entry(pose.clone()).or_default().insert(lamp.clone());
    }
    if shoot.poses.iter().all(|pose| corrections.lacks(pose, lamp)) {
        corrections.missing.retain(|_, lamps| {
            lamps.remove(lamp);
            !lamps.is_empty()
        });
        corrections.exchanged.retain(|_, files| {
            files.remove(lamp);
            !files.is_empty()
        });
        let place = shoot.all_lamps().position(|other| other == lamp);
        if let Some(place) = place.filter(|_| !shoot.lamp_layout.is_empty()) {
            shoot.lamp_layout.remove(place);
        }
        shoot.lamps.retain(|other| other != lamp);
        shoot.other_lamps.retain(|other| other != lamp);
    }
    let few = (0..project.settings.shoot.poses.len()).find(|&pose| project.pose_lamps(pose).len() < FEWEST);
    if few.is_some() || project.settings.shoot.lamps.len() < FEWEST {
        return Err(Error::invalid(
            format!("without {lamp}, fewer than {FEWEST} lamps are left"),
            "Keep the lamp, or import a shoot with more",
        ));
    }
    Ok(())
}

/// Mirrors the photographs of the balls, or back; without balls, the directions of the list. A ball's known circle that moves
/// with its picture is found again by the calibration.
fn mirror_balls(project: &mut Project, axis: Axis) -> Result<()> {
    const MOVES: f32 = 1.0;
    if project.settings.shoot.without_balls {
        let flip = match axis {
            Axis::LeftRight => glam::Vec3::new(-1.0, 1.0, 1.0),
            Axis::UpDown => glam::Vec3::new(1.0, -1.0, 1.0),
        };
        project.settings.shoot.lamp_layout.iter_mut().for_each(|lamp| *lamp *= flip);
        return Ok(());
    }
    let (width, height) = dimensions(&project.interview_probe_picture())?;
    let (c, length) = match axis {
        Axis::LeftRight => (0, width),
        Axis::UpDown => (1, height),
    };
    let shoot = &mut project.settings.shoot;
    let second = shoot.second_ball.as_mut().map(|second| &mut second.ball);
    for ball in [&mut shoot.ball].into_iter().chain(second) {
        if ball.has_circle() && (2.0 * ball.center_px[c] - length as f32).abs() > MOVES {
            ball.radius_px = 0.0;
        }
    }
    let axes = &mut shoot.corrections.balls;
    if !axes.remove(&axis) {
        axes.insert(axis);
    }
    Ok(())
}

#[cfg(test)]
#[path = "lamps_tests.rs"]
mod tests;
