//! The packages' metadata agrees with the program, and a version has its own release notes.
#![cfg(target_os = "linux")]

use afterlight::project::Project;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn read(name: &str) -> String {
    std::fs::read_to_string(root().join(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// The strings between `before` and `after` in a text, in order.
fn between<'a>(text: &'a str, before: &str, after: &str) -> Vec<&'a str> {
    let parts = text.split(before).skip(1);
    parts.filter_map(|part| part.split(after).next()).collect()
}

#[test]
fn icons_have_the_size_that_their_folder_says() {
    let table = read("Cargo.toml");
    let icons = between(&table, "[\"assets/icon/", "\"]");
    let mut sizes = 0;
    for icon in icons {
        let (file, rest) = icon.split_once("\", \"").unwrap();
        let path = root().join("assets/icon").join(file);
        if file.ends_with(".svg") {
            assert!(path.exists(), "{file}");
            continue;
        }
        let folder = between(rest, "hicolor/", "/apps").pop().unwrap();
        let (width, height) = image::image_dimensions(&path).unwrap();
        assert_eq!(folder, format!("{width}x{height}"), "{file}");
        sizes += 1;
    }
    assert_eq!(sizes, 8);
}

#[test]
fn what_is_packed_is_there() {
    let table = read("Cargo.toml");
    let assets = between(&table, "assets = [\n", "\n]\n").pop().unwrap();
    for line in assets.lines() {
        let file = between(line, "[\"", "\"").pop().unwrap();
        if file.starts_with("target/") {
            continue;
        }
        let folder = root().join(file.split('*').next().unwrap());
        assert!(folder.exists(), "{file}");
    }
}

/// All files that dist packs for each system exist, and its features are those of the Debian package.
#[test]
fn the_archives_of_each_system_are_built_of_what_there_is() {
    let dist: toml::Table = read("dist-workspace.toml").parse().unwrap();
    let cargo: toml::Table = read("Cargo.toml").parse().unwrap();
    let texts = |key: &str| {
        let list = dist["dist"][key].as_array().unwrap();
        list.iter().map(|text| text.as_str().unwrap()).collect::<Vec<_>>()
    };
    for system in ["linux", "apple-darwin", "windows"] {
        assert!(texts("targets").iter().any(|target| target.contains(system)), "{system}");
    }
    let features = cargo["features"].as_table().unwrap();
    assert!(texts("features").iter().all(|feature| features.contains_key(*feature)));
    let packed = read("tools/package.sh");
    assert_eq!(between(&packed, "\nfeatures=", "\n"), texts("features"));
    for file in texts("include") {
        assert!(root().join(file).is_file(), "{file}");
    }
    assert_eq!(cargo["profile"]["dist"]["inherits"].as_str(), Some("release"));
    assert_eq!(cargo["package"]["metadata"]["dist"]["dist"].as_bool(), Some(true));
}

/// Desktop rules that recognize a project, tested on one written by the program.
#[test]
fn a_project_is_what_its_type_says() {
    let folder = tempfile::tempdir().unwrap();
    Project::without_shoot(folder.path()).save().unwrap();
    let written = std::fs::read_to_string(folder.path().join("project.toml")).unwrap();

    let types = read("assets/desktop/afterlight.xml");
    let rules = between(&types, "<match type=\"string\" offset=\"", ">");
    assert_eq!(rules.len(), 3);
    for rule in rules {
        let (offset, value) = rule.split_once("\" value=\"").unwrap();
        let value = value.trim_end_matches('/').trim_end_matches('"');
        let value = value.replace("\\n", "\n");
        let found = written.find(&value).unwrap_or_else(|| panic!("{value:?} in {written}"));
        let range: Vec<usize> = offset.split(':').map(|n| n.parse().unwrap()).collect();
        let last = *range.last().unwrap();
        assert!((range[0]..=last).contains(&found), "{value:?} at {found}");
    }
    let entry = read("assets/desktop/afterlight.desktop");
    let kind = between(&types, "<mime-type type=\"", "\"")[0];
    assert!(entry.contains(&format!("MimeType={kind};\n")), "{entry}");
}

fn notes(version: &str, changelog: &str) -> Output {
    let folder = tempfile::tempdir().unwrap();
    let file: PathBuf = folder.path().join("CHANGELOG.md");
    std::fs::write(&file, changelog).unwrap();
    let script = root().join("tools/release_notes.sh");
    let mut command = Command::new("sh");
    command.arg(script).arg(version).arg(&file).output().unwrap()
}

const CHANGELOG: &str = "# Changelog\n\n## [Unreleased]\n\n### Added\n- Soon\n\n## [1.10.0] - 2031-05-04\n\n\
    ### Fixed\n- Ten\n\n## [1.1.0] - 2031-01-02\n- One\n\n[1.1.0]: https://example.org\n";

#[test]
fn the_notes_of_a_version_are_its_section_of_the_changelog() {
    for (version, expected) in [
        ("1.10.0", "# Afterlight 1.10.0, 2031-05-04\n\n### Fixed\n- Ten\n"),
        ("1.1.0", "# Afterlight 1.1.0, 2031-01-02\n\n- One\n"),
        ("2.0.0", "# Afterlight 2.0.0\n\n### Added\n- Soon\n"),
    ] {
        let output = notes(version, CHANGELOG);
        assert!(output.status.success());
        assert_eq!(String::from_utf8_lossy(&output.stdout), expected);
    }
}

#[test]
fn a_version_of_which_nothing_is_said_has_no_notes() {
    let output = notes("2.0.0", "# Changelog\n\n## [Unreleased]\n\n## [1.0.0]\n- One\n");
    assert!(!output.status.success());
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("expected a section [2.0.0] or [Unreleased] with text"), "{said}");
    assert!(output.stdout.is_empty());
}

/// The version to be packed has notes.
#[test]
fn this_version_has_notes() {
    let output = notes(env!("CARGO_PKG_VERSION"), &read("CHANGELOG.md"));
    assert!(output.status.success(), "{output:?}");
}
