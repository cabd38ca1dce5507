//! Pictures behind the subject, for the pictures of one request.

use super::comparison::Comparison;
use super::preview::PreviewRequest;
use base::error::Result;
use footage::BehindReader;
use imaging::Image;
use scene::Background;
use std::path::PathBuf;
use std::sync::Arc;

/// Read picture of a background's file, with a number that changes with it.
type Shown = (u64, Arc<Image>);

/// Pictures of backgrounds that are files.
#[derive(Debug, Default)]
pub(super) struct Behind {
    /// One reader for each file of the last request.
    files: Vec<(PathBuf, BehindReader, Option<Shown>)>,
    reads: u64,
}

impl Behind {
    /// Reads the pictures behind the request's. Returns sentences on files that cannot be read: nothing stands behind those
    /// pictures.
    pub fn read(&mut self, request: &PreviewRequest) -> Vec<String> {
        let compared = [&request.first, &request.second].into_iter().flatten();
        let compared = compared.filter_map(|comparison| match comparison {
            Comparison::Look(view) => Some(&**view),
            _ => None,
        });
        let views = compared.chain(request.looks.iter().flatten()).map(|view| &view.scene);
        let scenes = std::iter::once(&request.scene).chain(views);
        let mut wanted: Vec<PathBuf> =
            scenes.filter_map(|scene| Some(scene.background.file()?.to_path_buf())).collect();
        wanted.dedup();
        self.files.retain(|(file, ..)| wanted.contains(file));
        let mut missing = Vec::new();
        for file in wanted {
            let known = self.files.iter().position(|(of, ..)| *of == file);
            let at = known.unwrap_or_else(|| {
                self.files.push((file.clone(), BehindReader::default(), None));
                self.files.len() - 1
            });
            let (_, reader, shown) = &mut self.files[at];
            let read: Result<Shown> = reader.read(&file, request.scene.frame, request.frame_rate);
            match read {
                Ok((_, picture)) => {
                    let same = |(_, last): &Shown| Arc::ptr_eq(last, &picture);
                    if !shown.as_ref().is_some_and(same) {
                        self.reads += 1;
                        *shown = Some((self.reads, picture));
                    }
                }
                Err(error) => {
                    *shown = None;
                    missing.push(error.to_string());
                }
            }
        }
        missing
    }

    /// The picture behind, and its number; None if the background is no file, or cannot be read.
    pub fn picture(&self, background: &Background) -> Option<(u64, &Image)> {
        let file = background.file()?;
        let (.., shown) = self.files.iter().find(|(of, ..)| of == file)?;
        shown.as_ref().map(|(number, picture)| (*number, &**picture))
    }
}
