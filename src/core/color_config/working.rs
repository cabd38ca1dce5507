//! The program's working space in a configuration.

use ocio::{Config, Processor, Transform, TransformDirection};

/// Names of linear Rec. 709: that of the ASWF's Color Interop Forum, those of OpenColorIO's own ACES
/// configurations in their versions, and older ones still in use (ACES 1.0 to 1.2, Blender).
const NAMES: [&str; 8] = [
    "lin_rec709_scene",
    "lin_rec709_srgb",
    "lin_rec709",
    "Linear Rec.709 (sRGB)",
    "Utility - Linear - sRGB",
    "Utility - Linear - Rec.709",
    "Linear Rec.709",
    "lin_srgb",
];
/// Its name in the built-in configuration.
const BUILT_IN: &str = "Linear Rec.709 (sRGB)";
/// Role of the scene-linear working space.
const SCENE_LINEAR: &str = "scene_linear";

/// Route of our light into a configuration.
#[derive(Debug)]
pub(super) enum Working {
    /// The configuration has the space under this name.
    Named(String),
    /// Through the interchange space, into the space of this name.
    Converted(String, Box<Processor>),
}

impl Working {
    /// Finds the space by its names, or else a route through the interchange roles.
    ///
    /// # Errors
    /// When there is neither.
    pub fn from_config(config: &Config) -> ocio::Result<Self> {
        let known = NAMES.iter().find_map(|name| config.get_color_space(name));
        let by_id = || {
            let names = (0..config.num_color_spaces()).map(|i| config.color_space_name_by_index(i));
            let mut spaces = names.filter_map(|name| config.get_color_space(name));
            spaces.find(|space| space.interop_id() == NAMES[0])
        };
        let found = known.or_else(by_id).filter(|space| !space.is_data());
        if let Some(space) = found {
            return Ok(Self::Named(space.name().to_owned()));
        }
        let linear = config.get_color_space(SCENE_LINEAR);
        let linear = linear.ok_or_else(|| {
            ocio::Error::msg("it has no linear Rec. 709 under a known name, and no role scene_linear")
        })?;
        let name = linear.name().to_owned();
        let processor = Config::get_processor_from_builtin_color_space(BUILT_IN, config, &name)?;
        Ok(Self::Converted(name, Box::new(processor)))
    }

    /// The space in which [`Self::processor`]'s transforms begin.
    pub fn name(&self) -> &str {
        match self {
            Self::Named(name) | Self::Converted(name, _) => name,
        }
    }

    /// Processor from linear Rec. 709 through a transform that begins at [`Self::name`].
    ///
    /// # Errors
    /// When the configuration lacks a part of it.
    pub fn processor(&self, config: &Config, transform: &Transform) -> ocio::Result<Processor> {
        let after = config.get_processor_for_transform(transform, TransformDirection::Forward)?;
        Ok(match self {
            Self::Named(_) => after,
            Self::Converted(_, before) => {
                let ops = before.ops().iter().chain(after.ops()).cloned();
                Processor::from_ops(ops.collect())
            }
        })
    }
}
