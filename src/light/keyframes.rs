//! Keyframes: a number over the frames of a clip, such as the environment's yaw or a light's intensity.

use base::error::{Error, Result};
use serde::{Deserialize, Serialize};
use std::str::FromStr;

/// How a value goes from a key to the next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Interpolation {
    /// Evenly.
    Linear,
    /// With no corners and no overshoot: between two keys it never leaves their values. The monotone
    /// piecewise cubic of Fritsch and Carlson (SIAM J. Numer. Anal. 17, 1980), with the slopes of Fritsch and Butland
    /// (SIAM J. Sci. Stat. Comput. 5, 1984): the weighted harmonic mean of the neighbouring slopes, and 0 at
    /// peaks, valleys and ends.
    #[default]
    Smooth,
}

/// A value at a frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Key {
    /// The frame, which may lie between two.
    pub frame: f64,
    /// Values are interpolated as they are: a yaw from 0 to 720 turns twice.
    pub value: f64,
}

/// Keys in the order of their frames, no two at one frame, all finite.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "File", into = "File")]
pub struct Keyframes {
    pub interpolation: Interpolation,
    keys: Vec<Key>,
}

/// What a file holds, before it is checked.
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
        let mut keyframes = Self {
            interpolation: file.interpolation,
            keys: Vec::new(),
        };
        for key in file.keys {
            keyframes.insert(key.frame, key.value)?;
        }
        Ok(keyframes)
    }
}

impl From<Keyframes> for File {
    fn from(keyframes: Keyframes) -> Self {
        Self {
            interpolation: keyframes.interpolation,
            keys: keyframes.keys,
        }
    }
}

impl Keyframes {
    /// The keys in the order of their frames.
    pub fn keys(&self) -> &[Key] {
        &self.keys
    }

    /// Sets the value at a frame, replacing a key that is there. Returns the key's index.
    ///
    /// # Errors
    /// When a number is not finite or larger than 10⁹.
    pub fn insert(&mut self, frame: f64, value: f64) -> Result<usize> {
        const LARGEST: f64 = 1e9;
        if !(frame.abs() <= LARGEST && value.abs() <= LARGEST) {
            return Err(Error::invalid(
                format!(
                    "a keyframe cannot be {value} at frame {frame}: neither may exceed 1000000000"
                ),
                "Give smaller numbers",
            ));
        }
        let key = Key { frame, value };
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
    /// When there is no such key, or as [`Self::insert`]; nothing is moved then.
    pub fn shift(&mut self, index: usize, frame: f64, value: f64) -> Result<usize> {
        let mut moved = self.clone();
        moved.remove(index).ok_or_else(|| {
            Error::missing(
                format!(
                    "there is no key {index} among {} keys, numbered from 0",
                    self.keys.len()
                ),
                "Choose an existing key",
            )
        })?;
        let at = moved.insert(frame, value)?;
        *self = moved;
        Ok(at)
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
        let span = b.frame - a.frame;
        let t = (frame - a.frame) / span;
        let linear = a.value + t * (b.value - a.value);
        let value = match self.interpolation {
            Interpolation::Linear => linear,
            Interpolation::Smooth => {
                let (from, to) = (self.slope(next - 1) * span, self.slope(next) * span);
                // Hermite's cubic.
                let (t2, t3) = (t * t, t * t * t);
                (2.0 * t3 - 3.0 * t2 + 1.0) * a.value
                    + (t3 - 2.0 * t2 + t) * from
                    + (3.0 * t2 - 2.0 * t3) * b.value
                    + (t3 - t2) * to
            }
        };
        // Rounding may overshoot the ends.
        Some(value.clamp(a.value.min(b.value), a.value.max(b.value)))
    }

    /// The slope at a key, in values a frame.
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

impl FromStr for Keyframes {
    type Err = String;

    /// Values at frames, such as `0:0,24:90`.
    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let mut keys = Self::default();
        for key in text.split(',') {
            let refuse = || format!("{key:?} is not FRAME:VALUE");
            let (frame, value) = key.split_once(':').ok_or_else(refuse)?;
            let number = |text: &str| text.trim().parse().map_err(|_| refuse());
            keys.insert(number(frame)?, number(value)?)
                .map_err(|e| e.to_string())?;
        }
        Ok(keys)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn keyframes(keys: &[(f64, f64)], interpolation: Interpolation) -> Keyframes {
        let mut keyframes = Keyframes {
            interpolation,
            ..Keyframes::default()
        };
        for &(frame, value) in keys {
            keyframes.insert(frame, value).unwrap();
        }
        keyframes
    }

    fn any_keys() -> impl Strategy<Value = Keyframes> {
        let keys = proptest::collection::vec((-500.0f64..500.0, -1000.0f64..1000.0), 1..12);
        (keys, any::<bool>()).prop_map(|(keys, smooth)| {
            let kind = if smooth {
                Interpolation::Smooth
            } else {
                Interpolation::Linear
            };
            keyframes(&keys, kind)
        })
    }

    proptest! {
        #[test]
        fn keys_are_passed_through(keys in any_keys()) {
            for key in keys.keys() {
                prop_assert!((keys.at(key.frame).unwrap() - key.value).abs() < 1e-9);
            }
        }

        #[test]
        fn nothing_overshoots(keys in any_keys(), t in 0.0f64..1.0) {
            for pair in keys.keys().windows(2) {
                let value = keys.at(pair[0].frame + t * (pair[1].frame - pair[0].frame)).unwrap();
                let (low, high) = (pair[0].value.min(pair[1].value), pair[0].value.max(pair[1].value));
                prop_assert!((low..=high).contains(&value), "{value} between {low} and {high}");
            }
        }

        #[test]
        fn between_two_keys_a_value_only_rises_or_only_falls(keys in any_keys()) {
            for pair in keys.keys().windows(2) {
                let sign = (pair[1].value - pair[0].value).signum();
                let at = |i: i32| {
                    keys.at(pair[0].frame + f64::from(i) / 50.0 * (pair[1].frame - pair[0].frame)).unwrap()
                };
                for i in 0..50 {
                    prop_assert!(sign * (at(i + 1) - at(i)) >= -1e-9);
                }
            }
        }

        #[test]
        fn before_the_first_and_after_the_last_nothing_moves(keys in any_keys(), by in 0.0f64..1e6) {
            let (first, last) = (keys.keys()[0], *keys.keys().last().unwrap());
            prop_assert_eq!(keys.at(first.frame - by), Some(first.value));
            prop_assert_eq!(keys.at(last.frame + by), Some(last.value));
        }

        #[test]
        fn every_frame_has_a_number(keys in any_keys(), frame in any::<f64>()) {
            prop_assert!(keys.at(frame).unwrap().is_finite());
        }

        #[test]
        fn keys_stay_in_order(keys in any_keys(), index in 0usize..12, frame in -500.0f64..500.0) {
            let mut moved = keys.clone();
            let index = index % keys.keys().len();
            let at = moved.shift(index, frame, 7.0).unwrap();
            prop_assert_eq!(moved.keys()[at], Key { frame, value: 7.0 });
            prop_assert!(moved.keys().windows(2).all(|pair| pair[0].frame < pair[1].frame));
            prop_assert_eq!(moved.remove(at).unwrap().frame, frame);
            prop_assert_eq!(moved.keys().len(), keys.keys().len() - 1);
        }

        #[test]
        fn keyframes_survive_their_file(keys in any_keys()) {
            let text = toml::to_string(&keys).unwrap();
            prop_assert_eq!(toml::from_str::<Keyframes>(&text).unwrap(), keys);
        }
    }

    #[test]
    fn a_yaw_from_0_to_720_turns_twice() {
        for kind in [Interpolation::Linear, Interpolation::Smooth] {
            let keys = keyframes(&[(0.0, 0.0), (100.0, 720.0)], kind);
            assert_eq!(keys.at(50.0), Some(360.0));
        }
        let linear = keyframes(&[(0.0, 350.0), (10.0, 10.0)], Interpolation::Linear);
        assert_eq!(linear.at(5.0), Some(180.0));
    }

    #[test]
    fn a_steady_turn_through_three_keys_stays_steady_in_the_middle() {
        let keys = keyframes(
            &[(0.0, 0.0), (10.0, 30.0), (20.0, 60.0)],
            Interpolation::Smooth,
        );
        let slope = (keys.at(10.001).unwrap() - keys.at(9.999).unwrap()) / 0.002;
        assert!((slope - 3.0).abs() < 1e-3, "{slope}");
        // It sets out and arrives at rest.
        assert!(keys.at(0.1).unwrap() < 0.03);
    }

    #[test]
    fn an_extreme_is_flat_and_equal_keys_hold() {
        let keys = keyframes(
            &[(0.0, 0.0), (5.0, 8.0), (9.0, 8.0), (12.0, 1.0)],
            Interpolation::Smooth,
        );
        for frame in [5.0, 6.3, 8.9] {
            assert_eq!(keys.at(frame), Some(8.0));
        }
    }

    #[test]
    fn without_keys_there_is_no_value_and_nan_is_refused() {
        let mut keys = Keyframes::default();
        assert_eq!(keys.at(3.0), None);
        assert!(keys.insert(f64::NAN, 0.0).is_err() && keys.insert(0.0, f64::INFINITY).is_err());
        keys.insert(4.0, 1.0).unwrap();
        keys.insert(4.0, 2.0).unwrap();
        assert_eq!(
            keys.keys(),
            [Key {
                frame: 4.0,
                value: 2.0
            }]
        );
        assert!(keys.shift(1, 0.0, 0.0).is_err() && keys.shift(0, f64::NAN, 0.0).is_err());
        assert_eq!((keys.at(f64::NAN), keys.at(-1e300)), (Some(2.0), Some(2.0)));
        assert!(toml::from_str::<Keyframes>("keys = [{ frame = nan, value = 1.0 }]").is_err());
    }

    #[test]
    fn keys_are_read_or_refused() {
        let keys: Keyframes = "0:0, 24:-90.5".parse().unwrap();
        assert_eq!((keys.keys().len(), keys.at(24.0)), (2, Some(-90.5)));
        for text in ["", "3", "a:1", "1:nan", "1:2,"] {
            assert!(text.parse::<Keyframes>().is_err(), "{text}");
        }
    }
}
