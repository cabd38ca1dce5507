//! Addresses of a project's pictures and mattes.

use super::{Frames, Matte, Picture, Project, SecondBall};
use imaging::file::with_ending;
use std::path::{Path, PathBuf};

impl Picture {
    /// True if its file exists; for a sequence, if its folder exists.
    pub(super) fn is_there(&self) -> bool {
        let file = self.file();
        let is_movie = matches!(self, Self::Movie { .. });
        file.is_file() || (is_movie && (file.is_dir() || file.parent().is_some_and(Path::is_dir)))
    }
}

/// Folder of the interview's mattes in a shoot.
const INTERVIEW_MATTES: &str = "interview_masks";

impl Project {
    /// The OLAT of pose `pose` under lamp `lamp`, counted over all lamps. Its file need not exist if the pose
    /// [lacks](Self::has_olat) it.
    pub fn olat_picture(&self, pose: usize, lamp: usize) -> Picture {
        let shoot = &self.settings.shoot;
        let pose = &shoot.poses[pose];
        let lamp = shoot.corrections.file(pose, shoot.lamp(lamp));
        match shoot.takes.poses.get(pose) {
            Some(take) => self.movie_frame(&take.movie, take.lamps.get(lamp).copied().unwrap_or(0)),
            None => self.file(format!("exemplars/{pose}/{lamp}")),
        }
    }

    /// False if pose `pose` has no OLAT of lamp `lamp`, counted over all lamps.
    pub fn has_olat(&self, pose: usize, lamp: usize) -> bool {
        let shoot = &self.settings.shoot;
        !shoot.corrections.lacks(&shoot.poses[pose], shoot.lamp(lamp))
    }

    /// The lamps whose OLATs pose `pose` has, counted over all lamps.
    pub fn pose_lamps(&self, pose: usize) -> Vec<usize> {
        let lamps = 0..self.settings.shoot.all_lamps().len();
        lamps.filter(|&lamp| self.has_olat(pose, lamp)).collect()
    }

    /// The first OLAT that pose `pose` has.
    pub fn first_olat(&self, pose: usize) -> Picture {
        self.olat_picture(pose, self.pose_lamps(pose).first().copied().unwrap_or(0))
    }

    /// The matte of pose `pose`: its movie's alpha, the shoot's file, or the project's.
    pub fn exemplar_matte(&self, pose: usize) -> Matte {
        let shoot = &self.settings.shoot;
        let name = &shoot.poses[pose];
        if let Some(take) = shoot.takes.poses.get(name).filter(|take| take.alpha) {
            // A lamp may leave the subject dark, but not transparent; all lamps together show it best.
            let lit = take.tracking.first().or(take.lamps.values().next());
            return Matte::Alpha(self.movie_frame(&take.movie, lit.copied().unwrap_or(0)));
        }
        let shoots = self.found(format!("exemplar_masks/{name}"));
        self.grey(shoots, self.exemplar_matte_path(pose), shoot.takes.poses.contains_key(name))
    }

    /// Interview frame number `frame`.
    pub fn frame_picture(&self, frame: usize) -> Picture {
        match &self.settings.shoot.frames {
            Frames::Clip(clip) => self.movie_frame(&clip.movie, clip.first + frame as u64),
            frames => self.file(format!("interview/{}", frames.name(frame))),
        }
    }

    /// The matte of interview frame `frame`: its movie's alpha, the shoot's file, or the project's. If the
    /// shoot's mattes for a movie or sequence have other names, the first belongs to the first frame, and so on.
    pub fn frame_matte(&self, frame: usize) -> Matte {
        let frames = &self.settings.shoot.frames;
        let is_clip = match frames {
            Frames::Clip(clip) if clip.alpha => return Matte::Alpha(self.frame_picture(frame)),
            Frames::Clip(_) => true,
            Frames::Named(_) => false,
        };
        let own = self.frame_matte_path(frame);
        if let Some(movie) = &self.settings.shoot.takes.interview_mattes {
            return Matte::Grey(if own.is_file() { Picture::File(own) } else { self.movie_frame(movie, frame as u64) });
        }
        let shoots = self.found(format!("{INTERVIEW_MATTES}/{}", frames.name(frame)));
        if is_clip && !shoots.is_file() && !own.is_file() {
            let folder = self.shoot_path(INTERVIEW_MATTES);
            let first = || self.found(format!("{INTERVIEW_MATTES}/{}", frames.name(0)));
            if folder.is_dir() && !first().is_file() {
                return Matte::Grey(self.movie_frame(Path::new(INTERVIEW_MATTES), frame as u64));
            }
        }
        self.grey(shoots, own, is_clip)
    }

    /// Path of the project's own matte of pose `pose`, if the shoot has none.
    pub fn exemplar_matte_path(&self, pose: usize) -> PathBuf {
        let name = &self.settings.shoot.poses[pose];
        self.root.join(format!("mattes/exemplars/{name}.png"))
    }

    /// Path of the project's own matte of interview frame `frame`, if the shoot has none.
    pub fn frame_matte_path(&self, frame: usize) -> PathBuf {
        let name = self.settings.shoot.frames.name(frame);
        self.root.join(format!("mattes/interview/{name}.png"))
    }

    /// The mirror ball under the interview's light.
    pub fn interview_probe_picture(&self) -> Picture {
        self.ball_picture(match &self.settings.shoot.takes.interview_ball {
            Some(still) => self.movie_frame(&still.movie, still.frame),
            None => self.file("probes/interview"),
        })
    }

    /// The mirror ball under lamp `lamp` alone, counted over all lamps.
    pub fn lamp_probe_picture(&self, lamp: usize) -> Picture {
        let shoot = &self.settings.shoot;
        let name = shoot.lamp(lamp);
        self.ball_picture(match &shoot.takes.balls {
            Some(take) => self.movie_frame(&take.movie, take.lamps.get(name).copied().unwrap_or(0)),
            None => self.file(format!("probes/{name}")),
        })
    }

    /// A second ball under lamp `lamp` alone, counted over all lamps.
    pub fn second_probe_picture(&self, second: &SecondBall, lamp: usize) -> Picture {
        if second.folder == Path::new("probes") {
            return self.lamp_probe_picture(lamp);
        }
        let name = self.settings.shoot.lamp(lamp);
        self.ball_picture(self.file(second.folder.join(name)))
    }

    /// All mirror balls: the interview's, then the lamps'; none if the shoot has none.
    pub fn probe_pictures(&self) -> Vec<Picture> {
        let shoot = &self.settings.shoot;
        if shoot.without_balls {
            return Vec::new();
        }
        let lamps = 0..shoot.all_lamps().len();
        std::iter::once(self.interview_probe_picture()).chain(lamps.map(|lamp| self.lamp_probe_picture(lamp))).collect()
    }

    /// The tracking frames of pose `pose`, if they are frames of its movie, and the time of each: the number of
    /// lamps lit before it.
    pub fn tracking_pictures(&self, pose: usize) -> Vec<(Picture, usize)> {
        let shoot = &self.settings.shoot;
        let take = shoot.takes.poses.get(&shoot.poses[pose]);
        let tracking = take.into_iter().flat_map(|take| {
            let lit_before = |frame| take.lamps.values().filter(|&&lit| lit < frame).count();
            take.tracking.iter().map(move |&frame| (self.movie_frame(&take.movie, frame), lit_before(frame)))
        });
        tracking.collect()
    }

    fn movie_frame(&self, movie: &Path, frame: u64) -> Picture {
        let file = self.shoot_path(movie);
        Picture::Movie { file, frame }
    }

    /// A photograph of a ball, mirrored back if the project says so.
    fn ball_picture(&self, picture: Picture) -> Picture {
        let axes = &self.settings.shoot.corrections.balls;
        axes.iter().fold(picture, |picture, &axis| Picture::Mirrored(picture.into(), axis))
    }

    fn file(&self, inside: impl AsRef<Path>) -> Picture {
        Picture::File(self.found(inside))
    }

    /// A picture of the shoot by its name without ending.
    fn found(&self, inside: impl AsRef<Path>) -> PathBuf {
        with_ending(&self.shoot_path(inside))
    }

    /// The shoot's matte, unless only the project has one. For a movie, the project's is the default.
    fn grey(&self, shoots: PathBuf, own: PathBuf, is_movie: bool) -> Matte {
        let is_own = if is_movie { !shoots.is_file() } else { !shoots.is_file() && own.is_file() };
        Matte::Grey(Picture::File(if is_own { own } else { shoots }))
    }
}
