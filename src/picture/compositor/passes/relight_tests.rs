//! Tests of the sum of lamps on the GPU.

use super::*;
use crate::relight::{lit_lamps, relight, relight_compressed, relight_half, tests::noise_field};
use reflectance::CompressedField;
use std::future::Future;
use std::pin::pin;
use std::task::{Context, Poll, Waker};
use test_support::{Need, found};

/// Waits for work that wgpu finishes at once outside browsers.
fn wait<T>(future: impl Future<Output = T>) -> T {
    let mut future = pin!(future);
    loop {
        if let Poll::Ready(value) = future.as_mut().poll(&mut Context::from_waker(Waker::noop())) {
            return value;
        }
        std::thread::yield_now();
    }
}

/// Any adapter's device, even a software one, without optional features; None without an adapter: the test then
/// returns.
pub fn any_device() -> Option<(wgpu::Device, wgpu::Queue)> {
    device(false)
}

/// Any adapter's device; with timestamps if `timed`.
pub fn device(timed: bool) -> Option<(wgpu::Device, wgpu::Queue)> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = wait(instance.request_adapter(&wgpu::RequestAdapterOptions::default()));
    let adapter = found(Need::Gpu, adapter)?;
    println!("on {}", adapter.get_info().name);
    let (need, required_features) =
        if timed { (Need::GpuClock, wgpu::Features::TIMESTAMP_QUERY) } else { (Need::Gpu, wgpu::Features::empty()) };
    let wanted = wgpu::DeviceDescriptor { required_features, ..Default::default() };
    found(need, wait(adapter.request_device(&wanted)))
}

fn pass() -> Option<RelightPass> {
    any_device().map(|(device, queue)| RelightPass::new(&device, &queue))
}

#[test]
fn what_the_shader_is_told_is_laid_out_as_it_says() {
    let module = naga::front::wgsl::parse_str(&RELIGHT.source()).unwrap();
    for (name, size, offsets) in [
        ("Shape", size_of::<Shape>(), &[0, 4, 8, 12][..]),
        ("Share", size_of::<Share>(), &[0, 12]),
        // Sizes that `halve` and `FieldBuffer::upload_half` reserve.
        ("Stored", 8, &[0, 4]),
        ("Search", 8, &[0, 4]),
    ] {
        let found = module.types.iter().map(|(_, found)| found);
        let found = found.filter(|found| found.name.as_deref() == Some(name));
        let [found] = found.collect::<Vec<_>>()[..] else {
            panic!("there must be one {name}");
        };
        let naga::TypeInner::Struct { span, members } = &found.inner else {
            panic!("{name} is not a struct");
        };
        assert_eq!(*span as usize, size, "{name}");
        let found: Vec<u32> = members.iter().map(|member| member.offset).collect();
        assert_eq!(found, offsets, "{name}");
    }
}

#[test]
fn the_gpu_agrees_with_its_twin() {
    let Some(pass) = pass() else { return };
    for (width, height, lamps) in [(1, 1, 1), (67, 45, 41), (128, 128, 7)] {
        let field = noise_field(width, height, lamps);
        let mut weights: Vec<[f32; 3]> = (0..lamps).map(|l| [0.1 * l as f32, 1.0, 3.0 / (1 + l) as f32]).collect();
        weights[lamps / 2] = [0.0; 3];
        weights[lamps - 1] = [1e6, 0.5, 2e5];
        let there = pass.run(&field, &weights).unwrap();
        let here = relight(&field, &weights, &lit_lamps(&weights));
        assert_eq!(there.size(), here.size());
        for (gpu, cpu) in there.pixels.iter().flatten().zip(here.pixels.iter().flatten()) {
            // All terms are positive: the order of 41 additions and their fusing change less than this.
            assert!((gpu - cpu).abs() <= 1e-5 * cpu.abs(), "{gpu} is not {cpu}");
        }
    }
}

#[test]
fn the_gpu_sums_halves_as_its_twin_does() {
    let Some(pass) = pass() else { return };
    for (width, height, lamps) in [(1, 1, 1), (67, 45, 41), (128, 128, 7)] {
        let field = noise_field(width, height, lamps);
        let half = HalfField::from(&field);
        let mut weights: Vec<[f32; 3]> =
            (0..lamps).map(|l| [0.1 + 0.1 * l as f32, 1.0, 3.0 / (1 + l) as f32]).collect();
        weights[lamps - 1] = [1e6, 0.5, 2e5];
        let there = pass.run_half(&half, &weights).unwrap();
        let here = relight_half(&half, &weights, &lit_lamps(&weights));
        let full = pass.run(&field, &weights).unwrap();
        assert_eq!(there.size(), here.size());
        for ((gpu, cpu), full) in
            (there.pixels.iter().flatten()).zip(here.pixels.iter().flatten()).zip(full.pixels.iter().flatten())
        {
            // As above; and halves are off by 2⁻¹¹.
            assert!((gpu - cpu).abs() <= 1e-5 * cpu, "{gpu} is not {cpu}");
            assert!((gpu - full).abs() <= (1e-5 + 0.5f32.powi(11)) * full);
        }
    }
    assert!(pass.run_half(&HalfField::from(&noise_field(4, 4, 3)), &[[1.0; 3]; 2]).is_err());
}

#[test]
fn the_gpu_halves_a_field_as_the_cpu_does() {
    let Some(pass) = pass() else { return };
    for (width, height, lamps) in [(1, 1, 1), (67, 45, 41), (128, 128, 7)] {
        for brightness in [1.0, 0.0, 3e-5, 7e7, 1e-38] {
            let mut field = noise_field(width, height, lamps);
            field.values.iter_mut().for_each(|v| *v *= brightness);
            let weights: Vec<[f32; 3]> = (0..lamps).map(|l| [0.1 * l as f32, 1.0, 3.0]).collect();
            let there = FieldBuffer::upload(&field, &pass.device);
            let there = pass.halve(&there).unwrap();
            assert!(matches!(there.format(), FieldFormat::Half { .. }));
            let there = pass.sum(&there, &weights).unwrap();
            let here = pass.run_half(&HalfField::from(&field), &weights).unwrap();
            // Denormals may be 0 both in halves and in f32.
            let small: f32 =
                weights.iter().map(|w| w[2]).sum::<f32>() * (brightness * 0.5f32.powi(29)).max(f32::MIN_POSITIVE);
            for (there, here) in (there.pixels.iter().flatten()).zip(here.pixels.iter().flatten()) {
                // A tie between two halves may be rounded either way.
                let bound = 0.5f32.powi(10) * here + small;
                assert!((there - here).abs() <= bound, "{there} is not {here}");
            }
        }
    }
    test_support::shown!(Pictures, "A field that a GPU stores in f16",
 bound: "as in memory", measured: "holds");
}

#[test]
fn nan_and_infinity_stay_when_a_gpu_halves_a_field() {
    let Some(pass) = pass() else { return };
    let mut field = noise_field(5, 5, 2);
    field.values[7] = f32::INFINITY;
    field.values[25 + 9] = f32::NAN;
    let half = pass.halve(&FieldBuffer::upload(&field, &pass.device)).unwrap();
    let lit = pass.sum(&half, &[[1.0; 3]; 2]).unwrap();
    let here = relight(&field, &[[1.0; 3]; 2], &[0, 1]);
    for (i, (there, here)) in lit.pixels.iter().zip(&here.pixels).enumerate() {
        for c in 0..3 {
            let bad = (i, c) == (7, 0) || (i, c) == (9, 1);
            assert_eq!(there[c].is_finite(), !bad, "{i} {c} {there:?}");
            assert!(bad || (there[c] - here[c]).abs() <= 1e-3 * here[c]);
        }
    }
}

#[test]
fn the_gpu_sums_components_as_its_twin_does() {
    let Some(pass) = pass() else { return };
    let field = noise_field(67, 45, 5);
    let weights = [[1e4, 0.0, 2.0], [0.0; 3], [1.0; 3], [0.5; 3], [0.0, 3.0, 0.0]];
    for error in [0.0, 0.2, 2.0] {
        let field = CompressedField::new(&field, error);
        let here = relight_compressed(&field, &weights);
        let there = FieldBuffer::upload_components(field, &pass.device);
        let there = pass.sum(&there, &weights).unwrap();
        let largest = here.pixels.as_flattened().iter().fold(0f32, |m, v| m.max(*v));
        for (there, here) in (there.pixels.iter().flatten()).zip(here.pixels.iter().flatten()) {
            assert!((there - here).abs() <= 1e-5 * largest, "{there} is not {here}");
        }
    }
}

#[test]
fn halves_of_dark_lamps_are_not_read_on_the_gpu() {
    let Some(pass) = pass() else { return };
    let mut field = noise_field(5, 5, 3);
    field.values[75..150].fill(f32::NAN);
    field.values[7] = f32::INFINITY;
    let half = HalfField::from(&field);
    let lit = pass.run_half(&half, &[[1.0; 3], [0.0; 3], [1.0; 3]]).unwrap();
    let bad = |i: &usize| lit.pixels[*i].iter().any(|v| !v.is_finite());
    assert_eq!((0..25).filter(bad).collect::<Vec<_>>(), [7]);
}

#[test]
fn nothing_to_sum_is_black_and_what_does_not_fit_is_refused() {
    let Some(pass) = pass() else { return };
    let field = noise_field(4, 4, 3);
    assert!(pass.run(&field, &[[0.0; 3]; 3]).unwrap().pixels.iter().all(|&p| p == [0.0; 3]));
    assert!(pass.run(&field, &[[1.0; 3]; 2]).is_err());
    let mut dark = field.clone();
    dark.values[48..96].fill(f32::NAN);
    let lit = pass.run(&dark, &[[1.0; 3], [0.0; 3], [1.0; 3]]).unwrap();
    assert!(lit.pixels.iter().flatten().all(|v| v.is_finite()));
}
