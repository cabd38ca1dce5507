use super::*;

#[test]
fn the_way_between_folders_is_relative() {
    let base = tempfile::tempdir().unwrap();
    let (a, b) = (base.path().join("films/a"), base.path().join("shoots/b"));
    std::fs::create_dir_all(&a).unwrap();
    std::fs::create_dir_all(&b).unwrap();
    assert_eq!(relative(&a, &b).unwrap(), Path::new("../../shoots/b"));
}

/// A project with a shoot of two frames and a pose, all of them empty files.
fn project(base: &Path) -> Project {
    let shoot = base.join("shoot");
    for file in ["interview/f0.png", "interview/f1.png", "exemplar_masks/pose.png"] {
        let path = shoot.join(file);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, "").unwrap();
    }
    std::fs::create_dir_all(base.join("film")).unwrap();
    let mut project = Project::without_shoot(&base.join("film"));
    let shoot = &mut project.settings.shoot;
    shoot.folder = "../shoot".into();
    shoot.poses = vec!["pose".into()];
    shoot.frames = vec!["f0".into(), "f1".into()].into();
    project.save().unwrap();
    project
}

#[test]
fn a_moved_shoot_is_named_and_found_again_but_another_is_refused() {
    let base = tempfile::tempdir().unwrap();
    let mut project = project(base.path());
    project.check_shoot().unwrap();
    let moved = base.path().join("elsewhere/shoot");
    std::fs::create_dir_all(base.path().join("elsewhere")).unwrap();
    std::fs::rename(base.path().join("shoot"), &moved).unwrap();
    let sentence = project.check_shoot().unwrap_err().to_string();
    assert!(
        sentence.contains("/shoot is missing")
            && !sentence.contains("..")
            && sentence.contains("choose its new folder"),
        "{sentence}"
    );

    let before = project.clone();
    let refused = project.locate(base.path()).unwrap_err().to_string();
    assert!(refused.contains("f0.png"), "{refused}");
    assert_eq!((&project, &Project::open(&project.root).unwrap()), (&before, &before));
    Project::change(&project.root, |project| project.locate(&moved)).unwrap();
    Project::open(&project.root).unwrap().check_shoot().unwrap();
}

#[test]
fn another_framing_puts_aside_what_was_made_under_the_old_one() {
    let base = tempfile::tempdir().unwrap();
    let project = project(base.path());
    let frame = |x| {
        let framing = Framing { x, ..Framing::largest((40, 30)) };
        Project::change(&project.root, |project| project.frame(framing))
    };
    assert_eq!(frame(-3).unwrap(), None, "there are no results yet");
    for n in 1..=2 {
        std::fs::write(project.calibration_path(), n.to_string()).unwrap();
        std::fs::create_dir_all(project.checkpoint_path()).unwrap();
        std::fs::write(project.checkpoint_path().join("w"), n.to_string()).unwrap();
        let same = if n == 1 { -3 } else { n - 1 };
        assert_eq!(frame(same).unwrap(), None);
        assert!(project.calibration_path().exists(), "the same framing changes nothing");
        let aside = frame(n).unwrap().unwrap();
        assert!(aside.ends_with(format!("aside-{n}")));
        for file in ["calibration.toml", "checkpoint/w"] {
            let kept = std::fs::read_to_string(aside.join(file)).unwrap();
            assert_eq!(kept, n.to_string());
            assert!(!project.root.join(file).exists());
        }
    }
    let read = Project::open(&project.root).unwrap();
    assert_eq!(read.settings.framing.for_size((40, 30)).x, 2);
    assert!(frame(40).is_err());
}

#[cfg(unix)]
#[test]
fn a_path_that_is_not_utf_8_is_named_and_is_no_bug() {
    use std::os::unix::ffi::OsStrExt;
    let base = tempfile::tempdir().unwrap();
    let mut project = project(base.path());
    let before = std::fs::read(project.root.join("project.toml")).unwrap();
    let odd = Path::new(std::ffi::OsStr::from_bytes(b"../caf\xe9"));
    project.settings.shoot.folder = odd.to_path_buf();
    let shoot = project.save().unwrap_err().to_string();
    project.settings.shoot.folder = "../shoot".into();
    project.add_environment(odd, None);
    let environment = project.save().unwrap_err().to_string();
    for said in [shoot, environment] {
        assert!(said.contains("caf") && said.contains("UTF-8") && !said.contains("bug"), "{said}");
    }
    assert_eq!(std::fs::read(project.root.join("project.toml")).unwrap(), before);
    test_support::shown!(
        Surroundings,
        "A path that is not UTF-8",
        done: "the path is refused with a sentence; the project is unchanged"
    );
}
