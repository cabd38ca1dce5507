//! A network as it was about halfway through its training: where both disagree, training has not settled.

use super::cells::Differences;
use base::error::Result;
use footage::Frame;
use gpu::ComputeDevice;
use imaging::Image;
use project::Project;
use reflectance::{Predictor, ReflectanceField};
use std::ops::RangeInclusive;
use training::checkpoints;

/// The share of the steps after which a network may have been kept.
const HALFWAY: RangeInclusive<f64> = 0.2..=0.8;

/// A network, and what it was before if that was kept.
pub struct Network {
    pub predictor: Predictor,
    earlier: Option<Predictor>,
}

impl Network {
    /// The project's network. Of those that training kept, the one nearest to half of its steps is the earlier one.
    ///
    /// # Errors
    /// When there is none, or it cannot be read.
    pub fn open(project: &Project, compute: &ComputeDevice) -> Result<Self> {
        let predictor = Predictor::open(project, &compute.device)?;
        let present = predictor.info();
        let share = |step: u64| step as f64 / present.step.max(1) as f64;
        let kept = checkpoints::list(project).into_iter();
        let kept = kept.filter(|kept| {
            !kept.aside
                && kept.info.network == present.network
                && HALFWAY.contains(&share(kept.info.step))
        });
        let off = |step: u64| (share(step) - 0.5).abs();
        let nearest = kept.min_by(|a, b| off(a.info.step).total_cmp(&off(b.info.step)));
        let earlier = nearest
            .map(|kept| Predictor::open_at(project, &kept.folder(project), &compute.device))
            .transpose()?;
        Ok(Self { predictor, earlier })
    }

    /// Whether an earlier network was kept.
    pub fn has_past(&self) -> bool {
        self.earlier.is_some()
    }

    /// A frame's OLATs, and what they have changed since the earlier network.
    ///
    /// # Errors
    /// When the device fails.
    pub fn predict(&self, frame: &Frame) -> Result<(Vec<Image>, Option<Differences>)> {
        let olats = |predictor: &Predictor| -> Result<Vec<Image>> {
            let field: ReflectanceField = predictor.predict(frame)?;
            Ok((0..field.lamps).map(|lamp| field.olat(lamp)).collect())
        };
        let now = olats(&self.predictor)?;
        let changed = match &self.earlier {
            Some(earlier) => Some(Differences::of(&olats(earlier)?, &now, &frame.mask)),
            None => None,
        };
        Ok((now, changed))
    }
}
