//! A picture for a window, which may stay on the GPU.

use super::composition::{FinishedPicture, ReadPicture};
use super::passes::{DisplayTexture, Unread};
use super::picture::Picture;
use base::error::Result;
use scene::Pass;

/// A picture for a window. A GPU's picture stays there: the window draws its texture, and its pixels are copied to
/// memory only when they are read.
#[derive(Debug)]
pub struct ShownPicture {
    /// Without pixels and times of passes until it is read.
    pub picture: Picture,
    /// Texture that the window draws; None if the picture was made in memory.
    pub texture: Option<DisplayTexture>,
    unread: Option<Unread>,
}

impl ShownPicture {
    /// A picture in memory.
    pub fn in_memory(picture: Picture) -> Self {
        Self { picture, texture: None, unread: None }
    }

    pub(super) fn new(mut picture: Picture, finished: FinishedPicture) -> Self {
        let (texture, unread) = match finished {
            FinishedPicture::OnGpu(texture, unread) => (Some(texture), Some(unread)),
            FinishedPicture::InMemory(read) => {
                take(&mut picture, read);
                (None, None)
            }
        };
        Self { picture, texture, unread }
    }

    /// True if its pixels are in memory.
    pub fn is_read(&self) -> bool {
        self.unread.is_none()
    }

    /// Reads its pixels, the times of its passes, and the number of repaired pixels, unless this was done before.
    ///
    /// # Errors
    /// When the GPU fails or is lost.
    pub fn read(&mut self) -> Result<()> {
        if let Some(unread) = &self.unread {
            // A picture on the GPU has codes, since it is shown.
            take(&mut self.picture, ReadPicture::new(unread.read()?, true));
            self.unread = None;
        }
        Ok(())
    }
}

/// Adds pixels and measurements to a picture.
fn take(picture: &mut Picture, read: ReadPicture) {
    picture.linear = read.linear;
    picture.display = read.display;
    for (report, pass) in picture.passes.iter_mut().zip(Pass::ALL) {
        if report.ms.is_none() {
            report.ms = read.ms.map(|ms| ms[pass as usize]);
        }
        if pass == Pass::Relight && report.ran && read.mended > 0 {
            let mended = read.mended;
            report.reason += &format!("; {mended} pixels were NaN or infinite, filled from neighbours");
        }
    }
}
