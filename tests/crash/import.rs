//! An import that fails, or that cannot be completed.

use crate::Ground;
use std::os::unix::ffi::OsStrExt;

#[test]
fn an_import_that_fails_leaves_no_project_and_can_be_tried_again() {
    let ground = Ground::of_shoot();
    let import = ["import", "again", "--shoot", "shoot", "--size", "16"];
    let output = ground.run(&[&import[..], &["--lamps", "999"]].concat());
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("999") && !ground.at("again/project.toml").exists(), "{said}");
    ground.succeed(&[&import[..], &["--lamps", "4"]].concat());
    let project = afterlight::project::Project::open(&ground.at("again")).unwrap();
    assert_eq!(project.settings.shoot.lamps.len(), 4);
    test_support::shown!(
        Accidents,
        "An import of more lamps than the shoot has",
        done: "project.toml is written last, once everything has succeeded"
    );
}

#[test]
fn a_shoot_whose_path_is_not_utf_8_is_refused_in_words() {
    let ground = Ground::of_shoot();
    let odd = std::ffi::OsStr::from_bytes(b"caf\xe9");
    std::os::unix::fs::symlink(ground.at("shoot"), ground.folder.path().join(odd)).unwrap();
    // A link is followed; project.toml names the folder itself.
    let mut linked = ground.command(&["import", "linked", "--size", "16", "--shoot"]);
    let output = linked.arg(odd).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    std::fs::remove_file(ground.folder.path().join(odd)).unwrap();
    std::fs::rename(ground.at("shoot"), ground.folder.path().join(odd)).unwrap();
    let mut command = ground.command(&["import", "odd", "--size", "16", "--shoot"]);
    let output = command.arg(odd).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("UTF-8") && !said.contains("bug"), "{said}");
    assert!(!ground.at("odd/project.toml").exists());
}
