//! The passes on the GPU.
