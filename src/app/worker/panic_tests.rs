//! A panic in the threads of an open project. Other threads are tested next to their code.

use super::*;

fn worker_over(open: impl FnMut() -> Result<Source, Blocked> + Send + 'static) -> Worker {
    Worker::over(open, || {})
}

fn source() -> Source {
    super::source(|index| Ok(predicted(index).into()))
}

/// The first event that contains `on purpose`.
fn said(worker: &Worker) -> Event {
    wait_for(|| {
        let mut events = worker.events();
        events.find(|event| format!("{event:?}").contains("on purpose"))
    })
}

#[test]
fn a_panic_while_the_network_is_opened_is_said_and_the_next_opening_works() {
    let mut openings = 0;
    let worker = worker_over(move || {
        openings += 1;
        match openings {
            1 => panic!("on purpose"),
            _ => Ok(source()),
        }
    });
    let blocked = said(&worker);
    assert!(
        matches!(&blocked, Event::Blocked(blocked) if blocked.sentence.contains("bug in Afterlight")),
        "{blocked:?}"
    );
    let light = from_the_left();
    worker.show(ask(0, 0.0, &light));
    // After each job the source is opened again.
    worker.work("job", |_| Ok("done".to_owned())).unwrap();
    wait_for(|| worker.relit());
}

#[test]
fn a_panic_of_the_relighter_is_said_and_pictures_go_on() {
    let worker = worker_over(|| Ok(source()));
    let light = from_the_left();
    worker.show(ask(0, 0.0, &light));
    wait_for(|| worker.relit());
    worker.relighter.panic_next();
    worker.show(ask(0, 90.0, &light));
    assert!(matches!(said(&worker), Event::Failed { .. }));
    worker.show(ask(0, 180.0, &light));
    wait_for(|| worker.relit().filter(|relit| relit.scene.yaw_deg == 180.0));
}

#[test]
fn a_panic_of_the_job_thread_is_said_and_the_next_job_runs() {
    let worker = worker_over(|| Ok(source()));
    worker.jobs.panic_next();
    worker.work("job", |_| Ok("done".to_owned())).unwrap();
    assert!(matches!(said(&worker), Event::Finished { .. }));
    wait_for(|| worker.work("job", |_| Ok("done".to_owned())).ok());
}

#[test]
fn an_export_that_panics_has_failed_and_the_next_is_written() {
    let worker = worker_over(|| Ok(source()));
    let failed = worker.export("first".to_owned(), String::new(), |_| panic!("on purpose"));
    let written = worker.export("second".to_owned(), String::new(), |_| {
        Ok(WrittenExport { name: "second".to_owned(), folder: PathBuf::new(), sentence: "written".to_owned() })
    });
    assert!(matches!(said(&worker), Event::Exported(ExportStatus::Failed(_))));
    let exports = wait_for(|| {
        let exports = worker.exports();
        let over = exports.iter().all(|e| e.status.sentence().is_some());
        over.then_some(exports)
    });
    let sentence = |id| {
        let export = exports.iter().find(|export| export.id == id);
        export.and_then(|export| export.status.sentence()).unwrap()
    };
    assert!(sentence(failed).contains("on purpose"));
    assert_eq!(sentence(written), "written");
}
