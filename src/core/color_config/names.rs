//! Names in a configuration.

use ocio::{Config, ReferenceSpaceType};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// All choices in a configuration, in its order.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct ConfigNames {
    pub config: PathBuf,
    /// The configuration's own description.
    pub description: String,
    pub displays: Vec<DisplayNames>,
    pub looks: Vec<String>,
    pub roles: Vec<Role>,
    pub spaces: Vec<SpaceName>,
    /// Its name for the program's working space, or for the space through which that is reached.
    pub working: String,
}

/// A display and its views.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct DisplayNames {
    pub name: String,
    /// The first is the default.
    pub views: Vec<String>,
}

/// Role of a colour space.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Role {
    pub role: String,
    pub space: String,
}

/// A colour space.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct SpaceName {
    pub name: String,
    /// Menu of the space; "" if none.
    pub family: String,
    /// True if the configuration marks it as scene-linear.
    pub is_scene_linear: bool,
    /// True if its values are data, not colours.
    pub is_data: bool,
}

impl ConfigNames {
    pub(super) fn new(path: &Path, config: &Config, working: &str) -> Self {
        let views = |display: &str| {
            let count = config.num_views(display);
            let mut views: Vec<String> = (0..count).map(|i| config.view(display, i)).collect();
            first(&mut views, &config.default_view(display));
            views
        };
        let count = config.num_displays();
        let mut displays: Vec<String> = (0..count).map(|i| config.display(i)).collect();
        first(&mut displays, &config.default_display());
        let spaces = (0..config.num_color_spaces()).filter_map(|i| {
            let space = config.get_color_space(config.color_space_name_by_index(i))?;
            Some(SpaceName {
                name: space.name().to_owned(),
                family: space.family().to_owned(),
                is_scene_linear: space.encoding().eq_ignore_ascii_case("scene-linear")
                    && space.reference_space_type() == ReferenceSpaceType::Scene,
                is_data: space.is_data(),
            })
        });
        Self {
            config: path.to_path_buf(),
            description: config.description().trim().to_owned(),
            displays: (displays.into_iter()).map(|name| DisplayNames { views: views(&name), name }).collect(),
            looks: (0..config.num_looks()).map(|i| config.look_name_by_index(i).to_owned()).collect(),
            roles: (0..config.num_roles())
                .map(|i| Role {
                    role: config.role_name(i).to_owned(),
                    space: config.role_color_space_by_index(i).to_owned(),
                })
                .collect(),
            spaces: spaces.collect(),
            working: working.to_owned(),
        }
    }

    /// All names, one sentence per line.
    pub fn sentences(&self) -> String {
        let mut lines = vec![format!("OpenColorIO configuration {}", self.config.display())];
        for display in &self.displays {
            lines.push(format!("display {}: {}", display.name, display.views.join(", ")));
        }
        if !self.looks.is_empty() {
            lines.push(format!("looks: {}", self.looks.join(", ")));
        }
        let roles = self.roles.iter().map(|role| format!("{} = {}", role.role, role.space));
        lines.push(format!("roles: {}", roles.collect::<Vec<_>>().join(", ")));
        let spaces = self.spaces.iter().map(|space| &*space.name);
        lines.push(format!("colour spaces: {}", spaces.collect::<Vec<_>>().join(", ")));
        lines.push(format!("Afterlight's working space is {} there", self.working));
        lines.join("\n")
    }
}

/// Moves this name to the front.
fn first(names: &mut [String], name: &str) {
    if let Some(at) = names.iter().position(|known| known == name) {
        names[..=at].rotate_right(1);
    }
}
