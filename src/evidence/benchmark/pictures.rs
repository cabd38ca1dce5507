//! Whole relit frames, and turning the light by hand.

use super::measure::Tell;
use super::names::PICTURES;
use super::network::warm;
use super::{LAMPS, data};
use base::error::{Error, Result};
use compositor::{EnvironmentLight, Extra, Field, FieldEncoder, Identity, Ingredients, Plate, PlateSquare, Series};
use gpu::ComputeDevice;
use light::built_in;
use reflectance::checkpoint::CheckpointInfo;
use reflectance::{FieldBuffer, Predictor};
use scene::{Background, Output, Scene};
use training::Preset;

/// Rotation of the light between frames, in degrees.
const TURN_DEG: f32 = 7.0;

/// Input of the pictures.
struct Studio<'a> {
    compute: &'a ComputeDevice,
    predictor: Predictor,
    encoder: FieldEncoder,
    frame: footage::Frame,
    plate: Option<Plate>,
    light: Option<EnvironmentLight>,
    series: Series,
    turns: usize,
}

/// Times pictures of `size` pixels whose fields have `working` pixels: a frame without and with its prediction, both
/// read back into memory as in an export, and a turn of the light as in the window.
///
/// # Errors
/// When the device fails, or the receiver of figures is gone.
pub fn pictures(
    preset: Preset,
    (working, size): (usize, usize),
    seconds: f64,
    compute: &ComputeDevice,
    tell: Tell,
) -> Result<()> {
    let [whole, relit, turned] = PICTURES;
    let mut studio = Studio::new(preset, (working, size), compute)?;
    let share = seconds / 3.0;
    // These need no prediction, so they are timed even where a network's first use takes long.
    let field = data::field(working, LAMPS);
    let field = match &compute.gpu {
        Some(gpu) => Field::Gpu(FieldBuffer::upload(&field, &gpu.device), gpu.passes.clone()),
        None => field.into(),
    };
    warm(relit, share, tell, || studio.picture(&field, false, false))?;
    warm(turned, share, tell, || studio.picture(&field, false, true))?;
    drop(field);
    let mut kept = None;
    warm(whole, share, tell, || {
        // The previous field is freed first, as it is between frames of a clip.
        kept = None;
        let field = studio.predict()?;
        studio.picture(&field, true, false)?;
        kept = Some(field);
        Ok(())
    })
}

impl<'a> Studio<'a> {
    fn new(preset: Preset, (working, size): (usize, usize), compute: &'a ComputeDevice) -> Result<Self> {
        let network = preset.config().network_of(working, LAMPS);
        network.check()?;
        let info = CheckpointInfo {
            step: 0,
            seconds: 0.0,
            scale: 1.0,
            training_frames: Vec::new(),
            network: network.clone(),
            held_out: None,
        };
        let frame = data::frame(working);
        let square = PlateSquare { x: 0.0, y: 0.0, side: size as f32 };
        let plate = (size != working).then(|| Plate::new(data::plate(size), data::matte(size), square, &frame.mask));
        Ok(Self {
            compute,
            predictor: Predictor::new(network.init(0.4, &compute.device), info, &compute.device),
            encoder: FieldEncoder::default(),
            frame,
            plate: plate.transpose()?,
            light: None,
            series: Series::default(),
            turns: 0,
        })
    }

    /// Predicts the frame and keeps its field as the window does.
    fn predict(&mut self) -> Result<Field> {
        let (encoder, predictor, frame) = (&mut self.encoder, &self.predictor, &self.frame);
        let compute = self.compute;
        compute.guarded(|| encoder.encode(predictor.predict_on_device(frame)?, compute.passes()))
    }

    /// Renders the picture at the next yaw; with `shown`, it stays where the window draws it from. A `fresh` frame
    /// reuses nothing of the previous one.
    fn picture(&mut self, field: &Field, fresh: bool, shown: bool) -> Result<()> {
        self.turns += 1;
        let environment =
            built_in::named("courtyard").ok_or_else(|| Error::bug("a built-in environment is gone"))?.environment();
        let scene = Scene {
            yaw_deg: TURN_DEG * self.turns as f32,
            background: Background::Environment,
            output: Output::Display,
            ..Scene::default()
        };
        let rig = data::rig();
        let mask = &self.frame.mask;
        let (light, _) = EnvironmentLight::update(&mut self.light, &environment, &rig, &scene, (field, mask))?;
        let ingredients = Ingredients {
            extra: Extra {
                plate: self.plate.as_ref(),
                identity: Identity { frame: if fresh { self.turns as u64 } else { 0 }, ..Identity::default() },
                ..Extra::default()
            },
            ..light.on(field, mask)
        };
        let plate = (&self.frame.plate, mask);
        if shown {
            let made = self.series.show(&scene, plate, &ingredients)?;
            if let Some(gpu) = &self.compute.gpu {
                gpu.wait();
            }
            drop(made);
        } else {
            drop(self.series.compose(&scene, plate, &ingredients)?);
        }
        Ok(())
    }
}
