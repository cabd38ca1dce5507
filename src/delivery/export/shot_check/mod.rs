//! Check of a shot for delivery: all frames are present, intact and consistent. An ASC MHL keeps their hashes.

mod faults;
mod findings;
mod frame;
mod hash;
mod hash_list;
mod read;
mod shot;
mod time;
mod verify;

pub use faults::Requirements;
pub use findings::{Fault, Remark};
pub use hash::{FileHash, hash_file};
pub use shot::names_frames;
pub use verify::Verification;

use self::faults::{judge, rate_words};
use self::findings::{Findings, span};
use self::frame::{Content, Frame};
use self::hash_list::{Found, History};
use self::shot::Shot;
use base::error::Result;
use base::progress::Progress;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// A frame's files.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FrameReport {
    pub frame: i64,
    #[serde(flatten)]
    pub file: FileHash,
    /// C4 ID of the samples of all channels, independent of the compression; "" if the file could not be read.
    pub pixels_c4: String,
    /// Largest difference between the picture and the sum of its light layers. None without light layers.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub residual: Option<f32>,
    /// Files of the light layers and of their weights.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub beside: Vec<FileHash>,
}

/// Accuracy with which the light layers of a shot rebuild its pictures.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ShotLayers {
    /// Number of layers per frame.
    pub layers: usize,
    /// Largest difference of a channel, and the frame with it.
    pub residual: f32,
    pub frame: i64,
    /// Brightest light of that frame.
    pub brightest: f32,
}

/// Result of checking a shot.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ShotReport {
    /// The shot has no faults.
    pub passed: bool,
    /// Summary in one line.
    pub sentence: String,
    pub faults: Vec<Fault>,
    pub remarks: Vec<Remark>,
    /// Folder of the frames.
    pub folder: PathBuf,
    /// File names, with `####` for the number.
    pub shot: String,
    /// First and last frame.
    pub frames: [i64; 2],
    /// Columns and rows, from the headers of most frames.
    pub size: Option<[i64; 2]>,
    pub rate: Option<(i32, u32)>,
    /// Time codes of the first and the last frame.
    pub time_code: Option<[String; 2]>,
    pub color: Option<String>,
    pub layers: Option<ShotLayers>,
    /// Provenance of the first frame, without the entries that change per frame.
    pub made_of: BTreeMap<String, String>,
    /// The ASC MHL that was written.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hash_list: Option<PathBuf>,
    pub files: Vec<FrameReport>,
}

impl ShotReport {
    /// Examines all files of a shot. `named` is a list of files, their folder, or a pattern. Faults of the shot are part of the
    /// report.
    ///
    /// # Errors
    /// When no such files exist, they belong to several shots, or the user stops.
    pub fn new(named: &[PathBuf], settings: &Requirements, progress: &Progress) -> Result<Self> {
        let shot = Shot::find(named)?;
        let frames = read::frames(&shot, progress)?;
        let mut found = judge(&frames, shot.numbered, settings);
        if !shot.unfinished.is_empty() {
            found.fault(
                "unfinished",
                [],
                format!("an export is writing here or was killed: {}", shot.unfinished.join(", ")),
            );
        }
        Ok(Self::from_frames(&shot, &frames, found))
    }

    fn from_frames(shot: &Shot, frames: &[Frame], found: Findings) -> Self {
        let whole: Vec<(i64, &Content)> =
            (frames.iter()).filter_map(|frame| Some((frame.number, frame.picture.as_ref().ok()?))).collect();
        let first = whole.first().map(|(_, content)| *content);
        let code = |of: Option<&(i64, &Content)>| of.and_then(|(_, c)| c.time_code).map(time::words);
        let layers = whole.iter().filter_map(|(number, content)| {
            let rebuild = content.layers.as_ref()?.as_ref().ok()?;
            Some(ShotLayers {
                layers: rebuild.layers,
                // JSON has no infinity.
                residual: rebuild.residual.min(f32::MAX),
                frame: *number,
                brightest: rebuild.brightest.min(f32::MAX),
            })
        });
        let common = |(key, _): &(&str, &str)| !matches!(*key, "frame" | "plate" | "look");
        let made_of = first.map(|content| {
            let pairs = content.made_of().into_iter().filter(common);
            pairs.map(|(key, value)| (key.to_owned(), value.to_owned())).collect()
        });
        let ends = [frames.first(), frames.last()].map(|f| f.map_or(0, |frame| frame.number));
        let mut report = Self {
            passed: found.faults.is_empty(),
            sentence: String::new(),
            faults: found.faults,
            remarks: found.remarks,
            folder: shot.folder.clone(),
            shot: shot.pattern.clone(),
            frames: ends,
            size: first.map(|content| [content.display_window[2], content.display_window[3]]),
            rate: first.and_then(|content| content.rate),
            time_code: code(whole.first()).zip(code(whole.last())).map(|(first, last)| [first, last]),
            color: first.and_then(|content| content.color.interop_id.clone()),
            layers: layers.max_by(|a, b| a.residual.total_cmp(&b.residual)),
            made_of: made_of.unwrap_or_default(),
            hash_list: None,
            files: frames.iter().map(FrameReport::from_frame).collect(),
        };
        report.sentence = report.words();
        report
    }

    /// Summary in one line.
    fn words(&self) -> String {
        let mut parts = vec![match self.files.len() {
            1 => "1 frame".to_owned(),
            count => format!("{count} frames {}", span(self.frames[0], self.frames[1])),
        }];
        parts.extend(self.size.map(|[width, height]| format!("{width} × {height}")));
        parts.extend(self.color.clone());
        parts.extend(self.rate.map(|rate| rate_words(Some(rate))));
        parts.extend((self.time_code.as_ref()).map(|[from, to]| format!("time code {from} to {to}")));
        parts.extend(self.layers.map(|found| {
            format!("{} light layers that rebuild the picture to within {:.1e}", found.layers, found.residual)
        }));
        let verdict = match self.faults.len() {
            0 => "no faults".to_owned(),
            1 => "1 fault".to_owned(),
            count => format!("{count} faults"),
        };
        let list = self.hash_list.as_ref();
        let list = list.map_or(String::new(), |list| format!("; hash list {}", list.display()));
        format!("{}: {}; {verdict}{list}", self.shot, parts.join(", "))
    }

    /// Compares all files of the shot's folder with its hash lists, and writes the next list. Changed and missing files
    /// are faults. A shot with faults gets no list.
    ///
    /// # Errors
    /// When a file or a hash list cannot be read or written, or the user stops.
    pub fn list_hashes(&mut self, progress: &Progress) -> Result<()> {
        if self.passed {
            let history = History::read(&self.folder)?;
            let frames = self.files.iter().map(|frame| (&frame.file, Some(&frame.pixels_c4)));
            let beside = self.files.iter().flat_map(|frame| &frame.beside).map(|file| (file, None));
            let read: BTreeMap<String, Found> = (frames.chain(beside))
                .map(|(file, pixels)| {
                    let c4 = Ok(file.c4.clone());
                    (file.name.clone(), Found { bytes: file.bytes, c4, pixels: pixels.cloned() })
                })
                .collect();
            let mut left = hash_list::files(&self.folder)?;
            left.retain(|path| !read.contains_key(path));
            let mut found = hash_list::hash_files(&self.folder, left, |_| u64::MAX, progress)?;
            found.extend(read);
            self.faults = history.faults(&self.folder, &found);
            if self.faults.is_empty() {
                self.hash_list = Some(history.write(&self.folder, &found)?);
            }
        }
        self.passed = self.faults.is_empty();
        if !self.passed {
            self.remarks.push(Remark {
                kind: "hash_list".to_owned(),
                sentence: "No hash list was written: the shot has faults".to_owned(),
            });
        }
        self.sentence = self.words();
        Ok(())
    }
}

impl FrameReport {
    fn from_frame(frame: &Frame) -> Self {
        let content = frame.picture.as_ref().ok();
        let rebuild = content.and_then(|content| content.layers.as_ref()?.as_ref().ok());
        Self {
            frame: frame.number,
            file: frame.file.clone(),
            pixels_c4: content.map_or(String::new(), |content| content.pixels.clone()),
            residual: rebuild.map(|rebuild| rebuild.residual),
            beside: content.map_or(Vec::new(), |content| content.beside.clone()),
        }
    }
}

#[cfg(test)]
mod tests;
