//! Pictures and their order.

use super::*;
use crate::messages::FrameRequest;

#[test]
fn looks_beside_each_other_are_each_the_picture_that_they_are_alone() {
    let (worker, go, _begun) = slow_worker();
    go.send(()).unwrap();
    let light = from_the_left();
    let alone = |yaw_deg: f32, stops: f32| {
        let mut request = ask(0, yaw_deg, &light);
        request.scene.exposure_stops = stops;
        request
    };
    let wanted = [(0.0, 0.0), (40.0, 0.5), (-33.3, -1.0)];
    let rgb = |(yaw_deg, stops)| {
        worker.show(alone(yaw_deg, stops));
        let is_it = |relit: &Arc<PreviewPicture>| (relit.scene.yaw_deg, relit.scene.exposure_stops) == (yaw_deg, stops);
        wait_for(|| worker.relit().filter(is_it)).rgb.clone()
    };
    let pictures = wanted.map(rgb);
    let view = |(yaw_deg, stops)| {
        let PreviewRequest { scene, environment, .. } = alone(yaw_deg, stops);
        Some(LookView { scene, environment })
    };
    let [a, b, c] = wanted.map(view);
    let mut request = ask(0, 7.0, &light);
    request.looks = [a, None, b, c];
    let shown = |request: &PreviewRequest| {
        worker.show(request.clone());
        let is_it = |relit: &Arc<PreviewPicture>| {
            let found = relit.looks.each_ref().map(|one| one.as_ref().map(|(of, _)| of));
            found == request.looks.each_ref().map(Option::as_ref)
        };
        wait_for(|| worker.relit().filter(is_it))
    };
    let first = shown(&request);
    let codes = |relit: &PreviewPicture, place: usize| {
        let (_, codes) = relit.looks[place].clone().unwrap();
        codes
    };
    for (place, picture) in [(0, &pictures[0]), (2, &pictures[1]), (3, &pictures[2])] {
        assert!(codes(&first, place).rgb == *picture, "place {place}");
    }
    // One of them changes: the others are not made again.
    request.looks[2] = request.looks[3].clone();
    let second = shown(&request);
    assert!(Arc::ptr_eq(&codes(&first, 0), &codes(&second, 0)));
    assert!(codes(&second, 2).rgb == pictures[2]);
}

#[test]
fn the_newest_frame_is_predicted_and_those_between_are_not() {
    let (worker, go, begun) = slow_worker();
    let light = from_the_left();
    worker.show(ask(0, 0.0, &light));
    assert_eq!(begun.recv_timeout(PATIENCE), Ok(0));
    for frame in 1..=30 {
        worker.show(ask(frame, 0.0, &light));
        std::thread::sleep(Duration::from_millis(1));
    }
    // The relighter has also forwarded the last one.
    let newest = |request: &NetworkRequest| matches!(request, NetworkRequest::Predict(FrameRequest { frame: 30, .. }));
    wait_for(|| worker.network.waits(newest).then_some(()));
    go.send(()).unwrap();
    assert_eq!(begun.recv_timeout(PATIENCE), Ok(30));
    // The first field arrives before the next one can replace it.
    wait_for(|| worker.relit().filter(|r| r.frames_at_hand.contains(&0)));
    go.send(()).unwrap();
    let relit = wait_for(|| worker.relit().filter(|r| r.scene.frame == 30));
    assert!(relit.frames_at_hand.contains(&0) && relit.frames_at_hand.len() == 2);
    drop(go);
}

#[test]
fn a_turn_is_shown_while_the_network_is_busy() {
    let (worker, go, begun) = slow_worker();
    let light = from_the_left();
    worker.show(ask(0, 0.0, &light));
    go.send(()).unwrap();
    let left = wait_for(|| worker.relit());
    assert!(left.rgb[0] > left.rgb[3 * 7], "light from the left is on the left");
    assert!(left.passes.iter().any(|p| p.name == "predict" && p.ran));
    worker.show(ask(1, 0.0, &light));
    begun.recv_timeout(PATIENCE).unwrap();
    assert_eq!(begun.recv_timeout(PATIENCE), Ok(1));
    worker.show(ask(1, 180.0, &light));
    let turned = wait_for(|| worker.relit().filter(|r| r.scene.yaw_deg == 180.0));
    assert_eq!(turned.scene.frame, 0, "the frame in memory is shown meanwhile");
    assert!(turned.rgb[0] < turned.rgb[3 * 7]);
    assert!(turned.passes.iter().any(|p| p.name == "predict" && !p.ran));
    drop(go);
}

#[test]
fn what_is_at_hand_is_not_predicted_again() {
    let (worker, go, begun) = slow_worker();
    let light = from_the_left();
    for frame in [0, 1, 0, 1] {
        // Extra words do no harm.
        go.send(()).unwrap();
        worker.show(ask(frame, 0.0, &light));
        wait_for(|| worker.relit().filter(|r| r.scene.frame == frame));
    }
    assert_eq!(begun.try_iter().collect::<Vec<_>>(), [0, 1]);
}

#[test]
fn what_a_picture_is_compared_with_comes_with_it() {
    let open = || {
        Ok(Source {
            rig: rig(),
            device: "test".to_owned(),
            predict: Box::new(|index| Ok(predicted(index).into())),
            // Its lamps have swapped places.
            later: None,
            comparison: Box::new(|rival, index| match rival {
                ComparisonSource::Exemplar(1) => {
                    let (frame, field) = predicted(index);
                    let Field::Memory(field) = field else { unreachable!() };
                    let olats = [field.olat(1), field.olat(0)];
                    Ok((frame, Field::from(ReflectanceField::from_olats(&olats))).into())
                }
                _ => Err(Error::missing("there is only pose 1", "Ask for pose 1")),
            }),
        })
    };
    let worker = Worker::over(open, || {});
    let left = from_the_left();
    let compared = |second: Comparison, solo: &[usize]| {
        worker.show(PreviewRequest { second: Some(second.clone()), solo: solo.to_vec(), ..ask(0, 0.0, &left) });
        wait_for(|| worker.relit().filter(|relit| relit.second.as_ref().map(|(of, _)| of) == Some(&second)))
    };
    // The outer columns of the middle row.
    let ends = |rgb: &[u8]| [rgb[3 * 8 * 4], rgb[3 * (8 * 4 + 7)]];
    let codes = |relit: &PreviewPicture| relit.second.as_ref().unwrap().1.rgb.clone();

    let plate = compared(Comparison::Plate, &[]);
    assert_eq!(codes(&plate), vec![188; 3 * 64], "half of white in sRGB");

    let right = Image::from_fn(64, 32, |x, _| [if x < 32 { 0.0 } else { 1.0 }; 3]);
    let right = Arc::new(Environment::from_radiance("right", right));
    let turned = compared(Comparison::Light(right, 0.0), &[]);
    let [first, second] = [ends(&turned.rgb), ends(&codes(&turned))];
    assert!(first[0] > first[1] && second[1] > second[0], "{first:?} {second:?}");
    assert_eq!([first[0], first[1]], [second[1], second[0]], "both at one level");

    let rival = compared(Comparison::Olats(ComparisonSource::Exemplar(1)), &[]);
    assert_eq!(ends(&codes(&rival)), [first[1], first[0]], "at the level of the first");

    // Any two of them, and their difference.
    let exemplar = || Comparison::Olats(ComparisonSource::Exemplar(1));
    let two = |second: Comparison, inspection| {
        let mut wanted = ask(0, 0.0, &left);
        wanted.scene.effects.inspection = inspection;
        worker.show(PreviewRequest { first: Some(Comparison::Plate), second: Some(second.clone()), ..wanted.clone() });
        wait_for(|| {
            let relit = worker.relit()?;
            let comparison = relit.second.as_ref().map(|(of, _)| of);
            let whole = relit.first.is_some() && comparison == Some(&second);
            (whole && relit.scene == wanted.scene).then_some(relit)
        })
    };
    let both = two(exemplar(), Inspection::Picture);
    assert_eq!(both.rgb, turned.rgb);
    assert_eq!(both.first.as_ref().unwrap().1.rgb, codes(&plate));
    assert_eq!(codes(&both), codes(&rival));
    let apart = two(exemplar(), Inspection::Difference { gain: 1.0 });
    let wanted: Vec<u8> = (codes(&plate).iter().zip(codes(&rival))).map(|(a, b)| a.abs_diff(b)).collect();
    let (_, shown) = apart.first.as_ref().unwrap();
    let off = shown.rgb.iter().zip(&wanted).map(|(a, b)| a.abs_diff(*b));
    // Both codes were rounded before this subtraction.
    assert!(off.max() <= Some(1));
    // The probed values come from the picture, not from a difference or a false colour.
    let read = |relit: &PreviewPicture, side: usize| {
        let whole = relit.whole[side].as_ref();
        whole.map(|picture| picture.rgb.clone())
    };
    assert_eq!(read(&apart, 0), Some(codes(&plate)));
    let mapped = two(exemplar(), Inspection::FalseColor);
    assert_ne!(codes(&mapped), codes(&rival));
    for (side, picture) in [&plate, &rival].into_iter().enumerate() {
        assert_eq!(read(&mapped, side), Some(codes(picture)));
    }
    // A look is shown like any picture: mapped, and probed as a picture.
    let look = |inspection| {
        let mut scene = ask(0, 90.0, &left).scene;
        scene.effects.inspection = inspection;
        Comparison::Look(Box::new(LookView { scene, environment: left.clone() }))
    };
    let picture = two(look(Inspection::Picture), Inspection::Picture);
    let mapped = two(look(Inspection::FalseColor), Inspection::FalseColor);
    assert_ne!(codes(&mapped), codes(&picture));
    assert_eq!(read(&mapped, 1), Some(codes(&picture)));

    let alone = compared(Comparison::Plate, &[1]);
    let [left_end, right_end] = ends(&alone.rgb);
    assert!(left_end == 0 && right_end > 100, "{left_end} {right_end}");

    worker
        .show(PreviewRequest { second: Some(Comparison::Olats(ComparisonSource::Exemplar(0))), ..ask(0, 0.0, &left) });
    let said = wait_for(|| {
        worker.events().find_map(|event| match event {
            Event::Failed { sentence } => Some(sentence),
            _ => None,
        })
    });
    assert!(said.contains("Ask for pose 1"), "{said}");
}

#[test]
fn pictures_are_shown_through_a_table_and_inspected_without() {
    let folder = tempfile::tempdir().unwrap();
    let table = folder.path().join("negative.cube");
    std::fs::write(&table, "LUT_1D_SIZE 2\n1 1 1\n0 0 0\n").unwrap();
    let (worker, go, _begun) = slow_worker();
    go.send(()).unwrap();
    let light = from_the_left();
    worker.show(ask(0, 0.0, &light));
    let plain = wait_for(|| worker.relit());
    let through = |table: &Path, inspection| {
        let mut request = ask(0, 0.0, &light);
        request.scene.effects.inspection = inspection;
        worker.show(PreviewRequest { table: Some(table.to_owned()), ..request });
    };
    through(&table, Inspection::Picture);
    let negative = wait_for(|| worker.relit().filter(|relit| relit.rgb != plain.rgb));
    let pairs = plain.rgb.iter().zip(&negative.rgb);
    assert!(negative.texture.is_none());
    assert!(pairs.clone().all(|(a, b)| (a.abs_diff(255 - b)) <= 1));
    // A changed file is read again.
    std::fs::write(&table, "LUT_1D_SIZE 2\n0 0 0\n0.5 0.5 0.5\n").unwrap();
    let later = std::time::SystemTime::now() + Duration::from_secs(5);
    let file = std::fs::File::options().write(true).open(&table).unwrap();
    file.set_modified(later).unwrap();
    worker.show(ask(0, 1.0, &light));
    wait_for(|| worker.relit().filter(|relit| relit.scene.yaw_deg == 1.0));
    through(&table, Inspection::Picture);
    let dark = wait_for(|| worker.relit().filter(|relit| relit.scene.yaw_deg == 0.0));
    assert!(dark.rgb[0].abs_diff(plain.rgb[0] / 2) <= 1);
    let luminance = Inspection::Channel(scene::Channel::Luminance);
    through(&table, luminance);
    let inspected = |relit: &Arc<PreviewPicture>| relit.scene.effects.inspection == luminance;
    let inspected = wait_for(|| worker.relit().filter(inspected));
    assert_eq!(inspected.rgb[0], plain.rgb[0]);
    through(&folder.path().join("gone.cube"), Inspection::Picture);
    let said = wait_for(|| {
        let events = worker.events();
        events.into_iter().find_map(|event| match event {
            Event::Failed { sentence } => Some(sentence),
            _ => None,
        })
    });
    assert!(said.contains("gone.cube"), "{said}");
}
