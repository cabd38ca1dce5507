//! Files in a shoot's folders that are no part of it: strays beside mattes and poses, and files of systems.

use super::shoot::stem;
use base::files::{is_clutter, natural_order};
use movies::listed;
use project::{Frames, Picture, Project};
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// Sentences on the files that an import leaves out, besides strays in the series of the interview and the lamps.
pub fn notes(project: &Project) -> Vec<String> {
    let shoot = &project.settings.shoot;
    let frames = match &shoot.frames {
        Frames::Named(names) => Some(("interview_masks", &names[..], "no frame has that name")),
        // Mattes of a movie or sequence may have other names than its frames.
        Frames::Clip(_) => None,
    };
    let poses = [
        ("exemplar_masks", &shoot.poses[..], "no pose has that name"),
        ("exemplars", &[], "a pose is a folder or a movie"),
    ];
    let strays = frames.into_iter().chain(poses).filter_map(|(inside, wanted, why)| {
        let folder = project.shoot_path(inside);
        let wanted: HashSet<&str> = wanted.iter().map(String::as_str).collect();
        let mut names = movies::pictures(&folder).ok()?;
        names.retain(|name| !wanted.contains(stem(name)));
        let verb = if names.len() == 1 { "is" } else { "are" };
        let sentence = format!("{} {verb} left out of {}: {why}", listed(&names), folder.display());
        (!names.is_empty()).then_some(sentence)
    });
    strays.chain(clutter(project)).collect()
}

/// Sentence on the files of systems and file managers beside the pictures.
fn clutter(project: &Project) -> Option<String> {
    let mut found: Vec<PathBuf> = folders(project).iter().flat_map(|folder| clutter_in(folder)).collect();
    found.sort_by(|a, b| natural_order(a, b));
    let root = project.shoot_path("");
    let first = found.first()?;
    let first = first.strip_prefix(&root).unwrap_or(first).display();
    Some(match found.len() {
        1 => format!("1 hidden or system file is left out: {first}"),
        count => format!("{count} hidden or system files are left out, such as {first}"),
    })
}

fn clutter_in(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let names = entries.map(|entry| entry.file_name());
    let names = names.filter(|name| is_clutter(&name.to_string_lossy()));
    names.map(|name| folder.join(name)).collect()
}

/// Folders of the pictures, and those above them within the shoot.
fn folders(project: &Project) -> HashSet<PathBuf> {
    let poses = 0..project.settings.shoot.poses.len();
    let olats = poses.clone().map(|pose| project.first_olat(pose));
    let mattes = poses.map(|pose| project.exemplar_matte(pose)).chain([project.frame_matte(0)]);
    let mattes = mattes.map(|matte| matte.picture().clone());
    let pictures = [project.frame_picture(0)].into_iter().chain(olats).chain(mattes);
    let root = project.shoot_path("");
    let mut folders = HashSet::new();
    for picture in pictures.chain(project.probe_pictures()) {
        let folder = picture_folder(&picture);
        let above = folder.ancestors().skip(1);
        let above = above.take_while(|above| above.starts_with(&root) && **above != *root);
        folders.extend(above.map(Path::to_path_buf));
        folders.insert(folder);
    }
    folders
}

fn picture_folder(picture: &Picture) -> PathBuf {
    match picture {
        Picture::Movie { file, .. } if file.is_dir() => file.clone(),
        picture => picture.file().parent().unwrap_or(Path::new("")).to_path_buf(),
    }
}
