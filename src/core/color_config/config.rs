//! An open configuration.

use super::names::ConfigNames;
use super::transform::{Target, Transform};
use super::vetted::{REMEDY, caught, check_files, check_text};
use super::working::Working;
use base::error::{Error, Result};
use ocio::{Config, DisplayViewTransform, GroupTransform, LookTransform, ReferenceSpaceType, Transform as Step};
use std::path::{Path, PathBuf};

/// Maximum size of a configuration in bytes.
const MOST_BYTES: u64 = 8 << 20;

/// An open configuration.
#[derive(Debug)]
pub struct ColorConfig {
    path: PathBuf,
    config: Config,
    working: Working,
}

/// True if the configuration is built into OpenColorIO.
pub(super) fn is_built_in(config: &Path) -> bool {
    config.to_str().is_some_and(|name| name.starts_with("ocio://"))
}

impl ColorConfig {
    /// Reads a configuration: a file, or a built-in one. `ocio://default` is the one for ACES 2.0.
    ///
    /// # Errors
    /// When it cannot be read, names files that are not tables, or has no known way from linear Rec. 709.
    pub fn open(path: &Path) -> Result<Self> {
        let name = path.to_string_lossy();
        let fail = |e: ocio::Error| Error::codec("read", path, e, REMEDY);
        // Tables may have changed since another configuration was opened, so they are read again.
        ocio::clear_all_caches();
        let config = if is_built_in(path) {
            caught(path, || Config::create_from_builtin_config(&name))?.map_err(fail)?
        } else {
            let text = read(path)?;
            check_text(path, &text)?;
            caught(path, || Config::create_from_str(&text))?.map_err(fail)?
        };
        let mut config = config;
        if !is_built_in(path) {
            // Tables are searched from the folder of the configuration.
            let whole = std::path::absolute(path).map_err(|e| Error::io("open", path, e, REMEDY))?;
            let folder = whole.parent().unwrap_or(Path::new("/")).to_string_lossy();
            config.set_working_dir(&folder);
        }
        check_files(path, &config)?;
        let working = caught(path, || Working::from_config(&config))?.map_err(|e| {
            let problem =
                format!("linear Rec. 709 was not found in {}: {}", path.display(), e.message().replace('\n', " "));
            Error::invalid(
                problem,
                "Add the role aces_interchange to it, or the alias lin_rec709_scene to its linear Rec. 709",
            )
        })?;
        Ok(Self { path: path.to_path_buf(), config, working })
    }

    /// The file, or the name of a built-in one.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Names to choose from.
    pub fn names(&self) -> ConfigNames {
        ConfigNames::new(&self.path, &self.config, self.working.name())
    }

    /// Transform of our light to a display: `display` or its first, through `view` or the display's first, with
    /// `looks` in place of the view's own.
    ///
    /// # Errors
    /// When the configuration lacks one of these, or one of its tables cannot be read.
    pub fn to_view(&self, display: Option<&str>, view: Option<&str>, looks: Option<&str>) -> Result<Transform> {
        let names = self.names();
        let first = names.displays.first();
        let display = match display {
            None => first.ok_or_else(|| self.lacks("display", "any", &[]))?,
            Some(display) => {
                (names.displays.iter()).find(|known| known.name.eq_ignore_ascii_case(display)).ok_or_else(|| {
                    let known = names.displays.iter().map(|display| &*display.name);
                    self.lacks("display", display, &known.collect::<Vec<_>>())
                })?
            }
        };
        let known: Vec<&str> = display.views.iter().map(String::as_str).collect();
        let view = match view {
            None => *known.first().ok_or_else(|| self.lacks("view", "any", &[]))?,
            Some(view) => (known.iter())
                .find(|known| known.eq_ignore_ascii_case(view))
                .ok_or_else(|| self.lacks(&format!("view for {}", display.name), view, &known))?,
        };
        let shown = DisplayViewTransform {
            src: self.working.name().to_owned(),
            display: display.name.clone(),
            view: view.to_owned(),
            looks_bypass: looks.is_some(),
            ..DisplayViewTransform::default()
        };
        let steps = self.look(looks)?.into_iter().chain([shown.into()]);
        let target = Target::View { display: display.name.clone(), view: view.to_owned() };
        let display_space = self.config.display_view_color_space_name(&display.name, view);
        // A view in a display's own space uses the display's name.
        let display_space =
            if display_space.eq_ignore_ascii_case("<USE_DISPLAY_NAME>") { &display.name } else { display_space };
        self.transform(steps.collect(), target, display_space)
    }

    /// Transform of our light to a colour space or role, after `looks`.
    ///
    /// # Errors
    /// When the configuration has no such space or look, or one of its tables cannot be read.
    pub fn to_space(&self, space: &str, looks: Option<&str>) -> Result<Transform> {
        let found = self.config.get_color_space(space).ok_or_else(|| {
            let names = self.names();
            let spaces = names.spaces.iter().map(|space| &*space.name);
            let roles = names.roles.iter().map(|role| &*role.role);
            self.lacks("colour space or role", space, &roles.chain(spaces).collect::<Vec<_>>())
        })?;
        if found.is_data() {
            return Err(Error::invalid(
                format!("{space} of {} is for data, not for colours", self.path.display()),
                "Choose another colour space",
            ));
        }
        let name = found.name().to_owned();
        let step = match looks {
            Some(looks) => {
                self.check_looks(looks)?;
                LookTransform::new(self.working.name(), &name, looks).into()
            }
            None => ocio::ColorSpaceTransform::new(self.working.name(), &name).into(),
        };
        let target = Target::Space { is_linear: self.is_linear(&name) && looks.is_none(), name: name.clone() };
        self.transform(vec![step], target, &name)
    }

    fn is_linear(&self, space: &str) -> bool {
        let found = caught(&self.path, || (self.config).is_color_space_linear(space, ReferenceSpaceType::Scene));
        matches!(found, Ok(Ok(true)))
    }

    fn look(&self, looks: Option<&str>) -> Result<Option<Step>> {
        let Some(looks) = looks else { return Ok(None) };
        self.check_looks(looks)?;
        let working = self.working.name();
        Ok(Some(LookTransform::new(working, working, looks).into()))
    }

    /// Checks that looks of these names exist.
    fn check_looks(&self, looks: &str) -> Result<()> {
        let names = looks.split([',', ':', '|']).map(|name| name.trim().trim_start_matches(['+', '-']));
        for name in names.map(str::trim).filter(|name| !name.is_empty()) {
            if self.config.look(name).is_none() {
                let known = self.names().looks;
                let known: Vec<&str> = known.iter().map(String::as_str).collect();
                return Err(self.lacks("look", name, &known));
            }
        }
        Ok(())
    }

    fn transform(&self, steps: Vec<Step>, target: Target, space: &str) -> Result<Transform> {
        let steps = GroupTransform { transforms: steps, ..GroupTransform::default() };
        let processor = caught(&self.path, || self.working.processor(&self.config, &steps.into()))?;
        let processor = processor.map_err(|e| Error::codec("use", &self.path, e, REMEDY))?;
        let interop_id = (self.config.get_color_space(space)).map(|space| space.interop_id().to_owned());
        Ok(Transform::new(processor, target, interop_id.filter(|id| !id.is_empty()), space.to_owned()))
    }

    fn lacks(&self, what: &str, name: &str, known: &[&str]) -> Error {
        let known = match known {
            [] => "it has none".to_owned(),
            known => format!("it has {}", known.join(", ")),
        };
        Error::missing(
            format!("{} has no {what} {name:?}: {known}", self.path.display()),
            ("Check the name", "afterlight ocio lists all"),
        )
    }
}

/// Reads a configuration's text.
fn read(path: &Path) -> Result<String> {
    let fail = |e| Error::io("read", path, e, REMEDY);
    if base::has_extension(path, "ocioz") {
        return Err(Error::invalid(
            format!("{} is an archive", path.display()),
            ("Unpack it and name the config.ocio in it", "ocioarchive --extract"),
        ));
    }
    base::files::read_text(path, MOST_BYTES).map_err(fail)
}
