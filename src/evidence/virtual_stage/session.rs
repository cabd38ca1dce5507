//! Data common to all pictures of one shoot: the stage, the subject's poses, the lights, and the tracing of a pose.

use super::StageSettings;
use super::ball_view::{bank_solid_angles, bounce};
use super::camera::{FRAME_HEIGHT_M, Sensor};
use super::dome::Dome;
use super::effects::Tally;
use super::environments;
use super::grid::Grid;
use super::interview_light::InterviewLight;
use super::motion::{Pose, exemplar_poses, interview};
use super::picture::{Pictures, Request, take};
use super::room::Room;
use super::subject::Subject;
use super::sway::{Sway, reseat};
use super::transport::Effort;
use super::trouble::Trouble;
use base::error::Result;
use base::progress::Progress;
use chacha20::ChaCha8Rng;
use glam::Vec3;
use imaging::Image;
use rand::SeedableRng;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Name of the progress bar.
const STAGE: &str = "virtual stage";

/// Data common to all pictures of one shoot.
pub struct Session<'a> {
    pub folder: &'a Path,
    pub settings: &'a StageSettings,
    pub progress: &'a Progress<'a>,
    pub dome: Dome,
    pub sensor: Sensor,
    pub trouble: Trouble,
    pub poses: Vec<Pose>,
    pub frames: Vec<Pose>,
    pub truth_frames: Vec<usize>,
    pub environments: Vec<(&'static str, Image)>,
    /// Weight of every lamp, per environment.
    pub environment_weights: Vec<Vec<[f32; 3]>>,
    pub room: Room,
    /// The room's reflection of each bank, as radiances of all lamps; `None` if it reflects nothing.
    bounce: Option<Vec<Vec<[f32; 3]>>>,
    pub light: InterviewLight,
    /// Sway of the subject in each pose; empty if the subject sits still.
    pub sways: Vec<Sway>,
    pub files: AtomicUsize,
    pictures: AtomicUsize,
    pub tally: std::sync::Mutex<Tally>,
}

impl<'a> Session<'a> {
    pub fn new(folder: &'a Path, settings: &'a StageSettings, progress: &'a Progress<'a>) -> Self {
        let (seed, trouble) = (settings.seed, settings.trouble.resolve(settings.seed));
        let dome = match trouble.bank_lamps {
            Some(each) => Dome::with(settings.lamps, each * settings.lamps),
            None => Dome::new(settings.lamps),
        };
        let room = Room::draw(&mut ChaCha8Rng::seed_from_u64(seed ^ 0x726f_6f6d));
        let bounce = (trouble.room > 0.0).then(|| bounces(&dome, &room, trouble.room));
        let environments = environments::all();
        let (mut poses, mut frames) = (exemplar_poses(), interview(settings.frames, seed));
        reseat(&mut poses, &mut frames, &trouble, seed);
        let like_frames = settings.like_frames.iter().map(|&frame| frames[frame]);
        let poses: Vec<Pose> = poses.into_iter().take(settings.poses).chain(like_frames).collect();
        let sways = if trouble.sway > 0.0 {
            (0..poses.len()).map(|i| Sway::draw(trouble.sway, seed, i)).collect()
        } else {
            vec![]
        };
        Self {
            folder,
            settings,
            progress,
            sensor: Sensor::new(seed, &trouble),
            poses,
            frames,
            truth_frames: truth_frames(settings.frames),
            environment_weights: environments.iter().map(|(_, image)| dome.lamp_weights(image)).collect(),
            environments,
            light: InterviewLight::draw(&dome, &trouble, &room, bounce.as_deref(), seed),
            room,
            bounce,
            sways,
            dome,
            trouble,
            files: AtomicUsize::new(0),
            pictures: AtomicUsize::new(0),
            tally: std::sync::Mutex::default(),
        }
    }

    /// Distances of the subject in a pose.
    pub fn bake(&self, pose: &Pose) -> Grid {
        Grid::bake(&Subject::new(pose, &self.trouble.look))
    }

    /// Traces one pose: the interview's light first, then, if requested, the environments and the banks.
    pub fn take(
        &self,
        pose: &Pose,
        grid: &Grid,
        size: (usize, usize),
        (environments, banks): (bool, bool),
        note: &str,
    ) -> Result<Pictures> {
        let mut sums: Vec<&[[f32; 3]]> = vec![&self.light.weights];
        if environments {
            sums.extend(self.environment_weights.iter().map(Vec::as_slice));
        }
        let own = sums.len();
        // The room's reflection of a bank comes from all sides.
        let bounced: Vec<Vec<[f32; 3]>> = match self.bounce {
            Some(_) if banks => (0..self.dome.banks.len()).map(|b| self.lit_bank(b)).collect(),
            _ => vec![],
        };
        sums.extend(bounced.iter().map(Vec::as_slice));
        let mut pictures = self.trace(pose, grid, size, banks && bounced.is_empty(), &sums)?;
        if !bounced.is_empty() {
            pictures.banks = pictures.sums.split_off(own);
        }
        let done = self.pictures.fetch_add(1, Ordering::Relaxed) + 1;
        self.progress.step(STAGE, done as u64, (self.poses.len() + self.frames.len()) as u64, note);
        Ok(pictures)
    }

    pub fn trace(
        &self,
        pose: &Pose,
        grid: &Grid,
        size: (usize, usize),
        banks: bool,
        sums: &[&[[f32; 3]]],
    ) -> Result<Pictures> {
        self.progress.check("the pictures written so far")?;
        let request = Request { banks, others: &self.light.others, sums, look: self.trouble.look };
        let pictures = take(&self.dome, pose, grid, size, &request, Effort::Needed);
        self.count(&pictures.tally);
        Ok(pictures)
    }

    /// Radiances of all lamps when one bank is on, including the room's reflection of it.
    pub fn lit_bank(&self, bank: usize) -> Vec<[f32; 3]> {
        let own = |b: usize| if b == bank { 1.0 } else { 0.0 };
        (self.dome.bank_of_lamp.iter().enumerate())
            .map(|(lamp, &b)| {
                let reflected = self.bounce.as_ref().map_or([0.0; 3], |all| all[bank][lamp]);
                reflected.map(|v| v + own(b))
            })
            .collect()
    }

    /// Offset of the face from its centre, per pose and lamp, in pixels right and down.
    pub fn sway_px(&self) -> Vec<Vec<[f32; 2]>> {
        let per_m = self.settings.size as f32 / FRAME_HEIGHT_M;
        let lamps = self.dome.banks.len();
        let at = |sway: &Sway, lamp: usize| {
            let [x, y] = sway.face_m(lamp_time(lamp, lamps));
            [x * per_m, -y * per_m]
        };
        let poses = self.sways.iter();
        poses.map(|sway| (0..lamps).map(|lamp| at(sway, lamp)).collect()).collect()
    }

    /// Numbers of the lamps before which the fully lit subject is photographed, and one past the last; `None` without
    /// tracking.
    pub fn tracking_times(&self) -> Option<Vec<usize>> {
        let lamps = self.dome.banks.len();
        let every = self.trouble.tracking?;
        Some((0..lamps).step_by(every).chain([lamps]).collect())
    }

    pub fn count(&self, tally: &Tally) {
        // A poisoned lock only means that another thread failed; the counts are still counts.
        self.tally.lock().unwrap_or_else(|broken| broken.into_inner()).add(tally);
    }
}

/// Time of a lamp in the sequence, from 0 (before the first) to 1 (after the last).
pub fn lamp_time(lamp: usize, lamps: usize) -> f32 {
    (lamp as f32 + 0.5) / lamps as f32
}

/// The room's reflection of each bank, as radiance of the part of the sphere nearest to each lamp.
fn bounces(dome: &Dome, room: &Room, share: f32) -> Vec<Vec<[f32; 3]>> {
    let reflectance = dome.lamp_weights(&room.reflectance);
    let banks = dome.banks.iter().zip(bank_solid_angles(dome));
    banks
        .map(|(&bank, solid_angle)| {
            let lamps = dome.lamps.iter().zip(&reflectance);
            lamps
                .map(|(&lamp, &reflectance)| {
                    bounce(share * Vec3::from(reflectance), bank, lamp, solid_angle).to_array()
                })
                .collect()
        })
        .collect()
}

/// Up to four frames spread over the clip.
fn truth_frames(frames: usize) -> Vec<usize> {
    let mut chosen: Vec<usize> = (0..4).map(|i| (2 * i + 1) * frames / 8).collect();
    chosen.dedup();
    chosen
}
