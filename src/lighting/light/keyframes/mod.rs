//! Keyframes: a number over the frames of a clip, such as the environment's yaw or a light's intensity.

mod key;
#[cfg(test)]
mod tests;

pub use key::{Interpolation, Key};

use base::error::{Error, Result};
use serde::{Deserialize, Serialize};
use std::str::FromStr;

/// Largest frame, value and slope of a key.
const LARGEST: f64 = 1e9;

/// Keys sorted by frame, at most one per frame, all finite.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "File", into = "File")]
pub struct Keyframes {
    /// Interpolation after keys without their own.
    pub interpolation: Interpolation,
    keys: Vec<Key>,
}

/// Unchecked content of a file.
#[derive(Clone, Serialize, Deserialize)]
struct File {
    #[serde(default)]
    interpolation: Interpolation,
    #[serde(default)]
    keys: Vec<Key>,
}

impl TryFrom<File> for Keyframes {
    type Error = Error;

    fn try_from(file: File) -> Result<Self> {
        let mut keyframes = Self { interpolation: file.interpolation, keys: Vec::new() };
        for key in file.keys {
            keyframes.put(key)?;
        }
        Ok(keyframes)
    }
}

impl From<Keyframes> for File {
    fn from(keyframes: Keyframes) -> Self {
        Self { interpolation: keyframes.interpolation, keys: keyframes.keys }
    }
}

impl Keyframes {
    /// No keys.
    pub const NONE: Self = Self { interpolation: Interpolation::Smooth, keys: Vec::new() };

    /// Keys sorted by frame.
    pub fn keys(&self) -> &[Key] {
        &self.keys
    }

    /// Index of the key at a frame.
    pub fn index_at(&self, frame: f64) -> Option<usize> {
        self.keys.iter().position(|key| key.frame == frame)
    }

    /// Sets the value at a frame. An existing key keeps its interpolation and tangents. A new key continues the
    /// curve. Returns the key's index.
    ///
    /// # Errors
    /// When a number is not finite or larger than 10⁹.
    pub fn insert(&mut self, frame: f64, value: f64) -> Result<usize> {
        let key = match self.index_at(frame) {
            Some(index) => self.keys[index],
            None => self.between(frame),
        };
        self.put(Key { frame, value, ..key })
    }

    /// A new key at a frame: it takes the interpolation of the key before it, and for Bézier the slope of the
    /// curve.
    fn between(&self, frame: f64) -> Key {
        let next = self.keys.partition_point(|key| key.frame <= frame);
        let Some(before) = next.checked_sub(1) else { return Key::default() };
        let cuts = next < self.keys.len() && self.kind(before) == Interpolation::Bezier;
        let slope = cuts.then(|| self.bezier(before).slope(frame));
        Key { interpolation: self.keys[before].interpolation, slope_in: slope, slope_out: slope, ..Key::default() }
    }

    /// Adds a key and replaces an existing one at its frame. Returns its index.
    ///
    /// # Errors
    /// When a number is not finite or larger than 10⁹.
    pub fn put(&mut self, key: Key) -> Result<usize> {
        let Key { frame, value, .. } = key;
        if !key.is_within(LARGEST) {
            return Err(Error::invalid(
                format!(
                    "keyframe value {value} at frame {frame} is out of range: values, frames and tangents are limited to 1000000000"
                ),
                "Give smaller numbers",
            ));
        }
        let at = self.keys.partition_point(|other| other.frame < frame);
        match self.keys.get_mut(at).filter(|other| other.frame == frame) {
            Some(other) => *other = key,
            None => self.keys.insert(at, key),
        }
        Ok(at)
    }

    /// Removes the key at `index`, if it exists.
    pub fn remove(&mut self, index: usize) -> Option<Key> {
        (index < self.keys.len()).then(|| self.keys.remove(index))
    }

    /// Moves the key at `index` to another frame and value and replaces an existing key there. Returns its new
    /// index.
    ///
    /// # Errors
    /// When the key does not exist, or as [`Self::put`]; the keys are unchanged then.
    pub fn shift(&mut self, index: usize, frame: f64, value: f64) -> Result<usize> {
        let mut moved = self.clone();
        let key = moved.remove(index).ok_or_else(|| self.without_key(index))?;
        let at = moved.put(Key { frame, value, ..key })?;
        *self = moved;
        Ok(at)
    }

    fn without_key(&self, index: usize) -> Error {
        Error::missing(
            format!("no key {index}: the {} keys are numbered from 0", self.keys.len()),
            "Choose an existing key",
        )
    }

    /// The keyframes with `by` added to every value.
    ///
    /// # Errors
    /// When a value becomes larger than 10⁹.
    pub fn plus(&self, by: f64) -> Result<Self> {
        let mut raised = Self { interpolation: self.interpolation, keys: Vec::new() };
        for key in &self.keys {
            raised.put(Key { value: key.value + by, ..*key })?;
        }
        Ok(raised)
    }

    /// Interpolation from the key at `index`; after the last key, [`Self::interpolation`].
    pub fn kind(&self, index: usize) -> Interpolation {
        let own = self.keys.get(index).and_then(|key| key.interpolation);
        own.unwrap_or(self.interpolation)
    }

    /// Sets the interpolation from the key at `index`, if it exists.
    pub fn set_kind(&mut self, index: usize, kind: Interpolation) {
        let own = (kind != self.interpolation).then_some(kind);
        if let Some(key) = self.keys.get_mut(index) {
            key.interpolation = own;
        }
    }

    /// Incoming and outgoing slopes of a Bézier curve at the key `index`, in values per frame; None without such a
    /// key.
    pub fn slopes(&self, index: usize) -> Option<[f64; 2]> {
        let key = self.keys.get(index)?;
        let automatic = self.slope(index);
        Some([key.slope_in, key.slope_out].map(|slope| slope.unwrap_or(automatic)))
    }

    /// Sets both slopes by hand; None for automatic.
    ///
    /// # Errors
    /// When the key does not exist, or a slope is not finite or larger than 10⁹.
    pub fn set_slopes(&mut self, index: usize, slopes: [Option<f64>; 2]) -> Result<()> {
        let key = self.keys.get(index).copied();
        let [slope_in, slope_out] = slopes;
        self.put(Key { slope_in, slope_out, ..key.ok_or_else(|| self.without_key(index))? })?;
        Ok(())
    }

    /// Value at a frame. Before the first key it is the first value, after the last key the last value. `None`
    /// without keys. A NaN frame counts as the first.
    pub fn at(&self, frame: f64) -> Option<f64> {
        let (first, last) = (self.keys.first()?, self.keys.last()?);
        let next = self.keys.partition_point(|key| key.frame <= frame);
        if next == 0 || frame.is_nan() {
            return Some(first.value);
        }
        if next == self.keys.len() {
            return Some(last.value);
        }
        let (a, b) = (self.keys[next - 1], self.keys[next]);
        let linear = a.value + (frame - a.frame) / (b.frame - a.frame) * (b.value - a.value);
        // Rounding may overshoot the end values.
        let within = |value: f64| value.clamp(a.value.min(b.value), a.value.max(b.value));
        let value = match self.kind(next - 1) {
            Interpolation::Hold => a.value,
            Interpolation::Linear => within(linear),
            Interpolation::Smooth => within(self.smooth(next - 1).value(frame)),
            Interpolation::Bezier => self.bezier(next - 1).value(frame),
        };
        // Nearly coincident keys can have slopes beyond the range of f64.
        Some(if value.is_finite() { value } else { linear })
    }

    /// Curve from the key at `index` to the next, with the slopes of [`Interpolation::Smooth`].
    fn smooth(&self, index: usize) -> Cubic {
        Cubic { ends: [self.keys[index], self.keys[index + 1]], slopes: [self.slope(index), self.slope(index + 1)] }
    }

    /// The same curve, with slopes set by hand where they exist.
    fn bezier(&self, index: usize) -> Cubic {
        let mut cubic = self.smooth(index);
        let [a, b] = cubic.ends;
        for (slope, own) in cubic.slopes.iter_mut().zip([a.slope_out, b.slope_in]) {
            *slope = own.unwrap_or(*slope);
        }
        cubic
    }

    /// Automatic slope at a key, in values per frame.
    fn slope(&self, index: usize) -> f64 {
        if index == 0 || index + 1 == self.keys.len() {
            return 0.0;
        }
        let [a, b, c] = [index - 1, index, index + 1].map(|i| self.keys[i]);
        let (before, after) = (b.frame - a.frame, c.frame - b.frame);
        let (into, out) = ((b.value - a.value) / before, (c.value - b.value) / after);
        if into * out <= 0.0 {
            return 0.0;
        }
        let (w1, w2) = (2.0 * after + before, after + 2.0 * before);
        (w1 + w2) / (w1 / into + w2 / out)
    }
}

/// Hermite cubic between two keys.
struct Cubic {
    ends: [Key; 2],
    /// Slopes at the start and the end, in values per frame.
    slopes: [f64; 2],
}

impl Cubic {
    fn value(&self, frame: f64) -> f64 {
        let [a, b] = self.ends;
        let span = b.frame - a.frame;
        let t = (frame - a.frame) / span;
        let [from, to] = self.slopes.map(|slope| slope * span);
        let (t2, t3) = (t * t, t * t * t);
        (2.0 * t3 - 3.0 * t2 + 1.0) * a.value
            + (t3 - 2.0 * t2 + t) * from
            + (3.0 * t2 - 2.0 * t3) * b.value
            + (t3 - t2) * to
    }

    /// Slope at a frame, within [`LARGEST`].
    fn slope(&self, frame: f64) -> f64 {
        let [a, b] = self.ends;
        let [from, to] = self.slopes;
        let span = b.frame - a.frame;
        let t = (frame - a.frame) / span;
        let slope = 6.0 * t * (1.0 - t) * (b.value - a.value) / span
            + (1.0 - t) * (1.0 - 3.0 * t) * from
            + t * (3.0 * t - 2.0) * to;
        if slope.is_finite() { slope.clamp(-LARGEST, LARGEST) } else { 0.0 }
    }
}

impl FromStr for Keyframes {
    type Err = String;

    /// Parses values at frames, such as `0:0,24:90`.
    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let mut keys = Self::default();
        for key in text.split(',') {
            let refuse = || format!("{key:?} is not FRAME:VALUE");
            let (frame, value) = key.split_once(':').ok_or_else(refuse)?;
            let number = |text: &str| text.trim().parse().map_err(|_| refuse());
            keys.insert(number(frame)?, number(value)?).map_err(|e| e.to_string())?;
        }
        Ok(keys)
    }
}
