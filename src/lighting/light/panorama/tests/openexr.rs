use super::*;

#[test]
fn channels_by_other_names_are_found() {
    let folder = Folder::new();
    let path = folder.0.path().join("named.exr");
    let image = picture(32, 16);
    let rgb = [("R", 0), ("G", 1), ("B", 2)];
    write_exr(&path, &image, &rgb, (0, 0), (32, 16));
    let read = read_all(&path);
    assert_eq!((read.environment.radiance, read.notes.len()), (image.clone(), 0));
    for names in [
        vec![("sky.R", 0), ("sky.G", 1), ("sky.B", 2)],
        vec![("red", 0), ("green", 1), ("blue", 2), ("Z", 1)],
        // Colour without a layer's name has priority.
        vec![("a.R", 2), ("a.G", 2), ("a.B", 2), ("R", 0), ("G", 1), ("B", 2), ("A", 1)],
    ] {
        write_exr(&path, &image, &names, (0, 0), (32, 16));
        assert_eq!(read_all(&path).environment.radiance, image, "{names:?}");
    }
    for names in [vec![("Y", 1)], vec![("light.Y", 1), ("id", 0)], vec![("depth", 1)]] {
        write_exr(&path, &image, &names, (0, 0), (32, 16));
        let read = read_all(&path);
        assert_eq!(read.environment.radiance, image.map(|p| [p[1]; 3]), "{names:?}");
        assert!(read.notes[0].contains("grey"), "{:?}", read.notes);
    }
    write_exr(&path, &image, &[("R", 0), ("G", 1), ("U", 2)], (0, 0), (32, 16));
    let error = crate::panorama::read(&path, &ReadSettings::default()).unwrap_err().to_string();
    assert!(error.contains("channels G, R, U"), "{error}");
}

#[test]
fn layers_are_named() {
    let folder = Folder::new();
    let path = folder.0.path().join("layers.exr");
    let image = picture(16, 8);
    let names = [("key.R", 0), ("key.G", 1), ("key.B", 2), ("rim.R", 2), ("rim.G", 2), ("rim.B", 2)];
    write_exr(&path, &image, &names, (0, 0), (16, 8));
    let said = read(&path, &ReadSettings::default()).unwrap_err().to_string();
    assert!(said.contains("\"key\", \"rim\""), "{said}");
    // The finished picture needs no choice.
    let names = names.map(|(name, channel)| (name.replace("key", "beauty"), channel));
    let names: Vec<(&str, usize)> = names.iter().map(|(name, c)| (name.as_str(), *c)).collect();
    write_exr(&path, &image, &names, (0, 0), (16, 8));
    let read = read_all(&path);
    assert!(read.notes[0].contains("\"beauty\""), "{:?}", read.notes);
    assert_eq!(read.environment.radiance, image);
}

#[test]
fn a_data_window_lies_where_it_says() {
    let folder = Folder::new();
    let path = folder.0.path().join("window.exr");
    let image = picture(10, 6);
    let rgb = [("R", 0), ("G", 1), ("B", 2)];
    // Inside, and across two edges.
    for at in [(4, 3), (-3, -2), (29, 12)] {
        write_exr(&path, &image, &rgb, at, (32, 16));
        let read = read_all(&path);
        let expected = Image::from_fn(32, 16, |x, y| {
            let (x, y) = (x as i32 - at.0, y as i32 - at.1);
            if (0..10).contains(&x) && (0..6).contains(&y) { image.at(x as usize, y as usize) } else { [0.0; 3] }
        });
        assert_eq!(read.environment.radiance, expected, "{at:?}");
        assert!(read.notes[0].contains("the rest is black"), "{:?}", read.notes);
        // The same, reduced.
        let small = crate::panorama::read(&path, &ReadSettings { width: 12, mapping: None }).unwrap().environment;
        same_energy(&small, &Environment::from_radiance("", expected));
    }
    // The display window of a shot: the panorama is the data window.
    write_exr(&path, &picture(16, 8), &rgb, (0, 0), (192, 108));
    assert_eq!(read_all(&path).environment.radiance, picture(16, 8));
}
