//! Decisions of the relighter, without a thread.

use super::*;
use crate::ComparisonSource;
use crate::tests::drag_tests::filmed;
use crate::tests::{ask, from_the_left, predicted, rig};
use compositor::FineLight;
use imaging::Image;
use light::Environment;
use std::sync::Mutex;

type Tell = Box<dyn Fn(Event)>;

/// A relighter, its requests to the network, and its output for the window.
struct Bench {
    relighter: Relighter<Tell>,
    network: Arc<Mailbox<NetworkRequest>>,
    pictures: Arc<Latest<Arc<PreviewPicture>>>,
    told: Arc<Mutex<Vec<Event>>>,
    light: Arc<Environment>,
}

impl Bench {
    /// A bench whose source was opened once.
    fn new(budget_ms: f64) -> Self {
        let network = Mailbox::new();
        let pictures = Arc::new(Latest::new(|| {}));
        let told = Arc::new(Mutex::new(Vec::new()));
        let events = told.clone();
        let tell: Tell = Box::new(move |event| events.lock().unwrap().push(event));
        let mut bench = Self {
            relighter: Relighter::new(network.clone(), pictures.clone(), tell, budget_ms, STILL),
            network,
            pictures,
            told,
            light: from_the_left(),
        };
        bench.open(1, rig());
        bench
    }

    /// Delivers a request, and handles the thread's own follow-up requests.
    fn hear(&mut self, mut request: RelighterRequest) {
        loop {
            let answer = self.relighter.work(&mut request);
            self.relighter.deliver(request, answer);
            match self.relighter.rest() {
                Some((Duration::ZERO, next)) => request = next,
                _ => return,
            }
        }
    }

    fn open(&mut self, generation: u64, rig: Rig) {
        self.hear(RelighterRequest::Opened(OpenedSource { generation, rig: Arc::new(rig) }));
    }

    fn predict(&mut self, generation: u64, frame: usize) {
        self.hear(RelighterRequest::Predicted(frame_of(generation, frame)));
    }

    fn show(&mut self, frame: usize, yaw_deg: f32) {
        let request = ask(frame, yaw_deg, &self.light);
        self.hear(RelighterRequest::Show(Box::new(request)));
    }

    /// The newest picture's frame and yaw, once.
    fn picture(&self) -> Option<(usize, f32)> {
        let picture = self.pictures.take();
        picture.map(|picture| (picture.scene.frame, picture.scene.yaw_deg))
    }

    /// The frame requested from the network, once.
    fn asked(&self) -> Option<FrameRequest> {
        self.network.take().map(|request| match request {
            NetworkRequest::Predict(frame) => frame,
            _ => panic!("an unexpected request"),
        })
    }
}

fn frame_of(generation: u64, index: usize) -> Arc<PredictedFrame> {
    Arc::new(PredictedFrame::new(predicted(index).into(), generation, 1.0))
}

fn request(generation: u64, frame: usize) -> Option<FrameRequest> {
    Some(FrameRequest { generation, frame })
}

#[test]
fn a_missing_frame_is_asked_for_once_and_the_nearest_stands_in_for_it() {
    let mut bench = Bench::new(f64::MAX);
    bench.show(0, 0.0);
    assert_eq!((bench.picture(), bench.asked()), (None, request(1, 0)));
    bench.predict(1, 0);
    assert_eq!(bench.picture(), Some((0, 0.0)));
    bench.show(7, 0.0);
    // The picture is unchanged: frame 0 in the same light.
    assert_eq!((bench.picture(), bench.asked()), (None, request(1, 7)));
    bench.show(7, 90.0);
    assert_eq!((bench.picture(), bench.asked()), (Some((0, 90.0)), None));
    bench.predict(1, 7);
    assert_eq!(bench.picture(), Some((7, 90.0)));
    // A request without an answer is repeated only after another frame.
    bench.show(9, 90.0);
    bench.show(9, 0.0);
    assert_eq!((bench.asked(), bench.asked()), (request(1, 9), None));
    bench.show(7, 0.0);
    bench.show(9, 0.0);
    assert_eq!(bench.asked(), request(1, 9));
}

#[test]
fn the_same_picture_is_not_made_twice() {
    let mut bench = Bench::new(f64::MAX);
    bench.predict(1, 0);
    bench.show(0, 30.0);
    assert_eq!(bench.picture(), Some((0, 30.0)));
    bench.show(0, 30.0);
    assert_eq!(bench.picture(), None);
    bench.show(0, 31.0);
    assert_eq!(bench.picture(), Some((0, 31.0)));
}

#[test]
fn under_the_same_lamps_the_picture_stays_until_a_newer_network_has_predicted_it() {
    let mut bench = Bench::new(f64::MAX);
    bench.predict(1, 0);
    bench.show(0, 0.0);
    assert_eq!(bench.picture(), Some((0, 0.0)));
    bench.open(2, rig());
    assert_eq!((bench.picture(), bench.asked()), (None, request(2, 0)));
    bench.show(0, 45.0);
    assert_eq!(bench.picture(), Some((0, 45.0)), "from the older network");
    bench.predict(1, 0);
    assert_eq!(bench.picture(), None, "later answers of the older network are dropped");
    bench.predict(2, 0);
    assert_eq!(bench.picture(), Some((0, 45.0)));
    let mut other = rig();
    other.lamps.swap(0, 1);
    bench.open(3, other);
    bench.show(0, 50.0);
    assert_eq!(bench.picture(), None, "no field fits the other lamps");
}

#[test]
fn a_coarse_picture_is_made_again_at_full_size_when_the_pointer_rests() {
    let mut bench = Bench::new(0.0);
    bench.predict(1, 0);
    bench.show(0, 0.0);
    bench.pictures.take();
    let dragged = PreviewRequest { moving: true, ..ask(0, 20.0, &bench.light) };
    bench.hear(RelighterRequest::Show(Box::new(dragged)));
    let coarse = bench.pictures.take().unwrap();
    assert!(coarse.coarse > 1);
    let (wait, rested) = bench.relighter.rest().unwrap();
    assert_eq!(wait, STILL);
    bench.hear(rested);
    let sharp = bench.pictures.take().unwrap();
    assert_eq!((sharp.coarse, sharp.scene.yaw_deg), (1, 20.0));
    assert!(bench.relighter.rest().is_none());
}

/// Fine light that brightens every third column.
#[derive(Debug)]
struct Columns;

impl FineLight for Columns {
    fn is_ready(&self) -> bool {
        true
    }

    fn ratio(&self, weights: &[[f32; 3]]) -> Option<Image> {
        let light: f32 = weights.iter().map(|weight| weight[1]).sum();
        let column = |x: usize, _| [if x.is_multiple_of(3) { light } else { 0.0 }; 3];
        Some(Image::from_fn(320, 401, column))
    }

    fn bytes(&self) -> usize {
        0
    }
}

#[test]
fn fine_light_waits_until_nothing_moves() {
    // Each picture is quick enough, so none is coarse.
    let mut bench = Bench::new(f64::MAX);
    let mut predicted = filmed(0);
    let plate = predicted.plate.take();
    predicted.plate = plate.map(|plate| plate.with_fine_light(Arc::new(Columns)));
    let predicted = Arc::new(PredictedFrame::new(predicted, 1, 1.0));
    bench.hear(RelighterRequest::Predicted(predicted));
    let moving = PreviewRequest { moving: true, ..ask(0, 40.0, &bench.light) };
    bench.hear(RelighterRequest::Show(Box::new(moving)));
    let draft = bench.pictures.take().unwrap();
    let (wait, rested) = bench.relighter.rest().unwrap();
    assert_eq!(wait, STILL);
    bench.hear(rested);
    let sharp = bench.pictures.take().unwrap();
    assert!(bench.relighter.rest().is_none());
    assert_eq!((draft.coarse, sharp.coarse), (1, 1));
    assert_eq!((draft.draft, sharp.draft), (true, false));
    let code = |relit: &PreviewPicture, x| relit.codes([x, 200]).unwrap()[1];
    assert!(code(&sharp, 162) > code(&draft, 162) + 10);
    assert_eq!(code(&sharp, 161), code(&draft, 161));
}

#[test]
fn a_failure_is_said_once_and_a_lost_device_is_replaced() {
    let mut bench = Bench::new(f64::MAX);
    bench.predict(1, 0);
    bench.show(0, 0.0);
    bench.pictures.take();
    // Weights for a different number of lamps than the field's.
    let mut other = rig();
    other.lamps.pop();
    bench.open(2, other);
    bench.predict(2, 0);
    let told = std::mem::take(&mut *bench.told.lock().unwrap());
    assert!(matches!(&told[..], [Event::Failed { sentence }] if sentence.contains("lamp")), "{told:?}");
    assert!(bench.relighter.rest().is_none(), "a failed picture is not tried again");
    while bench.network.take().is_some() {}
    let lost = RelighterRequest::Relight { rested: false };
    bench.relighter.deliver(lost, Err(Error::GpuLost));
    assert!(matches!(bench.network.take(), Some(NetworkRequest::Open)));
    assert_eq!(bench.relighter.cache.indices().count(), 0);
    bench.show(0, 10.0);
    assert_eq!(bench.picture(), None, "fields on the device are gone");
}

#[test]
fn olats_to_compare_with_are_asked_for_once_and_those_of_another_frame_are_dropped() {
    let mut bench = Bench::new(f64::MAX);
    bench.predict(1, 0);
    let second = Some(Comparison::Olats(ComparisonSource::Exemplar(2)));
    let compared = |yaw_deg| PreviewRequest { second: second.clone(), ..ask(0, yaw_deg, &bench.light) };
    let [first, turned] = [0.0, 10.0].map(compared);
    bench.hear(RelighterRequest::Show(Box::new(first)));
    let Some(NetworkRequest::Compare(1, wanted)) = bench.network.take() else {
        panic!("no request");
    };
    assert_eq!((wanted.frame, wanted.generation), (0, 1));
    assert!(bench.pictures.take().unwrap().second.is_none());
    bench.hear(RelighterRequest::Show(Box::new(turned)));
    assert!(bench.network.take().is_none(), "it is already on its way");
    bench.pictures.take();
    let found = |of: ComparisonRequest| {
        let found = frame_of(1, of.frame);
        RelighterRequest::Compared(1, FoundComparison { of, found })
    };
    let other = ComparisonRequest { frame: 3, ..wanted.clone() };
    bench.hear(found(other));
    assert!(bench.pictures.take().is_none());
    bench.hear(found(wanted));
    assert!(bench.pictures.take().unwrap().second.is_some());
}
