//! WGSL text of shaders.

/// Text shared by all shaders from picture to picture: their bindings and common functions.
const PRELUDE: &str = include_str!("../../../../shaders/prelude.wgsl");

/// A shader from `shaders/`.
#[derive(Debug)]
pub struct Shader {
    /// Text of its file.
    pub name: &'static str,
    text: &'static str,
    /// Text appended after it, so that errors name the lines of its own file.
    shared: &'static str,
}

impl Shader {
    /// A shader from picture to picture, with the bindings of the prelude.
    pub(crate) const fn new(name: &'static str, text: &'static str) -> Self {
        Self { name, text, shared: PRELUDE }
    }

    /// A shader with its own bindings.
    pub(super) const fn alone(name: &'static str, text: &'static str) -> Self {
        Self { name, text, shared: "" }
    }

    /// Complete WGSL for a GPU.
    pub fn source(&self) -> String {
        [self.text, self.shared].concat()
    }
}
