//! Strokes painted on interview frames, and the resulting matte of the current frame.

use crate::panels::footage::reader::reduced;
use base::error::Result;
use egui::{Color32, ColorImage, Context, TextureHandle, TextureOptions};
use footage::{BrushSide, FrameMattes, MatteSettings, Stroke, Strokes, strokes};
use imaging::Mask;
use imaging::resample::resize_area;
use project::Project;
use worker::Query;

/// Longer side of the displayed matte in pixels.
const SHOWN_PX: usize = 1280;
/// Most undo steps.
const STEPS: usize = 50;
/// Factor on the brush radius per step.
pub const GROWTH: f32 = 1.2;

/// A frame and the strokes for its matte.
#[derive(Clone, Debug, PartialEq)]
struct LiveRequest {
    frame: usize,
    strokes: Strokes,
}

/// Overlay on the picture: removed parts in red, with a line at the edge.
type Overlay = ([usize; 2], Vec<Color32>);

/// The brush, the strokes, and the threads that make mattes from them and save them.
pub struct MattePainting {
    /// True while the brush is active.
    pub on: bool,
    pub side: BrushSide,
    /// Radius of the brush in pixels of the plate; None for one that fits the picture.
    pub radius: Option<f32>,
    /// The strokes, or the reason they cannot be read; None until read.
    strokes: Option<std::result::Result<Strokes, String>>,
    undo: Vec<Strokes>,
    redo: Vec<Strokes>,
    /// The newest matte, or the reason for its absence.
    live: Option<(LiveRequest, std::result::Result<TextureHandle, String>)>,
    mattes: Query<LiveRequest, Overlay>,
    reader: Query<(), Strokes>,
    saver: Query<Strokes, ()>,
    /// True while the strokes are not on disk.
    unsaved: bool,
    /// True if all mattes are requested once the strokes are on disk.
    make: bool,
    failure: Option<String>,
    /// Reason that the newest strokes could not be saved.
    unsaved_why: Option<String>,
}

impl Default for MattePainting {
    fn default() -> Self {
        Self {
            on: false,
            side: BrushSide::Keep,
            radius: None,
            strokes: None,
            undo: Vec::new(),
            redo: Vec::new(),
            live: None,
            mattes: Query::default(),
            reader: Query::default(),
            saver: Query::default(),
            unsaved: false,
            make: false,
            failure: None,
            unsaved_why: None,
        }
    }
}

impl MattePainting {
    /// The strokes, or the reason they cannot be read; None until read.
    pub fn strokes(&self) -> Option<&std::result::Result<Strokes, String>> {
        self.strokes.as_ref()
    }

    /// The matte of a frame, or the reason for its absence; None until found. While strokes are added, the last matte
    /// of that frame.
    pub fn live(&self, frame: usize) -> Option<std::result::Result<&TextureHandle, &str>> {
        let (request, found) = self.live.as_ref()?;
        let found = found.as_ref().map_err(String::as_str);
        (request.frame == frame).then_some(found)
    }

    /// True while a matte is being made.
    pub fn is_seeking(&self) -> bool {
        self.mattes.is_waiting()
    }

    /// True if all strokes are on disk.
    pub fn is_saved(&self) -> bool {
        !self.unsaved
    }

    /// Reason that the last attempt to save the strokes failed.
    pub fn unsaved(&self) -> Option<&str> {
        self.unsaved_why.as_deref()
    }

    /// Radius of the brush for a picture of this size, in pixels.
    pub fn radius(&self, size: (usize, usize)) -> f32 {
        let radius = self.radius.unwrap_or(Self::fitting_radius(size));
        radius.clamp(*strokes::RADII.start(), *strokes::RADII.end())
    }

    /// Default radius of the brush for a picture of this size, in pixels.
    pub fn fitting_radius((width, height): (usize, usize)) -> f32 {
        width.max(height) as f32 / 60.0
    }

    /// Adds a stroke.
    ///
    /// # Errors
    /// If the existing strokes are not known.
    pub fn paint(&mut self, mut stroke: Stroke) -> std::result::Result<(), String> {
        // The pointer may be far outside the picture.
        for place in stroke.points.iter_mut().flatten() {
            *place = place.clamp(-strokes::FARTHEST, strokes::FARTHEST);
        }
        self.change(|strokes| strokes.strokes.push(stroke))
    }

    /// Removes the strokes of a frame.
    ///
    /// # Errors
    /// As [`paint`](Self::paint).
    pub fn clear(&mut self, frame: usize) -> std::result::Result<(), String> {
        self.change(|strokes| strokes.strokes.retain(|stroke| stroke.frame != frame))
    }

    fn change(&mut self, act: impl FnOnce(&mut Strokes)) -> std::result::Result<(), String> {
        let strokes = match &mut self.strokes {
            Some(Ok(strokes)) => strokes,
            Some(Err(sentence)) => return Err(sentence.clone()),
            None => return Err("The strokes are still being read".to_owned()),
        };
        let before = strokes.clone();
        act(strokes);
        if *strokes != before {
            if self.undo.len() >= STEPS {
                self.undo.remove(0);
            }
            self.undo.push(before);
            self.redo.clear();
            self.unsaved = true;
        }
        Ok(())
    }

    /// True if a stroke can be undone, or redone.
    pub fn can_travel(&self, back: bool) -> bool {
        self.on && !(if back { &self.undo } else { &self.redo }).is_empty()
    }

    /// Undoes or redoes the last stroke.
    pub fn travel(&mut self, back: bool) {
        let (from, to) = if back { (&mut self.undo, &mut self.redo) } else { (&mut self.redo, &mut self.undo) };
        if let (Some(other), Some(Ok(strokes))) = (from.pop(), &mut self.strokes) {
            to.push(std::mem::replace(strokes, other));
            self.unsaved = true;
        }
    }

    /// Requests all mattes once the strokes are on disk.
    pub fn make_all(&mut self) {
        self.make = true;
    }

    /// True if all mattes should be made now. Reported once.
    pub fn takes_make(&mut self) -> bool {
        !self.unsaved && std::mem::take(&mut self.make)
    }

    /// Reason that strokes could not be saved; reported once.
    pub fn failure(&mut self) -> Option<String> {
        self.failure.take()
    }

    /// Takes in results of the threads. Call once per frame of the window.
    pub fn receive(&mut self, ctx: &Context) {
        for ((), read) in self.reader.answers() {
            self.strokes = Some(read);
        }
        for (request, found) in self.mattes.answers() {
            let found = found.map(|(size, pixels)| {
                let overlay = ColorImage::new(size, pixels);
                ctx.load_texture("matte", overlay, TextureOptions::LINEAR)
            });
            self.live = Some((request, found));
        }
        for (saved, done) in self.saver.answers() {
            if let Err(sentence) = done {
                self.failure = Some(sentence.clone());
                self.unsaved_why = Some(sentence);
                // Unsaved strokes cannot make mattes.
                (self.unsaved, self.make) = (false, false);
            } else if matches!(&self.strokes, Some(Ok(strokes)) if *strokes == saved) {
                (self.unsaved, self.unsaved_why) = (false, None);
            }
        }
    }

    /// Requests what is needed: reading and saving the strokes, and the frame's matte.
    pub fn ask(&mut self, project: &Project, frame: usize, wake: impl Fn() + Clone + Send + 'static) {
        if !self.on && !self.unsaved {
            return;
        }
        if self.strokes.is_none() {
            self.reader.ask((), wake.clone(), |_| {
                let own_project = project.clone();
                move |()| Strokes::load(&own_project)
            });
        }
        let Some(Ok(strokes)) = &self.strokes else { return };
        if self.unsaved {
            self.saver.ask(strokes.clone(), wake.clone(), |_| {
                let own_project = project.clone();
                move |strokes: &Strokes| strokes.save(&own_project)
            });
        }
        let request = LiveRequest { frame, strokes: strokes.clone() };
        let paintable = frame < project.settings.shoot.frames.len() && strokes::is_own_matte(project, frame);
        if self.on && paintable {
            self.mattes.ask(request, wake, |_| {
                let (of, mut mattes) = (project.clone(), None);
                move |request: &LiveRequest| found(&of, &mut mattes, request)
            });
        }
    }
}

fn found(project: &Project, mattes: &mut Option<FrameMattes>, request: &LiveRequest) -> Result<Overlay> {
    let mattes = match mattes {
        Some(mattes) => mattes,
        None => mattes.insert(FrameMattes::new(project, &MatteSettings::default(), Some(worker::find_person()?))?),
    };
    let found = mattes.of_painted(request.frame, &request.strokes)?;
    Ok(overlay(&found.matte.mask))
}

/// Overlay of a matte: removed parts are red, their edge a light line.
fn overlay(matte: &Mask) -> Overlay {
    let (width, height) = reduced(matte.size(), SHOWN_PX);
    let small: Mask = resize_area(matte, width, height);
    let inside = |x: usize, y: usize| small.at(x.min(width - 1), y.min(height - 1)) >= 0.5;
    let pixels = (0..width * height).map(|i| {
        let (x, y) = (i % width, i / width);
        let here = inside(x, y);
        if inside(x + 1, y) != here || inside(x, y + 1) != here {
            return Color32::from_rgb(255, 236, 160);
        }
        let red = 150.0 * (1.0 - small.pixels[i]);
        Color32::from_rgba_unmultiplied(214, 32, 32, red as u8)
    });
    ([width, height], pixels.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stroke(frame: usize) -> Stroke {
        Stroke { frame, side: BrushSide::Keep, radius: 3.0, points: vec![[1.0, 2.0]] }
    }

    #[test]
    fn strokes_are_undone_one_by_one_and_made_again() {
        let mut painting = MattePainting { on: true, ..MattePainting::default() };
        assert!(painting.paint(stroke(0)).unwrap_err().contains("being read"));
        painting.strokes = Some(Ok(Strokes::default()));
        for frame in [0, 1, 1] {
            painting.paint(stroke(frame)).unwrap();
        }
        painting.clear(1).unwrap();
        let frames = |painting: &MattePainting| painting.strokes().unwrap().as_ref().unwrap().strokes.len();
        assert_eq!(frames(&painting), 1);
        painting.travel(true);
        assert_eq!(frames(&painting), 3);
        painting.travel(true);
        assert_eq!(frames(&painting), 2);
        painting.travel(false);
        assert_eq!(frames(&painting), 3);
        painting.paint(stroke(2)).unwrap();
        assert!(!painting.can_travel(false) && painting.can_travel(true));
        // A clear without effect is not a step.
        let steps = painting.undo.len();
        painting.clear(7).unwrap();
        assert_eq!(painting.undo.len(), steps);
        painting.make_all();
        assert!(!painting.takes_make(), "the strokes are not saved yet");
        painting.unsaved = false;
        assert!(painting.takes_make() && !painting.takes_make());
    }

    #[test]
    fn the_overlay_is_clear_on_the_subject_and_red_elsewhere() {
        let matte = Mask::from_fn(60, 40, |x, _| f32::from(u8::from(x >= 30)));
        let ([width, height], pixels) = overlay(&matte);
        assert_eq!((width, height), (60, 40));
        assert_eq!(pixels[20 * 60 + 50].a(), 0);
        assert_eq!(pixels[20 * 60 + 10].a(), 150);
        assert_eq!(pixels[20 * 60 + 29].a(), 255);
    }
}
