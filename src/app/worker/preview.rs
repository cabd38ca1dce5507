//! A picture that the window asks for, and the one that it gets.

use super::PredictedFrame;
use super::comparison::Comparison;
use super::srgb_picture::SrgbPicture;
use compositor::passes::DisplayTexture;
use compositor::{PassReport, Picture};
use imaging::Image;
use light::{Environment, Rig};
use scene::Scene;
use std::collections::HashSet;
use std::path::PathBuf;
use std::sync::Arc;

/// Another look at the frame of a picture.
#[derive(Clone, Debug)]
pub struct LookView {
    /// Its frame is that of the picture whatever it says.
    pub scene: Scene,
    pub environment: Arc<Environment>,
}

impl PartialEq for LookView {
    /// Environments are equal if they are the same one.
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.environment, &other.environment) && self.scene == other.scene
    }
}

/// A look and its picture.
pub type LookPicture = (LookView, Arc<SrgbPicture>);

/// A picture that the window wants.
#[derive(Clone, Debug)]
pub struct PreviewRequest {
    /// Its output is a display whatever it says.
    pub scene: Scene,
    pub environment: Arc<Environment>,
    /// Comparison in place of the picture.
    pub first: Option<Comparison>,
    /// Its counterpart.
    pub second: Option<Comparison>,
    /// Looks that are shown beside each other, under all lamps.
    pub looks: [Option<LookView>; 4],
    /// Lamps that light the subject alone, each as bright as half of an even light; none means all of them.
    pub solo: Vec<usize>,
    /// A `.cube` table that codes go through before they are shown, as a display; it reads and gives sRGB codes. Channels,
    /// false colours and differences are shown as they are.
    pub table: Option<PathBuf>,
    /// Something is dragged or played: a picture that is soon there is better than a sharp one.
    pub moving: bool,
    /// The window draws textures of the GPU that pictures are made on, and needs nothing else until the picture
    /// rests: what it shows is then not read from there.
    pub texture: bool,
}

/// A relit picture, ready for a texture.
#[derive(Clone, Debug)]
pub struct PreviewPicture {
    /// Scene that the picture shows. While a frame is being predicted, this is an older frame in the new light.
    pub scene: Scene,
    /// Name of the environment.
    pub environment: String,
    pub width: usize,
    pub height: usize,
    /// Pixels along each axis that were lit as one, while something moved; 1 in a picture that stays.
    pub coarse: usize,
    /// Light finer than the working size was left out, because something moved.
    pub draft: bool,
    /// sRGB codes, three bytes a pixel, row by row. Empty while the picture is on the GPU alone.
    pub rgb: Vec<u8>,
    /// Columns and rows of `rgb`: the picture's, or fewer in one that is coarse.
    pub rgb_size: [usize; 2],
    /// The same codes on the GPU, if it made the picture.
    pub texture: Option<DisplayTexture>,
    /// Comparison in its place, of the same size; where a scene asks for the difference, that to the second.
    pub first: Option<(Comparison, SrgbPicture)>,
    /// Its counterpart, of the same size.
    pub second: Option<(Comparison, SrgbPicture)>,
    /// The first and the second themselves, where what is shown of them is a channel, false colours or a difference.
    pub whole: [Option<SrgbPicture>; 2],
    /// The looks that are shown beside each other, of the same size.
    pub looks: [Option<LookPicture>; 4],
    /// Lamps that light the subject alone.
    pub solo: Vec<usize>,
    /// Scene-linear light of each pixel, premultiplied, where it is in memory at full size.
    pub linear: Option<Image>,
    /// Factors of each lamp's picture.
    pub weights: Vec<[f32; 3]>,
    /// Passes that ran, and those that did not.
    pub passes: Vec<PassReport>,
    /// Time of the frame's prediction in milliseconds when it was made.
    pub predict_ms: f64,
    /// Time of relighting in milliseconds, from the ask to the codes, in memory or as a texture.
    pub relight_ms: f64,
    /// Share of the light's energy from where the rig has no lamp.
    pub uncovered: f32,
    /// The lamps.
    pub rig: Arc<Rig>,
    /// Frames whose field is in memory.
    pub frames_at_hand: HashSet<usize>,
    /// The frame and its field.
    pub predicted: Arc<PredictedFrame>,
}

impl PreviewPicture {
    /// The codes of the pixel in column `x` and row `y`; None outside the picture, and while it is on the GPU alone.
    pub fn codes(&self, [x, y]: [usize; 2]) -> Option<[u8; 3]> {
        let [columns, rows] = self.rgb_size;
        let inside = x < self.width && y < self.height;
        let at = y * rows / self.height.max(1) * columns + x * columns / self.width.max(1);
        let codes = self.rgb.as_chunks::<3>().0.get(at).copied();
        codes.filter(|_| inside)
    }

    /// Takes over what was made: its codes, its light and what became of the passes.
    pub(super) fn take(&mut self, made: Picture) {
        if let Some(codes) = &made.display {
            let SrgbPicture { width, height, rgb } = SrgbPicture::of(codes);
            (self.rgb, self.rgb_size) = (rgb, [width, height]);
        }
        self.linear = made.linear;
        self.passes = made.passes;
    }
}

/// All that a picture is made of.
#[derive(Clone)]
pub(super) struct PreviewInputs {
    /// Its scene is of the frame below.
    pub request: PreviewRequest,
    pub predicted: Arc<PredictedFrame>,
    /// The OLATs of the two pictures to compare, as far as they were found.
    pub olats: [Option<Arc<PredictedFrame>>; 2],
    /// Pixels along each axis that may be lit as one.
    pub coarse: usize,
    /// Light finer than the working size may be left out.
    pub draft: bool,
    /// Its codes have to be in memory.
    pub in_memory: bool,
}

impl PreviewInputs {
    /// True if a picture made of these is the one that `other` asks for, as sharp; it may have to be read.
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
                == (
                    &theirs.scene,
                    &theirs.solo,
                    &theirs.first,
                    &theirs.second,
                    &theirs.looks,
                    &theirs.table,
                )
    }
}
