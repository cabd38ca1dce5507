//! The badge in the status bar, and its checks.

use super::{SHOOT, Window, click_on, snapshot, until, until_said, window};
use afterlight::calibration::Calibration;
use afterlight::check::{Level, Subject};
use afterlight::footage::LampSettings;
use afterlight::gpu::DeviceChoice;
use afterlight::project::Project;
use afterlight::studio::{Pane, StudioApp, Workspace};
use egui_kittest::kittest::Queryable;
use std::path::Path;

fn opened(project: &Project) -> Window {
    let project = project.clone();
    let mut window = window(|ctx| StudioApp::new(ctx, Some(project), DeviceChoice::Cpu));
    until(&mut window, "report", |app| {
        let read = app.environments().iter().all(|e| e.panorama.is_done());
        read && app.check().report.is_some() && !app.check().is_waiting()
    });
    window
}

/// A project whose calibration has fixed figures, and a lamp that was not seen.
fn doubtful(folder: &Path) -> (Project, Calibration) {
    let (project, mut found) = SHOOT.calibrate(folder, "project");
    found.rig_findings.clear();
    found.rig_faults.clear();
    found.clipped_pixels = 0;
    (found.filled_energy, found.blind_share) = (0.0, 0.02);
    (found.probe_residual, found.uncovered_energy) = (0.09, 0.04);
    for lamp in &mut found.rig.lamps {
        (lamp.confidence, lamp.clipped) = (0.9, 0.0);
    }
    found.rig.lamps[3].confidence = 0.0;
    found.gamma_evidence.cases.truncate(1);
    for interval in &mut found.gamma_evidence.intervals {
        (interval.gamma1, interval.gamma2) = ([2.66, 2.79], [1.96, 2.05]);
    }
    found.save(&project).unwrap();
    (project, found)
}

#[test]
fn nothing_is_claimed_before_the_calibration() {
    let folder = crate::temporary();
    let window = opened(&SHOOT.import(folder.path(), "project"));
    assert_eq!(window.state().check().level(), None);
    assert!(window.query_by_label_contains("Checks: ").is_none());
}

#[test]
fn the_badge_opens_the_checks_and_a_check_leads_to_what_mends_it() {
    let folder = crate::temporary();
    let (project, mut found) = doubtful(folder.path());
    let mut window = opened(&project);
    assert_eq!(window.state().check().level(), Some(Level::Bad));
    // A new light is checked again.
    window.get_by_label("Overcast sky").click();
    until(&mut window, "report of the new light", |app| {
        let report = app.check().report.as_ref().and_then(|r| r.as_ref().ok());
        let names = report.map(|r| r.checks.iter().filter_map(|c| c.environment.as_ref()));
        names.is_some_and(|mut names| names.any(|name| name == "Overcast sky"))
    });
    click_on(&mut window, "Checks: bad");
    assert_eq!(window.state().state().panes.active, Pane::Checks);
    window.get_by_label_contains("do not show 1 of 12 lamps");
    snapshot(&mut window, "studio_checks");
    // The worst finding comes first.
    window.get_all_by_label("Open Probe").next().unwrap().click();
    window.run_steps(3);
    let state = window.state().state();
    assert_eq!((state.panes.workspace, state.panes.active), (Workspace::Calibrate, Pane::Probe));
    // The same words there lead back to the checks.
    until_said(&mut window, "do not show 1 of 12 lamps");
    window.get_by_label_contains("do not show 1 of 12 lamps").click();
    window.run_steps(3);
    assert_eq!(window.state().state().panes.active, Pane::Checks);

    // A calibration that sees the lamp is checked again.
    found.rig.lamps[3].confidence = 0.9;
    found.probe_residual = 0.01;
    found.save(&project).unwrap();
    let worker = window.state().worker().unwrap();
    let done = worker.work("calibrating", |_| Ok("calibrated".to_owned()));
    done.unwrap();
    let seen = |app: &StudioApp| {
        let report = app.check().report.as_ref()?.as_ref().ok()?;
        let checks = report.checks.iter();
        let mut of_lamps = checks.filter(|check| check.subject == Subject::LampsSeen);
        of_lamps.next().map(|check| check.level)
    };
    until(&mut window, "new report", |app| seen(app) == Some(Level::Good));
}

#[test]
fn exchanged_olats_are_put_right_by_a_click() {
    let folder = crate::temporary();
    let (mut project, _) = SHOOT.calibrate(folder.path(), "project");
    let lamps: Vec<String> = project.settings.shoot.all_lamps().cloned().collect();
    let exchange = LampSettings { exchange: vec![[lamps[1].clone(), lamps[6].clone()]], ..LampSettings::default() };
    // As if the files had been exchanged before the shoot was calibrated.
    let calibration = Calibration::load(&project).unwrap();
    exchange.run(&mut project).unwrap();
    project.save().unwrap();
    calibration.save(&project).unwrap();
    let mut window = opened(&project);
    let report = window.state().check().report.as_ref().unwrap().as_ref().unwrap();
    let shading = report.checks.iter().find(|check| check.subject == Subject::Shading).unwrap();
    assert_eq!(shading.correction.as_ref(), Some(&exchange), "{}", shading.sentence);
    // The window numbers the lamps.
    let button = exchange.words().replace("olat_0", "lamp ");
    click_on(&mut window, "Checks: bad");
    click_on(&mut window, &button);
    until(&mut window, "exchange", |app| {
        app.project().is_some_and(|project| project.settings.shoot.corrections.is_empty())
    });
    until_said(&mut window, "Calibrate again");
    let kept = Project::open(&project.root).unwrap();
    assert!(kept.settings.shoot.corrections.is_empty() && !kept.calibration_path().exists());
}
