//! Built-in environments, so that a new project can be relit before any file is added.
//!
//! Each is a panorama of relative radiance in the frame of [`super::latlong`], identical on every machine. Skies
//! are in thousands of candela per square metre and include their sun. In the studios white facing the key light
//! has radiance 1.

mod courtyard;
mod nave;
mod panorama;
pub mod pattern;
mod sky;
mod studio;

use super::Environment;
use imaging::Image;
use std::sync::{Arc, OnceLock};

/// A built-in environment.
#[derive(Clone, Copy, Debug)]
pub struct BuiltIn {
    /// Name in settings and files: lower case, with hyphens.
    pub name: &'static str,
    /// Name in the window.
    pub title: &'static str,
    /// One-sentence description of the view.
    pub describe: &'static str,
    /// Makes the panorama at `width × width / 2` texels (at least two by one). From 256 columns up its energy
    /// varies with the width by at most 1 %: lights are drawn with exact energy, and only lit surfaces are sampled.
    /// The nave's stained panes, thinner than a texel, raise it to 3 %.
    pub make: fn(width: usize) -> Image,
}

impl BuiltIn {
    /// The environment at [`Self::WIDTH`], with its title as its name. Made on first use and cached.
    pub fn environment(&self) -> Arc<Environment> {
        static MADE: [OnceLock<Arc<Environment>>; ALL.len()] = [const { OnceLock::new() }; ALL.len()];
        let make = || Arc::new(Environment::from_radiance(self.title, (self.make)(Self::WIDTH)));
        match ALL.iter().position(|own| own.name == self.name) {
            Some(place) => MADE[place].get_or_init(make).clone(),
            None => make(),
        }
    }

    /// Enough columns for a background without visible texels.
    pub const WIDTH: usize = 1024;
}

/// All built-in environments, in the order of the list.
pub fn all() -> Vec<&'static BuiltIn> {
    ALL.iter().collect()
}

/// The environment with this [`BuiltIn::name`].
pub fn named(name: &str) -> Option<&'static BuiltIn> {
    ALL.iter().find(|environment| environment.name == name)
}

static ALL: [BuiltIn; 8] = [
    BuiltIn {
        name: "three-point",
        title: "Three-point",
        describe: "A warm key from camera-left, a neutral fill at a quarter of it, a rim from behind, \
                   before grey paper.",
        make: studio::three_point,
    },
    BuiltIn {
        name: "clamshell",
        title: "Clamshell",
        describe: "A large box above the camera and a weaker one below it, for beauty, before bright paper.",
        make: studio::clamshell,
    },
    BuiltIn {
        name: "side-light",
        title: "Side light",
        describe: "One tall box from camera-left and a cool edge from behind, in a black room.",
        make: studio::side_light,
    },
    BuiltIn {
        name: "clear-sky",
        title: "Clear sky",
        describe: "The sun 40° above the horizon behind the camera's left shoulder, in a clear blue sky \
                   over an open plain.",
        make: sky::clear,
    },
    BuiltIn {
        name: "low-sun",
        title: "Low sun",
        describe: "The sun 8° above the horizon, ahead and to the right: a warm edge against a deep sky.",
        make: sky::low_sun,
    },
    BuiltIn {
        name: "overcast",
        title: "Overcast sky",
        describe: "A closed cover of cloud, three times as bright above as at the horizon.",
        make: sky::overcast,
    },
    BuiltIn {
        name: "courtyard",
        title: "Courtyard",
        describe: "A sunny courtyard with arcades; the sun stands behind the camera's right shoulder.",
        make: courtyard::courtyard,
    },
    BuiltIn {
        name: "nave",
        title: "Nave",
        describe: "A church nave with stained windows, the sun behind those at camera-left, and candles.",
        make: nave::nave,
    },
];

#[cfg(test)]
mod tests;
