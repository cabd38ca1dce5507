//! Shape of a convolution, and layout of its inputs.

/// The shape of a convolution with an odd square kernel, stride 1 and zeros around the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shape {
    pub batch: usize,
    pub inputs: usize,
    pub outputs: usize,
    pub height: usize,
    pub width: usize,
    /// Width and height of the kernel.
    pub kernel: usize,
    /// Factors rounded to bf16.
    pub bf16: bool,
}

/// Concatenated inputs: `[batch, c1, h, w]` and `[batch, c2, h, w]`, c1 + c2 the
/// convolution's inputs. The second may be empty.
pub type Sources<'a, T = f32> = [&'a [T]; 2];

/// Rows of a convolution's input.
pub trait Rows: Sync {
    /// Writes row `y` of a channel.
    fn fill(&self, picture: usize, channel: usize, y: usize, into: &mut [f32]);

    /// The same row, in `scratch` if it has to be computed.
    fn get<'s>(&'s self, picture: usize, channel: usize, y: usize, scratch: &'s mut [f32]) -> &'s [f32] {
        self.fill(picture, channel, y, scratch);
        scratch
    }
}

impl<F: Fn(usize, usize, usize, &mut [f32]) + Sync> Rows for F {
    fn fill(&self, picture: usize, channel: usize, y: usize, into: &mut [f32]) {
        self(picture, channel, y, into);
    }
}

/// The sources' own rows.
pub struct Input<'a>(pub &'a Shape, pub Sources<'a>);

impl Rows for Input<'_> {
    fn fill(&self, picture: usize, channel: usize, y: usize, into: &mut [f32]) {
        into.copy_from_slice(self.0.input_row(self.1, picture, channel, y));
    }

    fn get<'s>(&'s self, picture: usize, channel: usize, y: usize, _: &'s mut [f32]) -> &'s [f32] {
        self.0.input_row(self.1, picture, channel, y)
    }
}

impl Shape {
    pub(super) fn radius(&self) -> usize {
        self.kernel / 2
    }

    pub(super) fn taps(&self) -> usize {
        self.kernel * self.kernel
    }

    /// Weights of an output channel.
    pub(super) fn columns(&self) -> usize {
        self.inputs * self.taps()
    }

    pub(super) fn plane(&self) -> usize {
        self.height * self.width
    }

    /// One row of a plane of `values`, `[batch, channels, height, width]`.
    pub(super) fn row<'a, T>(
        &self,
        values: &'a [T],
        channels: usize,
        picture: usize,
        channel: usize,
        y: usize,
    ) -> &'a [T] {
        let start = ((picture * channels + channel) * self.height + y) * self.width;
        &values[start..start + self.width]
    }

    /// One row of an input with the concatenated channels of two sources.
    pub(super) fn input_row<'a, T>(
        &self,
        sources: Sources<'a, T>,
        picture: usize,
        channel: usize,
        y: usize,
    ) -> &'a [T] {
        let first = sources[0].len() / (self.batch * self.plane()).max(1);
        match channel.checked_sub(first) {
            None => self.row(sources[0], first, picture, channel, y),
            Some(channel) => self.row(sources[1], self.inputs - first, picture, channel, y),
        }
    }

    /// Shape of the transposed convolution.
    pub(super) fn reversed(&self) -> Self {
        Self { inputs: self.outputs, outputs: self.inputs, ..*self }
    }

    /// Rows of a band. They depend only on the shape, so that no result depends on the number of threads: few
    /// enough that both factors stay in the second-level cache.
    pub(super) fn band_rows(&self) -> usize {
        const CACHED: usize = 256 * 1024;
        let channels = self.inputs.max(self.outputs);
        let rows = CACHED / (channels * (self.width + self.radius())).max(1);
        let most = (self.height.div_ceil(16)).max(8);
        rows.saturating_sub(2 * self.radius()).clamp(2, most).min(self.height)
    }
}
