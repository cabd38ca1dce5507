//! Backends, which execute the passes of a composition.

use crate::background::Backdrop;
use crate::descriptor::{CodesInput, CodesStep, EncodeStep, LightStep, PassContext};
use crate::facts::{Grain, Screen, Spill};
use crate::passes::{DisplayTexture, Readback, Unread};
use crate::reuse::{Cache, Reuse};
use base::error::Result;
use imaging::{Encoded, Image};
use scene::Pass;

/// Executes the passes of one picture: in memory, or on a GPU that keeps all pictures until the end. Every
/// computation fails if the device does.
pub(crate) trait Backend {
    /// A picture in linear light. Cloning is free.
    type Light: Clone;
    /// A picture in display codes.
    type Codes;
    /// Other cached data.
    type Own: Clone + Default;

    /// Cache of the backend's pictures.
    fn cache(reuse: &mut Reuse) -> &mut Cache<Self::Light, Self::Own>;

    /// Starts a pass: later work belongs to it.
    fn begin(&mut self, pass: Pass);

    /// A subject without light.
    fn black(&self) -> Self::Light;

    /// Runs one step on light.
    fn light(&mut self, step: &LightStep, context: &PassContext, picture: &mut Self::Light) -> Result<()>;

    /// Converts light to codes; None if the codes stay.
    fn encode(
        &mut self,
        step: &EncodeStep,
        context: &PassContext,
        picture: &Self::Light,
    ) -> Result<Option<Self::Codes>>;

    /// Runs one step on codes.
    fn codes(
        &mut self,
        step: &CodesStep,
        context: &PassContext,
        input: &CodesInput,
        codes: &mut Self::Codes,
    ) -> Result<()>;

    /// The subject under even light, sampled by [`crate::Steady`].
    fn even_samples(&mut self) -> Result<Vec<[f32; 3]>>;

    /// The subject under these weights, repaired and premultiplied.
    fn relight(&mut self, weights: &[[f32; 3]]) -> Result<Self::Light>;

    /// Brings the subject, lit with these weights, to the plate's size: its light multiplies the plate.
    fn plate(&mut self, subject: &mut Self::Light, weights: &[[f32; 3]]) -> Result<()>;

    /// Guide of despill, and the spill.
    fn guide(&mut self, subject: &Self::Light) -> Result<(Self::Light, Spill)>;

    fn despill(&mut self, subject: &mut Self::Light, guide: &Self::Light, screen: Screen, amount: f32) -> Result<()>;

    /// A picture of the scene's own background.
    fn placed(&mut self, picture: Image) -> Result<Self::Light>;

    /// The full environment behind the subject.
    fn behind(&mut self, backdrop: &Backdrop) -> Result<Self::Light>;

    /// Lays the subject over the background, which is drawn only where it shows.
    fn surround(&mut self, subject: &mut Self::Light, backdrop: &Backdrop) -> Result<()>;

    /// Light that full wrapping would add to the rim, as a share of the rim's light.
    fn wrap_need(&mut self, subject: &Self::Light, behind: &Self::Light) -> Result<f32>;

    fn light_wrap(&mut self, subject: &mut Self::Light, behind: &Self::Light, amount: f32) -> Result<()>;

    /// Lays the subject over its background.
    fn over(&mut self, subject: &mut Self::Light, behind: &Self::Light) -> Result<()>;

    /// The largest value.
    fn brightest(&mut self, picture: &Self::Light) -> Result<f32>;

    /// The picture's own grain.
    fn measure_grain(&mut self, codes: &Self::Codes) -> Result<Grain>;

    /// Ends the picture: its codes if there are any, and its light if needed. A picture on a GPU stays there if
    /// it `may_stay` and a window can show it.
    fn finish(
        self,
        picture: Self::Light,
        codes: Option<Self::Codes>,
        needs_light: bool,
        may_stay: bool,
    ) -> Result<(FinishedPicture, Self::Own)>;
}

/// Finished picture of a backend.
pub(crate) enum FinishedPicture {
    InMemory(ReadPicture),
    OnGpu(DisplayTexture, Unread),
}

/// A picture in memory.
pub(crate) struct ReadPicture {
    pub linear: Option<Image>,
    pub display: Option<Encoded>,
    /// Number of subject pixels that were NaN or infinite.
    pub mended: usize,
    /// Milliseconds of each pass, by its place in [`Pass::ALL`]; None without a clock.
    pub ms: Option<[f64; Pass::ALL.len()]>,
}

impl ReadPicture {
    /// Light and codes, as far as requested, in this order.
    pub fn new(mut read: Readback, has_codes: bool) -> Self {
        let display = has_codes.then(|| read.pictures.pop()).flatten();
        Self {
            display: display.map(Encoded),
            linear: read.pictures.pop(),
            mended: read.mended,
            ms: read.times.map(|times| {
                let mut ms = [0.0; Pass::ALL.len()];
                times.iter().for_each(|(pass, span)| ms[*pass as usize] += span);
                ms
            }),
        }
    }
}
