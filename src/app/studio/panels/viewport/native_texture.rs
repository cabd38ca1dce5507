//! Textures on the window's GPU that egui did not create: pictures rendered there.

use compositor::passes::DisplayTexture;
use eframe::egui_wgpu::RenderState;
use eframe::wgpu::FilterMode;
use egui::{TextureHandle, TextureId};

/// Source of a picture's texture.
pub enum ShownTexture {
    InMemory(TextureHandle),
    /// The second texture is for pictures in memory, kept for reuse.
    OnGpu(TextureId, Option<TextureHandle>),
}

impl ShownTexture {
    pub fn id(&self) -> TextureId {
        match self {
            Self::InMemory(texture) => texture.id(),
            Self::OnGpu(id, _) => *id,
        }
    }

    /// The texture for pictures in memory.
    pub fn in_memory(self) -> Option<TextureHandle> {
        match self {
            Self::InMemory(texture) => Some(texture),
            Self::OnGpu(_, texture) => texture,
        }
    }
}

/// Id under which egui draws pictures on the window's GPU.
#[derive(Default)]
pub struct NativeTexture {
    window: Option<RenderState>,
    id: Option<TextureId>,
}

impl NativeTexture {
    pub fn from_window(window: RenderState) -> Self {
        Self { window: Some(window), id: None }
    }

    /// Makes egui draw this picture from now on. None if the picture is on another GPU than the window.
    pub fn show(&mut self, picture: &DisplayTexture) -> Option<TextureId> {
        let window = self.window.as_ref()?;
        if !picture.is_on(&window.device) {
            return None;
        }
        let (device, view) = (&window.device, picture.view());
        let mut renderer = window.renderer.write();
        match self.id {
            Some(id) => {
                let linear = FilterMode::Linear;
                renderer.update_egui_texture_from_wgpu_texture(device, &view, linear, id);
            }
            None => {
                let id = renderer.register_native_texture(device, &view, FilterMode::Linear);
                self.id = Some(id);
            }
        }
        self.id
    }
}

impl Drop for NativeTexture {
    fn drop(&mut self) {
        if let (Some(window), Some(id)) = (&self.window, self.id) {
            window.renderer.write().free_texture(&id);
        }
    }
}
