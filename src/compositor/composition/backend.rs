//! Who does the passes that a composition has decided on.

use crate::background::Backdrop;
use crate::despill::{Screen, Spill};
use crate::grain::Grain;
use crate::reuse::{Reuse, Slots};
use base::error::Result;
use imaging::{Encoded, Image, Mask};
use scene::{Channel, Pass, ViewTransform};

/// Does the passes of one picture: in memory, or on a GPU that keeps all pictures until the end. Everything
/// that is computed fails where the device does.
pub(crate) trait Backend {
    /// A whole picture in linear light. To clone it costs nothing.
    type Light: Clone;
    /// A whole picture in codes of a display.
    type Codes;
    /// What it keeps for itself from one picture to the next.
    type Own: Clone + Default;

    /// Where such a backend's pictures are kept.
    fn slots(reuse: &mut Reuse) -> &mut Slots<Self::Light, Self::Own>;

    /// What follows belongs to this pass.
    fn begin(&mut self, pass: Pass);

    /// A subject without light.
    fn black(&self) -> Self::Light;

    /// The subject under even light as [`crate::Steady`] samples it.
    fn even_samples(&mut self) -> Result<Vec<[f32; 3]>>;

    /// The subject under these weights, mended and premultiplied.
    fn relight(&mut self, weights: &[[f32; 3]]) -> Result<Self::Light>;

    /// What despill goes by, and the spill.
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

    fn background_blur(&mut self, behind: &mut Self::Light, radius: f32) -> Result<()>;

    /// What wrapping wholly would add to the rim, as a share of its light.
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

    fn glare(&mut self, picture: &mut Self::Light, amount: f32, white: f32) -> Result<()>;

    fn exposure(&mut self, picture: &mut Self::Light, stops: f32) -> Result<()>;

    fn view(&mut self, picture: &Self::Light, transform: ViewTransform) -> Result<Self::Codes>;

    /// The grain that the picture has of itself.
    fn grain_of(&mut self, codes: &Self::Codes) -> Result<Grain>;

    /// `alpha` is the picture's coverage, `grains` are the plate's and the picture's own.
    fn grain(
        &mut self,
        codes: &mut Self::Codes,
        alpha: &Mask,
        grains: [&Grain; 2],
        amount: f32,
        frame: usize,
    ) -> Result<()>;

    fn dither(&mut self, codes: &mut Self::Codes) -> Result<()>;

    /// `alpha` is the picture's coverage.
    fn channels(&mut self, codes: &mut Self::Codes, alpha: &Mask, channel: Channel) -> Result<()>;

    fn difference(&mut self, codes: &mut Self::Codes, second: &Encoded, gain: f32) -> Result<()>;

    fn false_color(&mut self, picture: &Self::Light) -> Result<Self::Codes>;

    /// Ends the picture: its codes where there are any, and its light where that is needed.
    fn finish(
        self,
        picture: Self::Light,
        codes: Option<Self::Codes>,
        needs_light: bool,
    ) -> Result<FinishedPicture<Self::Own>>;
}

/// What a backend leaves.
pub(crate) struct FinishedPicture<Own> {
    pub linear: Option<Image>,
    pub display: Option<Encoded>,
    /// How many of the subject's pixels were no numbers.
    pub mended: usize,
    /// Milliseconds of each pass, by its place in [`Pass::ALL`]; none where nothing tells the time.
    pub ms: Option<[f64; Pass::ALL.len()]>,
    pub own: Own,
}
