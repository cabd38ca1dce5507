//! Chooses which square of a project's pictures is used.

use super::scan::counted;
use base::error::{Error, Result};
use imaging::file::dimensions;
use project::{Framing, Padding, Project};
use serde::Serialize;
use std::path::PathBuf;

/// A square in pixels: left edge, upper edge, side.
pub type Square = (i32, i32, usize);

/// Which squares to use.
#[derive(Clone, Debug, Default)]
pub struct FrameSettings {
    /// The square of the interview's frames; `None` keeps theirs. If the exemplars have the same size, it is theirs
    /// too.
    pub interview: Option<Square>,
    /// The square of the exemplars.
    pub exemplars: Option<Square>,
    pub padding: Padding,
}

/// How a project's pictures are framed.
#[derive(Clone, Debug, Serialize)]
pub struct FrameReport {
    pub interview: Framing,
    pub exemplars: Framing,
    /// The folders into which the old calibration and network were moved, if there were any.
    pub aside: Vec<PathBuf>,
}

impl FrameSettings {
    /// Sets the framing of the project's pictures, or only reports it.
    ///
    /// # Errors
    /// When a picture cannot be read, a square shows none of it, or two squares are chosen for pictures of one
    /// size.
    pub fn run(&self, project: &mut Project) -> Result<FrameReport> {
        project.check_parts()?;
        let sizes = [
            dimensions(&project.frame_path(0))?,
            dimensions(&project.olat_path(0, 0))?,
        ];
        let alike = sizes[0] == sizes[1];
        if let (true, Some(one), Some(other)) = (alike, self.interview, self.exemplars)
            && one != other
        {
            return Err(Error::invalid(
                "frames and exemplars have the same size, but two different squares were given",
                "Give one square for both",
            ));
        }
        let mut aside = Vec::new();
        for (size, square) in sizes.into_iter().zip([self.interview, self.exemplars]) {
            if let Some((x, y, side)) = square {
                aside.extend(project.frame(Framing {
                    x,
                    y,
                    side,
                    padding: self.padding,
                    ..Framing::largest(size)
                })?);
            }
        }
        let framing = &project.settings.framing;
        Ok(FrameReport {
            interview: framing.of(sizes[0]),
            exemplars: framing.of(sizes[1]),
            aside,
        })
    }
}

impl FrameReport {
    /// The report in sentences.
    pub fn sentence(&self) -> String {
        let said = |framing: &Framing| {
            let [width, height] = framing.source;
            format!(
                "{} from {}, {} of {width} × {height}, {} beyond the edge",
                counted(framing.side, "pixel"),
                framing.x,
                framing.y,
                framing.padding.name()
            )
        };
        let mut text = format!(
            "Interview: {}. Exemplars: {}",
            said(&self.interview),
            said(&self.exemplars)
        );
        for folder in &self.aside {
            text += &format!(
                "\nThe calibration and the network were made with another framing and were moved to {}. Calibrate \
                 and train again",
                folder.display()
            );
        }
        text
    }
}
