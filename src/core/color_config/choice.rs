//! Choices in an OpenColorIO configuration.

use super::config::is_built_in;
use super::{ColorConfig, Transform, VARIABLE};
use base::error::{Error, Result};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// A configuration, and the choices in it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, clap::Args)]
#[serde(default)]
pub struct ColorChoice {
    /// OpenColorIO configuration: a file, or a built-in one such as ocio://default [default: the project's, else that of the
    /// variable OCIO].
    #[arg(id = "ocio_config", long = "ocio", value_name = "CONFIG")]
    pub config: Option<PathBuf>,
    /// Show pictures on this display of the OpenColorIO configuration [default: its first].
    #[arg(id = "ocio_display", long = "ocio-display", value_name = "NAME")]
    pub display: Option<String>,
    /// Show pictures through this view of the OpenColorIO configuration [default: the display's first].
    #[arg(id = "ocio_view", long = "ocio-view", value_name = "NAME")]
    pub view: Option<String>,
    /// Looks of the OpenColorIO configuration, in place of the view's own: NAME, or several names separated by
    /// commas, each with a leading + or -.
    #[arg(id = "ocio_look", long = "ocio-look", value_name = "LOOKS", allow_hyphen_values = true)]
    pub look: Option<String>,
    /// Write in this colour space of the OpenColorIO configuration, or that of a role such as scene_linear.
    #[arg(id = "ocio_space", long = "ocio-space", value_name = "SPACE")]
    pub space: Option<String>,
}

impl ColorChoice {
    /// True if a display, view, look or space is requested. A configuration alone changes no picture.
    pub fn is_asked(&self) -> bool {
        self.is_view() || self.space.is_some()
    }

    /// True if pictures go through a view.
    pub fn is_view(&self) -> bool {
        self.space.is_none() && (self.display.is_some() || self.view.is_some() || self.look.is_some())
    }

    /// The same choices with the project's configuration, if no other is chosen.
    #[must_use]
    pub fn or_config(mut self, project_config: Option<PathBuf>) -> Self {
        self.config = self.config.or(project_config);
        self
    }

    /// Path of the configuration: the chosen one, else that of the variable `OCIO`. None if there is neither.
    pub fn named(&self) -> Option<PathBuf> {
        self.config.clone().or_else(config_from_variable)
    }

    /// The same choices with an absolute configuration path if any part of it is used: for another program in
    /// another folder.
    ///
    /// # Errors
    /// When its file does not exist.
    pub fn pinned(mut self) -> Result<Self> {
        let named = self.named().filter(|_| self.is_asked());
        if let Some(named) = named {
            self.config = Some(if is_built_in(&named) {
                named
            } else {
                (named.canonicalize()).map_err(|e| Error::io("open", &named, e, "Choose the file config.ocio"))?
            });
        }
        Ok(self)
    }

    /// Opens the configuration: the chosen one, else that of the variable `OCIO`.
    ///
    /// # Errors
    /// When there is none, or it cannot be read.
    pub fn open(&self) -> Result<ColorConfig> {
        let Some(named) = self.named() else {
            return Err(Error::missing(
                format!("no OpenColorIO configuration is named, and the variable {VARIABLE} is not set"),
                ("Name one, set it for the project, or set OCIO", "--ocio FILE, or afterlight ocio PROJECT --use FILE"),
            ));
        };
        ColorConfig::open(&named)
    }

    /// Transform of our light. None if nothing is requested.
    ///
    /// # Errors
    /// When the configuration cannot be read or lacks a requested part, or two requests exclude each other.
    pub fn transform(&self) -> Result<Option<Transform>> {
        if !self.is_asked() {
            return Ok(None);
        }
        if let (Some(space), true) = (&self.space, self.display.is_some() || self.view.is_some()) {
            return Err(Error::invalid(
                format!("a picture cannot be both in the colour space {space} and shown by a view"),
                ("Leave one of the two out", "--ocio-space, or --ocio-display and --ocio-view"),
            ));
        }
        let config = self.open()?;
        let look = self.look.as_deref();
        match &self.space {
            Some(space) => config.to_space(space, look).map(Some),
            None => config.to_view(self.display.as_deref(), self.view.as_deref(), look).map(Some),
        }
    }
}

/// The configuration in the variable `OCIO`.
pub(super) fn config_from_variable() -> Option<PathBuf> {
    let named = std::env::var_os(VARIABLE).filter(|named| !named.is_empty())?;
    Some(Path::new(&named).to_path_buf())
}
