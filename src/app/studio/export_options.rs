//! Options of the next export.

use super::look::LookSettings;
use super::panels::environments::library::PanoramaState;
use super::status::Phase;
use color_config::ColorChoice;
use compositor::Storage;
use export::relight::RelightSettings;
use export::{
    Destination, Existing, ExrSettings, Files, Format, HandOver, LayerFiles, LayersBy, MovieAlpha, OutputSpace,
};
use footage::PictureSize;
use gpu::DeviceChoice;
use light::Environment;
use project::Project;
use scene::{Background, Effects, Inspection, Look, Pass, Setting};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Extensions that are replaced by that of the format.
const ENDINGS: [&str; 8] = [".png", ".tif", ".tiff", ".exr", ".mp4", ".mov", ".mkv", ".mxf"];

/// The current options.
#[derive(Clone, Debug, PartialEq)]
pub struct ExportOptions {
    pub format: Format,
    /// Content and resolution of the pictures.
    pub at: PictureSize,
    /// Pixels of the longer side; None to leave them as they are.
    pub size: Option<usize>,
    /// Background behind the subject; None for the picture's background.
    pub background: Option<Background>,
    /// Colour space of the files; None for sRGB, or linear Rec. 709 in an EXR.
    pub space: Option<OutputSpace>,
    /// A `.cube` table baked into the codes: relative to the project's folder, or absolute; "" for none.
    pub table: String,
    /// OpenColorIO view or colour space that replaces tone curve, colour space and table; empty for none. Independent
    /// of the viewing settings.
    pub ocio: ColorChoice,
    /// True to show the picture through the table as well.
    pub show_table: bool,
    /// Pixel format of an EXR.
    pub exr: ExrSettings,
    /// Alpha of a movie, if its codec keeps it.
    pub movie_alpha: MovieAlpha,
    /// True to write the interview's sound into a movie, if there is any.
    pub sound: bool,
    /// True to add the subject under each lamp or light as layers, if the format can hold them.
    pub layers: bool,
    /// Programs to write hand-over files for, if they can open the export.
    pub hand_over: Vec<HandOver>,
    /// Name of the files without frame number and extension: relative to the project's folder, or absolute.
    pub name: String,
    /// Number of the interview's first frame in the names of stills; None for the plate's own.
    pub first_number: Option<i64>,
    /// Consent for the present name.
    pub overwrite: Overwrite,
}

/// Existing files that an export may overwrite.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Overwrite {
    /// None: a number is appended to the new name.
    #[default]
    Never,
    All,
    /// Stills made with other settings: the others of a stopped export are kept.
    Outdated,
}

impl ExportOptions {
    /// Options for the pictures of a project as shown.
    pub fn from_project(project: &Project) -> Self {
        let plain = |c: char| if c.is_alphanumeric() { c } else { '-' };
        let name: String = project.settings.name.chars().map(plain).collect();
        Self { name: format!("exports/{name}"), ..Self::default() }
    }

    /// The table baked into the codes. None if not set, for an EXR, which has no codes, and if an OpenColorIO
    /// configuration makes the codes.
    fn table(&self, root: &Path) -> Option<PathBuf> {
        let name = self.table.trim();
        let has_codes = self.format != Format::Exr && !self.ocio.is_asked();
        (!name.is_empty() && has_codes).then(|| root.join(name))
    }

    /// Sentence about the contents of files with OpenColorIO colours; None without them.
    pub fn ocio_sentence(&self) -> Option<String> {
        let ColorChoice { display, view, look, space, .. } = &self.ocio;
        Some(match (space, view) {
            (Some(space), _) if self.format == Format::Exr => {
                format!("Writes linear light in {space} of the OpenColorIO configuration.")
            }
            (Some(space), _) => {
                format!("Writes the colour space {space} of the OpenColorIO configuration, in place of the tone curve.")
            }
            (None, Some(view)) => {
                let display = display.as_deref().unwrap_or("its first display");
                let look = look.as_ref().map(|look| format!(", with the look {look}"));
                format!(
                    "Writes the view {view} for {display}{}, in place of the tone curve. The viewing settings above the \
                     picture do not affect it.",
                    look.unwrap_or_default()
                )
            }
            (None, None) => return None,
        })
    }

    /// True if grain is set while an OpenColorIO configuration makes the codes. [`RelightSettings::check`] refuses
    /// that.
    fn has_foreign_grain(&self, look: &LookSettings) -> bool {
        let mut effects = look.effects;
        let grain = Setting::Effect(Pass::Grain);
        if look.animation.keys(grain).is_some() {
            effects.grain = 1.0;
        }
        self.ocio.is_asked() && effects.asks(Pass::Grain)
    }

    /// The table of the viewing transform; None without one.
    pub fn shown_table(&self, root: &Path) -> Option<PathBuf> {
        self.table(root).filter(|_| self.show_table)
    }

    /// Reason that a program could not open such an export; None if it can.
    pub fn hand_over_obstacle(&self, program: HandOver) -> Option<&'static str> {
        if !program.needs_layers() {
            return None;
        }
        match (self.format, self.layers, self.exr.layers) {
            (Format::Exr, true, LayerFiles::Parts) if program == HandOver::Blender => {
                Some("Blender reads only the first part of an EXR: put the layers in channels or files")
            }
            (Format::Exr, true, _) if self.exr.layers_by == LayersBy::Lamp => None,
            _ => Some("Needs an EXR with layers by lamp"),
        }
    }

    /// The alpha of the movie.
    fn movie_alpha(&self) -> MovieAlpha {
        match self.format.codec() {
            Some(codec) if codec.has_alpha() => self.movie_alpha,
            _ => MovieAlpha::default(),
        }
    }

    /// True if files keep their names, even if some exist.
    pub fn replaces(&self) -> bool {
        self.overwrite == Overwrite::All || self.resumes()
    }

    /// True if finished stills are kept.
    pub fn resumes(&self) -> bool {
        self.overwrite == Overwrite::Outdated && !self.format.is_movie()
    }

    /// The name without the extension of a format.
    fn stem(&self) -> &str {
        let name = self.name.trim();
        let ending = name.rfind('.').map(|dot| name.split_at(dot));
        match ending {
            Some((stem, ending)) if ENDINGS.contains(&ending) => stem,
            _ => name,
        }
    }

    /// The destination.
    pub fn to(&self, root: &Path) -> Destination {
        // A percent sign would begin the frame number.
        let path = root.join(self.stem()).display().to_string();
        let text = path.replace('%', "%%") + self.format.ending();
        // A movie without a name, which is an obstacle.
        Destination::parse(&text).unwrap_or_else(|_| Destination::Clip(text.into()))
    }

    /// Uses a chosen file as the name.
    pub fn choose(&mut self, file: &Path, root: &Path) {
        let name = file.strip_prefix(root).unwrap_or(file);
        self.name = name.display().to_string();
    }

    /// Reason that this look cannot be exported now, with the remedy; None if it can.
    pub fn obstacle(
        &self,
        phase: &Phase,
        environment: Option<&PanoramaState>,
        look: &LookSettings,
    ) -> Option<&'static str> {
        let name = self.stem();
        let named = !name.ends_with(std::path::is_separator) && Path::new(name).file_name().is_some();
        match (phase, environment) {
            (Phase::NoProject, _) => Some("Open a project first"),
            (Phase::Opening, _) => Some("The network is still being read"),
            (Phase::Blocked(_), _) => Some("Calibrate and train first: see the picture"),
            (_, None) => Some("Choose an environment first"),
            (_, Some(PanoramaState::Failed(_))) => Some("This environment cannot be read. Choose another"),
            // The light may have been dropped from memory, and is being read again.
            (_, Some(panorama)) if !panorama.has_light() => Some("The environment is still being read"),
            _ if !named => Some("Give the export a name"),
            _ if self.has_foreign_grain(look) => {
                Some("Grain cannot go through an OpenColorIO configuration. Set Grain to 0, or choose other colours")
            }
            _ => None,
        }
    }

    /// Everything that the export needs, under the lamps `solo` only if there are any. Later changes of the look do not
    /// affect it.
    pub fn settings(
        &self,
        project: &Project,
        look: &LookSettings,
        solo: &[usize],
        environment: Arc<Environment>,
        device: DeviceChoice,
    ) -> RelightSettings {
        let lamp = |lamp: &usize| project.settings.shoot.lamps.get(*lamp).cloned();
        let solo = solo.iter().filter_map(lamp).collect();
        RelightSettings {
            environment: PathBuf::from(&environment.name),
            read: Some(environment),
            front: Some(look.front()),
            mapping: None,
            environment_layer: None,
            look: Look {
                effects: Effects {
                    // Channels are for viewing only.
                    inspection: Inspection::Picture,
                    ..look.effects
                },
                background: self.background.as_ref().unwrap_or(&look.background).clone(),
                ..look.shown.clone()
            },
            turntable: false,
            solo,
            frames: Some(look.range_of(project.settings.shoot.frames.len())),
            files: Files {
                to: self.to(&project.root),
                first_number: self.first_number,
                existing: if self.replaces() { Existing::Replace } else { Existing::Keep },
                at: self.at,
                size: self.size,
                bits: self.format.bits(),
                layers: self.layers && self.format == Format::Exr,
                codec: self.format.codec(),
                movie_alpha: self.movie_alpha(),
                space: self.space.filter(|_| !self.ocio.is_asked()),
                lut: self.table(&project.root),
                ocio: self.ocio.clone(),
                no_sound: !self.sound,
                resume: self.resumes(),
                exr: self.exr,
            },
            hand_over: (HandOver::ALL.into_iter())
                .filter(|program| self.hand_over.contains(program))
                .filter(|program| self.hand_over_obstacle(*program).is_none())
                .collect(),
            profile: false,
            device,
            storage: Storage::default(),
        }
    }
}

impl Default for ExportOptions {
    fn default() -> Self {
        Self {
            format: Format::default(),
            at: PictureSize::default(),
            size: None,
            background: None,
            space: None,
            table: String::new(),
            ocio: ColorChoice::default(),
            show_table: false,
            exr: ExrSettings::default(),
            movie_alpha: MovieAlpha::default(),
            sound: true,
            layers: false,
            hand_over: Vec::new(),
            name: "exports/relit".to_owned(),
            first_number: None,
            overwrite: Overwrite::Never,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::{LookCommand, ViewCommand};
    use crate::state::State;
    use light::keyframes::{Interpolation, Keyframes};
    use light::{LightGroup, PlacedLight};
    use scene::Output;

    fn named(name: &str, format: Format) -> ExportOptions {
        ExportOptions { name: name.to_owned(), format, ..ExportOptions::default() }
    }

    #[test]
    fn an_export_goes_to_programs_that_can_open_it() {
        let mut options = named("a", Format::Exr);
        let able = |options: &ExportOptions| {
            let can = |program: &HandOver| options.hand_over_obstacle(*program).is_none();
            HandOver::ALL.into_iter().filter(can).collect::<Vec<_>>()
        };
        assert_eq!(able(&options), [HandOver::Otio, HandOver::Edl]);
        options.layers = true;
        assert_eq!(able(&options), HandOver::ALL);
        options.exr.layers_by = LayersBy::Light;
        assert_eq!(able(&options), [HandOver::Otio, HandOver::Edl]);
        options.exr.layers_by = LayersBy::Lamp;
        options.exr.layers = LayerFiles::Parts;
        assert_eq!(able(&options), [HandOver::Nuke, HandOver::Otio, HandOver::Edl]);
        options.format = Format::Movie(export::Codec::ProRes4444);
        assert_eq!(able(&options), [HandOver::Otio, HandOver::Edl]);
        options.movie_alpha = MovieAlpha::Premultiplied;
        assert_eq!(options.movie_alpha(), MovieAlpha::Premultiplied);
        options.format = Format::Movie(export::Codec::H264);
        assert_eq!(options.movie_alpha(), MovieAlpha::Straight);
    }

    #[test]
    fn a_name_and_a_format_are_a_destination() {
        let to = |name, format| named(name, format).to(Path::new("/film")).to_string();
        assert_eq!(to("exports/a", Format::Png16), "/film/exports/a.%04d.png");
        assert_eq!(to(" a.mov ", Format::Movie(export::Codec::H264)), "/film/a.mp4");
        assert_eq!(to("/else/v1.2", Format::Movie(export::Codec::ProRes4444)), "/else/v1.2.mov");
        assert_eq!(to("100%", Format::Exr), "/film/100%%.%04d.exr");
        let mut options = ExportOptions::default();
        options.choose(Path::new("/film/b/c.png"), Path::new("/film"));
        assert_eq!(options.to(Path::new("/film")).to_string(), "/film/b/c.%04d.png");
    }

    #[test]
    fn a_table_is_for_codes() {
        let mut options = named("a", Format::Exr);
        options.table = " looks/warm.cube ".to_owned();
        assert_eq!(options.table(Path::new("/film")), None);
        options.format = Format::Tiff;
        let found = options.table(Path::new("/film"));
        assert_eq!(found, Some("/film/looks/warm.cube".into()));
        options.table.clear();
        assert_eq!(options.table(Path::new("/film")), None);
    }

    #[test]
    fn a_configuration_decides_colours_alone_and_that_is_said() {
        let project = Project::without_shoot(Path::new("/film"));
        let environment = light::built_in::named("nave").unwrap().environment();
        let files = |options: &ExportOptions| {
            let (look, light) = (LookSettings::default(), environment.clone());
            (options.settings(&project, &look, &[], light, DeviceChoice::Cpu)).files
        };
        let mut options = named("a", Format::Png16);
        options.space = Some(OutputSpace::P3);
        options.table = "warm.cube".to_owned();
        assert_eq!(options.ocio_sentence(), None);
        let plain = files(&options);
        assert!(plain.space.is_some() && plain.lut.is_some() && !plain.ocio.is_asked());
        options.ocio.display = Some("Monitor".to_owned());
        options.ocio.view = Some("Film".to_owned());
        options.show_table = true;
        assert_eq!(options.shown_table(Path::new("/film")), None);
        let configured = files(&options);
        assert_eq!((configured.space, configured.lut), (None, None));
        assert_eq!(configured.ocio, options.ocio);
        let said = options.ocio_sentence().unwrap();
        assert!(said.contains("the view Film for Monitor, in place"), "{said}");
        options.ocio.look = Some("warm".to_owned());
        let said = options.ocio_sentence().unwrap();
        assert!(said.contains("with the look warm, in place"), "{said}");
        options.ocio = ColorChoice { space: Some("ACEScg".to_owned()), ..ColorChoice::default() };
        let said = options.ocio_sentence().unwrap();
        assert!(said.contains("the colour space ACEScg"), "{said}");
        options.format = Format::Exr;
        let said = options.ocio_sentence().unwrap();
        assert!(said.contains("linear light in ACEScg"), "{said}");
    }

    #[test]
    fn grain_is_in_the_way_of_a_configuration_exactly_where_the_export_refuses_it() {
        let project = Project::without_shoot(Path::new("/film"));
        let environment = light::built_in::named("nave").unwrap().environment();
        let mut options = named("a", Format::Png8);
        let mut keyed = LookSettings::default();
        let mut keys = Keyframes::default();
        keys.insert(0.0, 0.0).unwrap();
        keyed.set_lanes(vec![(Setting::Effect(Pass::Grain), keys)]);
        let mut grainy = LookSettings::default();
        grainy.effects.grain = 0.5;
        for (asked, look, obstructed) in [
            (false, &grainy, false),
            (true, &LookSettings::default(), false),
            (true, &grainy, true),
            (true, &keyed, true),
        ] {
            options.ocio.view = asked.then(|| "Film".to_owned());
            assert_eq!(options.has_foreign_grain(look), obstructed);
            let light = environment.clone();
            let settings = options.settings(&project, look, &[], light, DeviceChoice::Cpu);
            assert_eq!(settings.check().is_err(), obstructed);
        }
    }

    #[test]
    fn every_frame_is_exported_as_it_is_shown() {
        let mut project = Project::without_shoot(Path::new("/film"));
        let names: Vec<String> = (0..12).map(|i| i.to_string()).collect();
        project.settings.shoot.frames = names.into();
        let mut s = State::new(12, 24.0);
        s.change(LookCommand::Set(Setting::Yaw, 170.0));
        let mut lighting = s.look.lighting.clone();
        let group = LightGroup { name: "Left".to_owned(), ..LightGroup::default() };
        let light = PlacedLight { group: group.name.clone(), ..PlacedLight::default() };
        (lighting.placed, lighting.groups) = (vec![light; 2], vec![group]);
        s.change(LookCommand::Lighting(Box::new(lighting)));
        let settings = Setting::all(&s.look.lighting);
        let lanes = settings.into_iter().enumerate().map(|(i, of)| {
            let range = of.range();
            let share = |share: f64| {
                let (least, most) = (f64::from(*range.start()), f64::from(*range.end()));
                least + share * (most - least)
            };
            let mut keys = Keyframes::default();
            for (frame, value) in [(0.0, 0.3), (4.0, 0.9), (7.5, 0.1), (11.0, 0.6)] {
                let at = keys.insert(frame, share(value)).unwrap();
                keys.set_kind(at, Interpolation::ALL[(at + i) % 4].0);
            }
            keys.set_slopes(1, [Some(2.0), Some(-share(0.7))]).unwrap();
            (of, keys)
        });
        s.change(LookCommand::Keys(lanes.collect()));
        let environment = light::built_in::named("nave").unwrap().environment();
        for added_at in [0, 7] {
            s.show(ViewCommand::Frame(added_at));
            let options = ExportOptions::default();
            let cpu = DeviceChoice::Cpu;
            let asked = options.settings(&project, &s.look, &[], environment.clone(), cpu);
            let mut shown = Vec::new();
            for frame in 0..12 {
                s.show(ViewCommand::Frame(frame));
                let exported = asked.scene(frame, 0.5, asked.front.unwrap(), Output::Display);
                assert_eq!(exported, s.scene(), "frame {frame}");
                assert!(!shown.contains(&(exported.lighting.clone(), exported.effects)));
                shown.push((exported.lighting, exported.effects));
            }
        }
    }

    #[test]
    fn what_is_in_the_way_is_said() {
        let ready = Phase::Ready { device: "CPU".into() };
        let look = LookSettings::default();
        let waiting = PanoramaState::Waiting;
        let says = |options: &ExportOptions, phase| options.obstacle(phase, Some(&waiting), &look);
        assert!(says(&ExportOptions::default(), &Phase::Opening).unwrap().contains("network"));
        assert!(says(&ExportOptions::default(), &ready).unwrap().contains("environment"));
        assert!(ExportOptions::default().obstacle(&ready, None, &look).unwrap().contains("Choose"));
    }
}
