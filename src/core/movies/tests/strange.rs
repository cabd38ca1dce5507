//! Damaged, lying and hostile files.

use super::*;
use base::memory;
use std::time::Duration;

#[test]
fn names_mean_nothing_but_files() {
    if !test_support::ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    make(&folder.path().join("plain.mkv"), 3, "24", "-c:v ffv1");
    let bytes = std::fs::read(folder.path().join("plain.mkv")).unwrap();
    for name in [
        "-i.mkv",
        "concat:a|b.mkv",
        "http:x.mkv",
        "it's \"quoted\".mkv",
        "two\nlines.mkv",
        "shot %d.mkv",
        "ünï.mkv",
        "a:b,c=[d];e.mkv",
    ] {
        let path = folder.path().join(name);
        std::fs::write(&path, &bytes).unwrap();
        let movie = Movie::open(&path, &tools(folder.path())).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!(number(&movie.frame(2).unwrap()), 2, "{name}");
    }
    // A playlist with a file elsewhere, and one with a server.
    let secret = folder.path().join("plain.mkv");
    for text in [
        format!("#EXTM3U\n#EXTINF:1,\nhttp://127.0.0.1:1/{}\n", secret.display()),
        "ffconcat version 1.0\nfile 'http://127.0.0.1:1/a.mkv'\n".to_owned(),
    ] {
        let path = folder.path().join("list.mov");
        std::fs::write(&path, text).unwrap();
        assert!(Movie::open(&path, &tools(folder.path())).is_err());
    }
    shown!(
        Strangers,
        "A movie's name starts with a dash or reads like `concat:` or `http:`; a playlist calls itself a movie",
        done: "names are only names, and ffmpeg may open only files",
    );
}

#[test]
fn what_is_no_whole_movie_is_a_sentence() {
    if !test_support::ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let tools = tools(folder.path());
    let at = |name: &str| folder.path().join(name);
    make(&at("whole.mov"), 30, "24", "-c:v prores_ks");
    let whole = std::fs::read(at("whole.mov")).unwrap();
    std::fs::write(at("half.mov"), &whole[..whole.len() / 2]).unwrap();
    std::fs::write(at("text.mp4"), "this is not a movie").unwrap();
    std::fs::write(at("empty.mov"), "").unwrap();
    std::fs::write(at("film.r3d"), &whole).unwrap();
    std::fs::write(at("film.braw"), &whole).unwrap();
    // Renamed raw files: the content counts.
    std::fs::write(at("red.mov"), [&[0, 0, 1, 0][..], b"RED2", &[0; 300]].concat()).unwrap();
    std::fs::write(at("arri.mov"), [&b"ARRI"[..], &[0; 300]].concat()).unwrap();
    let is_prores = |tag: &[u8]| [b"apcn", b"apch", b"ap4h"].iter().any(|known| tag == *known);
    let coded = whole.windows(4).position(is_prores).unwrap();
    let raw = [&whole[..coded], b"brxq", &whole[coded + 4..]].concat();
    std::fs::write(at("blackmagic.mov"), raw).unwrap();
    std::fs::create_dir(at("A001.RDC")).unwrap();
    std::fs::write(at("A001.RDC/A001_001.R3D"), &whole).unwrap();
    ffmpeg(&["-f", "lavfi", "-i", "sine=d=1", at("sound.wav").to_str().unwrap()]);
    for (name, says) in [
        ("half.mov", "half.mov"),
        ("text.mp4", "text.mp4"),
        ("empty.mov", "empty.mov"),
        ("gone.mov", "gone.mov"),
        ("film.r3d", "REDCINE"),
        ("film.braw", "Transcode"),
        ("red.mov", "REDCINE"),
        ("arri.mov", "ARRI Reference Tool"),
        ("blackmagic.mov", "Blackmagic RAW"),
        ("sound.wav", "no pictures"),
    ] {
        let said = Movie::open(&at(name), &tools).map(|_| ()).unwrap_err().to_string();
        assert!(said.contains(says), "{name}: {said}");
    }
    let said = Source::open(&at("A001.RDC"), &tools).map(|_| ()).unwrap_err().to_string();
    assert!(said.contains("REDCINE") && said.contains("A001_001.R3D"), "{said}");
    let none = Tools { ffprobe: "no-such-ffprobe".into(), ..tools };
    let said = Movie::open(&at("whole.mov"), &none).unwrap_err().to_string();
    assert!(said.contains("Install ffmpeg"), "{said}");
    shown!(
        Strangers,
        "A movie that is truncated, not a movie, without pictures, or a camera's raw file; ffmpeg is missing",
        done: "the error names a remedy",
    );
}

#[test]
fn a_truncated_movie_has_the_frames_that_are_there() {
    if !test_support::ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cut.mkv");
    make(&path, 60, "24", "-c:v libx264 -bf 2 -g 12 -pix_fmt yuv420p");
    let whole = std::fs::read(&path).unwrap();
    std::fs::write(&path, &whole[..whole.len() * 2 / 3]).unwrap();
    let movie = Movie::open(&path, &tools(folder.path())).unwrap();
    let count = movie.count().unwrap();
    assert!((10..59).contains(&count), "{count}");
    assert_eq!(number(&movie.frame(count - 6).unwrap()), count as usize - 6);
    let said = movie.frame(count).unwrap_err().to_string();
    assert!(said.contains(&format!("no frame {count}")), "{said}");
}

/// Overwrites packet number `packet` in storage order.
fn damage(path: &Path, packet: usize, byte: u8) {
    let listed = Command::new("ffprobe")
        .args(["-v", "error", "-of", "csv=p=0", "-show_entries", "packet=pos,size"])
        .arg(path)
        .output()
        .unwrap();
    let listed = String::from_utf8(listed.stdout).unwrap();
    let mut places = listed.lines().map(|line| {
        let mut numbers = line.split(',').map(|n| n.parse::<usize>().unwrap());
        let (size, at) = (numbers.next().unwrap(), numbers.next().unwrap());
        at..at + size
    });
    let mut bytes = std::fs::read(path).unwrap();
    bytes[places.nth(packet).unwrap()].fill(byte);
    std::fs::write(path, bytes).unwrap();
}

#[test]
fn a_damaged_frame_is_named_and_the_others_are_read() {
    if !test_support::ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("damaged.mov");
    make(&path, 12, "24", "-c:v prores_ks");
    damage(&path, 5, 0xff);
    let movie = Movie::open(&path, &tools(folder.path())).unwrap();
    for frame in [0, 4, 6, 11, 7] {
        assert_eq!(number(&movie.frame(frame).unwrap()), frame as usize);
    }
    let said = movie.frame(5).unwrap_err().to_string();
    assert!(said.contains("frame 5") && said.contains("damaged.mov"), "{said}");
    assert_eq!(number(&movie.frame(6).unwrap()), 6);
    shown!(
        Strangers,
        "One frame in the middle of a movie is damaged",
        done: "the error names the frame, and the others are read",
    );
}

#[test]
#[cfg(unix)]
fn a_damaged_frame_late_in_a_movie_is_not_searched_from_its_start() {
    use std::os::unix::fs::PermissionsExt;
    if !test_support::ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    // ffmpeg, with a log of its start positions.
    let (program, log) = (folder.path().join("logged"), folder.path().join("starts"));
    let script = format!("#!/bin/sh\necho \"$@\" >> '{}'\nexec ffmpeg \"$@\"\n", log.display());
    std::fs::write(&program, script).unwrap();
    std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).unwrap();
    for (name, coding) in [
        ("intra.mov", "-c:v prores_ks"),
        ("groups.mp4", "-c:v libx264 -bf 2 -g 12 -pix_fmt yuv420p -x264-params scenecut=0"),
    ] {
        let path = folder.path().join(name);
        make(&path, 120, "24", coding);
        damage(&path, 100, 0);
        let tools = Tools { ffmpeg: program.clone().into(), ..tools(folder.path()) };
        let movie = Movie::open(&path, &tools).unwrap();
        assert_eq!(number(&movie.frame(90).unwrap()), 90);
        movie.forget();
        std::fs::write(&log, "").unwrap();
        // Packets are not stored in presentation order.
        assert!((96..106).any(|frame| movie.frame(frame).is_err()), "{name}");
        assert_eq!(number(&movie.frame(110).unwrap()), 110);
        let starts = std::fs::read_to_string(&log).unwrap();
        let from_the_start = |line: &&str| line.contains("rawvideo") && !line.contains("-ss ");
        assert_eq!(starts.lines().filter(from_the_start).count(), 0, "{name}: {starts}");
    }
    shown!(
        Strangers,
        "A frame is damaged ten hours into a movie",
        done: "decoding starts again a second before it; if its neighbours are decoded but it is not, the error names it",
    );
}

#[test]
fn a_movie_that_is_replaced_while_it_is_open_is_noticed() {
    if !test_support::ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("film.mov");
    make(&path, 5, "24", "-c:v prores_ks");
    let source = open(&path).unwrap();
    assert_eq!(number(&source.frame(4).unwrap()), 4);
    make(&path, 9, "24", "-c:v prores_ks -vf negate");
    let said = source.frame(4).unwrap_err().to_string();
    assert!(said.contains("film.mov was replaced"), "{said}");
    assert!(open(&path).is_err(), "an open movie reports the change once");
    assert_eq!(open(&path).unwrap().count().unwrap(), 9);
    shown!(
        Strangers,
        "A movie is replaced while the program has it open",
        done: "its size and modification time are compared before each frame; a cached index of the old one is not used",
    );
}

#[test]
#[cfg(unix)]
fn a_program_that_hangs_is_ended() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let program = folder.path().join("hangs");
    std::fs::write(&program, "#!/bin/sh\nsleep 1000 & wait\n").unwrap();
    std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).unwrap();
    std::fs::write(folder.path().join("film.mov"), "film").unwrap();
    let tools = Tools {
        ffmpeg: program.clone().into(),
        ffprobe: program.into(),
        cache: None,
        patience: Duration::from_millis(300),
    };
    let said = Movie::open(&folder.path().join("film.mov"), &tools).unwrap_err().to_string();
    assert!(said.contains("neither read nor wrote"), "{said}");
    shown!(
        Surroundings,
        "ffprobe or ffmpeg hangs while it reads a movie",
        done: "after two minutes without a sign of life it is killed with all its children",
    );
}

#[test]
fn a_movie_of_twenty_hours_opens_at_once_and_takes_no_more_memory() {
    if !test_support::ffmpeg() {
        return;
    }
    const HOURS: u64 = 20;
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    make(Path::new(&at("minute.mp4")), 250, "25", "-c:v libx264 -bf 2 -g 250 -pix_fmt yuv420p");
    let times = (HOURS * 360 - 1).to_string();
    ffmpeg(&["-stream_loop", &times, "-i", &at("minute.mp4"), "-c", "copy", &at("long.mp4")]);
    let before = memory::held().unwrap_or(0);
    let start = std::time::Instant::now();
    let movie = Movie::open(Path::new(&at("long.mp4")), &tools(folder.path())).unwrap();
    let opened = start.elapsed();
    assert_eq!(number(&movie.frame(3).unwrap()), 3);
    let first = start.elapsed();
    let count = movie.count().unwrap();
    let listed = start.elapsed();
    assert_eq!(count, HOURS * 3600 * 25);
    for frame in [count - 1, 777_777, 12_345, count - 250] {
        assert_eq!(number(&movie.frame(frame).unwrap()) as u64, frame % 250 % 256);
    }
    let more = memory::held().unwrap_or(0).saturating_sub(before);
    assert!(more < 64 << 20, "{more} bytes");
    drop(movie);
    let start = std::time::Instant::now();
    let again = Movie::open(Path::new(&at("long.mp4")), &tools(folder.path())).unwrap();
    assert_eq!(again.count().unwrap(), count);
    let again = start.elapsed();
    shown!(
        Strangers,
        "A movie of 20 hours: 1.8 million frames",
        bound: "64 MB more memory than before",
        measured: format!(
            "open after {:.1} s, first frame {:.1} s, all listed {:.1} s, opened again {:.1} s, {} MB",
            opened.as_secs_f32(), first.as_secs_f32(), listed.as_secs_f32(), again.as_secs_f32(), more >> 20
        ),
    );
}
