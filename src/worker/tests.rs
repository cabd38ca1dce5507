use super::*;
use footage::ImportSettings;
use imaging::{Image, Mask};
use light::{Environment, Lamp, Rig};
use reflectance::ReflectanceField;
use scene::{Background, Inspection, Output, Scene};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::Duration;
use test_support::{PATIENCE, wait_for};

/// Two lamps of one energy, left and right.
pub(crate) fn rig() -> Rig {
    let lamp = |x: f32| Lamp {
        name: format!("olat_{x}"),
        direction: glam::Vec3::new(x, 0.0, 0.0),
        energy: [1.0; 3],
        spread_deg: 5.0,
        confidence: 1.0,
        clipped: 0.0,
    };
    Rig {
        lamps: vec![lamp(-1.0), lamp(1.0)],
    }
}

/// A frame whose left half is lit by the left lamp alone.
pub(crate) fn predicted(index: usize) -> (Frame, Field) {
    let olat =
        |lit: fn(usize) -> bool| Image::from_fn(8, 8, |x, _| [if lit(x) { 0.5 } else { 0.0 }; 3]);
    let field = ReflectanceField::from_olats(&[olat(|x| x < 4), olat(|x| x >= 4)]);
    (
        Frame {
            index,
            plate: Image::filled(8, 8, [0.5; 3]),
            mask: Mask::filled(8, 8, 1.0),
        },
        field.into(),
    )
}

/// A worker whose predictions each wait for a word, and what says it.
fn slow_worker() -> (Worker, Sender<()>, Receiver<usize>) {
    let (go, gate) = channel::<()>();
    let (began, begun) = channel();
    let gate = Arc::new(std::sync::Mutex::new(gate));
    let open = move || {
        let (gate, began) = (gate.clone(), began.clone());
        let predict = move |index| {
            began.send(index).unwrap();
            let _ = gate.lock().unwrap().recv();
            Ok(predicted(index).into())
        };
        Ok(Source {
            rig: rig(),
            device: "test".to_owned(),
            predict: Box::new(predict),
            comparison: Box::new(|_, index| Ok(predicted(index).into())),
        })
    };
    (Worker::over(open, || {}), go, begun)
}

pub(crate) fn ask(frame: usize, yaw_deg: f32, environment: &Arc<Environment>) -> PreviewRequest {
    let scene = Scene {
        frame,
        yaw_deg,
        exposure_stops: 0.0,
        background: Background::None,
        output: Output::Display,
        ..Scene::default()
    };
    PreviewRequest {
        scene,
        environment: environment.clone(),
        first: None,
        second: None,
        looks: Default::default(),
        solo: Vec::new(),
        table: None,
        dragged: false,
        texture: false,
    }
}

/// Light from camera-left alone.
pub(crate) fn from_the_left() -> Arc<Environment> {
    let radiance = Image::from_fn(64, 32, |x, _| [if x < 32 { 1.0 } else { 0.0 }; 3]);
    Arc::new(Environment::from_radiance("left", radiance))
}

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
    let of = |(yaw_deg, stops)| {
        worker.show(alone(yaw_deg, stops));
        let is_it = |relit: &Arc<PreviewPicture>| {
            (relit.scene.yaw_deg, relit.scene.exposure_stops) == (yaw_deg, stops)
        };
        wait_for(|| worker.relit().filter(is_it)).rgb.clone()
    };
    let pictures = wanted.map(of);
    let view = |(yaw_deg, stops)| {
        let PreviewRequest {
            scene, environment, ..
        } = alone(yaw_deg, stops);
        Some(LookView { scene, environment })
    };
    let [a, b, c] = wanted.map(view);
    let mut request = ask(0, 7.0, &light);
    request.looks = [a, None, b, c];
    let shown = |request: &PreviewRequest| {
        worker.show(request.clone());
        let is_it = |relit: &Arc<PreviewPicture>| {
            let found = relit
                .looks
                .each_ref()
                .map(|one| one.as_ref().map(|(of, _)| of));
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
    go.send(()).unwrap();
    assert_eq!(begun.recv_timeout(PATIENCE), Ok(30));
    // The first field is taken in before the next one can replace it.
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
    assert!(
        left.rgb[0] > left.rgb[3 * 7],
        "light from the left is on the left"
    );
    assert!(left.passes.iter().any(|p| p.name == "predict" && p.ran));
    worker.show(ask(1, 0.0, &light));
    begun.recv_timeout(PATIENCE).unwrap();
    assert_eq!(begun.recv_timeout(PATIENCE), Ok(1));
    worker.show(ask(1, 180.0, &light));
    let turned = wait_for(|| worker.relit().filter(|r| r.scene.yaw_deg == 180.0));
    assert_eq!(turned.scene.frame, 0, "the frame at hand stands in");
    assert!(turned.rgb[0] < turned.rgb[3 * 7]);
    assert!(turned.passes.iter().any(|p| p.name == "predict" && !p.ran));
    drop(go);
}

#[test]
fn what_is_at_hand_is_not_predicted_again() {
    let (worker, go, begun) = slow_worker();
    let light = from_the_left();
    for frame in [0, 1, 0, 1] {
        // Too many words do no harm.
        go.send(()).unwrap();
        worker.show(ask(frame, 0.0, &light));
        wait_for(|| worker.relit().filter(|r| r.scene.frame == frame));
    }
    assert_eq!(begun.try_iter().collect::<Vec<_>>(), [0, 1]);
}

#[test]
fn a_job_runs_and_then_the_project_is_opened_again() {
    let (opened, openings) = channel();
    let open = move || {
        opened.send(()).unwrap();
        Err(Blocked {
            sentence: "no network".to_owned(),
            need: Some(Need::Network),
        })
    };
    let worker = Worker::over(open, || {});
    openings.recv_timeout(PATIENCE).unwrap();
    let job = Job::Import {
        project: PathBuf::from("nowhere"),
        shoot: PathBuf::from("no/such/shoot"),
        settings: ImportSettings { size: 128, seed: 1 },
        name: None,
        lamps: None,
    };
    worker.run(job).unwrap();
    openings.recv_timeout(PATIENCE).unwrap();
    let mut events = Vec::new();
    wait_for(|| {
        events.extend(worker.events());
        let blocked = events
            .iter()
            .filter(|e| matches!(e, Event::Blocked(_)))
            .count();
        (blocked == 2).then_some(())
    });
    let said = events.iter().find_map(|e| match e {
        Event::Finished { sentence } => Some(sentence.clone()),
        _ => None,
    });
    assert!(
        said.unwrap().contains("no/such/shoot"),
        "the failure is a sentence"
    );
    assert!(events.iter().any(|e| matches!(e, Event::Started { .. })));
}

/// A worker whose network, the `n`-th that was opened from 1, sees `1 / n` of the light; what it has
/// been asked to predict, as opening and frame. Opening fails where `fails` says so.
fn fading_worker(fails: fn(usize) -> bool) -> (Worker, Receiver<(usize, usize)>) {
    let (began, begun) = channel();
    let openings = AtomicUsize::new(0);
    let open = move || {
        let opening = openings.fetch_add(1, Ordering::Relaxed) + 1;
        if fails(opening) {
            return Err(Blocked {
                sentence: format!("opening {opening} failed"),
                need: Some(Need::Network),
            });
        }
        let began = began.clone();
        Ok(Source {
            rig: rig(),
            device: format!("opening {opening}"),
            predict: Box::new(move |index| {
                began.send((opening, index)).unwrap();
                let (frame, mut field) = predicted(index);
                if let Field::Memory(field) = &mut field {
                    field.values.iter_mut().for_each(|v| *v /= opening as f32);
                }
                Ok((frame, field).into())
            }),
            comparison: Box::new(|_, index| Ok(predicted(index).into())),
        })
    };
    (Worker::over(open, || {}), begun)
}

/// A job that does what it is told, until the words end or it is asked to stop.
fn told_job(worker: &Worker) -> Sender<fn(&Progress)> {
    let (tell, told) = channel::<fn(&Progress)>();
    let begun = worker.work("doing as told", move |progress| {
        while !progress.cancelled() {
            match told.recv_timeout(Duration::from_millis(1)) {
                Ok(word) => word(progress),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Ok("done".to_owned()),
            }
        }
        Ok("stopped".to_owned())
    });
    begun.unwrap();
    tell
}

fn wait_for_event(worker: &Worker, wanted: impl Fn(&Event) -> bool) -> Vec<Event> {
    let mut events = Vec::new();
    wait_for(|| {
        events.extend(worker.events());
        events
            .iter()
            .any(&wanted)
            .then(|| std::mem::take(&mut events))
    })
}

fn is_finished(event: &Event) -> bool {
    matches!(event, Event::Finished { .. })
}

#[test]
fn frames_are_predicted_while_a_job_runs() {
    let (worker, begun) = fading_worker(|_| false);
    let job = told_job(&worker);
    let light = from_the_left();
    for frame in 0..3 {
        worker.show(ask(frame, 0.0, &light));
        wait_for(|| worker.relit().filter(|r| r.scene.frame == frame));
    }
    assert_eq!(
        begun.try_iter().collect::<Vec<_>>(),
        [(1, 0), (1, 1), (1, 2)]
    );
    assert!(!worker.events().any(|event| is_finished(&event)));
    drop(job);
    wait_for_event(&worker, is_finished);
}

#[test]
fn what_is_shown_is_predicted_anew_by_each_network_that_is_saved() {
    let (worker, begun) = fading_worker(|_| false);
    let job = told_job(&worker);
    let light = from_the_left();
    worker.show(ask(1, 0.0, &light));
    wait_for(|| worker.relit().filter(|r| r.scene.frame == 1));
    worker.show(ask(0, 0.0, &light));
    let before = wait_for(|| worker.relit().filter(|r| r.scene.frame == 0));
    assert_eq!(before.frames_at_hand.len(), 2);
    let opened = |n: usize| {
        move |e: &Event| {
            *e == Event::Ready {
                device: format!("opening {n}"),
            }
        }
    };
    wait_for_event(&worker, opened(1));

    job.send(|progress| progress.saved()).unwrap();
    let events = wait_for_event(&worker, opened(2));
    assert!(
        !events.contains(&Event::Opening),
        "nothing is missing meanwhile"
    );
    let after = wait_for(|| worker.relit());
    assert_eq!(after.scene, before.scene);
    assert!(
        after.rgb[0] < before.rgb[0],
        "a darker network is seen as such: the level of the light stays"
    );
    assert_eq!(
        after.frames_at_hand.iter().collect::<Vec<_>>(),
        [&0],
        "the fields of the older network are gone"
    );
    worker.show(ask(1, 0.0, &light));
    wait_for(|| worker.relit().filter(|r| r.scene.frame == 1));
    assert_eq!(
        begun.try_iter().collect::<Vec<_>>(),
        [(1, 1), (1, 0), (2, 0), (2, 1)]
    );
}

#[test]
fn the_first_network_that_a_job_saves_is_shown_while_the_job_runs() {
    let (worker, _begun) = fading_worker(|opening| opening == 1);
    let job = told_job(&worker);
    worker.show(ask(0, 0.0, &from_the_left()));
    wait_for_event(&worker, |e| matches!(e, Event::Blocked(_)));
    job.send(|progress| progress.saved()).unwrap();
    wait_for(|| worker.relit());
    assert!(!worker.events().any(|event| is_finished(&event)));
}

#[test]
fn a_network_that_cannot_be_read_leaves_the_one_at_hand() {
    let (worker, begun) = fading_worker(|opening| opening == 2);
    let job = told_job(&worker);
    let light = from_the_left();
    worker.show(ask(0, 0.0, &light));
    wait_for(|| worker.relit());
    job.send(|progress| progress.saved()).unwrap();
    let failed =
        |e: &Event| matches!(e, Event::Failed { sentence } if sentence == "opening 2 failed");
    let events = wait_for_event(&worker, failed);
    assert!(!events.iter().any(|e| matches!(e, Event::Blocked(_))));
    worker.show(ask(1, 0.0, &light));
    wait_for(|| worker.relit().filter(|r| r.scene.frame == 1));
    assert_eq!(begun.try_iter().collect::<Vec<_>>(), [(1, 0), (1, 1)]);
}

#[test]
fn a_job_pauses_and_goes_on() {
    let (worker, _begun) = fading_worker(|_| false);
    let job = told_job(&worker);
    worker.pause(true);
    job.send(|progress| {
        progress.say("before");
        progress.wait_while_paused();
        progress.say("after");
    })
    .unwrap();
    let said = |what: &'static str| {
        move |e: &Event| *e == Event::Report(base::progress::Report::Say(what.to_owned()))
    };
    let events = wait_for_event(&worker, said("before"));
    assert!(!events.iter().any(said("after")));
    // Time for a job that does not wait to say so.
    std::thread::sleep(Duration::from_millis(50));
    assert!(!worker.events().any(|event| said("after")(&event)));
    worker.pause(false);
    wait_for_event(&worker, said("after"));
    drop(job);
    wait_for_event(&worker, is_finished);
}

#[test]
fn a_paused_job_can_be_stopped() {
    let (worker, _begun) = fading_worker(|_| false);
    let job = told_job(&worker);
    worker.pause(true);
    job.send(|progress| progress.wait_while_paused()).unwrap();
    worker.cancel();
    let events = wait_for_event(&worker, is_finished);
    assert!(events.contains(&Event::Finished {
        sentence: "stopped".to_owned()
    }));
}

#[test]
fn a_job_is_not_taken_twice() {
    let (worker, _begun) = fading_worker(|_| false);
    let job = told_job(&worker);
    assert_eq!(worker.running_job(), Some("doing as told"));
    let refused = worker.work("another", |_| Ok(String::new()));
    assert!(matches!(refused, Err(Error::Busy { .. })), "{refused:?}");
    assert_eq!(
        refused.unwrap_err().to_string(),
        worker.idle().unwrap_err().to_string()
    );
    drop(job);
    wait_for_event(&worker, is_finished);
    assert_eq!(worker.running_job(), None);
    worker.idle().unwrap();
    worker.work("another", |_| Ok(String::new())).unwrap();
    let events = wait_for_event(&worker, is_finished);
    assert!(events.contains(&Event::Started { what: "another" }));
}

#[test]
fn a_job_that_may_not_write_is_refused_with_the_reason_and_others_run() {
    let (mut worker, _begun) = fading_worker(|_| false);
    worker.refuse_writes("Another studio has it open".to_owned());
    let refused = worker.run(Job::GoBack {
        project: PathBuf::from("film"),
        to: "1".to_owned(),
    });
    let sentence = refused.unwrap_err().to_string();
    assert_eq!(
        sentence,
        "Nothing can be written here. Another studio has it open"
    );
    assert_eq!(worker.running_job(), None);
    let reads = Job::Pack {
        project: PathBuf::from("no/such/project"),
        to: PathBuf::from("network"),
    };
    worker.run(reads).unwrap();
    wait_for_event(&worker, is_finished);
}

#[test]
fn a_worker_that_is_dropped_amid_a_job_ends_it() {
    let alive = Arc::new(());
    let held = alive.clone();
    let (worker, _begun) = fading_worker(|_| false);
    let begun = worker.work("waiting for ever", move |progress| {
        let _held = held;
        while !progress.cancelled() {
            progress.wait_while_paused();
            std::thread::sleep(Duration::from_millis(1));
        }
        Ok(String::new())
    });
    begun.unwrap();
    wait_for_event(&worker, |e| matches!(e, Event::Started { .. }));
    worker.pause(true);
    drop(worker);
    assert_eq!(Arc::strong_count(&alive), 1);
}

#[test]
fn what_a_picture_is_compared_with_comes_with_it() {
    let open = || {
        Ok(Source {
            rig: rig(),
            device: "test".to_owned(),
            predict: Box::new(|index| Ok(predicted(index).into())),
            // Its lamps have changed places.
            comparison: Box::new(|rival, index| match rival {
                ComparisonSource::Exemplar(1) => {
                    let (frame, field) = predicted(index);
                    let Field::Memory(field) = field else {
                        unreachable!()
                    };
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
        worker.show(PreviewRequest {
            second: Some(second.clone()),
            solo: solo.to_vec(),
            ..ask(0, 0.0, &left)
        });
        wait_for(|| {
            worker
                .relit()
                .filter(|relit| relit.second.as_ref().map(|(of, _)| of) == Some(&second))
        })
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
    assert!(
        first[0] > first[1] && second[1] > second[0],
        "{first:?} {second:?}"
    );
    assert_eq!(
        [first[0], first[1]],
        [second[1], second[0]],
        "both at one level"
    );

    let rival = compared(Comparison::Olats(ComparisonSource::Exemplar(1)), &[]);
    assert_eq!(
        ends(&codes(&rival)),
        [first[1], first[0]],
        "at the level of the first"
    );

    // Any two of them, and their difference.
    let two = |inspection| {
        let mut wanted = ask(0, 0.0, &left);
        wanted.scene.effects.inspection = inspection;
        worker.show(PreviewRequest {
            first: Some(Comparison::Plate),
            second: Some(Comparison::Olats(ComparisonSource::Exemplar(1))),
            ..wanted.clone()
        });
        wait_for(|| {
            let relit = worker.relit()?;
            let whole = relit.first.is_some() && relit.second.is_some();
            (whole && relit.scene == wanted.scene).then_some(relit)
        })
    };
    let both = two(Inspection::Picture);
    assert_eq!(both.rgb, turned.rgb);
    assert_eq!(both.first.as_ref().unwrap().1.rgb, codes(&plate));
    assert_eq!(codes(&both), codes(&rival));
    let apart = two(Inspection::Difference { gain: 1.0 });
    let wanted: Vec<u8> = (codes(&plate).iter().zip(codes(&rival)))
        .map(|(a, b)| a.abs_diff(b))
        .collect();
    let (_, shown) = apart.first.as_ref().unwrap();
    let off = shown.rgb.iter().zip(&wanted).map(|(a, b)| a.abs_diff(*b));
    // Both codes were rounded before they were taken from each other here.
    assert!(off.max() <= Some(1));

    let alone = compared(Comparison::Plate, &[1]);
    let [left_end, right_end] = ends(&alone.rgb);
    assert!(left_end == 0 && right_end > 100, "{left_end} {right_end}");

    worker.show(PreviewRequest {
        second: Some(Comparison::Olats(ComparisonSource::Exemplar(0))),
        ..ask(0, 0.0, &left)
    });
    let said = wait_for(|| {
        worker.events().find_map(|event| match event {
            Event::Failed { sentence } => Some(sentence),
            _ => None,
        })
    });
    assert!(said.contains("Ask for pose 1"), "{said}");
}

#[test]
fn a_dropped_worker_is_gone() {
    let alive = Arc::new(());
    let held = alive.clone();
    let worker = Worker::over(
        move || {
            let held = held.clone();
            let predict = move |index| {
                let _ = &held;
                Ok(predicted(index).into())
            };
            Ok(Source {
                rig: rig(),
                device: "test".to_owned(),
                predict: Box::new(predict),
                comparison: Box::new(|_, index| Ok(predicted(index).into())),
            })
        },
        || {},
    );
    worker.show(ask(0, 0.0, &from_the_left()));
    wait_for(|| worker.relit());
    drop(worker);
    assert_eq!(
        Arc::strong_count(&alive),
        1,
        "no thread holds anything any more"
    );
}

#[path = "export_queue_tests.rs"]
mod export_queue_tests;

#[path = "drag_tests.rs"]
mod drag_tests;

#[path = "lost_tests.rs"]
mod lost_tests;

#[path = "panic_tests.rs"]
mod panic_tests;

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
        worker.show(PreviewRequest {
            table: Some(table.to_owned()),
            ..request
        });
    };
    through(&table, Inspection::Picture);
    let negative = wait_for(|| worker.relit().filter(|relit| relit.rgb != plain.rgb));
    let pairs = plain.rgb.iter().zip(&negative.rgb);
    assert!(negative.texture.is_none());
    assert!(pairs.clone().all(|(a, b)| (a.abs_diff(255 - b)) <= 1));
    // A file that changes is read again.
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
