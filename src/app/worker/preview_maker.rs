//! Makes the window's pictures for one rig. Keeps the light, the reference frame and caches from one picture to
//! the next.

use super::adaptive_resolution::{AdaptiveResolution, Reduced, ReducedFrame};
use super::behind::Behind;
use super::comparison::Comparison;
use super::look_pictures::LookPictures;
use super::prediction::PredictedFrame;
use super::preview::{PreviewInputs, PreviewPicture, PreviewRequest};
use super::relit_frame::RelitFrame;
use super::srgb_picture::SrgbPicture;
use super::view_table::ViewTable;
use base::error::Result;
use compositor::{EnvironmentLight, Extra, Identity, Ingredients, Series, ShownPicture, Upstream, difference};
use imaging::Encoded;
use light::Rig;
use scene::{Background, Inspection, Scene};
use std::collections::HashSet;
use std::sync::Arc;
use std::time::Instant;

/// Cached state of the shoot.
pub(super) struct PreviewMaker {
    rig: Arc<Rig>,
    /// The first predicted frame. It sets the level of every light for the whole session.
    reference: Option<Arc<PredictedFrame>>,
    light: Option<EnvironmentLight>,
    /// Lights of the compared pictures, if they differ from the picture's own.
    comparison_lights: [Option<EnvironmentLight>; 2],
    looks: LookPictures,
    /// Frame of the last picture.
    last: Option<Arc<PredictedFrame>>,
    /// Identifiers of the last picture's frame, environment and counterpart.
    identity: Identity,
    series: Series,
    resolution: AdaptiveResolution,
    table: ViewTable,
    behind: Behind,
    /// The last picture, if it is only on the GPU.
    unread: Option<(ShownPicture, PreviewPicture)>,
}

impl PreviewMaker {
    /// Creates a maker with a time budget of `budget_ms` milliseconds per picture while something moves.
    pub fn new(rig: Arc<Rig>, budget_ms: f64) -> Self {
        Self {
            rig,
            reference: None,
            light: None,
            comparison_lights: [None, None],
            looks: LookPictures::default(),
            last: None,
            identity: Identity::default(),
            series: Series::default(),
            resolution: AdaptiveResolution::within(budget_ms),
            table: ViewTable::default(),
            behind: Behind::default(),
            unread: None,
        }
    }

    pub fn rig(&self) -> &Arc<Rig> {
        &self.rig
    }

    /// [`PreviewInputs::coarse`] of the next picture while something moves.
    pub fn coarse(&self) -> usize {
        self.resolution.factor()
    }

    /// True if the last picture is only on the GPU.
    pub fn is_unread(&self) -> bool {
        self.unread.is_some()
    }

    /// The last picture with its codes in memory and the measured times of its passes. None if they were there
    /// from the start.
    ///
    /// # Errors
    /// When the GPU fails or is lost.
    pub fn read(&mut self) -> Result<Option<PreviewPicture>> {
        let Some((mut shown, mut preview)) = self.unread.take() else { return Ok(None) };
        shown.read()?;
        preview.take(shown.picture);
        Ok(Some(preview))
    }

    /// Makes a picture. `predict_ms` is the time of the frame's prediction, if this is its first picture;
    /// `started` is the picture's start time. The caller fills in the frames in memory.
    ///
    /// # Errors
    /// As [`compositor::compose`].
    pub fn make(
        &mut self,
        inputs: &PreviewInputs,
        predict_ms: Option<f64>,
        started: Instant,
    ) -> Result<PreviewPicture> {
        let (request, predicted) = (&inputs.request, &inputs.predicted);
        self.identify(request, predicted);
        let missing = self.behind.read(request);
        let behind = self.behind.picture(&request.scene.background);
        self.identity.behind = behind.map_or(0, |(number, _)| number);
        let reference = self.reference.get_or_insert_with(|| predicted.clone());
        let reference = (&*reference.field, &reference.frame.mask);
        let mut scene = request.scene.clone();
        let (light, weights_ms) =
            EnvironmentLight::update(&mut self.light, &request.environment, &self.rig, &scene, reference)?;
        let solo = (!request.solo.is_empty()).then(|| light.solo(&request.solo));
        let relit = RelitFrame {
            scene: &request.scene,
            predicted,
            light,
            solo: solo.as_ref(),
            rig: &self.rig,
            behind: &self.behind,
            reference,
        };
        let lights = &mut self.comparison_lights;
        let [mut first, mut second] = compared(&relit, inputs, lights)?;
        let whole = match scene.effects.inspection {
            Inspection::Picture => [None, None],
            Inspection::Difference { .. } => [first.clone(), None],
            _ => {
                let mut scene = scene.clone();
                scene.effects.inspection = Inspection::Picture;
                let relit = RelitFrame { scene: &scene, ..relit };
                compared(&relit, inputs, lights)?
            }
        };
        if solo.is_some() {
            scene.background = Background::None;
        }
        let weights = solo.as_ref().unwrap_or(light.weights());
        let ingredients = Ingredients {
            weights,
            upstream: Upstream { predict_ms, weights_ms },
            extra: Extra {
                plate: predicted.plate.as_deref(),
                behind: behind.map(|(_, picture)| picture),
                second: second.as_ref(),
                identity: self.identity,
                draft: inputs.draft,
                ..Extra::default()
            },
            ..light.on(&predicted.field, &predicted.frame.mask)
        };
        let composed = Instant::now();
        let (coarse, mut shown) =
            compose((&mut self.series, &mut self.resolution), (&scene, &ingredients), (predicted, inputs.coarse))?;
        let asked_frame = (request, predicted);
        let table = &mut self.table;
        let looks = (self.looks).make(asked_frame, (&self.rig, reference), table, &self.behind)?;
        let table = self.table.read(&request.scene, request.table.as_ref())?;
        if inputs.in_memory || table.is_some() {
            shown.read()?;
        }
        let fine = (predicted.plate.as_ref()).is_some_and(|plate| plate.has_fine_light());
        // The next moving picture goes without fine light, and so takes less time.
        if inputs.draft || !fine {
            let ms = composed.elapsed().as_secs_f64() * 1e3;
            self.resolution.took(coarse, ms);
        }
        if let (Inspection::Difference { gain }, Some(first), Some(second)) =
            (scene.effects.inspection, &mut first, &second)
        {
            difference(first, second, gain)?;
        }
        if let Some(table) = table {
            // Only the picture itself has a table, and then `whole` is empty.
            let pictures = [&mut shown.picture.display, &mut first, &mut second];
            let pictures = pictures.into_iter().flatten();
            pictures.for_each(|codes| table.apply_to(codes));
            shown.texture = None;
        }
        let (width, height) = predicted.size();
        let codes = |picture: Option<Encoded>| picture.as_ref().map(SrgbPicture::from_picture);
        let subject = light.levels().subject;
        let mut preview = PreviewPicture {
            scene: request.scene.clone(),
            environment: light.environment().name.clone(),
            width,
            height,
            coarse,
            draft: inputs.draft && fine,
            rgb: Vec::new(),
            rgb_size: [width, height],
            texture: shown.texture.clone(),
            first: request.first.clone().zip(codes(first)),
            second: request.second.clone().zip(codes(second)),
            whole: whole.map(codes),
            looks,
            missing,
            solo: request.solo.clone(),
            linear: None,
            weights: (weights.per_lamp.iter()).map(|weight| weight.map(|w| w * subject)).collect(),
            passes: shown.picture.passes.clone(),
            predict_ms: predicted.ms,
            relight_ms: 0.0,
            uncovered: light.weights().uncovered,
            rig: self.rig.clone(),
            frames_at_hand: HashSet::new(),
            predicted: predicted.clone(),
        };
        let left = if shown.is_read() {
            preview.take(shown.picture);
            None
        } else {
            Some(shown)
        };
        preview.relight_ms = started.elapsed().as_secs_f64() * 1e3;
        self.unread = left.map(|shown| (shown, preview.clone()));
        Ok(preview)
    }

    /// Notes the frame, environment and counterpart of the next picture.
    fn identify(&mut self, request: &PreviewRequest, predicted: &Arc<PredictedFrame>) {
        let known = |last: &Arc<PredictedFrame>| Arc::ptr_eq(last, predicted);
        if !self.last.as_ref().is_some_and(known) {
            self.last = Some(predicted.clone());
            self.identity.frame += 1;
        }
        let known = |light: &EnvironmentLight| light.is_of(&request.environment);
        if !self.light.as_ref().is_some_and(known) {
            self.identity.environment += 1;
        }
        if request.first.is_some() || request.second.is_some() {
            self.identity.second += 1;
        }
    }
}

/// Makes a frame's picture. Also returns the number of pixels along each axis that were lit as one: up to
/// `coarse`, if the field is in memory.
fn compose(
    (series, resolution): (&mut Series, &mut AdaptiveResolution),
    (scene, of): (&Scene, &Ingredients),
    (predicted, coarse): (&Arc<PredictedFrame>, usize),
) -> Result<(usize, ShownPicture)> {
    let plate = (&predicted.frame.plate, &predicted.frame.mask);
    let reduced = (coarse > 1).then(|| resolution.reduced(predicted, coarse));
    let Some(ReducedFrame { reduced, reuse, .. }) = reduced.flatten() else {
        return Ok((1, series.show(scene, plate, of)?));
    };
    let ingredients = match reduced {
        Reduced::Field(field, mask) => Ingredients { field, mask, ..*of },
        Reduced::Plate(plate) => {
            let plate = Some(&*plate);
            Ingredients { extra: Extra { plate, ..of.extra }, ..*of }
        }
    };
    let mut stand_in = series.compose_stand_in(scene, plate, &ingredients, reuse)?;
    stand_in.linear = None;
    Ok((coarse, ShownPicture::in_memory(stand_in)))
}

/// The two compared pictures, as far as their inputs are in memory.
fn compared(
    relit: &RelitFrame,
    inputs: &PreviewInputs,
    [first_light, second_light]: &mut [Option<EnvironmentLight>; 2],
) -> Result<[Option<Encoded>; 2]> {
    let PreviewRequest { first, second, .. } = &inputs.request;
    let [first_olats, second_olats] = inputs.olats.each_ref().map(|olats| olats.as_deref());
    let picture = |comparison: &Option<Comparison>, olats, own_light: &mut _| match comparison {
        Some(comparison) => relit.compared(comparison, olats, own_light),
        None => Ok(None),
    };
    Ok([picture(first, first_olats, first_light)?, picture(second, second_olats, second_light)?])
}
