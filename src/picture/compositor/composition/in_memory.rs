//! The passes on the CPU, on pictures in memory.

use super::backend::{Backend, FinishedPicture, ReadPicture};
use crate::background::{Backdrop, draw_background};
use crate::descriptor::{CodesInput, CodesStep, EncodeStep, LightStep, PassContext};
use crate::despill::{self, despill};
use crate::edges::extend_edges;
use crate::facts::{Grain, Screen, Spill};
use crate::glare::brightest;
use crate::light_wrap::{self, light_wrap};
use crate::picture::Ingredients;
use crate::reuse::{Cache, Reuse, Rim};
use crate::smoothing::{self, even_light};
use base::error::Result;
use imaging::{Encoded, Image, Mask, resample::resize_area};
use rayon::prelude::*;
use scene::Pass;
use std::sync::Arc;
use std::time::Instant;

/// The CPU backend.
pub(crate) struct InMemory<'a> {
    ingredients: &'a Ingredients<'a>,
    /// Key of the frame.
    frame: u64,
    rim: Rim,
    mended: usize,
    ms: [f64; Pass::ALL.len()],
    /// Running pass and its start.
    running: Option<(Pass, Instant)>,
}

impl<'a> InMemory<'a> {
    pub fn new(ingredients: &'a Ingredients<'a>, frame: u64, rim: Rim) -> Self {
        Self { ingredients, frame, rim, mended: 0, ms: [0.0; Pass::ALL.len()], running: None }
    }

    fn stop(&mut self) {
        if let Some((pass, started)) = self.running.take() {
            self.ms[pass as usize] += started.elapsed().as_secs_f64() * 1e3;
        }
    }

    fn draw(&self, picture: &mut Image, mask: &Mask, backdrop: &Backdrop) {
        let panorama = &self.ingredients.environment.radiance;
        draw_background(picture, mask, panorama, backdrop, self.ingredients.view);
    }
}

impl Backend for InMemory<'_> {
    type Light = Arc<Image>;
    type Codes = Encoded;
    type Own = Rim;

    fn cache(reuse: &mut Reuse) -> &mut Cache<Arc<Image>, Rim> {
        &mut reuse.memory
    }

    fn begin(&mut self, pass: Pass) {
        self.stop();
        self.running = Some((pass, Instant::now()));
    }

    fn black(&self) -> Arc<Image> {
        let (width, height) = self.ingredients.mask.size();
        Arc::new(Image::filled(width, height, [0.0; 3]))
    }

    fn light(&mut self, step: &LightStep, context: &PassContext, picture: &mut Arc<Image>) -> Result<()> {
        (step.in_memory)(context, Arc::make_mut(picture));
        Ok(())
    }

    fn encode(&mut self, step: &EncodeStep, context: &PassContext, picture: &Arc<Image>) -> Result<Option<Encoded>> {
        Ok((step.in_memory)(context, picture))
    }

    fn codes(
        &mut self,
        step: &CodesStep,
        context: &PassContext,
        input: &CodesInput,
        codes: &mut Encoded,
    ) -> Result<()> {
        (step.in_memory)(context, input, codes)
    }

    fn even_samples(&mut self) -> Result<Vec<[f32; 3]>> {
        let (field, mask) = (self.ingredients.field, self.ingredients.mask);
        let even = field.relight(&even_light(field.lamps()))?;
        let step = smoothing::step(even.pixels.len());
        Ok(smoothing::samples(even.pixels.into_iter().step_by(step), mask))
    }

    fn relight(&mut self, weights: &[[f32; 3]]) -> Result<Arc<Image>> {
        let mask = self.ingredients.mask;
        let mut subject = self.ingredients.field.relight(weights)?;
        self.mended = extend_edges(&mut subject, mask);
        for (pixel, &alpha) in subject.pixels.iter_mut().zip(&mask.pixels) {
            *pixel = pixel.map(|v| v * alpha);
        }
        Ok(Arc::new(subject))
    }

    fn plate(&mut self, subject: &mut Arc<Image>, weights: &[[f32; 3]]) -> Result<()> {
        if let Some(plate) = self.ingredients.plate() {
            *subject = Arc::new(match self.ingredients.finely_lit() {
                Some(plate) => plate.relit_by(subject, self.ingredients.mask, weights),
                None => plate.relit(subject, self.ingredients.mask),
            });
        }
        Ok(())
    }

    fn guide(&mut self, subject: &Arc<Image>) -> Result<(Arc<Image>, Spill)> {
        let mask = self.ingredients.matte();
        let rim = self.rim.get(self.frame);
        let rim = rim.unwrap_or_else(|| Arc::new(despill::rim(mask)));
        self.rim.put(self.frame, rim.clone());
        let guide = despill::guide(subject, mask, &rim);
        let spill = despill::spill(subject, &guide);
        Ok((Arc::new(guide), spill))
    }

    fn despill(&mut self, subject: &mut Arc<Image>, guide: &Arc<Image>, screen: Screen, amount: f32) -> Result<()> {
        despill(Arc::make_mut(subject), guide, screen, amount);
        Ok(())
    }

    fn placed(&mut self, picture: Image) -> Result<Arc<Image>> {
        Ok(Arc::new(picture))
    }

    fn behind(&mut self, backdrop: &Backdrop) -> Result<Arc<Image>> {
        let (width, height) = self.ingredients.matte().size();
        let mut behind = Image::filled(width, height, [0.0; 3]);
        self.draw(&mut behind, &Mask::filled(width, height, 0.0), backdrop);
        Ok(Arc::new(behind))
    }

    fn surround(&mut self, subject: &mut Arc<Image>, backdrop: &Backdrop) -> Result<()> {
        self.draw(Arc::make_mut(subject), self.ingredients.matte(), backdrop);
        Ok(())
    }

    fn wrap_need(&mut self, subject: &Arc<Image>, behind: &Arc<Image>) -> Result<f32> {
        let (width, height) = light_wrap::measured_size(subject.size());
        if subject.pixels.is_empty() {
            return Ok(0.0);
        }
        let small = |image: &Image| resize_area(image, width, height);
        let mask = resize_area(self.ingredients.matte(), width, height);
        Ok(light_wrap::need(&small(subject), &mask, &small(behind)))
    }

    fn light_wrap(&mut self, subject: &mut Arc<Image>, behind: &Arc<Image>, amount: f32) -> Result<()> {
        light_wrap(Arc::make_mut(subject), self.ingredients.matte(), behind, amount);
        Ok(())
    }

    fn over(&mut self, subject: &mut Arc<Image>, behind: &Arc<Image>) -> Result<()> {
        let pixels = Arc::make_mut(subject).pixels.par_iter_mut();
        let pixels = pixels.zip(&behind.pixels).zip(&self.ingredients.matte().pixels);
        pixels.with_min_len(4096).for_each(|((pixel, light), alpha)| {
            (0..3).for_each(|c| pixel[c] += (1.0 - alpha) * light[c]);
        });
        Ok(())
    }

    fn brightest(&mut self, picture: &Arc<Image>) -> Result<f32> {
        Ok(brightest(picture))
    }

    fn measure_grain(&mut self, codes: &Encoded) -> Result<Grain> {
        Ok(Grain::new(codes, self.ingredients.matte()))
    }

    fn finish(
        mut self,
        picture: Arc<Image>,
        codes: Option<Encoded>,
        _needs_light: bool,
        _may_stay: bool,
    ) -> Result<(FinishedPicture, Rim)> {
        self.stop();
        let made = ReadPicture {
            linear: Some(Arc::unwrap_or_clone(picture)),
            display: codes,
            mended: self.mended,
            ms: Some(self.ms),
        };
        Ok((FinishedPicture::InMemory(made), self.rim))
    }
}
