//! Chooses which square of a project's pictures is used.

use super::framed::dimensions;
use super::scan::counted;
use base::error::{Error, Result};
use base::numbers;
use project::{Framing, Padding, Project};
use serde::Serialize;
use std::path::PathBuf;

/// A square in pixels: left edge, upper edge, side.
pub type Square = (i32, i32, usize);

/// Which squares to use; `None` keeps the current one.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct FrameSettings {
    /// Left edge, upper edge and side of the square in pixels of the interview's frames. It may extend beyond their
    /// edges. Exemplars of the same size are framed alike.
    #[arg(long, value_name = "X,Y,SIDE", value_parser = square, allow_hyphen_values = true)]
    pub interview: Option<Square>,
    /// The same for the exemplars, if they have another size.
    #[arg(long, value_name = "X,Y,SIDE", value_parser = square, allow_hyphen_values = true)]
    pub exemplars: Option<Square>,
    /// What fills the square beyond the pictures' edges.
    #[arg(long, value_enum, default_value_t)]
    pub padding: Padding,
}

/// Left edge, upper edge and side in whole pixels.
fn square(text: &str) -> std::result::Result<Square, String> {
    let numbers = numbers(text, "X,Y,SIDE in pixels")?;
    let whole = |v: f64| v.fract() == 0.0 && v.abs() <= f64::from(i32::MAX);
    let [x, y, side] = numbers;
    if numbers.into_iter().all(whole) && side >= 1.0 {
        Ok((x as i32, y as i32, side as usize))
    } else {
        Err(format!(
            "{text:?} is not a square: give whole pixels and a side of at least 1"
        ))
    }
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
            dimensions(&project.frame_picture(0))?,
            dimensions(&project.olat_picture(0, 0))?,
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
