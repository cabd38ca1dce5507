//! Every reader that needs neither the network nor the window.

mod files;
mod pictures;
mod projects;
mod words;

#[global_allocator]
static COUNTED: fuzz::Counted = fuzz::Counted;
