//! Networks trained on a farm, and their way back into the project.

use crate::job::Ground;
use crate::program::{fail, succeed};
use serde_json::Value;
use test_support::shown;

#[test]
fn a_network_that_was_trained_elsewhere_comes_home_and_the_present_one_is_kept() {
    let ground = Ground::new();
    let write = "farm-train;my film;--epochs;3;--device;cpu;--set;width=8;--set;most-channels=16;--engine;slurm;--to;a job;--json";
    let written = succeed(ground.path(), &write.split(';').collect::<Vec<_>>());
    assert_eq!(written["tasks"], 1);
    let before = succeed(ground.path(), &["checkpoints", "my film", "--json"]);
    let trained = succeed(ground.path(), &["farm-chunk", "a job", "--task", "0", "--json"]);
    assert!(trained["steps"].as_u64() > before["present"]["step"].as_u64());
    // The artist's own project is unchanged.
    assert_eq!(succeed(ground.path(), &["checkpoints", "my film", "--json"]), before);
    // A worker with a repeated task has nothing left to do.
    let again = succeed(ground.path(), &["farm-chunk", "a job", "--task", "0", "--json"]);
    assert_eq!(again["steps"], trained["steps"]);
    let said = fail(ground.path(), &["farm-chunk", "a job", "--task", "1"]);
    assert!(said.contains("no training 1"), "{said}");
    // A task stays inside its job.
    let job = ground.at("a job/job.json");
    let whole = std::fs::read_to_string(&job).unwrap();
    let mut astray: Value = serde_json::from_str(&whole).unwrap();
    astray["work"]["train"][0]["folder"] = "../my film".into();
    std::fs::write(&job, astray.to_string()).unwrap();
    let said = fail(ground.path(), &["farm-chunk", "a job", "--task", "0"]);
    assert!(said.contains("is not in the job"), "{said}");
    std::fs::write(&job, whole).unwrap();

    let entries = std::fs::read_dir(ground.at("a job/projects")).unwrap();
    let copies: Vec<String> = entries.map(|e| e.unwrap().path().display().to_string()).collect();
    let adopt = ["checkpoints", "my film", "--adopt", &copies[0], "--json"];
    let adopted = succeed(ground.path(), &adopt);
    assert_eq!(adopted["info"]["step"], trained["steps"]);
    assert_eq!(adopted["optimizer"], true);
    let list = succeed(ground.path(), &["checkpoints", "my film", "--json"]);
    assert_eq!(list["present"]["step"], trained["steps"]);
    let kept = list["kept"].as_array().unwrap();
    let aside = kept.iter().find(|kept| kept["aside"] == true).unwrap();
    assert_eq!(aside["info"]["step"], before["present"]["step"]);
    // A second adoption changes nothing.
    succeed(ground.path(), &adopt);
    assert_eq!(succeed(ground.path(), &["checkpoints", "my film", "--json"]), list);

    // A network of another calibration, size or set of lamps does not fit this project.
    succeed(ground.path(), &["calibrate", "my film", "--gamma", "srgb", "--json"]);
    let said = fail(ground.path(), &adopt[..4]);
    assert!(said.contains("its calibration differs"), "{said}");
    for (name, more, what) in
        [("small", &["--size", "32"][..], "its size"), ("few", &["--size", "64", "--lamps", "4"], "its lamps")]
    {
        let import = ["import", name, "--shoot", "shoot", "--json"];
        succeed(ground.path(), &[&import[..], more].concat());
        let said = fail(ground.path(), &["checkpoints", name, "--adopt", &copies[0]]);
        assert!(said.contains(&format!("{what} differs")), "{said}");
    }
    shown!(Accidents, "A network trained on a farm is adopted",
        done: "size, lamps, shoot, framing and calibration are compared; the present checkpoint is set aside");
}

#[test]
fn a_rung_that_a_farm_trained_comes_home_with_its_own_shape_of_network() {
    let ground = Ground::new();
    let write = "farm-train;my film;--epochs;1;--device;cpu;--rung;width=16;--rung;width=16,most-channels=32;--engine;openjd;--to;\
                 rungs;--json";
    let written = succeed(ground.path(), &write.split(';').collect::<Vec<_>>());
    assert_eq!(written["tasks"], 2);
    let job: Value = serde_json::from_slice(&ground.read("rungs/job.json")).unwrap();
    let tasks = job["work"]["train"].as_array().unwrap();
    let names: Vec<&str> = tasks.iter().map(|t| t["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["virtual stage width=16", "virtual stage width=16,most-channels=32"]);
    let shape = |checkpoints: &Value| checkpoints["present"]["network"].clone();
    let list = || succeed(ground.path(), &["checkpoints", "my film", "--json"]);
    let before = list();
    let trained = succeed(ground.path(), &["farm-chunk", "rungs", "--task", "1", "--json"]);
    assert_eq!(list(), before);
    let copy = format!("rungs/{}", tasks[1]["folder"].as_str().unwrap());
    let adopted = succeed(ground.path(), &["checkpoints", "my film", "--adopt", &copy, "--json"]);
    assert_eq!(adopted["info"]["step"], trained["steps"]);
    let after = list();
    assert_ne!(shape(&after), shape(&before));
    // The adopted network relights, and the one before can be restored.
    let relight = "relight;my film;--environment;nave;--device;cpu;--frames;0;--to;rung.png;--json";
    succeed(ground.path(), &relight.split(';').collect::<Vec<_>>());
    let kept = after["kept"].as_array().unwrap();
    let aside = kept.iter().find(|kept| kept["aside"] == true).unwrap();
    let name = aside["name"].as_str().unwrap();
    succeed(ground.path(), &["checkpoints", "my film", "--back-to", name, "--json"]);
    assert_eq!(shape(&list()), shape(&before));
    // A task that has not run has nothing to adopt.
    let other = format!("rungs/{}", tasks[0]["folder"].as_str().unwrap());
    let said = fail(ground.path(), &["checkpoints", "my film", "--adopt", &other]);
    assert!(said.contains("rungs"), "{said}");
    // An impossible network shape is refused before anything is written.
    let odd = "farm-train;my film;--rung;width=12;--engine;slurm;--to;odd";
    let said = fail(ground.path(), &odd.split(';').collect::<Vec<_>>());
    assert!(said.contains("multiples of 8"), "{said}");
    assert!(!ground.at("odd").exists());
}
