use super::super::colors::Encoding;
use super::super::layers::{LightLayer, LightLayers};
use super::super::still::tests::{about, picture};
use super::super::{About, Bits, ExrCompression, LayerFiles, OutputSpace, Samples, TimeCode, write_still};
use super::hash::{c4, c4_of_file};
use super::*;
use base::error::Error;
use compositor::Picture;
use sha2::{Digest, Sha512};
use std::path::Path;

const FRAMES: i64 = 6;

/// Input for one frame's file.
struct Take {
    picture: Picture,
    layers: Option<LightLayers>,
    about: About<'static>,
    made_of: String,
}

/// Correct frame `number`: two lamps whose weighted layers add up to the picture.
fn take(number: i64) -> Take {
    let shade = 0.25 + number as f32 / 16.0;
    let layer = |color: [f32; 3], weight: f32| LightLayer {
        lamp: "lamp".to_owned(),
        weight: [weight; 3],
        picture: picture(8, 5, color, false).linear.unwrap(),
    };
    let lamps = vec![layer([shade, 1.0, 0.5], 0.5), layer([0.5, shade, 2.0], 0.25)];
    let mut whole = picture(8, 5, [0.0; 3], false);
    let sum = whole.linear.as_mut().unwrap();
    for (i, pixel) in sum.pixels.iter_mut().enumerate() {
        for lamp in &lamps {
            (0..3).for_each(|c| pixel[c] += lamp.weight[c] * lamp.picture.pixels[i][c]);
        }
    }
    Take {
        picture: whole,
        layers: Some(LightLayers { lamps, ..LightLayers::default() }),
        about: About {
            time_code: TimeCode::parse("01:00:00:22", 24.0).unwrap().plus(number as usize),
            frame_rate: 24.0,
            ..about(Bits::Eight)
        },
        made_of: format!(
            "version=1 project=a checkpoint=b environment=c settings=d look={number} plate={number} frame={number}"
        ),
    }
}

impl Take {
    fn write(&self, path: &Path) {
        let about = About {
            layers: self.layers.as_ref(),
            provenance: (!self.made_of.is_empty()).then_some(&*self.made_of),
            ..self.about
        };
        write_still(path, &self.picture, &about).unwrap();
    }
}

fn file(folder: &Path, number: i64) -> PathBuf {
    folder.join(format!("shot.{number:04}.exr"))
}

fn whole_shot(folder: &Path) {
    (1..=FRAMES).for_each(|number| take(number).write(&file(folder, number)));
}

fn checked(folder: &Path, settings: &Requirements) -> ShotReport {
    ShotReport::new(&[folder.into()], settings, &Progress::silent()).unwrap()
}

fn kinds(faults: &[Fault]) -> Vec<&str> {
    faults.iter().map(|fault| &*fault.kind).collect()
}

#[test]
fn a_whole_shot_is_described() {
    let folder = tempfile::tempdir().unwrap();
    whole_shot(folder.path());
    let asked = Requirements { frames: Some((1, FRAMES)), rate: Some(24.0), ..Requirements::default() };
    let found = checked(folder.path(), &asked);
    assert!(found.passed, "{:?}", found.faults);
    assert!(found.remarks.is_empty(), "{:?}", found.remarks);
    assert_eq!((&*found.shot, found.frames), ("shot.####.exr", [1, FRAMES]));
    assert_eq!((found.size, found.rate), (Some([8, 5]), Some((24, 1))));
    assert_eq!(found.color.as_deref(), Some("lin_rec709_scene"));
    // Crosses a full second.
    assert_eq!(found.time_code, Some(["01:00:00:23", "01:00:01:04"].map(str::to_owned)));
    let layers = found.layers.unwrap();
    assert!(layers.layers == 2 && layers.residual <= layers.brightest / 1024.0);
    assert_eq!(found.made_of["checkpoint"], "b");
    assert!(!found.made_of.contains_key("frame"));
    for FrameReport { file, .. } in &found.files {
        let bytes = std::fs::read(folder.path().join(&file.name)).unwrap();
        assert_eq!(file.bytes, bytes.len() as u64);
        assert_eq!(file.c4, c4(Sha512::digest(&bytes)));
    }
    for part in ["6 frames 1-6", "8 × 5", "2 light layers", "01:00:00:23 to", "no faults"] {
        assert!(found.sentence.contains(part), "{part}: {}", found.sentence);
    }
    assert!(!found.sentence.contains('\n'));
}

#[test]
fn each_harm_to_a_shot_is_named_with_its_frame() {
    type Harm = fn(&Path);
    /// Writes a changed frame 4.
    fn fourth(folder: &Path, change: impl FnOnce(&mut Take)) {
        let mut take = take(4);
        change(&mut take);
        take.write(&file(folder, 4));
    }
    let harms: [(&str, &str, Harm); 19] = [
        ("missing", "1 of 1-6 is missing: 3", |f| std::fs::remove_file(file(f, 3)).unwrap()),
        ("double", "duplicate frame 4: shot.0004.exr, shot.4.exr", |f| {
            take(4).write(&f.join("shot.4.exr"));
        }),
        ("repeated", "same picture as the frame before: 4", |f| {
            fourth(f, |t| (t.picture, t.layers) = (take(3).picture, take(3).layers));
        }),
        ("unreadable", "shot.0004.exr", |f| {
            let bytes = std::fs::read(file(f, 4)).unwrap();
            std::fs::write(file(f, 4), &bytes[..bytes.len() - 60]).unwrap();
        }),
        ("unreadable", "shot.0004.exr", |f| std::fs::write(file(f, 4), "").unwrap()),
        ("unreadable", "1099511627776 bytes", |f| {
            let file = std::fs::OpenOptions::new().write(true).open(file(f, 4)).unwrap();
            file.set_len(1 << 40).unwrap();
        }),
        ("not_finite", "1 value is NaN or infinite, in 4", |f| {
            fourth(f, |t| t.picture.linear.as_mut().unwrap().pixels[9][1] = f32::NAN);
        }),
        ("rebuild", "in 4: the largest difference is 5.0", |f| {
            fourth(f, |t| t.picture.linear.as_mut().unwrap().pixels[9][1] += 0.5);
        }),
        ("layers", "missing in 4; 5 frames have them", |f| fourth(f, |t| t.layers = None)),
        ("layers", "shot.light_01.0004.exr", |f| {
            fourth(f, |t| t.about.exr.layers = LayerFiles::Files);
            std::fs::remove_file(f.join("shot.light_01.0004.exr")).unwrap();
        }),
        ("time_code", "frame 4 has 01:00:01:03 instead of 01:00:01:02", |f| {
            fourth(f, |t| t.about.time_code = t.about.time_code.plus(1));
        }),
        ("rate", "the frame rate: 25 frames a second in 4", |f| fourth(f, |t| t.about.frame_rate = 25.0)),
        ("color", "lin_ap1_scene", |f| {
            let aces: &'static Encoding = Box::leak(Box::new(Encoding::open(Some(OutputSpace::Acescg), None).unwrap()));
            fourth(f, |t| t.about.encoding = aces);
        }),
        ("size", "the size: 9 × 5 pixels from 0, 0 in 4", |f| {
            fourth(f, |t| (t.picture, t.layers) = (picture(9, 5, [0.5; 3], true), None));
        }),
        ("channels", "the channels: A float", |f| fourth(f, |t| t.about.exr.samples = Samples::Float)),
        ("provenance", "provenance (checkpoint): x in 4; b in most frames", |f| {
            fourth(f, |t| t.made_of = t.made_of.replace("checkpoint=b", "checkpoint=x"));
        }),
        ("provenance", "provenance (environment): nothing in 4", |f| {
            fourth(f, |t| t.made_of = String::new());
        }),
        ("order", "differs from the file name in 4", |f| {
            fourth(f, |t| t.made_of = t.made_of.replace("frame=4", "frame=5"));
        }),
        ("unfinished", ".shot.0007.exr.a1b2c3.afterlight", |f| {
            std::fs::write(f.join(".shot.0007.exr.a1b2c3.afterlight"), "").unwrap();
        }),
    ];
    for (kind, wanted, harm) in harms {
        let folder = tempfile::tempdir().unwrap();
        whole_shot(folder.path());
        harm(folder.path());
        let mut found = checked(folder.path(), &Requirements::default());
        assert!(!found.passed);
        // Infinite light can be written, too.
        serde_json::to_string(&found).unwrap();
        found.list_hashes(&Progress::silent()).unwrap();
        assert_eq!(found.hash_list, None);
        assert!(!folder.path().join("ascmhl").exists());
        let fault = found.faults.iter().find(|fault| fault.kind == kind && (fault.sentence.contains(wanted)));
        assert!(fault.is_some(), "{kind} {wanted}: {:?}", found.faults);
    }
    test_support::shown!(Strangers, "A shot for delivery with missing, duplicate or truncated frames, or frames of another look",
        bound: "19 harms", measured: "all named");
}

#[test]
fn what_may_be_meant_so_is_a_remark() {
    let folder = tempfile::tempdir().unwrap();
    for number in 1..=3 {
        let mut cropped = take(number);
        cropped.about.exr.crop = true;
        let light = cropped.picture.linear.as_mut().unwrap();
        // The picture grows from frame to frame.
        for (i, pixel) in light.pixels.iter_mut().enumerate() {
            if (i / 8) as i64 > number {
                *pixel = [0.0; 3];
                cropped.picture.alpha.pixels[i] = 0.0;
            }
        }
        cropped.layers = None;
        cropped.write(&file(folder.path(), number));
    }
    let found = checked(folder.path(), &Requirements::default());
    assert!(found.passed, "{:?}", found.faults);
    let remarks: Vec<&str> = found.remarks.iter().map(|remark| &*remark.kind).collect();
    assert_eq!(remarks, ["layers", "data_window"]);
    // A picture of another program has no provenance; a repeated picture may be intended.
    let plain = tempfile::tempdir().unwrap();
    for number in 0..3 {
        let light = take(1).picture.linear.unwrap();
        imaging::file::write_exr(&file(plain.path(), number), &light).unwrap();
    }
    let found = checked(plain.path(), &Requirements::default());
    assert_eq!(kinds(&found.faults), ["repeated"]);
    let allowed = Requirements { allow_repeats: true, ..Requirements::default() };
    let found = checked(plain.path(), &allowed);
    assert!(found.passed && found.remarks.len() == 3, "{:?}", found.remarks);
    // Black frames may repeat.
    let black = tempfile::tempdir().unwrap();
    for number in 0..3 {
        let light = imaging::Image::filled(4, 4, [0.0; 3]);
        imaging::file::write_exr(&file(black.path(), number), &light).unwrap();
    }
    assert!(checked(black.path(), &Requirements::default()).passed);
}

#[test]
fn a_range_and_a_rate_that_are_asked_for_are_demanded() {
    let folder = tempfile::tempdir().unwrap();
    whole_shot(folder.path());
    let asked = |frames, rate| {
        let settings = Requirements { frames, rate, ..Requirements::default() };
        checked(folder.path(), &settings).faults
    };
    let missing = asked(Some((0, 1_000_000_000)), None);
    assert_eq!(missing[0].frames, "0, 7-1000000000");
    let extra = asked(Some((2, 5)), None);
    assert_eq!((kinds(&extra), &*extra[0].frames), (vec!["extra"], "1, 6"));
    assert!(asked(None, Some(23.976)).iter().any(|fault| fault.kind == "rate"));
    let below = asked(Some((-3, 8)), None);
    assert_eq!((&*below[0].frames, below.len()), ("-3 to 0, 7-8", 1));
    assert!(below[0].sentence.starts_with("6 of -3 to 8 are missing"), "{}", below[0].sentence);
    assert_eq!(asked(Some((i64::MIN, i64::MAX)), None).len(), 1);
}

#[test]
fn time_codes_step_at_every_rate() {
    for (rate, start) in [
        (24.0, "23:59:59:20"),
        (25.0, "00:00:59:22"),
        (30000.0 / 1001.0, "00:00:59;27"),
        (60000.0 / 1001.0, "00:09:59;57"),
        (50.0, "10:00:00:47"),
        (120.0, "01:02:03:117"),
    ] {
        for harmed in [false, true] {
            let folder = tempfile::tempdir().unwrap();
            for number in (1..=9).filter(|number| *number != 5) {
                let mut take = take(number);
                take.layers = None;
                take.about.frame_rate = rate;
                // A jump longer than the frames that share a number.
                let jump = if harmed && number > 6 { 7 } else { 0 };
                let start = TimeCode::parse(start, rate).unwrap();
                take.about.time_code = start.plus(number as usize + jump);
                take.write(&file(folder.path(), number));
            }
            let found = checked(folder.path(), &Requirements::default());
            let jumps: Vec<_> = found.faults.iter().filter(|f| f.kind == "time_code").collect();
            assert_eq!(jumps.len(), usize::from(harmed), "{rate} {start}: {jumps:?}");
            assert!(!harmed || jumps[0].frames == "7", "{jumps:?}");
        }
    }
}

#[test]
fn a_name_and_chromaticities_that_differ_are_a_fault() {
    use super::frame::Color;
    let primaries = imaging::color_space::ColorSpace::Rec709.primaries();
    let corners = [primaries.red, primaries.green, primaries.blue, primaries.white];
    let found: Vec<f32> = corners.as_flattened().iter().map(|v| *v as f32).collect();
    let color = |id: &str| Color {
        chromaticities: found.clone().try_into().ok(),
        interop_id: Some(id.to_owned()),
        alpha: None,
    };
    assert_eq!(color("lin_rec709_scene").contradiction(), None);
    assert_eq!(color("of_another_program").contradiction(), None);
    assert!(color("lin_ap1_scene").contradiction().unwrap().contains("lin_ap1_scene"));
}

/// Writes the next hash list of a shot.
fn listed(folder: &Path) -> ShotReport {
    let mut report = checked(folder, &Requirements::default());
    report.list_hashes(&Progress::silent()).unwrap();
    report
}

#[test]
fn a_hash_list_is_compared_with_the_files_later() {
    let folder = tempfile::tempdir().unwrap();
    let frames = folder.path().join("frames");
    for number in 1..=3 {
        let mut take = take(number);
        take.about.exr.layers = LayerFiles::Files;
        take.write(&file(&frames, number));
    }
    std::fs::create_dir(frames.join("scripts")).unwrap();
    std::fs::write(frames.join("scripts/comp <1> & 2.nk"), "").unwrap();
    let list = listed(&frames).hash_list.unwrap();
    let name = list.file_name().unwrap().to_str().unwrap();
    assert!(name.starts_with("0001_frames_2") && name.ends_with("Z.mhl"), "{name}");
    // Three files of layers and weights for each frame, and the script.
    let verified = |list: &Path| Verification::of_file(list, &Progress::silent()).unwrap();
    let found = verified(&list);
    assert!(found.passed && found.remarks.is_empty(), "{found:?}");
    assert_eq!((found.files, found.same), (13, 13));
    assert!(found.sentence.contains("all 13 files"), "{}", found.sentence);
    // The folder may move as a whole.
    let moved = folder.path().join("moved");
    std::fs::rename(&frames, &moved).unwrap();
    let (frames, list) = (&moved, moved.join("ascmhl").join(name));
    assert_eq!(verified(&moved.join("ascmhl")).same, 13);
    // The next generation lists a new file beside those of the first.
    std::fs::write(frames.join("notes.txt"), "graded").unwrap();
    assert_eq!(verified(&list).remarks[0].sentence, "notes.txt is not in the hash list");
    let second = listed(frames);
    assert!(second.passed && second.sentence.contains("0002_moved_"), "{}", second.sentence);
    assert_eq!(verified(&list).files, 14);

    let said = |wanted: [&str; 2]| {
        let found = verified(&list);
        let fault = found.faults.iter().find(|f| f.sentence.contains(wanted[1]));
        assert!(fault.is_some_and(|f| f.kind == wanted[0]), "{wanted:?}: {:?}", found.faults);
        found
    };
    let mut take = take(2);
    take.about.exr.layers = LayerFiles::Files;
    take.about.exr.compression = ExrCompression::Piz;
    take.write(&file(frames, 2));
    // The files of the layers were recompressed, too.
    let found = said(["changed", "shot.0002.exr differs in its bytes, with the same picture"]);
    assert_eq!((found.same, found.passed), (11, false));
    assert!(found.faults.iter().all(|fault| fault.frames == "2"), "{:?}", found.faults);
    // A changed file keeps the next list from being written.
    let third = listed(frames);
    assert_eq!((third.hash_list, third.passed), (None, false));
    take.picture.linear.as_mut().unwrap().pixels[0] = [0.25; 3];
    take.write(&file(frames, 2));
    said(["changed", "shot.0002.exr has a different picture"]);
    std::fs::write(file(frames, 2), "half").unwrap();
    said(["unreadable", "shot.0002.exr is damaged"]);
    std::fs::remove_file(file(frames, 2)).unwrap();
    said(["missing", "shot.0002.exr is missing"]);
    std::fs::remove_file(frames.join("shot.light_00.0003.exr")).unwrap();
    said(["missing", "shot.light_00.0003.exr"]);
    std::fs::write(frames.join("notes.txt"), "graded again").unwrap();
    said(["changed", "notes.txt differs in its bytes"]);

    let text = std::fs::read_to_string(&list).unwrap();
    std::fs::write(&list, text.replace(">c4", ">c5")).unwrap();
    said(["hash_list", "hash mismatch: damaged or edited"]);
    std::fs::write(&list, text.replace("shot.0001.exr", "../../etc/passwd")).unwrap();
    said(["hash_list", "../../etc/passwd leads out of the folder"]);
    for text in ["", "{}", &"<hash>".repeat(1 << 16), &text[..text.len() / 2]] {
        std::fs::write(&list, text).unwrap();
        let said = Verification::of_file(&list, &Progress::silent()).unwrap_err().to_string();
        assert!(said.contains(name), "{said}");
    }
    std::fs::remove_file(&list).unwrap();
    let list = moved.join("ascmhl");
    let found = verified(&list);
    assert!(found.faults[0].sentence.contains("in the chain, but missing"), "{:?}", found.faults);
    std::fs::rename(list.join("ascmhl_chain.xml"), frames.join("chain.xml")).unwrap();
    let said = Verification::of_file(&list, &Progress::silent()).unwrap_err().to_string();
    assert!(said.contains("ascmhl_chain.xml"), "{said}");
    let said = Verification::of_file(&frames.join("chain.xml"), &Progress::silent()).unwrap_err();
    assert!(said.to_string().contains("not in a folder ascmhl"), "{said}");
}

#[test]
fn hash_lists_of_other_tools_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let hash = |text: &str| c4(Sha512::digest(text));
    for (name, text) in [("new.mov", "movie"), ("plain.txt", "notes"), ("added.wav", "sound")] {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    let list = format!(
        "<?xml version=\"1.0\"?>\n<hashlist version=\"2.0\" xmlns=\"urn:ASC:MHL:v2.0\">\
         <creatorinfo><creationdate>2024-01-01T00:00:00+00:00</creationdate><author role=\"DIT\">A</author>\
         </creatorinfo><processinfo><process>in-place</process><roothash><content><xxh64>0</xxh64></content>\
         </roothash></processinfo><hashes><hash><path size=\"5\">old.mov</path><c4>{0}</c4></hash>\
         <directoryhash><path>Clips</path><content><xxh64>1</xxh64></content></directoryhash>\
         <hash><path size=\"1\">plain.txt</path><c4/><md5>ab</md5></hash>\
         <hash><path>new.mov</path><c4 action=\"verified\">{0}</c4><previousPath>old.mov</previousPath></hash>\
         </hashes><references/></hashlist>",
        hash("movie")
    );
    let lists = folder.path().join("ascmhl");
    std::fs::create_dir(&lists).unwrap();
    std::fs::write(lists.join("0001.mhl"), &list).unwrap();
    let chain = format!(
        "<ascmhldirectory xmlns=\"urn:ASC:MHL:DIRECTORY:v2.0\"><hashlist sequencenr=\"1\"><path>0001.mhl</path>\
         <c4>{}</c4></hashlist></ascmhldirectory>",
        hash(&list)
    );
    std::fs::write(lists.join("ascmhl_chain.xml"), chain).unwrap();
    let found = Verification::of_file(&lists, &Progress::silent()).unwrap();
    assert!(found.passed, "{:?}", found.faults);
    assert_eq!((found.files, found.same), (2, 1));
    let remarks: Vec<&str> = found.remarks.iter().map(|remark| &*remark.sentence).collect();
    assert!(remarks[0].contains("added.wav") && remarks[1].contains("ascmhl"), "{remarks:?}");
    // A folder inside with lists of its own is left to the tool that made them.
    std::fs::create_dir_all(folder.path().join("reel/ascmhl")).unwrap();
    let said = Verification::of_file(&lists, &Progress::silent()).unwrap_err().to_string();
    assert!(said.contains("reel has hash lists of its own"), "{said}");
}

#[test]
fn a_stop_ends_the_check_and_nothing_is_written() {
    use base::progress::Control;
    let folder = tempfile::tempdir().unwrap();
    whole_shot(folder.path());
    let control = Control::default();
    control.stop();
    let progress = Progress::new(&|_| (), control);
    let stopped = ShotReport::new(&[folder.path().into()], &Requirements::default(), &progress);
    assert!(matches!(stopped, Err(Error::Cancelled { .. })));
}

#[test]
fn the_hashes_of_a_file_are_the_published_ones() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("abc");
    std::fs::write(&path, "abc").unwrap();
    // Example of FIPS 180-4.
    let wanted = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
    assert_eq!(hash_file(&path).unwrap(), (3, wanted.to_owned()));
    assert_eq!(c4_of_file(&path, 2).unwrap(), (3, String::new()));
    // C4 ID of no bytes, as the standard's authors publish it.
    let wanted = "c459dsjfscH38cYeXXYogktxf4Cd9ibshE3BHUo6a58hBXmRQdZrAkZzsWcbWtDg5oQstpDuni4Hirj75GEmTc1sFT";
    assert_eq!(c4(Sha512::digest("")), wanted);
    assert_eq!(c4([0; 64]), format!("c4{}", "1".repeat(88)));
}
