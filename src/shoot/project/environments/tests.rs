use super::*;
use light::conventions::Tool;

/// A saved project beside its shoot, both in `folder`.
fn project(folder: &Path) -> Project {
    let root = folder.join("film");
    let shoot = folder.join("shoot");
    std::fs::create_dir_all(shoot.join("hdri")).unwrap();
    std::fs::create_dir_all(&root).unwrap();
    for file in ["shoot/hdri/sky.hdr", "film/own.hdr", "far.hdr", "nave.hdr"] {
        std::fs::write(folder.join(file), file).unwrap();
    }
    let mut project = Project::without_shoot(&root);
    project.settings.shoot.folder = "../shoot".into();
    project.settings.shoot.environments =
        vec![NamedEnvironment { name: "sky".into(), file: "hdri/sky.hdr".into(), front: None }];
    project.save().unwrap();
    project
}

#[test]
fn what_was_added_and_which_way_is_front_are_remembered_over_reopening() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path().canonicalize().unwrap();
    let root = project(&at).root;
    std::fs::write(at.join("shoot/hdri/noon.hdr"), "").unwrap();
    let front = Some(Front::from_tool(Tool::Blender));
    Project::change(&root, |project| {
        let change = EnvironmentChange {
            add: ["film/own.hdr", "shoot/hdri/noon.hdr", "far.hdr"].map(|file| at.join(file)).into(),
            front,
            of: vec!["sky".into()],
            ..EnvironmentChange::default()
        };
        project.apply(&change)
    })
    .unwrap();
    let project = Project::open(&root).unwrap();
    let files: Vec<&Path> = (project.settings.environments.iter()).map(|e| e.file.as_path()).collect();
    let far = at.join("far.hdr");
    assert_eq!(files, [Path::new("own.hdr"), Path::new("../shoot/hdri/noon.hdr"), &far]);
    let known = project.environments();
    assert_eq!(known.len(), 4);
    for known in &known {
        assert_eq!((known.front, known.missing), (front, false), "{known:?}");
    }
    // The project and its shoot are found after a move.
    let moved = tempfile::tempdir().unwrap();
    for part in ["film", "shoot"] {
        std::fs::rename(at.join(part), moved.path().join(part)).unwrap();
    }
    let moved = Project::open(&moved.path().join("film")).unwrap();
    assert!(moved.environments().iter().all(|known| !known.missing));
}

#[test]
fn a_file_is_listed_once_under_a_name_of_its_own() {
    let folder = tempfile::tempdir().unwrap();
    let mut project = project(folder.path());
    let (far, front) = (folder.path().join("far.hdr"), Front::new(90.0));
    project.add_environment(&far, Some(front));
    // Another path to the same file, without a front this time.
    project.add_environment(&folder.path().join("film/../far.hdr"), None);
    project.add_environment(&folder.path().join("shoot/hdri/sky.hdr"), None);
    assert_eq!(project.settings.environments.len(), 1);
    assert_eq!(project.environment(&far).unwrap().front, Some(front));
    // A taken name, or that of a built-in environment, would hide the other.
    std::fs::create_dir(folder.path().join("more")).unwrap();
    for file in ["more/far.hdr", "nave.hdr"] {
        std::fs::write(folder.path().join(file), "").unwrap();
        project.add_environment(&folder.path().join(file), None);
    }
    let names: Vec<&str> = (project.settings.environments.iter()).map(|e| e.name.as_str()).collect();
    assert_eq!(names, ["far", "far 2", "nave 2"]);
}

#[test]
fn added_environments_are_removed_and_those_of_the_shoot_stay() {
    let folder = tempfile::tempdir().unwrap();
    let mut project = project(folder.path());
    project.add_environment(&folder.path().join("far.hdr"), None);
    assert_eq!(project.environments().len(), 2);
    project.remove_environment(Path::new("far")).unwrap();
    assert_eq!(project.environments().len(), 1);
    for (name, says) in [("sky", "shoot's"), ("far", "only sky")] {
        let error = project.remove_environment(Path::new(name)).unwrap_err();
        assert!(error.to_string().contains(says), "{error}");
    }
    assert!(folder.path().join("far.hdr").exists());
}

#[test]
fn a_missing_file_is_named_and_its_entry_stays() {
    let folder = tempfile::tempdir().unwrap();
    let root = project(folder.path()).root;
    let far = folder.path().join("far.hdr");
    Project::change(&root, |project| {
        project.add_environment(&far, None);
        Ok(())
    })
    .unwrap();
    std::fs::remove_file(&far).unwrap();
    let known = Project::open(&root).unwrap().environments();
    let complaints: Vec<String> = known.iter().filter_map(|e| e.complaint()).collect();
    assert_eq!((known.len(), complaints.len()), (2, 1));
    assert!(complaints[0].contains("far.hdr") && complaints[0].contains("stays"), "{complaints:?}");
    let change = EnvironmentChange { add: vec![far], ..EnvironmentChange::default() };
    let refused = Project::change(&root, |project| project.apply(&change)).unwrap_err();
    assert!(refused.to_string().contains("far.hdr"), "{refused}");
}

#[test]
fn changes_from_many_sides_are_all_kept() {
    let folder = tempfile::tempdir().unwrap();
    let root = project(folder.path()).root;
    std::thread::scope(|scope| {
        for i in 0..8 {
            let (root, folder) = (&root, folder.path());
            scope.spawn(move || {
                let file = folder.join(format!("{i}.hdr"));
                Project::change(root, |project| {
                    project.add_environment(&file, None);
                    Ok(())
                })
                .unwrap();
            });
        }
    });
    assert_eq!(Project::open(&root).unwrap().settings.environments.len(), 8);
}

#[test]
fn a_project_from_before_there_were_added_environments_is_read_and_stays_as_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let project = project(folder.path());
    let file = project.root.join("project.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    assert!(!text.contains("front") && text.matches("environments").count() == 1);
    Project::change(&project.root, |_| Ok(())).unwrap();
    assert_eq!(Project::open(&project.root).unwrap(), project);
    let broken = text.replace("file = \"hdri/sky.hdr\"", "file = \"a.hdr\"\nfront = nan");
    std::fs::write(&file, broken).unwrap();
    let front = Project::open(&project.root).unwrap().environments()[0].front;
    assert_eq!(front.unwrap().yaw_deg(), 0.0);
}
