//! Choice of the crop of a project's pictures.

use super::framed::{dimensions, read_matte};
use super::scan::counted;
use base::error::{Error, Result};
use base::numbers;
use imaging::Mask;
use project::{DamagedFrames, Framing, Matte, Padding, Project};
use serde::Serialize;
use std::path::PathBuf;

/// A square in pixels: left edge, upper edge, side.
pub type Square = (i32, i32, usize);

/// Crop settings; `None` keeps the current one.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct FrameSettings {
    /// Left edge, upper edge and side of the square in pixels of the interview's frames. May extend beyond the
    /// frame. Exemplars of the same size use the same crop.
    #[arg(long, value_name = "X,Y,SIDE", value_parser = square, allow_hyphen_values = true)]
    pub interview: Option<Square>,
    /// The same for exemplars that differ in size from the frames.
    #[arg(long, value_name = "X,Y,SIDE", value_parser = square, allow_hyphen_values = true)]
    pub exemplars: Option<Square>,
    /// Smallest square around the subject in its mattes, plus a tenth.
    #[arg(long, conflicts_with_all = ["interview", "exemplars"])]
    pub fit: bool,
    /// Fill of the square beyond the pictures' edges.
    #[arg(long, value_enum, default_value_t)]
    pub padding: Padding,
    /// Stand-in for unreadable interview frames [default: unchanged; stop in a new project].
    #[arg(long, value_enum, value_name = "CHOICE")]
    pub damaged_frames: Option<DamagedFrames>,
}

/// Parses left edge, upper edge and side in whole pixels.
fn square(text: &str) -> std::result::Result<Square, String> {
    let numbers = numbers(text, "X,Y,SIDE in pixels")?;
    let whole = |v: f64| v.fract() == 0.0 && v.abs() <= f64::from(i32::MAX);
    let [x, y, side] = numbers;
    if numbers.into_iter().all(whole) && side >= 1.0 {
        Ok((x as i32, y as i32, side as usize))
    } else {
        Err(format!("{text:?} is not a square: give whole pixels and a side of at least 1"))
    }
}

/// Crop of a project's pictures.
#[derive(Clone, Debug, Serialize)]
pub struct FrameReport {
    pub interview: Framing,
    pub exemplars: Framing,
    /// Stand-in for unreadable interview frames.
    pub damaged_frames: DamagedFrames,
    /// Folders with the previous calibration and network, if they existed.
    pub aside: Vec<PathBuf>,
}

impl FrameSettings {
    /// Sets the crop of the project's pictures, or only reports it.
    ///
    /// # Errors
    /// When a picture cannot be read, a square lies fully outside it, or two squares are given for pictures of one
    /// size.
    pub fn run(&self, project: &mut Project) -> Result<FrameReport> {
        project.check_parts()?;
        if let Some(choice) = self.damaged_frames {
            project.settings.shoot.damaged_frames = choice;
        }
        let sizes = [dimensions(&project.frame_picture(0))?, dimensions(&project.first_olat(0))?];
        let alike = sizes[0] == sizes[1];
        if let (true, Some(one), Some(other)) = (alike, self.interview, self.exemplars)
            && one != other
        {
            return Err(Error::invalid(
                "frames and poses have the same size, but two different squares were given",
                "Give one square for both",
            ));
        }
        let mut aside = Vec::new();
        if self.fit {
            for Fitted { framing, .. } in fitted(project, sizes)? {
                let padding = self.padding;
                aside.extend(project.frame(Framing { padding, ..framing })?);
            }
        }
        for (size, square) in sizes.into_iter().zip([self.interview, self.exemplars]) {
            if let Some((x, y, side)) = square {
                aside.extend(project.frame(Framing { x, y, side, padding: self.padding, ..Framing::largest(size) })?);
            }
        }
        let framing = &project.settings.framing;
        Ok(FrameReport {
            interview: framing.for_size(sizes[0]),
            exemplars: framing.for_size(sizes[1]),
            damaged_frames: project.settings.shoot.damaged_frames,
            aside,
        })
    }
}

/// Number of interview mattes read to find the subject.
const LOOKS: usize = 9;
/// Side of a square relative to the subject's extent.
const SPARE: f64 = 1.1;

/// A square around the subject.
pub(super) struct Fitted {
    pub framing: Framing,
    /// True if the largest centred square also contains the subject.
    pub is_central: bool,
}

/// Smallest square around the subject in the mattes of some frames and all poses, plus a tenth: one square if
/// frames and exemplars have equal size, otherwise one for each.
///
/// # Errors
/// When a matte is missing or cannot be read.
pub(super) fn fitted(project: &Project, sizes: [(usize, usize); 2]) -> Result<Vec<Fitted>> {
    let shoot = &project.settings.shoot;
    let count = shoot.frames.len();
    let looks = LOOKS.min(count);
    let frames = (0..looks).map(|i| i * (count - 1) / (looks - 1).max(1));
    let frames: Vec<Matte> = frames.map(|frame| project.frame_matte(frame)).collect();
    let poses: Vec<Matte> = (0..shoot.poses.len()).map(|pose| project.exemplar_matte(pose)).collect();
    let groups = if sizes[0] == sizes[1] {
        vec![(sizes[0], [frames, poses].concat())]
    } else {
        vec![(sizes[0], frames), (sizes[1], poses)]
    };
    let fitted = groups.into_iter().map(|(size, mattes)| {
        let mut held: Option<Extent> = None;
        for matte in &mattes {
            let found = extent(&read_matte(matte)?);
            held = match (held, found) {
                (Some(held), Some(found)) => Some(held.and(found)),
                (held, found) => held.or(found),
            };
        }
        let largest = Framing::largest(size);
        Ok(Fitted {
            framing: held.map_or(largest, |held| held.framing(size)),
            is_central: held.is_none_or(|held| held.is_within(&largest)),
        })
    });
    fitted.collect()
}

/// Rectangle of the subject in a picture: first and last column and row.
#[derive(Clone, Copy)]
struct Extent {
    columns: [usize; 2],
    rows: [usize; 2],
}

impl Extent {
    fn and(self, other: Self) -> Self {
        let join = |[a, b]: [usize; 2], [c, d]: [usize; 2]| [a.min(c), b.max(d)];
        Self { columns: join(self.columns, other.columns), rows: join(self.rows, other.rows) }
    }

    fn is_within(self, framing: &Framing) -> bool {
        let within = |[first, last]: [usize; 2], from: i32| {
            let end = i64::from(from) + framing.side as i64;
            first as i64 >= i64::from(from) && (last as i64) < end
        };
        within(self.columns, framing.x) && within(self.rows, framing.y)
    }

    fn framing(self, size: (usize, usize)) -> Framing {
        let length = |[first, last]: [usize; 2]| last + 1 - first;
        let longest = length(self.columns).max(length(self.rows));
        let side = (longest as f64 * SPARE).ceil() as usize;
        let from = |[first, last]: [usize; 2]| ((first + last + 1) as i64 - side as i64).div_euclid(2) as i32;
        Framing { x: from(self.columns), y: from(self.rows), side, ..Framing::largest(size) }.bounded()
    }
}

/// Area in which a matte exceeds a tenth; None if it is empty.
fn extent(mask: &Mask) -> Option<Extent> {
    let covered = |alpha: &f32| *alpha > 0.1;
    let rows = mask.pixels.chunks_exact(mask.width.max(1)).enumerate();
    let found = rows.filter_map(|(y, row)| {
        let first = row.iter().position(covered)?;
        let last = row.iter().rposition(covered)?;
        Some(Extent { columns: [first, last], rows: [y, y] })
    });
    found.reduce(Extent::and)
}

impl FrameReport {
    /// Summary sentence.
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
        let mut text = format!("Interview: {}. Poses: {}", said(&self.interview), said(&self.exemplars));
        text += match self.damaged_frames {
            DamagedFrames::Stop => "",
            DamagedFrames::Hold => ". Damaged frames show the previous frame",
            DamagedFrames::Black => ". Damaged frames are black",
        };
        for folder in &self.aside {
            text += &format!(
                "\nThe calibration and the network of the previous crop were moved to {}. Calibrate \
                 and train again",
                folder.display()
            );
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_square_is_fitted_to_the_subject_and_may_leave_the_picture() {
        let subject = |columns: std::ops::Range<usize>, rows: std::ops::Range<usize>| {
            let inside = |x, y| columns.contains(&x) && rows.contains(&y);
            let mask = Mask::from_fn(108, 192, |x, y| f32::from(inside(x, y)));
            extent(&mask)
        };
        let largest = Framing::largest((108, 192));
        let standing = subject(30..70, 20..192).unwrap();
        assert!(!standing.is_within(&largest));
        let standing = standing.framing((108, 192));
        // 172 rows, plus a tenth.
        assert_eq!((standing.x, standing.y, standing.side), (-45, 11, 190));
        let head = subject(40..80, 70..110).unwrap();
        assert!(head.is_within(&largest));
        let head = head.framing((108, 192));
        assert_eq!((head.x, head.y, head.side), (38, 68, 44));
        assert!(subject(0..108, 42..150).unwrap().is_within(&largest));
        assert!(subject(0..0, 0..0).is_none());
        let corner = subject(0..1, 0..1).unwrap().framing((108, 192));
        corner.check().unwrap();
        assert_eq!(corner.side, 2);
    }
}
