//! Corrections of a shoot's lamps.

use super::*;
use crate::{Exemplar, ImportSettings, import};
use base::progress::Progress;
use imaging::Response;
use project::Picture;
use std::path::Path;
use virtual_stage::{StageSettings, write_shoot};

/// A project of a stage with three poses, and its folder.
fn staged(folder: &Path, before: impl FnOnce(&Path)) -> Result<Project> {
    let shoot = folder.join("shoot");
    let stage = StageSettings { frames: 2, size: 32, lamps: 8, poses: 3, ..StageSettings::default() };
    write_shoot(&shoot, &stage, &Progress::silent())?;
    before(&shoot);
    let settings = ImportSettings { size: 32, seed: 1, layer: None };
    import(&folder.join("project"), &shoot, &settings, &Progress::silent())
}

fn names(project: &Project) -> Vec<String> {
    project.settings.shoot.all_lamps().cloned().collect()
}

fn file(picture: &Picture) -> String {
    picture.file().file_stem().unwrap().to_string_lossy().into_owned()
}

/// Files of a pose's OLATs, by lamp.
fn files(project: &Project, pose: usize) -> Vec<String> {
    let lamps = 0..project.settings.shoot.all_lamps().len();
    lamps.map(|lamp| file(&project.olat_picture(pose, lamp))).collect()
}

#[test]
fn an_exchange_undoes_itself_and_a_shift_is_undone_by_the_other() -> Result<()> {
    let folder = tempfile::tempdir().unwrap();
    let mut project = staged(folder.path(), |_| ())?;
    let (before, lamps) = (project.clone(), names(&project));
    let [pose, a, b] = ["pose01", &lamps[2], &lamps[5]].map(str::to_owned);
    let exchange =
        LampSettings { exchange: vec![[a.clone(), b.clone()]], pose: vec![pose.clone()], ..LampSettings::default() };
    exchange.run(&mut project)?;
    let mut exchanged = lamps.clone();
    exchanged.swap(2, 5);
    assert_eq!(files(&project, 1), exchanged);
    assert_eq!(files(&project, 0), lamps);
    assert_eq!(Project::open(&project.root)?, before);
    project.save()?;
    assert_eq!(Project::open(&project.root)?, project);
    exchange.run(&mut project)?;
    assert_eq!(project, before);

    let shift = |from: &String, to: &String| LampSettings {
        shift: Some([from.clone(), to.clone()]),
        ..LampSettings::default()
    };
    shift(&a, &b).run(&mut project)?;
    let mut shifted = lamps.clone();
    shifted[2..=5].rotate_right(1);
    assert_eq!(files(&project, 0), shifted);
    assert_eq!(files(&project, 2), shifted);
    shift(&b, &a).run(&mut project)?;
    assert_eq!(project, before);
    Ok(())
}

#[test]
fn a_lamp_left_out_of_a_pose_is_a_sum_of_its_others_and_one_left_out_of_all_is_gone() -> Result<()> {
    let folder = tempfile::tempdir().unwrap();
    let mut project = staged(folder.path(), |_| ())?;
    let lamps = names(&project);
    let whole = Exemplar::load(&project, &Response::Srgb, 1)?;
    let leave_out = |pose: &[&str]| LampSettings {
        leave_out: vec![lamps[3].clone()],
        pose: pose.iter().map(|pose| (*pose).to_owned()).collect(),
        ..LampSettings::default()
    };
    leave_out(&["pose01"]).run(&mut project)?;
    let lacking = Exemplar::load(&project, &Response::Srgb, 1)?;
    assert_eq!((lacking.missing, lacking.olats.len()), (vec![3], 8));
    for lamp in (0..8).filter(|&lamp| lamp != 3) {
        assert_eq!(lacking.olats[lamp], whole.olats[lamp]);
    }
    // Nearer to the truth than every single OLAT of the pose.
    let apart = |olat: &imaging::Image| -> f32 {
        let pairs = olat.pixels.iter().zip(&whole.olats[3].pixels);
        pairs.flat_map(|(a, b)| (0..3).map(|c| (a[c] - b[c]).powi(2))).sum()
    };
    let others = (0..8).filter(|&lamp| lamp != 3).map(|lamp| apart(&whole.olats[lamp]));
    let nearest = others.fold(f32::INFINITY, f32::min);
    assert!(apart(&lacking.olats[3]) < 0.8 * nearest, "{} {nearest}", apart(&lacking.olats[3]));

    leave_out(&["pose00", "pose02"]).run(&mut project)?;
    assert_eq!(names(&project).len(), 7);
    assert!(!names(&project).contains(&lamps[3]));
    assert!(project.settings.shoot.corrections.is_empty());
    assert_eq!(project.settings.shoot.lamp_layout.len(), 7);
    let refused = leave_out(&[]).run(&mut project).unwrap_err().to_string();
    assert!(refused.contains(&lamps[3]), "{refused}");
    Ok(())
}

#[test]
fn a_shoot_whose_pose_lacks_an_olat_is_imported() -> Result<()> {
    let folder = tempfile::tempdir().unwrap();
    let mut project = staged(folder.path(), |shoot| {
        std::fs::remove_file(shoot.join("exemplars/pose02/olat_05.png")).unwrap();
        assert!(crate::scan::scan(shoot, None).is_complete());
    })?;
    assert_eq!(project.pose_lamps(2), [0, 1, 2, 3, 4, 6, 7]);
    assert_eq!(Exemplar::load(&project, &Response::Srgb, 2)?.missing, [5]);
    // The gap moves with the file.
    let exchange = LampSettings {
        exchange: vec![["olat_05".into(), "olat_00".into()]],
        pose: vec!["pose02".into()],
        ..LampSettings::default()
    };
    exchange.run(&mut project)?;
    assert_eq!(project.pose_lamps(2), [1, 2, 3, 4, 5, 6, 7]);
    assert_eq!(file(&project.first_olat(2)), "olat_01");
    Ok(())
}

#[test]
fn balls_are_mirrored_and_back() -> Result<()> {
    let folder = tempfile::tempdir().unwrap();
    let mut project = staged(folder.path(), |_| ())?;
    let before = project.clone();
    let read = |project: &Project| crate::read_picture(&project.lamp_probe_picture(1));
    let plain = read(&project)?.0;
    let mirror = LampSettings { mirror_balls: Some(Axis::LeftRight), ..LampSettings::default() };
    mirror.run(&mut project)?;
    let mirrored = read(&project)?.0;
    let last = plain.width - 1;
    assert!((0..plain.width).all(|x| mirrored.at(x, 7) == plain.at(last - x, 7)));
    project.save()?;
    assert_eq!(Project::open(&project.root)?, project);
    mirror.run(&mut project)?;
    assert_eq!(project, before);
    Ok(())
}
