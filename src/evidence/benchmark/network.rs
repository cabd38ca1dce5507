//! Training steps and predictions.

use super::budget::{Budget, Spread, timed};
use super::measure::{Figure, Tell};
use super::names::{PREDICTION, STEP};
use super::{LAMPS, data};
use base::error::Result;
use gpu::ComputeDevice;
use reflectance::Predictor;
use training::{Preset, Trainer};

/// Most runs of one kind.
const MOST: usize = 200;

/// Times predictions, then training steps, each for half of `seconds`. Predictions come first because steps have many
/// more kernels to tune.
///
/// # Errors
/// When the device fails, or the receiver of figures is gone.
pub fn network(preset: Preset, size: usize, seconds: f64, compute: &ComputeDevice, tell: Tell) -> Result<()> {
    let config = preset.config();
    let network = config.network_of(size, LAMPS);
    let mut trainer = Trainer::on_noise(config, network, &compute.device)?;
    let step = |trainer: &mut Trainer| {
        compute.guarded(|| {
            trainer.step(0.5);
            Ok(())
        })
    };
    let predictor = Predictor::new(trainer.network().clone(), trainer.info().clone(), &compute.device);
    predictions(&predictor, size, seconds / 2.0, compute, tell)?;
    drop(predictor);
    warm(STEP, seconds / 2.0, tell, || step(&mut trainer))
}

/// Times predictions. The network's output is complete, but stays on the device.
fn predictions(predictor: &Predictor, size: usize, seconds: f64, compute: &ComputeDevice, tell: Tell) -> Result<()> {
    let frame = data::frame(size);
    warm(PREDICTION, seconds, tell, || {
        compute.guarded(|| {
            let field = predictor.predict_on_device(&frame)?;
            // On a CPU the output is already in memory; on a GPU it is a buffer there.
            match &compute.gpu {
                Some(gpu) => {
                    let buffer = field.into_buffer(&gpu.device)?;
                    gpu.wait();
                    drop(buffer);
                }
                None => drop(field.read()?),
            }
            Ok(())
        })
    })
}

/// Times `work` for about `seconds` after its first run, which compiles kernels and allocates memory. Reports after the
/// first run, after the second, and at the end.
pub fn warm(what: &str, seconds: f64, tell: Tell, mut work: impl FnMut() -> Result<()>) -> Result<()> {
    let (first, ()) = timed(&mut work)?;
    let figure = |times: &[f64]| {
        let times = (!times.is_empty()).then(|| Spread::from_times(times.to_vec()));
        Figure {
            what: what.to_owned(),
            times,
            first_ms: Some((first - times.map_or(0.0, |times| times.median_ms)).max(0.0)),
            ..Figure::default()
        }
    };
    tell(figure(&[]))?;
    let (second, ()) = timed(&mut work)?;
    let mut times = vec![second];
    tell(figure(&times))?;
    // A first run that took longer than the whole allowance is not repeated.
    let left = seconds - second / 1e3;
    if left > 0.0 {
        times.extend(Budget::seconds(left, MOST).time(&mut work)?);
        tell(figure(&times))?;
    }
    Ok(())
}
