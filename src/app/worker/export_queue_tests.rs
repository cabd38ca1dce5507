//! Exports in a queue, behind each other and behind jobs.

use super::*;

/// An export that writes one frame for each word, under the control of the test.
fn told_export(worker: &Worker, name: &str) -> (u64, Sender<()>) {
    let (tell, told) = channel::<()>();
    let said = name.to_owned();
    let id = worker.export(name.to_owned(), format!("settings of {name}"), move |progress| {
        let mut frames = 0;
        loop {
            progress.check(&format!("{frames} frames are kept"))?;
            match told.recv_timeout(Duration::from_millis(1)) {
                Ok(()) => frames += 1,
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) if said == "full" => {
                    return Err(Error::io("write", &said, std::io::ErrorKind::StorageFull.into(), "Make room"));
                }
                Err(RecvTimeoutError::Disconnected) => {
                    return Ok(WrittenExport {
                        name: format!("{said}, written"),
                        folder: PathBuf::from(&said),
                        sentence: format!("{frames} frames"),
                    });
                }
            }
            progress.step("exporting", frames, 10, "");
        }
    });
    (id, tell)
}

fn status(worker: &Worker, id: u64) -> Option<ExportStatus> {
    let exports = worker.exports().into_iter();
    exports.map(|e| (e.id, e.status)).find(|(i, _)| *i == id).map(|(_, s)| s)
}

fn wait_until(worker: &Worker, id: u64, wanted: impl Fn(&ExportStatus) -> bool) -> ExportStatus {
    wait_for(|| status(worker, id).filter(|s| wanted(s)))
}

#[test]
fn exports_are_written_one_after_the_other_and_behind_the_running_job() {
    let (worker, _begun) = fading_worker(|_| false);
    let job = told_job(&worker);
    let (first, tell_first) = told_export(&worker, "first");
    let (second, tell_second) = told_export(&worker, "second");
    drop(tell_second);
    // Time for an export that does not wait its turn.
    std::thread::sleep(Duration::from_millis(50));
    assert!(worker.exports().iter().all(|e| e.status == ExportStatus::Waiting));
    drop(job);
    wait_until(&worker, first, |s| *s == ExportStatus::Running);
    let refused = worker.work("another", |_| Ok(String::new()));
    assert!(matches!(refused, Err(Error::Busy { .. })), "an export is running");
    assert_eq!(worker.running_job(), None, "an export is not a job");
    assert_eq!(status(&worker, second), Some(ExportStatus::Waiting));
    for _ in 0..3 {
        tell_first.send(()).unwrap();
    }
    drop(tell_first);
    let done = wait_until(&worker, second, |s| matches!(s, ExportStatus::Done(_)));
    assert_eq!(done.sentence(), Some("0 frames"));
    let names: Vec<String> = worker.exports().into_iter().map(|e| e.name).collect();
    assert_eq!(names, ["first, written", "second, written"]);
    let first = wait_until(&worker, first, |s| matches!(s, ExportStatus::Done(_)));
    assert_eq!(first.sentence(), Some("3 frames"));
}

#[test]
fn a_cancelled_export_says_what_is_kept_and_the_next_one_is_written() {
    let (worker, begun) = fading_worker(|_| false);
    let (first, tell_first) = told_export(&worker, "first");
    let (full, tell_full) = told_export(&worker, "full");
    let (gone, tell_gone) = told_export(&worker, "gone");
    drop((tell_full, tell_gone));
    wait_until(&worker, first, |s| *s == ExportStatus::Running);
    tell_first.send(()).unwrap();
    let one = |e: &Event| matches!(e, Event::Report(base::progress::Report::Step { done: 1, .. }));
    wait_for_event(&worker, one);
    worker.withdraw(first);
    assert_eq!(status(&worker, first), Some(ExportStatus::Running), "it is running");
    worker.withdraw(gone);
    worker.cancel();
    let said = wait_until(&worker, first, |s| matches!(s, ExportStatus::Cancelled(_)));
    assert!(said.sentence().unwrap().contains("1 frames are kept"), "{said:?}");
    let said = wait_until(&worker, full, |s| matches!(s, ExportStatus::Failed(_)));
    assert!(said.sentence().unwrap().contains("Make room"), "{said:?}");
    assert_eq!(status(&worker, gone), None);
    worker.withdraw(first);
    assert_eq!(status(&worker, first), None);
    // The network is unchanged, so nothing is predicted again.
    let light = from_the_left();
    worker.show(ask(0, 0.0, &light));
    wait_for(|| worker.relit());
    assert_eq!(begun.try_iter().collect::<Vec<_>>(), [(1, 0)]);
}

#[test]
fn a_paused_export_goes_on_and_a_dropped_worker_ends_the_line() {
    let (worker, _begun) = fading_worker(|_| false);
    let (id, tell) = told_export(&worker, "first");
    let (_, tell_next) = told_export(&worker, "next");
    wait_until(&worker, id, |s| *s == ExportStatus::Running);
    worker.pause(true);
    // Time to see the request, and for an export that does not wait to end.
    std::thread::sleep(Duration::from_millis(50));
    drop(tell);
    std::thread::sleep(Duration::from_millis(50));
    assert_eq!(status(&worker, id), Some(ExportStatus::Running));
    worker.pause(false);
    wait_until(&worker, id, |s| matches!(s, ExportStatus::Done(_)));
    drop(worker);
    assert!(tell_next.send(()).is_err(), "the receiver is gone");
}

/// The jobs' thread may have read its mailbox just before the worker is dropped.
#[test]
fn nothing_begins_once_the_worker_is_about_to_stop() {
    let current = job_thread::CurrentJob::default();
    let running = current.begin(None).unwrap();
    current.close();
    assert!(running.stopped());
    let late = job_thread::CurrentJob::default();
    late.close();
    assert!(matches!(late.begin(None), Err(Error::Busy { .. })));
    test_support::shown!(
        Accidents,
        "An export is about to begin while its project is closed",
        done: "nothing begins once closing has begun",
    );
}

#[test]
fn waiting_exports_change_places_and_a_stopped_one_is_written_again() {
    let (worker, _begun) = fading_worker(|_| false);
    let job = told_job(&worker);
    let told: Vec<(u64, Sender<()>)> = ["a", "full", "c"].map(|name| told_export(&worker, name)).into_iter().collect();
    let [a, full, c] = [0, 1, 2].map(|at| told[at].0);
    let order = || worker.exports().into_iter().map(|export| export.id).collect::<Vec<_>>();
    worker.write_export_next(c);
    assert_eq!(order(), [c, a, full]);
    worker.write_export_next(c);
    assert_eq!(order(), [c, a, full], "the first stays");
    assert_eq!(worker.exports()[0].settings, "settings of c");
    // One that waits cannot be written again.
    worker.retry_export(a);
    assert_eq!(order(), [c, a, full]);
    drop(job);
    wait_until(&worker, c, |status| *status == ExportStatus::Running);
    worker.write_export_next(full);
    assert_eq!(order(), [c, full, a], "the running one stays first");
    worker.write_export_next(a);
    worker.cancel();
    wait_until(&worker, c, |status| matches!(status, ExportStatus::Cancelled(_)));
    wait_until(&worker, a, |status| *status == ExportStatus::Running);
    worker.retry_export(c);
    assert_eq!(order(), [a, full, c]);
    drop(told);
    let failed = wait_until(&worker, full, |status| matches!(status, ExportStatus::Failed(_)));
    assert!(failed.sentence().unwrap().contains("Make room"));
    let done = wait_until(&worker, c, |status| matches!(status, ExportStatus::Done(_)));
    assert_eq!(done.sentence(), Some("0 frames"));
    let retries: Vec<bool> = worker.exports().iter().map(|export| export.retries).collect();
    assert_eq!(retries, [false, true, false]);
    worker.retry_export(full);
    wait_until(&worker, full, |status| matches!(status, ExportStatus::Failed(_)));
}
