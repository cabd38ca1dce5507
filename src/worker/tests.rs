use super::*;
use crate::footage::ImportSettings;
use crate::imaging::{Image, Mask};
use crate::light::{Environment, Lamp, Rig};
use crate::reflectance::ReflectanceField;
use crate::scene::{Background, Output, Scene};
use std::path::PathBuf;
use std::sync::mpsc::{Sender, channel};
use std::time::Duration;

const LONG: Duration = Duration::from_secs(30);

/// Two lamps of one energy, left and right.
fn rig() -> Rig {
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
fn predicted(index: usize) -> (Frame, Field) {
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
            Ok(predicted(index))
        };
        Ok(Source {
            rig: rig(),
            device: "test".to_owned(),
            predict: Box::new(predict),
        })
    };
    (Worker::over(open, || {}), go, begun)
}

fn ask(frame: usize, yaw_deg: f32, environment: &Arc<Environment>) -> Ask {
    let scene = Scene {
        frame,
        yaw_deg,
        exposure_stops: 0.0,
        background: Background::None,
        output: Output::Display,
    };
    Ask {
        scene,
        environment: environment.clone(),
    }
}

/// Light from camera-left alone.
fn from_the_left() -> Arc<Environment> {
    let radiance = Image::from_fn(64, 32, |x, _| [if x < 32 { 1.0 } else { 0.0 }; 3]);
    Arc::new(Environment::from_radiance("left", radiance))
}

fn wait_for<T>(mut get: impl FnMut() -> Option<T>) -> T {
    let started = std::time::Instant::now();
    loop {
        if let Some(value) = get() {
            return value;
        }
        assert!(started.elapsed() < LONG);
        std::thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn the_newest_frame_is_predicted_and_those_between_are_not() {
    let (worker, go, begun) = slow_worker();
    let light = from_the_left();
    worker.show(ask(0, 0.0, &light));
    assert_eq!(begun.recv_timeout(LONG), Ok(0));
    for frame in 1..=30 {
        worker.show(ask(frame, 0.0, &light));
        std::thread::sleep(Duration::from_millis(1));
    }
    go.send(()).unwrap();
    assert_eq!(begun.recv_timeout(LONG), Ok(30));
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
    begun.recv_timeout(LONG).unwrap();
    assert_eq!(begun.recv_timeout(LONG), Ok(1));
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
    openings.recv_timeout(LONG).unwrap();
    worker.run(Job::Import {
        project: PathBuf::from("nowhere"),
        shoot: PathBuf::from("no/such/shoot"),
        settings: ImportSettings { size: 128, seed: 1 },
    });
    openings.recv_timeout(LONG).unwrap();
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

#[test]
fn a_dropped_worker_is_gone() {
    let alive = Arc::new(());
    let held = alive.clone();
    let worker = Worker::over(
        move || {
            let held = held.clone();
            let predict = move |index| {
                let _ = &held;
                Ok(predicted(index))
            };
            Ok(Source {
                rig: rig(),
                device: "test".to_owned(),
                predict: Box::new(predict),
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
