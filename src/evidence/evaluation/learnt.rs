//! Methods trained during evaluation, for the requested lights: Texler 2020 and Sun 2019.

use super::accuracy::{Method, Pictures};
use base::error::{Error, Result};
use base::progress::Progress;
use calibration::Calibration;
use footage::Frame;
use gpu::ComputeDevice;
use imaging::Image;
use project::Project;
use rivals::{Effort, PatchStyle, Portrait, Poses, Spent};
use std::collections::BTreeMap;
use std::time::Instant;

/// Weights on each lamp's OLAT.
type Light = Vec<[f32; 3]>;

/// A method trained to show frames in certain lights.
pub struct Learnt {
    names: Vec<String>,
    lights: Vec<Light>,
    kind: Kind,
}

enum Kind {
    /// The networks for the lights and for single lamps.
    Texler(Box<PatchStyle>, Option<Box<PatchStyle>>),
    Sun(Box<Portrait>),
}

impl Learnt {
    /// Trains on the project's poses. `lights` are the lights to show, by name; `olats` adds single lamps. Texler's
    /// network is trained for its lights: single lamps need a second one, trained for as long again.
    ///
    /// # Errors
    /// When `method` does not learn, a picture cannot be read, the user stops it, or the training fails.
    pub fn learn(
        method: Method,
        (project, calibration): (&Project, &Calibration),
        lights: &BTreeMap<String, Light>,
        olats: bool,
        effort: &Effort,
        compute: &ComputeDevice,
        progress: &Progress,
    ) -> Result<Self> {
        let device = &compute.device;
        let poses = Poses::load(project, calibration, None, progress)?;
        let (names, lights): (Vec<String>, Vec<Light>) = lights.clone().into_iter().unzip();
        let kind = match method {
            Method::Texler => {
                let looks = PatchStyle::learn(&poses, &lights, effort, device, progress)?;
                let lamps = single_lamps(poses.lamps());
                let lamps = olats.then(|| PatchStyle::learn(&poses, &lamps, effort, device, progress)).transpose()?;
                Kind::Texler(Box::new(looks), lamps.map(Box::new))
            }
            Method::Sun => {
                let portrait = Portrait::learn(&poses, effort, device, progress)?;
                Kind::Sun(Box::new(portrait))
            }
            _ => return Err(Error::bug(format!("{method:?} does not learn"))),
        };
        Ok(Self { names, lights, kind })
    }

    /// Training cost; for Texler, of the network for the lights, not the one for single lamps.
    pub fn spent(&self) -> Spent {
        match &self.kind {
            Kind::Texler(looks, _) => looks.spent,
            Kind::Sun(portrait) => portrait.spent,
        }
    }

    /// A frame in each light, linear.
    ///
    /// # Errors
    /// When the device fails.
    pub fn relit(&self, frame: &Frame) -> Result<Vec<Image>> {
        match &self.kind {
            Kind::Texler(looks, _) => looks.relit(frame),
            Kind::Sun(portrait) => portrait.relit(frame, &self.lights),
        }
    }

    /// A frame in each light, and under each lamp if trained and requested.
    ///
    /// # Errors
    /// When the device fails.
    pub fn predict(&self, frame: &Frame, olats: bool) -> Result<Pictures> {
        let began = Instant::now();
        // One picture is timed, as for a user; Texler's looks all come at once.
        let relit = match &self.kind {
            Kind::Texler(..) => self.relit(frame)?,
            Kind::Sun(portrait) => portrait.relit(frame, &self.lights[..1.min(self.lights.len())])?,
        };
        let picture_ms = began.elapsed().as_secs_f64() * 1e3;
        let relit = match &self.kind {
            Kind::Texler(..) => relit,
            Kind::Sun(_) => self.relit(frame)?,
        };
        let olats = match &self.kind {
            _ if !olats => None,
            Kind::Texler(_, lamps) => lamps.as_ref().map(|l| l.relit(frame)).transpose()?,
            Kind::Sun(portrait) => Some(portrait.relit(frame, &single_lamps(portrait.lamps()))?),
        };
        Ok(Pictures { relit: self.names.iter().cloned().zip(relit).collect(), olats, picture_ms })
    }
}

/// Unit weights of each single lamp.
pub fn single_lamps(lamps: usize) -> Vec<Light> {
    let alone = |lit: usize| (0..lamps).map(move |lamp| [f32::from(u8::from(lamp == lit)); 3]);
    (0..lamps).map(|lit| alone(lit).collect()).collect()
}
