//! A GPU that is lost while it makes pictures.

use super::*;
use compositor::passes::PicturePasses;
use reflectance::FieldBuffer;
use test_support::{Need, found};

/// A device for this test only.
fn own_device() -> Option<(wgpu::Device, wgpu::Queue)> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()));
    let adapter = found(Need::Gpu, adapters.first().ok_or("no adapter"))?;
    let device = pollster::block_on(adapter.request_device(&Default::default()));
    found(Need::Gpu, device)
}

/// A worker that lights frames on this device until it is lost.
fn worker_on(device: &wgpu::Device, queue: &wgpu::Queue) -> Worker {
    let (passes, gpu) = (Arc::new(PicturePasses::new(device, queue)), device.clone());
    let open = move || {
        let (passes, gpu) = (passes.clone(), gpu.clone());
        let there = !passes.is_lost();
        let predict = move |index| {
            let (frame, field) = predicted(index);
            let Field::Memory(olats) = &field else { unreachable!() };
            if !there {
                return Ok((frame, field).into());
            }
            passes.guarded(|| {
                let buffer = FieldBuffer::upload(olats, &gpu);
                Ok((frame, Field::Gpu(buffer, passes.clone())).into())
            })
        };
        Ok(Source { device: if there { "GPU" } else { "CPU" }.to_owned(), ..source(predict) })
    };
    Worker::over(open, || {})
}

#[test]
fn pictures_go_on_in_memory_when_the_gpu_is_lost() {
    let light = from_the_left();
    // It is lost before a frame is lit, or before one is predicted.
    for (frame, yaw_deg) in [(0, 90.0), (1, 0.0)] {
        let Some((device, queue)) = own_device() else { return };
        let worker = worker_on(&device, &queue);
        worker.show(ask(0, 0.0, &light));
        let there = wait_for(|| worker.relit());
        assert!(matches!(*there.predicted.field, Field::Gpu(..)));
        device.destroy();
        worker.show(ask(frame, yaw_deg, &light));
        let here = wait_for(|| {
            let relit = worker.relit();
            relit.filter(|relit| (relit.scene.frame, relit.scene.yaw_deg) == (frame, yaw_deg))
        });
        assert!(matches!(*here.predicted.field, Field::Memory(_)));
        assert_eq!(here.rgb.len(), there.rgb.len());
        let said: Vec<Event> = worker.events().collect();
        let ready = |device: &str| Event::Ready { device: device.to_owned() };
        let sentence = Error::GpuLost.to_string();
        for wanted in [ready("GPU"), Event::Failed { sentence }, ready("CPU")] {
            assert!(said.contains(&wanted), "{wanted:?} is not in {said:?}");
        }
    }
}

#[test]
fn a_fault_of_a_job_or_of_a_prediction_is_said_and_its_thread_goes_on() {
    let open = || {
        Ok(source(|index| match index {
            0 => panic!("on purpose"),
            _ => Ok(predicted(index).into()),
        }))
    };
    let worker = Worker::over(open, || {});
    let light = from_the_left();
    let said = |worker: &Worker, wanted: fn(&Event) -> bool| {
        wait_for(|| {
            let mut events = worker.events();
            events.find(|event| wanted(event) && format!("{event:?}").contains("on purpose"))
        })
    };
    worker.show(ask(0, 0.0, &light));
    said(&worker, |event| matches!(event, Event::Failed { .. }));
    worker.show(ask(1, 0.0, &light));
    wait_for(|| worker.relit());
    worker.work("job", |_| panic!("on purpose")).unwrap();
    said(&worker, |event| matches!(event, Event::Finished { .. }));
    wait_for(|| worker.work("job", |_| Ok("done".to_owned())).ok());
}
