//! The text of shaders.

/// Text that all shaders from picture to picture share: their bindings, and functions that several need.
const PRELUDE: &str = include_str!("../../../../shaders/prelude.wgsl");

/// A shader, as it is written under `shaders/`.
#[derive(Debug)]
pub struct Shader {
    /// That of its file.
    pub name: &'static str,
    text: &'static str,
    /// Text that is put behind it, so that errors name the lines of its own file.
    shared: &'static str,
}

impl Shader {
    /// A shader from picture to picture, over the bindings of the prelude.
    pub(crate) const fn new(name: &'static str, text: &'static str) -> Self {
        Self { name, text, shared: PRELUDE }
    }

    /// A shader with bindings of its own.
    pub(super) const fn alone(name: &'static str, text: &'static str) -> Self {
        Self { name, text, shared: "" }
    }

    /// The WGSL that a GPU is given.
    pub fn source(&self) -> String {
        [self.text, self.shared].concat()
    }
}
