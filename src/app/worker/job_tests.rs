//! Jobs that run while pictures are made.

use super::*;

#[test]
fn a_job_runs_and_then_the_project_is_opened_again() {
    let (opened, openings) = channel();
    let open = move || {
        opened.send(()).unwrap();
        Err(Blocked { sentence: "no calibration".to_owned(), need: Some(Need::Calibration) })
    };
    let worker = Worker::over(open, || {});
    openings.recv_timeout(PATIENCE).unwrap();
    let job = Job::Import {
        project: PathBuf::from("nowhere"),
        shoot: PathBuf::from("no/such/shoot"),
        settings: ImportSettings { size: 128, seed: 1, layer: None },
        corrections: footage::LampSettings::default(),
        name: None,
        lamps: None,
    };
    worker.run(job).unwrap();
    openings.recv_timeout(PATIENCE).unwrap();
    let mut events = Vec::new();
    wait_for(|| {
        events.extend(worker.events());
        let blocked = events.iter().filter(|e| matches!(e, Event::Blocked(_))).count();
        (blocked == 2).then_some(())
    });
    let said = events.iter().find_map(|e| match e {
        Event::Finished { sentence } => Some(sentence.clone()),
        _ => None,
    });
    assert!(said.unwrap().contains("no/such/shoot"), "the failure is a sentence");
    assert!(events.iter().any(|e| matches!(e, Event::Started { .. })));
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
    assert_eq!(begun.try_iter().collect::<Vec<_>>(), [(1, 0), (1, 1), (1, 2)]);
    assert!(!worker.events().any(|event| is_finished(&event)));
    drop(job);
    wait_for_event(&worker, is_finished);
}

#[test]
fn what_is_shown_is_predicted_again_by_each_network_that_is_saved() {
    let (worker, begun) = fading_worker(|_| false);
    let job = told_job(&worker);
    let light = from_the_left();
    worker.show(ask(1, 0.0, &light));
    wait_for(|| worker.relit().filter(|r| r.scene.frame == 1));
    worker.show(ask(0, 0.0, &light));
    let before = wait_for(|| worker.relit().filter(|r| r.scene.frame == 0));
    assert_eq!(before.frames_at_hand.len(), 2);
    let opened = |n: usize| move |e: &Event| *e == Event::Ready { device: format!("opening {n}") };
    wait_for_event(&worker, opened(1));

    job.send(|progress| progress.saved()).unwrap();
    let events = wait_for_event(&worker, opened(2));
    assert!(!events.contains(&Event::Opening), "the window keeps its source meanwhile");
    let after = wait_for(|| worker.relit());
    assert_eq!(after.scene, before.scene);
    assert!(after.rgb[0] < before.rgb[0], "a darker network gives a darker picture: the level of the light stays");
    assert_eq!(after.frames_at_hand.iter().collect::<Vec<_>>(), [&0], "the fields of the older network are gone");
    worker.show(ask(1, 0.0, &light));
    wait_for(|| worker.relit().filter(|r| r.scene.frame == 1));
    assert_eq!(begun.try_iter().collect::<Vec<_>>(), [(1, 1), (1, 0), (2, 0), (2, 1)]);
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
    let failed = |e: &Event| matches!(e, Event::Failed { sentence } if sentence == "opening 2 failed");
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
    let said = |what: &'static str| move |e: &Event| *e == Event::Report(base::progress::Report::Say(what.to_owned()));
    let events = wait_for_event(&worker, said("before"));
    assert!(!events.iter().any(said("after")));
    // Time for a job that does not wait to report.
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
    assert!(events.contains(&Event::Finished { sentence: "stopped".to_owned() }));
}

#[test]
fn a_job_is_not_taken_twice() {
    let (worker, _begun) = fading_worker(|_| false);
    let job = told_job(&worker);
    assert_eq!(worker.running_job(), Some("doing as told"));
    let refused = worker.work("another", |_| Ok(String::new()));
    assert!(matches!(refused, Err(Error::Busy { .. })), "{refused:?}");
    assert_eq!(refused.unwrap_err().to_string(), worker.idle().unwrap_err().to_string());
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
    let refused = worker.run(Job::GoBack { project: PathBuf::from("film"), to: "1".to_owned() });
    let sentence = refused.unwrap_err().to_string();
    assert_eq!(sentence, "Read-only. Another studio has it open");
    assert_eq!(worker.running_job(), None);
    let reads = Job::Pack { project: PathBuf::from("no/such/project"), to: PathBuf::from("network") };
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
