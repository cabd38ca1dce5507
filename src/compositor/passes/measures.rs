//! What passes are measured by on the GPU. Full pictures stay there: each function reads what it has
//! brought to little data first.

use super::effects::{GrainParams, PlainParams, size_of_picture};
use super::pictures::GpuPicture;
use super::recording::Recording;
use crate::despill::{INSIDE, Spill, reach};
use crate::grain::{BINS, Grain, Sample, places};
use crate::light_wrap::{measured_size, need};
use crate::pyramid::Rgba;
use base::error::Result;
use bytemuck::bytes_of;
use imaging::{Image, Mask};

/// Values that a whole picture is brought to, as in the shader.
const GROUPS: u32 = 64;

/// Every function fails where the GPU cannot hold its pictures, or fails itself.
impl Recording<'_> {
    /// Every `step`-th pixel: at most as many as the picture has, divided by `step`.
    pub fn every(&mut self, picture: &GpuPicture, step: usize) -> Result<Vec<[f32; 4]>> {
        let count = (picture.width * picture.height).div_ceil(step);
        let params = PlainParams {
            size: size_of_picture((count, 1)),
            values: [step as u32, 0],
        };
        let picked = self.run("pick", bytes_of(&params), picture, None, (count, 1))?;
        let [picked] = self.read([&picked])?;
        Ok(picked.pixels)
    }

    /// The rim of a matte: [`crate::rim`] in the red, the matte in the fourth value.
    pub fn rim(&mut self, matte: &GpuPicture) -> Result<GpuPicture> {
        let open = self.plain("open", [0; 2], matte, Some(matte))?;
        let open = self.background_blur(&open, reach(matte.height))?;
        self.plain("rim", [0; 2], matte, Some(&open))
    }

    /// What [`Self::despill`] goes by, and the spill of a subject: reads 1 KiB.
    pub fn guide(&mut self, subject: &GpuPicture, rim: &GpuPicture) -> Result<(GpuPicture, Spill)> {
        let inside = self.plain("inside", [0; 2], subject, Some(rim))?;
        let inside = self.background_blur(&inside, INSIDE * reach(subject.height))?;
        let guide = self.plain("guide", [0; 2], &inside, Some(rim))?;
        let spill = self.plain("spill", [0; 2], subject, Some(&guide))?;
        let parts = self.groups("total", &spill)?;
        let sum = |c: usize| parts.iter().map(|part| f64::from(part[c])).sum::<f64>();
        Ok((guide, Spill::of([sum(0), sum(1)], sum(2))))
    }

    /// The largest value of a picture's channels that is a number, 0 at least: reads 1 KiB.
    pub fn brightest(&mut self, picture: &GpuPicture) -> Result<f32> {
        let parts = self.groups("largest", picture)?;
        let largest = parts.iter().flat_map(|[r, g, b, _]| [r, g, b]);
        Ok(largest.fold(0.0, |most, &v| most.max(v)))
    }

    fn groups(&mut self, entry: &'static str, picture: &GpuPicture) -> Result<Vec<[f32; 4]>> {
        let params = PlainParams {
            size: size_of_picture(picture.size()),
            values: [0; 2],
        };
        let parts = self.blank((GROUPS as usize, 1))?;
        let bound = [picture, picture, &parts].map(GpuPicture::binding);
        self.dispatch(entry, bytes_of(&params), bound, [GROUPS, 1])?;
        let [parts] = self.read([&parts])?;
        Ok(parts.pixels)
    }

    /// What wrapping light would add to the rim, as [`crate::light_wrap`] measures it: on two
    /// pictures of at most 64 pixels along each side, 128 KiB.
    pub fn wrap_need(&mut self, subject: &GpuPicture, behind: &GpuPicture) -> Result<f32> {
        let size = measured_size(subject.size());
        let subject = self.shrink(subject, size)?;
        let behind = self.shrink(behind, size)?;
        let [subject, behind] = self.read([&subject, &behind])?;
        let light = |picture: &Rgba| -> Image { picture.map(|[r, g, b, _]| [r, g, b]) };
        let mask = subject.map(|[_, _, _, alpha]| alpha);
        Ok(need(&light(&subject), &mask, &light(&behind)))
    }

    fn shrink(&mut self, picture: &GpuPicture, size: (usize, usize)) -> Result<GpuPicture> {
        let params = PlainParams {
            size: size_of_picture(size),
            values: size_of_picture(picture.size()),
        };
        self.run("shrink", bytes_of(&params), picture, None, size)
    }

    /// The grain of codes where the matte is solid, as [`Grain::of`] finds it: from the same places, at most
    /// 40,000, which are 1.9 MB.
    pub fn grain_of(&mut self, codes: &GpuPicture, mask: &Mask) -> Result<Grain> {
        let Some((step, count)) = places(codes.size()) else {
            return Ok(Grain::default());
        };
        let params = GrainParams {
            size: size_of_picture(codes.size()),
            frame: 0,
            step: step as u32,
            inside: [[0.0; 4]; BINS],
            outside: [[0.0; 4]; BINS],
        };
        let survey = self.run("survey", bytes_of(&params), codes, None, (count, 3))?;
        let [survey] = self.read([&survey])?;
        Ok(Grain::measured(mask, |place, _, channel| {
            let [code, gradient, high, _] = survey.at(place, channel);
            Sample {
                code,
                gradient,
                high,
            }
        }))
    }
}
