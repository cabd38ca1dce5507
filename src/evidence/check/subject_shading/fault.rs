//! A disagreement of a pose's shading with the lamps.

use footage::LampSettings;
use light::Lamp;
use project::Axis;

/// One disagreement.
#[derive(Clone, Debug, PartialEq)]
pub struct Fault {
    pub kind: Kind,
    /// Poses, counted from 0; all of them if a fault of the balls would look the same.
    pub poses: Vec<usize>,
    /// True if the evidence is strong.
    pub certain: bool,
}

/// Kind of a disagreement, with lamps counted as in the rig.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// The OLAT is black, the lamp's ball is lit.
    Black(usize),
    /// Two lamps are exchanged.
    Exchanged(usize, usize),
    /// From one lamp to another, each OLAT shows the next lamp.
    Early(usize, usize),
    /// From one lamp to another, each OLAT shows the lamp before.
    Late(usize, usize),
    /// Another order altogether.
    Disordered,
    /// Left and right are mirrored.
    Mirrored,
    /// Up and down are mirrored.
    UpsideDown,
}

impl Fault {
    /// Poses, lamps and disagreement.
    pub fn sentence(&self, lamps: &[Lamp], poses: &[&str]) -> String {
        let name = |lamp: usize| &lamps[lamp].name;
        let all = self.poses.len() == poses.len();
        let named: Vec<&str> = self.poses.iter().map(|&pose| poses[pose]).collect();
        let place = match (all, &named[..]) {
            (true, [_, _, ..]) => "All poses".to_owned(),
            (_, named) => format!("Pose {}", named.join(", ")),
        };
        match self.kind {
            Kind::Black(lamp) => {
                let though = if lamps[lamp].is_usable() { "the lamp was found" } else { "other poses show the lamp" };
                format!("{place}, {}: the OLAT is black, though {though}", name(lamp))
            }
            Kind::Exchanged(a, b) => {
                let (a, b) = (name(a), name(b));
                format!("{place}: the OLATs of {a} and {b} are exchanged")
            }
            Kind::Early(from, to) => {
                let (from, to) = (name(from), name(to));
                format!("{place}: from {from} to {to}, each OLAT shows the next lamp")
            }
            Kind::Late(from, to) => {
                let (from, to) = (name(from), name(to));
                format!("{place}: from {from} to {to}, each OLAT shows the lamp before")
            }
            Kind::Disordered => format!("{place}: the OLATs are not in the lamps' order"),
            Kind::Mirrored if all => {
                "The lamps' directions are mirrored: lamps on the left light the subject from the right".to_owned()
            }
            Kind::Mirrored => format!("{place}: the OLATs are mirrored left to right"),
            Kind::UpsideDown if all => {
                "The lamps' directions are upside down: lamps above light the subject from below".to_owned()
            }
            Kind::UpsideDown => format!("{place}: the OLATs are upside down"),
        }
    }

    /// The correction that undoes it, without a change of files.
    pub fn correction(&self, lamps: &[Lamp], poses: &[&str]) -> Option<LampSettings> {
        let name = |lamp: usize| lamps[lamp].name.clone();
        let all = self.poses.len() == poses.len();
        let pose = if all { &[][..] } else { &self.poses };
        let none =
            LampSettings { pose: pose.iter().map(|&pose| poses[pose].to_owned()).collect(), ..LampSettings::default() };
        Some(match self.kind {
            Kind::Black(lamp) => LampSettings { leave_out: vec![name(lamp)], ..none },
            Kind::Exchanged(a, b) => LampSettings { exchange: vec![[name(a), name(b)]], ..none },
            Kind::Early(from, to) => LampSettings { shift: Some([name(from), name(to)]), ..none },
            Kind::Late(from, to) => LampSettings { shift: Some([name(to), name(from)]), ..none },
            Kind::Mirrored if all => LampSettings { mirror_balls: Some(Axis::LeftRight), ..none },
            Kind::UpsideDown if all => LampSettings { mirror_balls: Some(Axis::UpDown), ..none },
            Kind::Mirrored | Kind::UpsideDown | Kind::Disordered => return None,
        })
    }
}

impl Kind {
    /// Remedy for a fault in all poses or in some.
    pub fn remedy(self, all: bool) -> &'static str {
        match self {
            Self::Black(_) if all => "Photograph this lamp again, or leave it out",
            Self::Black(_) => "Photograph this OLAT again, or leave it out of this pose",
            Self::Exchanged(..) if all => "Exchange the two lamps' OLATs",
            Self::Exchanged(..) => "Exchange the two OLATs of this pose",
            Self::Early(..) | Self::Late(..) if all => {
                "Look for a missing or extra picture, or shift the OLATs by one lamp"
            }
            Self::Early(..) | Self::Late(..) => {
                "Look for a missing or extra picture in this pose, or shift its OLATs by one lamp"
            }
            Self::Disordered => "Name the OLATs like the balls or the list, and import again",
            Self::Mirrored | Self::UpsideDown if all => "Mirror the photographs of the balls, or the list",
            Self::Mirrored | Self::UpsideDown => "Flip the pictures of this pose, and calibrate again",
        }
    }
}
