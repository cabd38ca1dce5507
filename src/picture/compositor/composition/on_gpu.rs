//! The passes on a GPU. Pictures stay there until the requested one is read.

use super::backend::{Backend, FinishedPicture, ReadPicture};
use crate::background::{Backdrop, draw_background};
use crate::descriptor::{CodesInput, CodesStep, EncodeStep, LightStep, PassContext};
use crate::facts::{Grain, Inputs, Screen, Spill, key};
use crate::passes::{GpuMatte, GpuPicture, PicturePasses, Recording};
use crate::picture::Ingredients;
use crate::plate::GpuPlate;
use crate::reuse::{Cache, Reuse, Uploads};
use crate::smoothing::{self, even_light};
use base::error::Result;
use imaging::{Image, Mask};
use reflectance::FieldBuffer;
use scene::Pass;

/// GPU of the field.
pub(crate) struct OnGpu<'a> {
    ingredients: &'a Ingredients<'a>,
    field: &'a FieldBuffer,
    passes: &'a PicturePasses,
    recording: Recording<'a>,
    /// Key of the frame.
    frame: u64,
    /// At the working size.
    matte: GpuMatte,
    /// At the picture's size, if the light is brought to it.
    plate: Option<GpuPlate>,
    uploads: Uploads,
}

impl<'a> OnGpu<'a> {
    pub fn new(
        ingredients: &'a Ingredients<'a>,
        inputs: Inputs,
        (field, passes): (&'a FieldBuffer, &'a PicturePasses),
        mut uploads: Uploads,
    ) -> Result<Self> {
        let matte = match uploads.matte.get(inputs.frame) {
            Some(matte) => matte,
            None => passes.upload_matte(ingredients.mask)?,
        };
        uploads.matte.put(inputs.frame, matte.clone());
        let plate = match (ingredients.plate(), uploads.plate.get(inputs.frame)) {
            (None, _) => None,
            (_, Some(plate)) => Some(plate),
            (Some(plate), None) => Some(passes.upload_plate(plate)?),
        };
        if let Some(plate) = &plate {
            uploads.plate.put(inputs.frame, plate.clone());
        }
        Ok(Self { ingredients, field, passes, recording: passes.begin(), frame: inputs.frame, matte, plate, uploads })
    }

    /// The panorama on the GPU; None if it exceeds the GPU's binding size.
    fn panorama(&mut self) -> Result<Option<GpuPicture>> {
        let radiance = &self.ingredients.environment.radiance;
        if self.passes.fits(radiance.width, radiance.height).is_err() {
            return Ok(None);
        }
        let key = key((self.ingredients.extra.identity.environment, radiance.size()));
        let panorama = match self.uploads.panorama.get(key) {
            Some(panorama) => panorama,
            None => self.passes.upload_opaque(radiance)?,
        };
        self.uploads.panorama.put(key, panorama.clone());
        Ok(Some(panorama))
    }
}

impl Backend for OnGpu<'_> {
    type Light = GpuPicture;
    type Codes = GpuPicture;
    type Own = Uploads;

    fn cache(reuse: &mut Reuse) -> &mut Cache<GpuPicture, Uploads> {
        &mut reuse.gpu
    }

    fn begin(&mut self, pass: Pass) {
        self.recording.begin(pass);
    }

    fn black(&self) -> GpuPicture {
        self.matte.picture.clone()
    }

    fn light(&mut self, step: &LightStep, context: &PassContext, picture: &mut GpuPicture) -> Result<()> {
        *picture = (step.on_gpu)(context, &mut self.recording, picture)?;
        Ok(())
    }

    fn encode(&mut self, step: &EncodeStep, context: &PassContext, picture: &GpuPicture) -> Result<Option<GpuPicture>> {
        (step.on_gpu)(context, &mut self.recording, picture)
    }

    fn codes(
        &mut self,
        step: &CodesStep,
        context: &PassContext,
        input: &CodesInput,
        codes: &mut GpuPicture,
    ) -> Result<()> {
        let matte = self.plate.as_ref().map_or(&self.matte.picture, |plate| &plate.lit);
        *codes = (step.on_gpu)(context, input, &mut self.recording, codes, matte)?;
        Ok(())
    }

    fn even_samples(&mut self) -> Result<Vec<[f32; 3]>> {
        let even = self.recording.sum(self.field, &even_light(self.field.lamps))?;
        let step = smoothing::step(even.width * even.height);
        let even = self.recording.every(&even, step)?;
        let light = even.into_iter().map(|[r, g, b, _]| [r, g, b]);
        Ok(smoothing::samples(light, self.ingredients.mask))
    }

    fn relight(&mut self, weights: &[[f32; 3]]) -> Result<GpuPicture> {
        self.recording.relight(self.field, weights, &self.matte)
    }

    fn plate(&mut self, subject: &mut GpuPicture, weights: &[[f32; 3]]) -> Result<()> {
        if let Some(plate) = &self.plate {
            *subject = self.recording.plate(subject, plate)?;
        }
        let plate = self.ingredients.finely_lit();
        if let Some(light) = plate.and_then(|plate| plate.fine_light(weights)) {
            let light = self.passes.upload_opaque(&light)?;
            *subject = self.recording.add_light(subject, &light)?;
        }
        Ok(())
    }

    fn guide(&mut self, subject: &GpuPicture) -> Result<(GpuPicture, Spill)> {
        let rim = match self.uploads.rim.get(self.frame) {
            Some(rim) => rim,
            None => {
                let plate = self.plate.as_ref().map(|plate| &plate.lit);
                self.recording.rim(plate.unwrap_or(&self.matte.picture))?
            }
        };
        self.uploads.rim.put(self.frame, rim.clone());
        self.recording.guide(subject, &rim)
    }

    fn despill(&mut self, subject: &mut GpuPicture, guide: &GpuPicture, screen: Screen, amount: f32) -> Result<()> {
        *subject = self.recording.despill(subject, guide, screen, amount)?;
        Ok(())
    }

    fn placed(&mut self, picture: Image) -> Result<GpuPicture> {
        self.passes.upload_opaque(&picture)
    }

    fn behind(&mut self, backdrop: &Backdrop) -> Result<GpuPicture> {
        let (width, height) = self.ingredients.matte().size();
        if let Some(panorama) = self.panorama()? {
            let open = self.recording.blank((width, height))?;
            let view = self.ingredients.view;
            return self.recording.background(&open, &panorama, backdrop, view, false);
        }
        let mut behind = Image::filled(width, height, [0.0; 3]);
        let open = Mask::filled(width, height, 0.0);
        let panorama = &self.ingredients.environment.radiance;
        draw_background(&mut behind, &open, panorama, backdrop, self.ingredients.view);
        self.passes.upload_opaque(&behind)
    }

    fn surround(&mut self, subject: &mut GpuPicture, backdrop: &Backdrop) -> Result<()> {
        *subject = match self.panorama()? {
            Some(panorama) => {
                let view = self.ingredients.view;
                self.recording.background(subject, &panorama, backdrop, view, true)?
            }
            None => {
                let behind = self.behind(backdrop)?;
                self.recording.over(subject, &behind)?
            }
        };
        Ok(())
    }

    fn wrap_need(&mut self, subject: &GpuPicture, behind: &GpuPicture) -> Result<f32> {
        self.recording.wrap_need(subject, behind)
    }

    fn light_wrap(&mut self, subject: &mut GpuPicture, behind: &GpuPicture, amount: f32) -> Result<()> {
        *subject = self.recording.light_wrap(subject, behind, amount)?;
        Ok(())
    }

    fn over(&mut self, subject: &mut GpuPicture, behind: &GpuPicture) -> Result<()> {
        *subject = self.recording.over(subject, behind)?;
        Ok(())
    }

    fn brightest(&mut self, picture: &GpuPicture) -> Result<f32> {
        self.recording.brightest(picture)
    }

    fn measure_grain(&mut self, codes: &GpuPicture) -> Result<Grain> {
        self.recording.measure_grain(codes, self.ingredients.matte())
    }

    fn finish(
        self,
        picture: GpuPicture,
        codes: Option<GpuPicture>,
        needs_light: bool,
        may_stay: bool,
    ) -> Result<(FinishedPicture, Uploads)> {
        let light = needs_light.then_some(&picture);
        let wanted: Vec<&GpuPicture> = light.into_iter().chain(&codes).collect();
        let shown = codes.as_ref().filter(|_| may_stay);
        let finished = match shown.filter(|codes| self.passes.has_texture(codes.size())) {
            Some(codes) => {
                let (texture, unread) = self.recording.show(codes, &wanted)?;
                FinishedPicture::OnGpu(texture, unread)
            }
            None => {
                let read = self.recording.finish(&wanted)?;
                FinishedPicture::InMemory(ReadPicture::new(read, codes.is_some()))
            }
        };
        Ok((finished, self.uploads))
    }
}
