//! Mattes: which pixels are the subject.
//!
//! [`grab_cut`] tells a subject from what is behind it by their colours and edges, from marks of a person or of
//! another method. Everything here is a pure function of pictures, and the same on any number of threads.

mod flow_network;
mod grab_cut;
mod mixture;

pub use grab_cut::{GrabCut, Mark, grab_cut, rectangle};
