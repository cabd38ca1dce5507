use super::*;
use compositor::Field;
use footage::{Frame, ImportSettings};
use imaging::{Image, Mask};
use light::{Environment, Lamp, Rig};
use reflectance::ReflectanceField;
use scene::{Background, Inspection, Output, Scene};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::Duration;
use test_support::{PATIENCE, wait_for};

/// Two lamps of equal energy, left and right.
pub(crate) fn rig() -> Rig {
    let lamp = |x: f32| Lamp::new(format!("olat_{x}"), glam::Vec3::new(x, 0.0, 0.0));
    Rig { lamps: vec![lamp(-1.0), lamp(1.0)] }
}

/// A frame whose left half is lit by the left lamp alone.
pub(crate) fn predicted(index: usize) -> (Frame, Field) {
    let olat = |lit: fn(usize) -> bool| Image::from_fn(8, 8, |x, _| [if lit(x) { 0.5 } else { 0.0 }; 3]);
    let field = ReflectanceField::from_olats(&[olat(|x| x < 4), olat(|x| x >= 4)]);
    (Frame { index, plate: Image::filled(8, 8, [0.5; 3]), mask: Mask::filled(8, 8, 1.0) }, field.into())
}

/// A source of such predictions, compared with [`predicted`].
pub(crate) fn source(predict: impl FnMut(usize) -> Result<Prediction, Error> + 'static) -> Source {
    Source {
        rig: rig(),
        device: "test".to_owned(),
        predict: Box::new(predict),
        later: None,
        comparison: Box::new(|_, index| Ok(predicted(index).into())),
    }
}

/// A worker whose predictions each wait for a word; the sender of words; and the frame numbers.
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
        Ok(source(predict))
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
        frame_rate: 24.0,
        moving: false,
        texture: false,
    }
}

/// Light from camera-left alone.
pub(crate) fn from_the_left() -> Arc<Environment> {
    let radiance = Image::from_fn(64, 32, |x, _| [if x < 32 { 1.0 } else { 0.0 }; 3]);
    Arc::new(Environment::from_radiance("left", radiance))
}

/// A worker whose network, opened for the `n`-th time from 1, sees `1 / n` of the light; and the predictions
/// requested from it, as opening and frame. Openings fail where `fails` returns true.
fn fading_worker(fails: fn(usize) -> bool) -> (Worker, Receiver<(usize, usize)>) {
    let (began, begun) = channel();
    let openings = AtomicUsize::new(0);
    let open = move || {
        let opening = openings.fetch_add(1, Ordering::Relaxed) + 1;
        if fails(opening) {
            return Err(Blocked { sentence: format!("opening {opening} failed"), need: Some(Need::Calibration) });
        }
        let began = began.clone();
        let predict = move |index| {
            began.send((opening, index)).unwrap();
            let (frame, mut field) = predicted(index);
            if let Field::Memory(field) = &mut field {
                field.values.iter_mut().for_each(|v| *v /= opening as f32);
            }
            Ok((frame, field).into())
        };
        Ok(Source { device: format!("opening {opening}"), ..source(predict) })
    };
    (Worker::over(open, || {}), begun)
}

/// A job that runs the actions sent to it, until they end or it is stopped.
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
        events.iter().any(&wanted).then(|| std::mem::take(&mut events))
    })
}

fn is_finished(event: &Event) -> bool {
    matches!(event, Event::Finished { .. })
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
            Ok(source(predict))
        },
        || {},
    );
    worker.show(ask(0, 0.0, &from_the_left()));
    wait_for(|| worker.relit());
    drop(worker);
    assert_eq!(Arc::strong_count(&alive), 1, "all threads have released it");
}

#[path = "preview_tests.rs"]
mod preview_tests;

#[path = "job_tests.rs"]
mod job_tests;

#[path = "export_queue_tests.rs"]
mod export_queue_tests;

#[path = "drag_tests.rs"]
pub(crate) mod drag_tests;

#[path = "lost_tests.rs"]
mod lost_tests;

#[path = "panic_tests.rs"]
mod panic_tests;
