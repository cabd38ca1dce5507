//! What each pass from picture to picture asks of its shader. The twins on the CPU are the functions of
//! the same names in [`crate`].

use super::pictures::GpuPicture;
use super::recording::Recording;
use crate::background::{Backdrop, CameraView, Sampling};
use crate::background_blur::{LARGEST_RADIUS, halved};
use crate::grain::BINS;
use crate::{CLIPPED, Grain, LEGEND, Screen, false_color, glare, light_wrap};
use base::error::Result;
use bytemuck::{Pod, Zeroable, bytes_of};
use scene::{Channel, ViewTransform};

/// Parameters of `pyramid`.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(super) struct PyramidParams {
    size: [u32; 2],
    from_size: [u32; 2],
    odd_end: f32,
    keep: f32,
    unused: [f32; 2],
}

/// Parameters of passes that go by the size and two more values at most.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(super) struct PlainParams {
    pub size: [u32; 2],
    pub values: [u32; 2],
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(super) struct BackgroundParams {
    size: [u32; 2],
    panorama: [u32; 2],
    pixel: f32,
    turn: f32,
    samples: u32,
    opaque: u32,
    untilt: [[f32; 4]; 3],
    level: [f32; 4],
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(super) struct GrainParams {
    pub size: [u32; 2],
    pub frame: u32,
    pub step: u32,
    pub inside: [[f32; 4]; BINS],
    pub outside: [[f32; 4]; BINS],
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(super) struct FalseColorParams {
    size: [u32; 2],
    unused: [u32; 2],
    zones: [[f32; 4]; LEGEND.len()],
    clipped: [f32; 4],
}

pub(super) fn size_of_picture((width, height): (usize, usize)) -> [u32; 2] {
    [width as u32, height as u32]
}

/// Every function records its work and gives the new picture that it leaves on the GPU. Each fails where the
/// GPU cannot hold that picture. A second picture has the size of the first, where it is no panorama.
impl Recording<'_> {
    pub(super) fn plain(
        &mut self,
        entry: &'static str,
        values: [u32; 2],
        first: &GpuPicture,
        second: Option<&GpuPicture>,
    ) -> Result<GpuPicture> {
        let size = size_of_picture(first.size());
        let params = PlainParams { size, values };
        self.run(entry, bytes_of(&params), first, second, first.size())
    }

    fn halve(&mut self, fine: &GpuPicture, odd_end: f32) -> Result<GpuPicture> {
        let size = (fine.width.div_ceil(2), fine.height.div_ceil(2));
        let params = PyramidParams {
            size: size_of_picture(size),
            from_size: size_of_picture(fine.size()),
            odd_end,
            keep: 0.0,
            unused: [0.0; 2],
        };
        self.run("halve", bytes_of(&params), fine, None, size)
    }

    fn double_onto(
        &mut self,
        coarse: &GpuPicture,
        fine: &GpuPicture,
        keep: f32,
        odd_end: f32,
    ) -> Result<GpuPicture> {
        let params = PyramidParams {
            size: size_of_picture(fine.size()),
            from_size: size_of_picture(coarse.size()),
            odd_end,
            keep,
            unused: [0.0; 2],
        };
        self.run("double", bytes_of(&params), coarse, Some(fine), fine.size())
    }

    /// Pass `despill`; `guide` is as [`crate::guide`] makes it.
    pub fn despill(
        &mut self,
        subject: &GpuPicture,
        guide: &GpuPicture,
        screen: Screen,
        amount: f32,
    ) -> Result<GpuPicture> {
        let values = [screen.channel() as u32, amount.to_bits()];
        self.plain("despill", values, subject, Some(guide))
    }

    /// Pass `background`: the fourth value of `subject` is its matte; after it, it is 1 where the subject
    /// is `laid` over the background by this, and stays where it is not.
    pub fn background(
        &mut self,
        subject: &GpuPicture,
        panorama: &GpuPicture,
        backdrop: &Backdrop,
        view: CameraView,
        laid: bool,
    ) -> Result<GpuPicture> {
        let sampling = Sampling::of(subject.height, panorama.height, backdrop.yaw_deg, view);
        let [x, y, z] = glam::Mat3::from_quat(backdrop.tilt.inverse())
            .to_cols_array_2d()
            .map(|[x, y, z]| [x, y, z, 0.0]);
        let [r, g, b] = backdrop.level;
        let params = BackgroundParams {
            size: size_of_picture(subject.size()),
            panorama: size_of_picture(panorama.size()),
            pixel: sampling.pixel,
            turn: sampling.turn,
            samples: sampling.samples as u32,
            opaque: u32::from(laid),
            untilt: [x, y, z],
            level: [r, g, b, 0.0],
        };
        let size = subject.size();
        self.run(
            "background",
            bytes_of(&params),
            subject,
            Some(panorama),
            size,
        )
    }

    /// Pass `background_blur`, by a disc of `radius` pixels. All four values are blurred.
    pub fn background_blur(&mut self, picture: &GpuPicture, radius: f32) -> Result<GpuPicture> {
        if radius < LARGEST_RADIUS || picture.width * picture.height <= 1 {
            return self.plain("disc", [radius.max(0.0).to_bits(), 0], picture, None);
        }
        let half = self.halve(picture, 1.0)?;
        let small = self.background_blur(&half, halved(radius))?;
        self.double_onto(&small, picture, 0.0, 1.0)
    }

    /// Pass `light_wrap`: the fourth value of `subject` is its matte, `behind` is not yet laid under it.
    pub fn light_wrap(
        &mut self,
        subject: &GpuPicture,
        behind: &GpuPicture,
        amount: f32,
    ) -> Result<GpuPicture> {
        let open = self.plain("open", [0; 2], subject, Some(behind))?;
        let past = self.background_blur(&open, light_wrap::reach(subject.height))?;
        self.plain("wrap", [amount.to_bits(), 0], subject, Some(&past))
    }

    /// A premultiplied subject over what is behind it. The fourth value becomes 1.
    pub fn over(&mut self, subject: &GpuPicture, behind: &GpuPicture) -> Result<GpuPicture> {
        self.plain("over", [0; 2], subject, Some(behind))
    }

    /// Pass `glare`.
    pub fn glare(&mut self, picture: &GpuPicture, amount: f32, white: f32) -> Result<GpuPicture> {
        let values = [white.to_bits(), amount.to_bits()];
        let shares = glare::shares(picture.width, picture.height);
        let mut scattered = self.plain("excess", values, picture, None)?;
        if shares.is_empty() {
            return self.plain("lay", values, picture, Some(&scattered));
        }
        let mut levels = Vec::with_capacity(shares.len());
        for _ in &shares {
            let half = self.halve(&scattered, 0.5)?;
            levels.push(std::mem::replace(&mut scattered, half));
        }
        // The coarsest level has nothing wider to add to: it takes its own share here.
        let mut keeps = vec![0.0];
        keeps.extend_from_slice(&shares[..shares.len() - 1]);
        let last = shares[shares.len() - 1];
        scattered = self.plain("exposure", [last.to_bits(), 0], &scattered, None)?;
        for (level, keep) in levels.iter().zip(keeps).rev() {
            scattered = self.double_onto(&scattered, level, keep, 2.0)?;
        }
        self.plain("lay", values, picture, Some(&scattered))
    }

    /// Pass `exposure`.
    pub fn exposure(&mut self, picture: &GpuPicture, stops: f32) -> Result<GpuPicture> {
        self.plain("exposure", [stops.exp2().to_bits(), 0], picture, None)
    }

    /// Pass `view`.
    pub fn view(&mut self, picture: &GpuPicture, transform: ViewTransform) -> Result<GpuPicture> {
        let curve = match transform {
            ViewTransform::Srgb => 0,
            ViewTransform::Filmic => 1,
            ViewTransform::Aces => 2,
        };
        self.plain("view", [curve, 0], picture, None)
    }

    /// Pass `grain`: the fourth value of `codes` is the picture's coverage, that of `matte` the subject's.
    pub fn grain(
        &mut self,
        codes: &GpuPicture,
        matte: &GpuPicture,
        [plate, own]: [&Grain; 2],
        amount: f32,
        frame: usize,
    ) -> Result<GpuPicture> {
        let padded = |grain: Grain| grain.deviation.map(|[r, g, b]| [r, g, b, 0.0]);
        let params = GrainParams {
            size: size_of_picture(codes.size()),
            frame: frame as u32,
            step: 1,
            inside: padded(plate.beyond(own, amount)),
            outside: padded(plate.beyond(&Grain::default(), amount)),
        };
        self.run("grain", bytes_of(&params), codes, Some(matte), codes.size())
    }

    /// Pass `dither`: the fourth value of `matte` is the subject's matte.
    pub fn dither(&mut self, codes: &GpuPicture, matte: &GpuPicture) -> Result<GpuPicture> {
        self.plain("dither", [0; 2], codes, Some(matte))
    }

    /// Pass `channels`.
    pub fn channels(&mut self, codes: &GpuPicture, channel: Channel) -> Result<GpuPicture> {
        let channel = match channel {
            Channel::Red => 0,
            Channel::Green => 1,
            Channel::Blue => 2,
            Channel::Luminance => 3,
            Channel::Alpha => 4,
        };
        self.plain("channels", [channel, 0], codes, None)
    }

    /// Pass `difference`.
    pub fn difference(
        &mut self,
        codes: &GpuPicture,
        second: &GpuPicture,
        gain: f32,
    ) -> Result<GpuPicture> {
        self.plain("difference", [gain.to_bits(), 0], codes, Some(second))
    }

    /// Pass `false_color`.
    pub fn false_color(&mut self, linear: &GpuPicture) -> Result<GpuPicture> {
        let limits = false_color::limits();
        let zones = std::array::from_fn(|i| {
            let [r, g, b] = LEGEND[i].color.unwrap_or([-1.0; 3]);
            [r, g, b, limits[i]]
        });
        let [r, g, b] = CLIPPED;
        let params = FalseColorParams {
            size: size_of_picture(linear.size()),
            unused: [0; 2],
            zones,
            clipped: [r, g, b, 0.0],
        };
        self.run(
            "false_color",
            bytes_of(&params),
            linear,
            None,
            linear.size(),
        )
    }
}

#[cfg(test)]
#[path = "effects_tests.rs"]
mod tests;
