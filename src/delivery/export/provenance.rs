//! Provenance of a still, in its header: lets a stopped export resume.

use super::about::PROVENANCE;
use super::destination::Destination;
use super::footage_print::FootagePrints;
use super::format::Files;
use super::relight::RelightSettings;
use base::error::{Error, Result};
use base::files::open;
use base::{FileFormat, Fnv};
use color_config::ColorChoice;
use exr::meta::MetaData;
use exr::meta::attribute::{AttributeValue, Text};
use footage::{exemplar_sources, picture_behind};
use light::Environment;
use light::conventions::Front;
use project::{Picture, Project, Shoot};
use scene::{Background, Scene};
use std::io::BufReader;
use std::path::{Path, PathBuf};
use tiff::tags::Tag;

/// Provenance shared by all frames of an export. It covers content, not paths or times: the same export of a copy, also on
/// another machine, has the same provenance.
#[derive(Debug)]
pub struct Provenance {
    common: String,
    /// Hash of the other settings of a file's look.
    files: u64,
    footage: FootagePrints,
}

impl Provenance {
    /// Provenance of an export whose first frame is `first`: its light sets the level of all frames. `front` is the environment's
    /// front, as requested or as the project remembers it. `colors` is the identity of a configuration's transform.
    ///
    /// # Errors
    /// When calibration, network or look-up table cannot be read.
    pub fn new(
        project: &Project,
        environment: &Environment,
        asked: &RelightSettings,
        (front, first): (Front, usize),
        colors: &str,
    ) -> Result<Self> {
        let settings = &project.settings;
        let read = |path: &Path| {
            std::fs::read(path).map_err(|e| Error::io("read", path, e, "Check that the project exists and is complete"))
        };
        let mut made_of = Fnv::default();
        let shoot = Shoot {
            // Paths of the pictures and unused environments do not change the frames.
            folder: PathBuf::new(),
            environments: Vec::new(),
            ..settings.shoot.clone()
        };
        made_of.text(&format!("{shoot:?} {:?} {}", settings.framing, settings.size));
        made_of.bytes(&read(&project.calibration_path())?);
        let footage = FootagePrints::default();
        for picture in exemplar_sources(project) {
            made_of.text(&footage.picture_print(&picture));
        }
        // It holds the checksums of the weights.
        let mut network = Fnv::default();
        let table = project.checkpoint_path().join("checkpoint.toml");
        if table.exists() {
            network.bytes(&read(&table)?);
        }
        let mut lit_by = Fnv::default();
        lit_by.text(&environment.name);
        for value in environment.radiance.pixels.iter().flatten() {
            lit_by.bytes(&value.to_le_bytes());
        }
        let mut written = Fnv::default();
        // The destination does not change the pixels.
        let plain = Files {
            to: Destination::default(),
            first_number: None,
            existing: super::Existing::default(),
            resume: false,
            lut: None,
            ocio: ColorChoice::default(),
            ..asked.files.clone()
        };
        written.text(&format!("{plain:?} {first}"));
        // The first frame's light sets the level of all.
        for picture in sources(project, first, &Background::None)? {
            written.text(&footage.picture_print(&picture));
        }
        if let Some(table) = &asked.files.lut {
            written.bytes(&read(table)?);
        }
        written.text(colors);
        for lamp in &asked.solo {
            written.text(lamp);
        }
        let common = format!(
            "version={} project={} checkpoint={} environment={} settings={}",
            env!("CARGO_PKG_VERSION"),
            made_of,
            network,
            lit_by,
            look(asked, front)
        );
        Ok(Self { common, files: written.0, footage })
    }

    /// Provenance of one frame of the project with the look of `scene`. Its source pictures are read.
    ///
    /// # Errors
    /// When the movie of the background cannot be opened.
    pub fn frame(&self, project: &Project, scene: &Scene) -> Result<String> {
        let mut look = Fnv(self.files);
        let background = without_path(&scene.background);
        look.text(&format!("{:?}", Scene { background, ..scene.clone() }));
        let mut plate = Fnv::default();
        for picture in sources(project, scene.frame, &scene.background)? {
            plate.text(&self.footage.picture_print(&picture));
        }
        Ok(format!("{} look={look} plate={plate} frame={}", self.common, scene.frame))
    }
}

/// Source pictures of frame `frame`: its plate, its matte, and the picture behind it if the background is a file.
///
/// # Errors
/// When the movie of the background cannot be opened.
fn sources(project: &Project, frame: usize, background: &Background) -> Result<Vec<Picture>> {
    let matte = project.frame_matte(frame);
    let mut sources = vec![project.frame_picture(frame), matte.picture().clone()];
    if let Some(file) = background.file() {
        sources.push(picture_behind(file, frame, project.settings.shoot.frame_rate)?);
    }
    Ok(sources)
}

/// A background whose file counts by its content, not its path.
fn without_path(background: &Background) -> Background {
    background.clone().with_file("")
}

/// Provenance of the look of an export, independent of the frame: an animation counts as a whole.
fn look(asked: &RelightSettings, front: Front) -> Fnv {
    let mut look = Fnv::default();
    look.text(&format!(
        "{:?} {:?} {} {:?} {:?} {:?}",
        front, asked.look.yaw_deg, asked.turntable, asked.look.animation, asked.solo, asked.look.lighting
    ));
    look.text(&format!(
        "{:?} {:?} {:?} {:?}",
        asked.look.effects,
        asked.look.exposure_stops,
        without_path(&asked.look.background),
        asked.storage
    ));
    look
}

/// Provenance in a file's header. None if it has none, or the file is damaged.
pub fn provenance_of(path: &Path) -> Option<String> {
    let file = BufReader::new(open(path).ok()?);
    match FileFormat::from_path(path)? {
        FileFormat::OpenExr => {
            let parts = MetaData::read_from_buffered(file, false).ok()?.headers;
            let key = Text::from(PROVENANCE);
            let part = parts.first()?;
            let shared = part.shared_attributes.other.get(&key);
            // The reader stores unknown attributes here.
            match shared.or_else(|| part.own_attributes.other.get(&key))? {
                AttributeValue::Text(text) => Some(text.to_string()),
                _ => None,
            }
        }
        FileFormat::Tiff => {
            let mut decoder = tiff::decoder::Decoder::new(file).ok()?;
            let text = decoder.get_tag_ascii_string(Tag::ImageDescription).ok()?;
            let (_, provenance) = text.split_once(&format!("\n{PROVENANCE}: "))?;
            Some(provenance.trim_end_matches('\0').to_owned())
        }
        _ => {
            let reader = png::Decoder::new(file).read_info().ok()?;
            let texts = &reader.info().uncompressed_latin1_text;
            let text = texts.iter().find(|text| text.keyword == PROVENANCE)?;
            Some(text.text.clone())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_that_say_nothing_are_made_of_nothing() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a.png", "a.exr", "a.tif"] {
            let path = folder.path().join(name);
            assert_eq!(provenance_of(&path), None);
            std::fs::write(&path, b"not a picture").unwrap();
            assert_eq!(provenance_of(&path), None);
        }
    }
}
