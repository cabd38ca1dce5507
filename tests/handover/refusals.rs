use crate::FOLDER;
use crate::program::fail;

#[test]
fn what_a_program_could_not_open_is_refused_before_anything_is_relit() {
    let at = FOLDER.path();
    for (to, more, said) in [
        ("no/layers.%04d.exr", "--hand-over nuke", "--layers"),
        ("no/layers.mov", "--hand-over otio,blender", "--layers"),
        ("no/a#.%04d.exr", "--layers --hand-over nuke", "frame's number"),
        ("no/%d/a.exr", "--hand-over otio", "Number only the files"),
        ("no/a.%04d.v2.exr", "--layers --hand-over blender", "number last"),
        ("no/a.%04d.exr", "--layers --layer-files parts --hand-over nuke,blender", "--layer-files channels"),
    ] {
        let mut arguments = vec!["relight", "film", "--environment", "nave", "--to", to];
        arguments.extend(more.split(' '));
        let sentence = fail(at, &arguments);
        assert!(sentence.contains(said), "{more}: {sentence}");
        assert!(!at.join("no").exists(), "{more}");
    }
}
