//! Keyframes: a number over the frames of a clip, such as the environment's yaw or a light's intensity.

mod key;
#[cfg(test)]
mod tests;

pub use key::{Interpolation, Key};

use base::error::{Error, Result};
use serde::{Deserialize, Serialize};
use std::str::FromStr;

/// The largest frame, value and slope of a key.
const LARGEST: f64 = 1e9;

/// Keys in the order of their frames, no two at one frame, all finite.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "File", into = "File")]
pub struct Keyframes {
    /// Interpolation after keys that have none of their own.
    pub interpolation: Interpolation,
    keys: Vec<Key>,
}

/// Content of a file, before it is checked.
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

    /// The keys in the order of their frames.
    pub fn keys(&self) -> &[Key] {
        &self.keys
    }

    /// The index of the key at a frame.
    pub fn index_at(&self, frame: f64) -> Option<usize> {
        self.keys.iter().position(|key| key.frame == frame)
    }

    /// Sets the value at a frame. A key that is there keeps its interpolation and its tangents; a new one goes on as the
    /// curve does there. Returns the key's index.
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

    /// A new key at a frame: it goes on as the key before it, and where that is Bézier with the curve's slope.
    fn between(&self, frame: f64) -> Key {
        let next = self.keys.partition_point(|key| key.frame <= frame);
        let Some(before) = next.checked_sub(1) else {
            return Key::default();
        };
        let cuts = next < self.keys.len() && self.kind(before) == Interpolation::Bezier;
        let slope = cuts.then(|| self.bezier(before).slope(frame));
        Key {
            interpolation: self.keys[before].interpolation,
            slope_in: slope,
            slope_out: slope,
            ..Key::default()
        }
    }

    /// Adds a key, replacing one at its frame. Returns its index.
    ///
    /// # Errors
    /// When a number is not finite or larger than 10⁹.
    pub fn put(&mut self, key: Key) -> Result<usize> {
        let Key { frame, value, .. } = key;
        if !key.is_within(LARGEST) {
            return Err(Error::invalid(
                format!(
                    "a keyframe cannot be {value} at frame {frame}: neither may exceed 1000000000, nor may its tangents"
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

    /// Removes the key at `index`, if there is one.
    pub fn remove(&mut self, index: usize) -> Option<Key> {
        (index < self.keys.len()).then(|| self.keys.remove(index))
    }

    /// Moves the key at `index` to another frame and value, replacing a key that is there. Returns its new index.
    ///
    /// # Errors
    /// When there is no such key, or as [`Self::put`]; nothing is moved then.
    pub fn shift(&mut self, index: usize, frame: f64, value: f64) -> Result<usize> {
        let mut moved = self.clone();
        let key = moved.remove(index).ok_or_else(|| self.without_key(index))?;
        let at = moved.put(Key { frame, value, ..key })?;
        *self = moved;
        Ok(at)
    }

    fn without_key(&self, index: usize) -> Error {
        Error::missing(
            format!("there is no key {index} among {} keys, numbered from 0", self.keys.len()),
            "Choose an existing key",
        )
    }

    /// The same with `by` added to every value.
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

    /// Interpolation from the key at `index`; beyond the last one, that of [`Self::interpolation`].
    pub fn kind(&self, index: usize) -> Interpolation {
        let own = self.keys.get(index).and_then(|key| key.interpolation);
        own.unwrap_or(self.interpolation)
    }

    /// Sets how the value goes on from the key at `index`, if there is one.
    pub fn set_kind(&mut self, index: usize, kind: Interpolation) {
        let own = (kind != self.interpolation).then_some(kind);
        if let Some(key) = self.keys.get_mut(index) {
            key.interpolation = own;
        }
    }

    /// The slopes with which a Bézier curve comes into the key at `index` and goes out of it, in values a frame; None if
    /// there is no such key.
    pub fn slopes(&self, index: usize) -> Option<[f64; 2]> {
        let key = self.keys.get(index)?;
        let automatic = self.slope(index);
        Some([key.slope_in, key.slope_out].map(|slope| slope.unwrap_or(automatic)))
    }

    /// Sets these slopes by hand; None for automatic ones.
    ///
    /// # Errors
    /// When there is no such key, or a slope is not finite or larger than 10⁹.
    pub fn set_slopes(&mut self, index: usize, slopes: [Option<f64>; 2]) -> Result<()> {
        let key = self.keys.get(index).copied();
        let [slope_in, slope_out] = slopes;
        self.put(Key { slope_in, slope_out, ..key.ok_or_else(|| self.without_key(index))? })?;
        Ok(())
    }

    /// The value at a frame: before the first key that key's, after the last one that key's. `None` without keys; a
    /// NaN frame counts as the first.
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
        // Rounding may overshoot the ends.
        let within = |value: f64| value.clamp(a.value.min(b.value), a.value.max(b.value));
        let value = match self.kind(next - 1) {
            Interpolation::Hold => a.value,
            Interpolation::Linear => within(linear),
            Interpolation::Smooth => within(self.smooth(next - 1).value(frame)),
            Interpolation::Bezier => self.bezier(next - 1).value(frame),
        };
        // Keys that almost coincide can have slopes that no number holds.
        Some(if value.is_finite() { value } else { linear })
    }

    /// The curve from the key at `index` to the next with the slopes of [`Interpolation::Smooth`].
    fn smooth(&self, index: usize) -> Cubic {
        Cubic {
            ends: [self.keys[index], self.keys[index + 1]],
            slopes: [self.slope(index), self.slope(index + 1)],
        }
    }

    /// The same with the slopes that are set by hand, where they are.
    fn bezier(&self, index: usize) -> Cubic {
        let mut cubic = self.smooth(index);
        let [a, b] = cubic.ends;
        for (slope, own) in cubic.slopes.iter_mut().zip([a.slope_out, b.slope_in]) {
            *slope = own.unwrap_or(*slope);
        }
        cubic
    }

    /// The automatic slope at a key, in values a frame.
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

/// Hermite's cubic between two keys.
struct Cubic {
    ends: [Key; 2],
    /// Slopes at its beginning and its end, in values a frame.
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

    /// Its slope at a frame, within [`LARGEST`].
    fn slope(&self, frame: f64) -> f64 {
        let [a, b] = self.ends;
        let [from, to] = self.slopes;
        let span = b.frame - a.frame;
        let t = (frame - a.frame) / span;
        let slope = 6.0 * t * (1.0 - t) * (b.value - a.value) / span
            + (1.0 - t) * (1.0 - 3.0 * t) * from
            + t * (3.0 * t - 2.0) * to;
        match slope.is_finite() {
            true => slope.clamp(-LARGEST, LARGEST),
            false => 0.0,
        }
    }
}

impl FromStr for Keyframes {
    type Err = String;

    /// Values at frames, such as `0:0,24:90`.
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
