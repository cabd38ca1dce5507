//! A clip during relighting: each frame is predicted, and lit at the level of the first frame.

use super::RelightSettings;
use super::named::lamps_named;
use crate::look::Look;
use crate::provenance::Provenance;
use crate::writer::Writer;
use crate::{Interview, LayersBy, LightLayers, Stages};
use base::error::{Error, Result};
use base::progress::Progress;
use calibration::Calibration;
use compositor::{
    EnvironmentLight, Extra, FieldEncoder, Identity, Ingredients, PassReport, Picture, Plate, Series, Upstream, compose,
};
use footage::{BehindReader, Frame, PictureSize, picture_size};
use gpu::ComputeDevice;
use light::{Rig, conventions};
use project::Project;
use rayon::prelude::*;
use scene::{Background, Effects, Output, Scene};
use std::path::Path;
use std::time::Instant;
use transfer::{FineField, OlatPredictor};

/// Name of a light, and the lamps' weights under it alone.
type NamedLight = (String, Vec<[f32; 3]>);

/// Frame to relight.
pub(super) struct Plan {
    pub frame: usize,
    pub scene: Scene,
    /// Provenance for its file, if computed in advance to find existing frames.
    pub made_of: Option<String>,
    /// True if the frame is written. A frame that only later frames depend on may exist already.
    pub write: bool,
}

/// Frame to write.
pub(super) struct Made {
    pub picture: Picture,
    pub layers: Option<LightLayers>,
}

/// Clip during relighting.
pub(super) struct Clip<'a> {
    look: Look<'a>,
    pub calibration: Calibration,
    pub compute: ComputeDevice,
    predictor: OlatPredictor,
    encoder: FieldEncoder,
    /// At the level of the first frame; otherwise the clip would flicker.
    light: Option<EnvironmentLight>,
    /// Numbers of the solo lamps; empty for all lamps.
    solo: Vec<usize>,
    series: Series,
    behind: BehindReader,
    /// Passes of the newest frame, with the time of all frames so far.
    pub passes: Vec<PassReport>,
    pub uncovered_energy: f32,
}

impl<'a> Clip<'a> {
    /// Reads the shared input of all frames, and opens the destination.
    pub fn open(
        project: &'a Project,
        settings: &'a RelightSettings,
        part_folder: Option<&Path>,
        progress: &Progress,
    ) -> Result<(Self, Writer)> {
        let calibration = Calibration::load(project)?;
        let solo = lamps_named(&calibration.rig, &settings.solo)?;
        let look = Look::open(project, settings, progress)?;
        let compute = ComputeDevice::choose(settings.device);
        let mut predictor = OlatPredictor::open(project, &calibration, &compute.device)?.steady(project, &calibration);
        if settings.files.at != PictureSize::Square {
            predictor = predictor.with_detail(project, &calibration)?;
        }
        progress.say(predictor.sentence());
        if predictor.network().is_some() {
            progress.say(format!("The network runs on the {}", compute.description));
        }
        let interview = Interview::from_project(project)?;
        let size = picture_size(project, settings.files.at)?;
        let (files, encoding) = (&settings.files, &look.encoding);
        let writer = Writer::open(files, encoding, look.frames, size, &interview, part_folder, progress)?;
        let clip = Self {
            look,
            calibration,
            compute,
            predictor,
            encoder: FieldEncoder::new(settings.storage),
            light: None,
            solo,
            series: Series::default(),
            behind: BehindReader::default(),
            passes: Vec::new(),
            uncovered_energy: 0.0,
        };
        Ok((clip, writer))
    }

    /// Frames to relight: those of `first` to `last` that do not exist yet, and the frames that they depend on. With the
    /// provenance for their files, where files hold one.
    pub fn plan(
        &self,
        (first, last): (usize, usize),
        writer: &mut Writer,
        progress: &Progress,
    ) -> Result<(Vec<Plan>, Option<Provenance>)> {
        let count = last - first + 1;
        let provenance = (writer.writes_stills()).then(|| self.look.provenance()).transpose()?;
        let start = self.look.frames.0;
        let depends = self.look.settings.goes_from_frame_to_frame();
        let mut planned = Vec::with_capacity(count + 1);
        let before = (start..first).take(if depends { usize::MAX } else { 1 });
        for frame in before.chain(first..=last) {
            let scene = self.look.scene(frame);
            let mut made_of = None;
            let mut write = frame >= first;
            if let (true, true, Some(provenance)) = (write, writer.goes_on(), &provenance) {
                progress.check("")?;
                let text = provenance.frame(self.look.project, &scene)?;
                write = !writer.keeps_frame(frame, &text);
                made_of = Some(text);
            }
            // The export's first frame sets the level of all.
            if write || frame == start || depends {
                planned.push(Plan { frame, scene, made_of, write });
            }
        }
        let relit = planned.iter().filter(|plan| plan.write).count();
        if relit < count {
            progress.say(format!("{} of {count} frames exist already", count - relit));
        }
        if relit == 0 {
            planned.clear();
        }
        Ok((planned, provenance))
    }

    /// Predicts and lights a frame; None if it is not written.
    pub fn relight_frame(&mut self, plan: &Plan, frame: &Frame, plate: Option<Plate>) -> Result<Option<Made>> {
        let (index, scene) = (plan.frame, &plan.scene);
        let started = Instant::now();
        let (predicted, fine) = self.predictor.predict_fine(frame)?;
        let plate = plate.map(|plate| FineField::on(fine, plate));
        let field = self.encoder.encode(predicted, self.compute.passes())?;
        let predict_ms = Some(started.elapsed().as_secs_f64() * 1e3);
        let rig = &self.calibration.rig;
        let (light, weights_ms) =
            EnvironmentLight::update(&mut self.light, &self.look.environment, rig, scene, (&field, &frame.mask))?;
        self.uncovered_energy = light.weights().uncovered;
        let files = &self.look.settings.files;
        let by_light = plan.write && files.layers && files.exr.layers_by == LayersBy::Light;
        let solo = (!self.solo.is_empty()).then(|| light.solo(&self.solo));
        let parts = by_light.then(|| match &solo {
            Some(solo) => vec![("lamps".to_owned(), solo.per_lamp.clone())],
            None => light.parts(),
        });
        let rate = self.look.project.settings.shoot.frame_rate;
        let behind = scene.background.file().map(|file| self.behind.read(file, index, rate));
        let (number, behind) = behind.transpose()?.unzip();
        let ingredients = Ingredients {
            weights: solo.as_ref().unwrap_or(light.weights()),
            upstream: Upstream { predict_ms, weights_ms },
            extra: Extra {
                plate: plate.as_ref(),
                behind: behind.as_deref(),
                identity: Identity { frame: index as u64, behind: number.unwrap_or_default(), ..Identity::default() },
                ..Extra::default()
            },
            ..light.on(&field, &frame.mask)
        };
        let plate = (&frame.plate, &frame.mask);
        let picture = self.series.compose(scene, plate, &ingredients)?;
        add_times(&mut self.passes, &picture);
        if !plan.write {
            return Ok(None);
        }
        let layers = || light_layers(scene, &ingredients, rig, parts.as_deref());
        let layers = files.layers.then(layers).transpose()?;
        Ok(Some(Made { picture, layers }))
    }

    /// Reports result and time of each pass.
    pub fn profile(&self, stages: Stages, progress: &Progress) {
        let turned = self.look.scene(self.look.frames.0).yaw_deg;
        progress.say(conventions::sentence(turned));
        progress.say(match self.compute.passes() {
            Some(_) => "The passes ran on the GPU, timed by its own clock",
            None => "The passes ran on the CPU, timed by the wall clock",
        });
        progress.say(self.encoder.sentence());
        progress.say(stages.sentence());
        for pass in &self.passes {
            let time = match pass.ms {
                None => "   not timed".to_owned(),
                Some(ms) if pass.ran || ms > 0.0 => format!("{ms:9.3} ms"),
                Some(_) => "     skipped".to_owned(),
            };
            progress.say(format!("{:16} {time}  {}", pass.name, pass.reason));
        }
    }
}

/// The subject under each lamp or light, and the compositor's sum over all: without background
/// and without effects.
/// `parts`: names and the lamps' weights of the lights; None for layers by lamp.
fn light_layers(scene: &Scene, of: &Ingredients, rig: &Rig, parts: Option<&[NamedLight]>) -> Result<LightLayers> {
    let plain =
        Scene { background: Background::None, effects: Effects::default(), output: Output::Linear, ..scene.clone() };
    let factor = of.levels.subject * scene.exposure_stops.exp2();
    let scaled = |weight: &[f32; 3]| weight.map(|share| share * factor);
    let layers = match parts {
        None => {
            let lamps = rig.lamps.par_iter().zip(&of.weights.per_lamp).enumerate();
            let lamps = lamps.map(|(index, (lamp, weight))| {
                let mut alone = vec![[0.0; 3]; rig.lamps.len()];
                alone[index] = [1.0; 3];
                (lamp.name.clone(), alone, scaled(weight))
            });
            LightLayers::new(of, LayersBy::Lamp, lamps)?
        }
        Some(parts) => {
            let lights = parts
                .par_iter()
                .map(|(name, per_lamp)| (name.clone(), per_lamp.iter().map(scaled).collect(), [1.0; 3]));
            LightLayers::new(of, LayersBy::Light, lights)?
        }
    };
    let extra = Extra { plate: of.extra.plate, ..Extra::default() };
    let subject = compose(&plain, &Ingredients { extra, ..*of })?.linear;
    let subject = subject.ok_or_else(|| Error::bug("the subject under all lights has no light"))?;
    Ok(LightLayers { subject: Some(subject), ..layers })
}

fn add_times(sums: &mut Vec<PassReport>, picture: &Picture) {
    let times: Vec<Option<f64>> = sums.iter().map(|pass| pass.ms).collect();
    sums.clone_from(&picture.passes);
    for (pass, earlier) in sums.iter_mut().zip(times) {
        pass.ms = pass.ms.zip(earlier).map(|(ms, earlier)| ms + earlier);
    }
}

#[cfg(test)]
#[path = "clip_tests.rs"]
mod tests;
