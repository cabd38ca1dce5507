//! Pages, keys and answers on clips without a network, and on a small shoot.

use super::answers::Answers;
use super::clips::{Clip, Clips};
use super::key::{Key, Shown};
use super::result::name;
use super::*;
use calibration::CalibrateSettings;
use clap::ValueEnum;
use footage::{ImportSettings, PictureSize, import};
use gpu::DeviceChoice;
use std::path::Path;
use virtual_stage::{StageSettings, write_shoot};

/// Two lamps, three methods, clips of two pictures.
fn clips() -> Clips {
    let methods = [Method::Network, Method::Texler, Method::Sun];
    let clip = |i: usize| Clip {
        method: methods[i % 3],
        lamp: [1, 4][i / 3],
        pictures: vec![vec![i as u8, 1, 2], vec![3, i as u8]],
    };
    Clips {
        clips: (0..6).map(clip).collect(),
        references: BTreeMap::from([(1, vec![9]), (4, vec![8, 7])]),
        frames: vec![3, 4],
        seen: 0,
        minutes: BTreeMap::from([("sun".to_owned(), 2.0)]),
    }
}

/// A project with the key of [`clips`], and the page.
fn study(folder: &Path) -> (Project, Key, String) {
    let mut project = Project::without_shoot(folder);
    project.settings.shoot.lamps = (0..5).map(|lamp| format!("olat_{lamp:02}")).collect();
    let (key, html) = page::page(&project, &clips()).unwrap();
    key.save(&project).unwrap();
    (project, key, html)
}

/// File of answers in which `choose` picks one of two clips.
fn answered(key: &Key, person: &str, choose: impl Fn([&Shown; 2]) -> usize) -> String {
    let mut text = format!("{}\n", answers::HEADER);
    for (trial, pair) in &key.trials {
        for question in Question::ALL {
            let chosen = &pair[choose([0, 1].map(|side| &key.clips[&pair[side]]))];
            let (study, question) = (&key.study, question.name());
            text += &format!("{study},{person},{trial},{question},{},{},{chosen},1.25\n", pair[1], pair[0]);
        }
    }
    text
}

fn written(folder: &Path, name: &str, text: &str) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    path
}

#[test]
fn the_page_names_no_method_and_no_lamp_and_loads_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let (_, key, html) = study(folder.path());
    let (again, same) = page::page(
        &{
            let mut project = Project::without_shoot(folder.path());
            project.settings.shoot.lamps = vec!["olat_00".to_owned(); 5];
            project
        },
        &clips(),
    )
    .unwrap();
    assert_eq!((again.study, same), (key.study.clone(), html.clone()));
    // Without the picture data, which may contain any word.
    let mut text = String::new();
    for (i, part) in html.split("base64,").enumerate() {
        let part = if i == 0 { part } else { part.split_once('"').unwrap().1 };
        text += part;
    }
    let text = text.to_lowercase();
    let words: Vec<&str> = text.split(|c: char| !c.is_alphanumeric()).collect();
    for method in Method::value_variants() {
        assert!(!words.contains(&name(*method).as_str()), "{method:?}");
    }
    assert!(!text.contains("olat_") && !text.contains("://"));
    assert_eq!(html.matches("data:image/jpeg").count(), 2 + 12);
    assert!(!text.contains("{{"));
    assert_eq!((key.trials.len(), key.clips.len()), (6, 6));
    for pair in key.trials.values() {
        let [a, b] = [0, 1].map(|side| &key.clips[&pair[side]]);
        assert!(a.lamp == b.lamp && a.method != b.method);
    }
    // Codes do not follow the methods.
    let order: Vec<Method> = key.clips.values().map(|shown| shown.method).collect();
    assert_ne!(order[..3], order[3..]);
}

#[test]
fn answers_are_unblinded_collected_once_and_counted_exactly() {
    let folder = tempfile::tempdir().unwrap();
    let (project, key, _) = study(folder.path());
    let likes = |person: &str, method: Method| {
        let text = answered(&key, person, |pair| usize::from(pair[0].method != method && pair[1].method == method));
        written(folder.path(), &format!("{person}.csv"), &text)
    };
    // Three people always choose the network where it is shown; the fourth always chooses Sun.
    let mut files: Vec<PathBuf> =
        (["ann", "bob", "cy"].into_iter()).map(|person| likes(person, Method::Network)).collect();
    files.push(likes("dee", Method::Sun));
    let report = answers(&project, &files).unwrap();
    assert_eq!((report.new, report.studies.len()), (48, 1));
    let study = &report.studies[0];
    assert_eq!((study.people, study.answers, study.left.of), (4, 48, 48));
    for question in &study.questions {
        let share = |method: Method| {
            let mut all = question.methods.iter();
            all.find(|m| m.method == method).unwrap().share
        };
        // Two lamps, two pairs with the network, four people. For Texler against the network, the fourth chose by code.
        let network = share(Method::Network);
        assert_eq!(network.of, 16);
        assert!((12..=14).contains(&network.chosen), "{network:?}");
        let pair = |methods: [Method; 2]| {
            let mut all = question.pairs.iter();
            all.find(|p| p.methods == methods).unwrap().first
        };
        assert_eq!(pair([Method::Network, Method::Sun]), Share::new(6, 8));
        assert_eq!(question.pairs.len(), 3);
        let sum: u64 = question.methods.iter().map(|m| m.share.chosen).sum();
        assert_eq!(sum, 24);
        assert_eq!([network.low, network.high], exact_interval(network.chosen, 16));
    }
    // The same files again, and then no files: nothing is new, and everything is kept.
    let again = answers(&project, &files[..2]).unwrap();
    assert_eq!((again.new, &again.studies), (0, &report.studies));
    files.iter().for_each(|file| std::fs::remove_file(file).unwrap());
    assert_eq!(answers(&project, &[]).unwrap().studies, report.studies);
    let text = report.sentence();
    for part in ["4 people, 48 answers", "network against sun: 6 of 8 (75.0 %", "looks better?"] {
        assert!(text.contains(part), "{text}");
    }
    let json = serde_json::to_value(&report).unwrap();
    assert_eq!(json["studies"][0]["questions"][0]["question"], "like");
    assert_eq!(json["studies"][0]["questions"][1]["methods"][0]["method"], "network");
    assert!(json["studies"][0]["left"]["low"].is_f64());
}

#[test]
fn hostile_answers_are_refused_in_sentences_and_change_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let (project, key, _) = study(folder.path());
    let good = answered(&key, "ann", |_| 0);
    answers(&project, &[written(folder.path(), "good.csv", &good)]).unwrap();
    let collected = std::fs::read(Answers::path(&project)).unwrap();
    let lines: Vec<&str> = good.lines().collect();
    let with = |line: &str| format!("{}\n{line}\n", answers::HEADER);
    let fields: Vec<&str> = lines[1].split(',').collect();
    let changed = |field: usize, value: &str| {
        let mut fields = fields.clone();
        fields[1] = "eve";
        fields[field] = value;
        with(&fields.join(","))
    };
    let other = key.clips.keys().find(|c| **c != fields[4] && **c != fields[5]).unwrap();
    let cases = [
        (String::new(), "its first line is \"\""),
        ("<html>\n".to_owned(), "its first line is \"<html>\""),
        (with("a,b"), "line 2: expected 8 values between commas, found 2"),
        (with(&"x,".repeat(100_000)), "found 100001"),
        (changed(0, "../../../etc/passwd"), "study is \"../../../etc/passwd\""),
        (changed(0, "0123456789abcdef"), "which"),
        (changed(1, "=cmd|' /C calc'!A0"), "person is"),
        (changed(1, &"p".repeat(33)), "up to 32 small letters"),
        (changed(2, "t99"), "the study has no trial t99"),
        (changed(3, "best"), "neither like nor better"),
        (changed(4, other), "compares"),
        (changed(4, fields[5]), "compares"),
        (changed(6, other), "which is neither"),
        (changed(7, "NaN"), "seconds is \"NaN\""),
        (changed(7, "-1"), "seconds is \"-1\""),
        (
            // The same person chose the other clip.
            with(&lines[1].replace(
                &format!(",{},1.25", fields[6]),
                &format!(",{},1.25", if fields[6] == fields[4] { fields[5] } else { fields[4] }),
            )),
            "elsewhere",
        ),
    ];
    for (text, part) in cases {
        let file = written(folder.path(), "bad.csv", &text);
        let refused = answers(&project, &[file]).unwrap_err().to_string();
        assert!(refused.contains(part) && refused.contains("bad.csv"), "{refused}");
        assert!(refused.len() < 1000 && !refused.contains('\n'), "{refused}");
    }
    let bytes = folder.path().join("bytes.csv");
    std::fs::write(&bytes, [0xff, 0xfe, 0, 1]).unwrap();
    assert!(answers(&project, &[bytes]).is_err());
    assert!(answers(&project, &[folder.path().join("gone.csv")]).is_err());
    // One bad line: nothing from the file is added.
    let mixed = written(folder.path(), "mixed.csv", &(answered(&key, "eve", |_| 1) + "x\n"));
    assert!(answers(&project, &[mixed]).is_err());
    assert_eq!(std::fs::read(Answers::path(&project)).unwrap(), collected);
    // Windows line ends and a byte order mark.
    let dos = format!("\u{feff}{}", answered(&key, "dan", |_| 1).replace('\n', "\r\n"));
    assert_eq!(answers(&project, &[written(folder.path(), "dos.csv", &dos)]).unwrap().new, 12);
    // A key that was edited by hand.
    let path = Key::path(&project, &key.study);
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::write(&path, text.replacen("sun", "network", 1)).unwrap();
    let refused = answers(&project, &[]).unwrap_err().to_string();
    assert!(refused.contains("checksum"), "{refused}");
    test_support::shown!(
        Strangers,
        "A file of answers to a blind comparison comes back damaged, made up or contradicting itself",
        done: "names are letters and digits, and each line must be a possible answer; otherwise the whole file is refused",
    );
}

#[test]
fn a_small_shoot_gives_a_page_of_methods_without_a_network() {
    let folder = tempfile::tempdir().unwrap();
    let (shoot, silent) = (folder.path().join("shoot"), Progress::silent());
    let stage = StageSettings { frames: 4, size: 32, lamps: 6, ..StageSettings::default() };
    write_shoot(&shoot, &stage, &silent).unwrap();
    let settings = ImportSettings { size: 32, seed: 0, layer: None };
    let mut project = import(&folder.path().join("p"), &shoot, &settings, &silent).unwrap();
    let found = calibration::calibrate(&mut project, &CalibrateSettings::default(), &silent);
    found.unwrap().save(&project).unwrap();
    let settings = |methods: &[Method]| BlindSettings {
        page: None,
        methods: methods.to_vec(),
        lamps: None,
        conditions: 2,
        frames: 3,
        minutes: None,
        at: PictureSize::Square,
        device: DeviceChoice::Cpu,
    };
    let methods = [Method::Nearest, Method::Ratio, Method::Nearest];
    let report = blind(&project, &settings(&methods), &silent).unwrap();
    assert_eq!((report.methods.len(), report.pairs, report.frames), (2, 2, 3));
    let html = std::fs::read_to_string(&report.page).unwrap();
    assert_eq!(html.len() as u64, report.bytes);
    assert_eq!(html.matches("data:image/jpeg").count(), 2 + 2 * 2 * 3);
    assert!(report.key.exists() && report.page.starts_with(&project.root));
    assert!(report.sentence().contains("nearest, ratio"));

    let one = blind(&project, &settings(&[Method::Ratio; 2]), &silent).unwrap_err();
    assert!(one.to_string().contains("needs two methods"), "{one}");
    let none = answers(&project, &[]).unwrap_err().to_string();
    assert!(none.contains("no answers yet"), "{none}");
    let mut wrong = settings(&methods);
    wrong.lamps = Some(vec!["olat_99".to_owned()]);
    let wrong = blind(&project, &wrong, &silent).unwrap_err().to_string();
    assert!(wrong.contains("no lamp olat_99") && wrong.contains("olat_00"), "{wrong}");
}
