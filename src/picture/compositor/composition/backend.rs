//! Backends, which make the passes that a composition has decided on.

use crate::background::Backdrop;
use crate::descriptor::{CodesInput, CodesStep, EncodeStep, LightStep, PassContext};
use crate::facts::{Grain, Screen, Spill};
use crate::passes::{DisplayTexture, Readback, Unread};
use crate::reuse::{Cache, Reuse};
use base::error::Result;
use imaging::{Encoded, Image};
use scene::Pass;

/// Makes the passes of one picture: in memory, or on a GPU that keeps all pictures until the end. Everything
/// that is computed fails if the device does.
pub(crate) trait Backend {
    /// A whole picture in linear light. To clone it costs nothing.
    type Light: Clone;
    /// A whole picture in codes of a display.
    type Codes;
    /// Cached data besides pictures.
    type Own: Clone + Default;

    /// The cache of such a backend's pictures.
    fn cache(reuse: &mut Reuse) -> &mut Cache<Self::Light, Self::Own>;

    /// Begins a pass: all that follows belongs to it.
    fn begin(&mut self, pass: Pass);

    /// A subject without light.
    fn black(&self) -> Self::Light;

    /// Makes one step of light.
    fn light(
        &mut self,
        step: &LightStep,
        context: &PassContext,
        picture: &mut Self::Light,
    ) -> Result<()>;

    /// Makes codes of light; None if the codes stay.
    fn encode(
        &mut self,
        step: &EncodeStep,
        context: &PassContext,
        picture: &Self::Light,
    ) -> Result<Option<Self::Codes>>;

    /// Makes one step of codes.
    fn codes(
        &mut self,
        step: &CodesStep,
        context: &PassContext,
        input: &CodesInput,
        codes: &mut Self::Codes,
    ) -> Result<()>;

    /// The subject under even light as [`crate::Steady`] samples it.
    fn even_samples(&mut self) -> Result<Vec<[f32; 3]>>;

    /// The subject under these weights, mended and premultiplied.
    fn relight(&mut self, weights: &[[f32; 3]]) -> Result<Self::Light>;

    /// Brings the subject, lit by lamps of these weights, to the plate's size, where its light multiplies the plate.
    fn plate(&mut self, subject: &mut Self::Light, weights: &[[f32; 3]]) -> Result<()>;

    /// The guide of despill, and the spill.
    fn guide(&mut self, subject: &Self::Light) -> Result<(Self::Light, Spill)>;

    fn despill(
        &mut self,
        subject: &mut Self::Light,
        guide: &Self::Light,
        screen: Screen,
        amount: f32,
    ) -> Result<()>;

    /// The background, whole.
    fn behind(&mut self, backdrop: &Backdrop) -> Result<Self::Light>;

    /// Lays the subject over the background, which is drawn only where it shows.
    fn surround(&mut self, subject: &mut Self::Light, backdrop: &Backdrop) -> Result<()>;

    /// Light that wrapping wholly would add to the rim, as a share of its light.
    fn wrap_need(&mut self, subject: &Self::Light, behind: &Self::Light) -> Result<f32>;

    fn light_wrap(
        &mut self,
        subject: &mut Self::Light,
        behind: &Self::Light,
        amount: f32,
    ) -> Result<()>;

    /// Lays the subject over what is behind it.
    fn over(&mut self, subject: &mut Self::Light, behind: &Self::Light) -> Result<()>;

    /// The largest value.
    fn brightest(&mut self, picture: &Self::Light) -> Result<f32>;

    /// The grain that the picture has of itself.
    fn grain_of(&mut self, codes: &Self::Codes) -> Result<Grain>;

    /// Ends the picture: its codes if there are any, and its light if that is needed. What is on a GPU stays there if
    /// it `may_stay` and a window can show it.
    fn finish(
        self,
        picture: Self::Light,
        codes: Option<Self::Codes>,
        needs_light: bool,
        may_stay: bool,
    ) -> Result<(FinishedPicture, Self::Own)>;
}

/// The picture that a backend leaves.
pub(crate) enum FinishedPicture {
    InMemory(ReadPicture),
    OnGpu(DisplayTexture, Unread),
}

/// A picture in memory.
pub(crate) struct ReadPicture {
    pub linear: Option<Image>,
    pub display: Option<Encoded>,
    /// Number of the subject's pixels that were NaN or infinite.
    pub mended: usize,
    /// Milliseconds of each pass, by its place in [`Pass::ALL`]; None if nothing tells the time.
    pub ms: Option<[f64; Pass::ALL.len()]>,
}

impl ReadPicture {
    /// Of the light and the codes, as far as they were asked for, in this order.
    pub fn of(mut read: Readback, has_codes: bool) -> Self {
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
