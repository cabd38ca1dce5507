//! One line for each kind of a shoot's pictures: format, depth, colour and turn, as the reader takes them.

use super::framed::about;
use base::error::Result;
use movies::Source;
use project::{Matte, Picture, Project};
use rayon::prelude::*;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt;

/// Most pictures of a kind whose headers are read; of more, evenly spaced ones.
const MOST_READ: usize = 1000;

/// Pictures of one kind, as their files describe them.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Understood {
    /// Kind, such as `Interview`.
    pub kind: &'static str,
    /// Number of pictures.
    pub count: usize,
    /// Format, depth, colour and turn of most of them.
    pub content: String,
    /// Number of pictures that differ, and one of them with its content; None if all agree.
    pub differing: Option<(usize, String)>,
}

impl fmt::Display for Understood {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { kind, count, content, differing } = self;
        write!(f, "{kind}: {count} {content}")?;
        match differing {
            Some((some, example)) => write!(f, "; {some} of {count} differ: {example}"),
            None => Ok(()),
        }
    }
}

/// Reads the headers of interview, OLATs, mirror balls, mattes and environments. Unreadable pictures are left out, and
/// kinds without pictures; of more than a thousand of a kind, evenly spaced ones are read.
pub fn understood(project: &Project) -> Vec<Understood> {
    let shoot = &project.settings.shoot;
    let (frames, poses) = (shoot.frames.len(), shoot.poses.len());
    let lamps = shoot.all_lamps().len();
    let mut balls = project.probe_pictures();
    if let Some(second) = &shoot.second_ball {
        balls.extend((0..lamps).map(|lamp| project.second_probe_picture(second, lamp)));
    }
    let matte = |i: usize| {
        let is_frame = i < frames;
        match if is_frame { project.frame_matte(i) } else { project.exemplar_matte(i - frames) } {
            Matte::Grey(picture) => Some(picture),
            // In the line of its picture.
            Matte::Alpha(_) => None,
        }
    };
    let environments = &shoot.environments;
    let environment = |i: usize| Picture::File(project.shoot_path(&environments[i].file));
    let kinds = [
        kind_summary("Interview", frames, |i| Some(project.frame_picture(i))),
        kind_summary("OLATs", poses * lamps, |i| {
            let (pose, lamp) = (i / lamps, i % lamps);
            project.has_olat(pose, lamp).then(|| project.olat_picture(pose, lamp))
        }),
        kind_summary("Balls", balls.len(), |i| Some(balls[i].clone())),
        kind_summary("Mattes", frames + poses, matte),
        kind_summary("Environments", environments.len(), |i| Some(environment(i))),
    ];
    kinds.into_iter().flatten().collect()
}

fn kind_summary(
    kind: &'static str,
    count: usize,
    picture: impl Fn(usize) -> Option<Picture> + Sync,
) -> Option<Understood> {
    let step = count.div_ceil(MOST_READ).max(1);
    let read: Vec<(Picture, String)> = (0..count)
        .into_par_iter()
        .step_by(step)
        .filter_map(|i| {
            let picture = picture(i)?;
            let content = content(&picture).ok()?;
            Some((picture, content))
        })
        .collect();
    let mut sums = BTreeMap::<&str, usize>::new();
    read.iter().for_each(|(_, content)| *sums.entry(content).or_default() += 1);
    let (&content, _) = sums.iter().max_by_key(|(_, count)| **count)?;
    let others = || read.iter().filter(|(_, other)| other != content);
    let differing = others().next().map(|(picture, other)| {
        let name = picture.file().file_name().unwrap_or_default().to_string_lossy().into_owned();
        let name = match picture {
            Picture::File(_) | Picture::Mirrored(..) => name,
            Picture::Movie { frame, .. } => format!("frame {frame} of {name}"),
        };
        (others().count() * step, format!("{name} is {other}"))
    });
    let count = if step == 1 { read.len() } else { count };
    Some(Understood { kind, count, content: content.to_owned(), differing })
}

/// A picture's description.
fn content(picture: &Picture) -> Result<String> {
    Ok(match about(picture)? {
        Some(about) => about.sentence(),
        None => match &*movies::open(picture.file())? {
            Source::Movie(movie) => format!("frames of a movie, {}", movie.info().codec),
            Source::Sequence(_) => "DPX".to_owned(),
        },
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ImportSettings, import};
    use base::progress::Progress;
    use imaging::file;
    use virtual_stage::{StageSettings, write_shoot};

    #[test]
    fn each_kind_has_a_line_and_files_that_differ_are_counted() {
        let folder = tempfile::tempdir().unwrap();
        let (shoot, silent) = (folder.path().join("shoot"), Progress::silent());
        let stage = StageSettings { frames: 3, size: 16, lamps: 4, ..StageSettings::default() };
        write_shoot(&shoot, &stage, &silent).unwrap();
        let png = shoot.join("probes/olat_01.png");
        let light = file::read_linear(&png).unwrap();
        file::write_exr(&png.with_extension("exr"), &light).unwrap();
        std::fs::remove_file(png).unwrap();
        let settings = ImportSettings { size: 16, seed: 1, layer: None };
        let project = import(&folder.path().join("project"), &shoot, &settings, &silent).unwrap();
        let lines: Vec<String> = understood(&project).iter().map(ToString::to_string).collect();
        let poses = project.settings.shoot.poses.len();
        for line in [
            "Interview: 3 PNG, 8 bits, curve not named".to_owned(),
            format!("OLATs: {} PNG, 8 bits, curve not named", 4 * poses),
            "Balls: 5 PNG, 8 bits, curve not named; 1 of 5 differ: olat_01.exr is EXR, 16 bits, scene-linear"
                .to_owned(),
            format!("Mattes: {} PNG, 8 bits, curve not named", 3 + poses),
        ] {
            assert!(lines.contains(&line), "{line}: {lines:#?}");
        }
    }
}
