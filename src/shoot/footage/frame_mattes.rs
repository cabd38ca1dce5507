//! Mattes of an interview's frames, one by one: from screen, box, clean plate, strokes, or a neighbour's matte.

use super::framed::{read_matte, read_picture};
use super::matte_settings::MatteSettings;
use super::movement::Movement;
use super::strokes::Strokes;
use base::error::{Error, Result};
use imaging::{Encoded, Mask};
use matte::{Correction, Key, Seeds, boxed, by_clean_plate, corrected, followed, guessed, key, painted};
use project::{Picture, Project};
use std::path::Path;
use std::sync::Arc;

/// Person detector: returns the probability of a person per pixel, at any size.
pub type FindPerson = Box<dyn Fn(&Encoded) -> Result<Mask> + Send>;

/// Smallest mean confidence of the motion for a frame to follow another.
const LEAST_TRUST: f32 = 0.25;

/// Finds mattes of frames, and caches data used by several frames.
pub struct FrameMattes {
    project: Project,
    within: Option<[usize; 4]>,
    plate: Option<Encoded>,
    pub(super) person: Option<FindPerson>,
    /// True after the network found the person; all frames then use it.
    is_guessed: bool,
    /// Screen of the first keyed frame.
    pub(super) screen: Option<Key>,
    pub(super) movement: Movement,
    /// Matte of the previously processed frame.
    pub(super) neighbour: Option<(usize, Mask)>,
    /// Matte of the frame at which following starts.
    pub(super) first: Option<(usize, Mask)>,
    /// A frame and its matte before any stroke.
    start: Option<(usize, Start)>,
}

/// A frame's matte.
pub struct FrameMatte {
    pub picture: Arc<Encoded>,
    pub matte: matte::Matte,
    /// Strokes painted on the frame.
    pub seeds: Seeds,
    /// True if the matte follows a neighbour's.
    pub followed: bool,
    /// True if the matte starts from a detected person.
    pub guessed: bool,
}

#[derive(Clone)]
struct Start {
    picture: Arc<Encoded>,
    /// Matte before strokes, or the reason for its absence.
    matte: std::result::Result<matte::Matte, Arc<Error>>,
    guessed: bool,
}

impl FrameMattes {
    /// Mattes of this project's frames. Without box, clean plate and screen, `person` detects the person.
    ///
    /// # Errors
    /// When the clean plate cannot be read.
    pub fn new(project: &Project, settings: &MatteSettings, person: Option<FindPerson>) -> Result<Self> {
        let plate = settings.clean_plate.as_deref();
        Ok(Self {
            project: project.clone(),
            within: settings.within,
            plate: plate.map(read_plate).transpose()?,
            person,
            is_guessed: false,
            screen: None,
            movement: Movement::from_project(project.clone()),
            neighbour: None,
            first: None,
            start: None,
        })
    }

    /// True if a frame's subject can be found without strokes.
    ///
    /// # Errors
    /// When the frame cannot be read.
    pub fn is_told(&mut self, frame: usize) -> Result<bool> {
        Ok(self.start(frame)?.matte.is_ok())
    }

    /// Matte of a frame, corrected by strokes on it and near it. A frame without another way to find the subject
    /// follows the previously processed neighbour.
    ///
    /// # Errors
    /// When a picture cannot be read, or the subject cannot be found.
    pub fn frame_matte(&mut self, frame: usize, strokes: &Strokes) -> Result<FrameMatte> {
        let start = self.start(frame)?;
        let picture = start.picture;
        self.movement.show(frame, &picture);
        let size = picture.0.size();
        let seeds = strokes.seeds(frame, size);
        let mut told = seeds.clone();
        if let Some(carried) = strokes.carried(frame, size, &mut self.movement) {
            told.join(&carried.resized(size));
        }
        let named = |e: Error| about(&self.project.frame_picture(frame), e);
        let mut follows = false;
        let found = match start.matte {
            Ok(matte) if told.is_empty() => matte,
            Ok(matte) => corrected(&picture, &matte, &told).map_err(named)?.matte,
            Err(_) if seeds.hold_both() => painted(&picture, &seeds, self.within).map_err(named)?,
            Err(why) => {
                let near = [&self.neighbour, &self.first].into_iter().flatten();
                let near = near.into_iter().find(|(other, _)| other.abs_diff(frame) == 1);
                // Only strokes confirm that the frames show the same person.
                let near = near.filter(|_| !strokes.strokes.is_empty());
                let Some((other, matte)) = near.cloned() else { return Err(named(unwrapped(why))) };
                let Some(flow) = self.movement.between(frame, other)? else { return Err(named(unwrapped(why))) };
                let trust = &flow.trust().pixels;
                if trust.iter().sum::<f32>() < LEAST_TRUST * trust.len() as f32 {
                    return Err(named(Error::missing(
                        "too little of it matches the neighbouring frame to track that frame's matte",
                        "Paint on this frame what to keep and what to remove (studio: Footage, Paint matte)",
                    )));
                }
                follows = true;
                let matte = flow.warped_mask(&matte);
                let found = followed(&picture, &matte, flow.trust(), &told).map_err(named)?;
                if seeds.is_empty() { found } else { corrected(&picture, &found, &told).map_err(named)?.matte }
            }
        };
        self.neighbour = Some((frame, found.mask.clone()));
        Ok(FrameMatte { picture, matte: found, seeds, followed: follows, guessed: start.guessed })
    }

    /// Matte of a frame during painting: as [`frame_matte`](Self::frame_matte), except that an existing matte of the
    /// project replaces a neighbour's.
    ///
    /// # Errors
    /// The same as [`frame_matte`](Self::frame_matte).
    pub fn of_painted(&mut self, frame: usize, strokes: &Strokes) -> Result<FrameMatte> {
        let start = self.start(frame)?;
        let seeds = strokes.seeds(frame, start.picture.0.size());
        let own = self.project.frame_matte_path(frame);
        if start.matte.is_ok() || seeds.hold_both() || !own.is_file() {
            return self.frame_matte(frame, strokes);
        }
        let mask = read_matte(&self.project.frame_matte(frame))?;
        let matte = matte::Matte { mask, uncertain: 0.0 };
        let named = |e: Error| about(&self.project.frame_picture(frame), e);
        let Correction { matte, .. } = corrected(&start.picture, &matte, &seeds).map_err(named)?;
        Ok(FrameMatte { picture: start.picture, matte, seeds, followed: false, guessed: false })
    }

    fn start(&mut self, frame: usize) -> Result<Start> {
        if let Some((started, start)) = &self.start
            && *started == frame
        {
            return Ok(start.clone());
        }
        let picture = read_picture(&self.project.frame_picture(frame))?;
        let matte = match (&self.plate, self.within) {
            (Some(plate), _) => by_clean_plate(&picture, plate),
            (None, Some(within)) => boxed(&picture, within),
            (None, None) => self.found(&picture),
        };
        let start = Start {
            picture: Arc::new(picture),
            guessed: self.is_guessed && matte.is_ok(),
            matte: matte.map_err(Arc::new),
        };
        self.start = Some((frame, start.clone()));
        Ok(start)
    }
}

impl FrameMattes {
    /// Matte from the screen, or from a detected person. The first frame decides for all.
    fn found(&mut self, picture: &Encoded) -> Result<matte::Matte> {
        let Some(person) = &self.person else { return keyed(picture, &mut self.screen) };
        if !self.is_guessed {
            match keyed(picture, &mut self.screen) {
                Err(Error::Missing { .. }) if self.screen.is_none() => (),
                told => return told,
            }
        }
        let matte = guessed(picture, person)?;
        self.is_guessed = true;
        Ok(matte)
    }
}

/// Matte of a frame, from the screen of the first frame that shows one.
fn keyed(picture: &Encoded, screen: &mut Option<Key>) -> Result<matte::Matte> {
    let found = match screen {
        Some(found) => found,
        None => screen.insert(key(picture)?),
    };
    found.matte(picture)
}

/// The clean plate: a picture, or the first frame of a movie.
fn read_plate(file: &Path) -> Result<Encoded> {
    if !movies::is_movie(file) {
        return imaging::file::read_encoded(file);
    }
    let movie = movies::open(file)?;
    Ok(movie.frame(movie.first())?.encoded())
}

/// Copies a shared error with its message.
fn unwrapped(error: Arc<Error>) -> Error {
    Arc::try_unwrap(error).unwrap_or_else(|shared| match &*shared {
        Error::Missing { problem, remedy } => Error::missing(problem.clone(), remedy.clone()),
        Error::Invalid { problem, remedy } => Error::invalid(problem.clone(), remedy.clone()),
        other => Error::bug(other.to_string()),
    })
}

/// Adds the name of the picture to the error.
pub fn about(picture: &Picture, error: Error) -> Error {
    match error {
        Error::Missing { problem, remedy } => Error::missing(format!("{}: {problem}", picture.display()), remedy),
        Error::Invalid { problem, remedy } => Error::invalid(format!("{}: {problem}", picture.display()), remedy),
        other => other,
    }
}
