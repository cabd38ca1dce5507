//! A picture request of the window, and the picture made for it.

use super::comparison::{Comparison, LookView};
use super::prediction::PredictedFrame;
use super::srgb_picture::SrgbPicture;
use compositor::passes::DisplayTexture;
use compositor::{PassReport, Picture};
use imaging::Image;
use light::{Environment, Rig};
use scene::Scene;
use std::collections::HashSet;
use std::path::PathBuf;
use std::sync::Arc;

/// A look and its picture.
pub type LookPicture = (LookView, Arc<SrgbPicture>);

/// Request of the window for a picture.
#[derive(Clone, Debug)]
pub struct PreviewRequest {
    /// Its output is ignored: the picture is for a display.
    pub scene: Scene,
    pub environment: Arc<Environment>,
    /// Comparison in place of the picture.
    pub first: Option<Comparison>,
    /// Counterpart of the picture.
    pub second: Option<Comparison>,
    /// Looks side by side, under all lamps.
    pub looks: [Option<LookView>; 4],
    /// Soloed lamps that light the subject, each with half the energy of an even light; empty for all lamps.
    pub solo: Vec<usize>,
    /// A `.cube` display table from sRGB codes to sRGB codes, applied last. Channels, false colours and
    /// differences bypass it.
    pub table: Option<PathBuf>,
    /// Frames of the interview per second, for a movie behind the subject.
    pub frame_rate: f64,
    /// True while something is dragged or played: speed matters more than sharpness.
    pub moving: bool,
    /// True if the window draws textures of the GPU that makes the pictures. Codes are then not read back until
    /// the picture rests.
    pub texture: bool,
}

/// A relit picture, ready for a texture.
#[derive(Clone, Debug)]
pub struct PreviewPicture {
    /// Scene of the picture. While a frame is being predicted, this is an older frame in the new light.
    pub scene: Scene,
    /// Name of the environment.
    pub environment: String,
    pub width: usize,
    pub height: usize,
    /// Pixels along each axis that were lit as one while something moved; 1 at rest.
    pub coarse: usize,
    /// True if light finer than the working size was left out because something moved.
    pub draft: bool,
    /// sRGB codes, three bytes per pixel, row by row. Empty while the picture is only on the GPU.
    pub rgb: Vec<u8>,
    /// Columns and rows of `rgb`: the picture's, or fewer if it is coarse.
    pub rgb_size: [usize; 2],
    /// The same codes on the GPU, if it made the picture.
    pub texture: Option<DisplayTexture>,
    /// Comparison in place of the picture, of the same size; if the scene shows a difference, the difference to
    /// the second.
    pub first: Option<(Comparison, SrgbPicture)>,
    /// Counterpart, of the same size.
    pub second: Option<(Comparison, SrgbPicture)>,
    /// The first and second pictures themselves, if a channel, false colours or a difference is shown of them.
    pub whole: [Option<SrgbPicture>; 2],
    /// Looks side by side, of the same size.
    pub looks: [Option<LookPicture>; 4],
    /// Sentences on backgrounds that cannot be read: nothing is behind the subject.
    pub missing: Vec<String>,
    /// Soloed lamps.
    pub solo: Vec<usize>,
    /// Scene-linear light of each pixel, premultiplied, if it is in memory at full size.
    pub linear: Option<Image>,
    /// Factors of each lamp's picture.
    pub weights: Vec<[f32; 3]>,
    /// Passes that ran, and those that did not.
    pub passes: Vec<PassReport>,
    /// Time of the frame's prediction in milliseconds.
    pub predict_ms: f64,
    /// Time of relighting in milliseconds, from the request to the codes, in memory or as a texture.
    pub relight_ms: f64,
    /// Share of the light's energy from directions without a lamp.
    pub uncovered: f32,
    /// The lamps.
    pub rig: Arc<Rig>,
    /// Frames with a field in memory.
    pub frames_at_hand: HashSet<usize>,
    /// The frame and its field.
    pub predicted: Arc<PredictedFrame>,
}

impl PreviewPicture {
    /// The codes of the pixel in column `x` and row `y`. None outside the picture, and while it is only on the
    /// GPU.
    pub fn codes(&self, [x, y]: [usize; 2]) -> Option<[u8; 3]> {
        let [columns, rows] = self.rgb_size;
        let inside = x < self.width && y < self.height;
        let at = y * rows / self.height.max(1) * columns + x * columns / self.width.max(1);
        let codes = self.rgb.as_chunks::<3>().0.get(at).copied();
        codes.filter(|_| inside)
    }

    /// Takes over the codes, the light and the pass reports of a picture.
    pub(super) fn take(&mut self, made: Picture) {
        if let Some(codes) = &made.display {
            let SrgbPicture { width, height, rgb } = SrgbPicture::from_picture(codes);
            (self.rgb, self.rgb_size) = (rgb, [width, height]);
        }
        self.linear = made.linear;
        self.passes = made.passes;
    }
}

/// All inputs of a picture.
#[derive(Clone)]
pub(super) struct PreviewInputs {
    /// Its scene has the frame below.
    pub request: PreviewRequest,
    pub predicted: Arc<PredictedFrame>,
    /// OLATs of the two pictures of a comparison, as far as they were found.
    pub olats: [Option<Arc<PredictedFrame>>; 2],
    /// Pixels along each axis that may be lit as one.
    pub coarse: usize,
    /// True if light finer than the working size may be left out.
    pub draft: bool,
    /// True if its codes have to be in memory.
    pub in_memory: bool,
}

impl PreviewInputs {
    /// True if a picture made from these inputs satisfies `other` at the same sharpness; its codes may still have
    /// to be read back.
    pub fn serves(&self, other: &Self) -> bool {
        let olats = |inputs: &Self| {
            let each = inputs.olats.each_ref();
            each.map(|olats| olats.as_ref().map(Arc::as_ptr))
        };
        let (mine, theirs) = (&self.request, &other.request);
        self.coarse <= other.coarse
            && self.draft <= other.draft
            && Arc::ptr_eq(&self.predicted, &other.predicted)
            && olats(self) == olats(other)
            && Arc::ptr_eq(&mine.environment, &theirs.environment)
            && (&mine.scene, &mine.solo, &mine.first, &mine.second, &mine.looks, &mine.table)
                == (&theirs.scene, &theirs.solo, &theirs.first, &theirs.second, &theirs.looks, &theirs.table)
    }
}
