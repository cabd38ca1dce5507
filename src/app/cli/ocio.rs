//! `afterlight ocio`.

use super::OutputArgs;
use super::console::{Console, print};
use base::error::{Error, Result};
use clap::Args;
use color_config::ColorChoice;
use project::Project;
use std::path::{Path, PathBuf};

/// List displays, views, looks, roles and colour spaces of an OpenColorIO configuration: the given one, the
/// project's, or that of the variable OCIO. `relight` shows pictures through them (--ocio-view, --ocio-space).
#[derive(Debug, Args)]
#[command(
    after_help = "Example: afterlight ocio --ocio ocio://default\n         afterlight ocio interview --use show/config.ocio"
)]
pub struct OcioArgs {
    /// The project's folder.
    project: Option<PathBuf>,
    /// The configuration: a file, or a built-in one such as ocio://default.
    #[arg(long = "ocio", value_name = "CONFIG", conflicts_with = "choose")]
    config: Option<PathBuf>,
    /// Use this configuration for the project from now on; `none` removes it.
    #[arg(id = "choose", long = "use", value_name = "CONFIG", requires = "project")]
    choose: Option<PathBuf>,
    #[command(flatten)]
    output: OutputArgs,
}

impl OcioArgs {
    /// Lists the configuration, or changes the project.
    ///
    /// # Errors
    /// When there is no configuration, or it cannot be read; the project is then unchanged.
    pub fn run(self) -> Result<()> {
        if let (Some(root), Some(chosen)) = (&self.project, &self.choose) {
            let chosen = (chosen != Path::new("none")).then_some(&**chosen);
            // An unreadable configuration is not chosen.
            let opened = chosen.map(color_config::ColorConfig::open).transpose()?;
            // Merged with other changes: an open window on the project goes on.
            Project::change(root, |project| project.set_color_config(chosen))?;
            if opened.is_none() {
                return if self.output.json {
                    print("{\"config\":null}")
                } else {
                    print("The project has no OpenColorIO configuration")
                };
            }
        }
        let of_project = match &self.project {
            Some(root) => Project::open(root)?.color_config(),
            None => None,
        };
        let choice = ColorChoice { config: self.config, ..ColorChoice::default() };
        let names = choice.or_config(of_project).open()?.names();
        if names.displays.is_empty() && names.spaces.is_empty() {
            return Err(Error::invalid(
                format!("{} has neither displays nor colour spaces", names.config.display()),
                "Choose another configuration",
            ));
        }
        Console::new(self.output.json).finish(&names, || names.sentences())
    }
}
