//! Pictures behind the subject, for the pictures of one request.

use super::comparison::Comparison;
use super::preview::PreviewRequest;
use footage::BehindReader;
use imaging::Image;
use scene::Background;
use std::path::PathBuf;
use std::sync::Arc;

/// A background's file, its reader, and its picture with a number that changes with it; None if it cannot be read.
#[derive(Debug)]
struct BackgroundFile {
    path: PathBuf,
    reader: BehindReader,
    picture: Option<(u64, Arc<Image>)>,
}

/// Pictures of backgrounds that are files.
#[derive(Debug, Default)]
pub(super) struct Behind {
    /// Files of the last request.
    files: Vec<BackgroundFile>,
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
        self.files.retain(|file| wanted.contains(&file.path));
        let mut missing = Vec::new();
        for path in wanted {
            let known = self.files.iter().position(|file| file.path == path);
            let at = known.unwrap_or_else(|| {
                let reader = BehindReader::default();
                self.files.push(BackgroundFile { path, reader, picture: None });
                self.files.len() - 1
            });
            let file = &mut self.files[at];
            match file.reader.read(&file.path, request.scene.frame, request.frame_rate) {
                Ok((_, picture)) => {
                    let same = |(_, last): &(u64, Arc<Image>)| Arc::ptr_eq(last, &picture);
                    if !file.picture.as_ref().is_some_and(same) {
                        self.reads += 1;
                        file.picture = Some((self.reads, picture));
                    }
                }
                Err(error) => {
                    file.picture = None;
                    missing.push(error.to_string());
                }
            }
        }
        missing
    }

    /// The picture behind, and its number; None if the background is no file, or cannot be read.
    pub fn picture(&self, background: &Background) -> Option<(u64, &Image)> {
        let path = background.file()?;
        let file = self.files.iter().find(|file| file.path == path)?;
        file.picture.as_ref().map(|(number, picture)| (*number, &**picture))
    }
}
