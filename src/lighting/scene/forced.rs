//! Passes switched on or off by the user, overriding the plan.

use super::Pass;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Forced passes: `true` to run one, `false` to skip it. Stored in files as a table keyed by pass name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "BTreeMap<Pass, bool>", into = "BTreeMap<Pass, bool>")]
pub struct Forced([Option<bool>; Pass::ALL.len()]);

impl Forced {
    /// Forced state of a pass; None if the plan decides.
    pub fn get(self, pass: Pass) -> Option<bool> {
        self.0[pass as usize]
    }

    /// Copy with a pass forced to run (`Some(true)`), forced off (`Some(false)`), or left to the plan (None).
    pub fn with(mut self, pass: Pass, run: Option<bool>) -> Self {
        self.0[pass as usize] = run;
        self
    }

    /// Number of forced passes.
    pub fn count(self) -> usize {
        self.0.iter().flatten().count()
    }
}

impl From<BTreeMap<Pass, bool>> for Forced {
    fn from(table: BTreeMap<Pass, bool>) -> Self {
        let all = table.into_iter();
        all.fold(Self::default(), |forced, (pass, run)| forced.with(pass, Some(run)))
    }
}

impl From<Forced> for BTreeMap<Pass, bool> {
    fn from(forced: Forced) -> Self {
        let entry = |pass| Some((pass, forced.get(pass)?));
        Pass::ALL.into_iter().filter_map(entry).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Effects;

    #[test]
    fn what_is_forced_is_kept_by_name() {
        let forced =
            Forced::default().with(Pass::LightWrap, Some(true)).with(Pass::Dither, Some(false));
        let text = serde_json::to_string(&forced).unwrap();
        assert_eq!(text, r#"{"light_wrap":true,"dither":false}"#);
        assert_eq!(serde_json::from_str::<Forced>(&text).unwrap(), forced);
        assert_eq!(forced.count(), 2);
        assert_eq!(forced.with(Pass::Dither, None).count(), 1);
    }

    #[test]
    fn a_forced_effect_is_asked_for_without_a_strength_and_one_forced_off_is_not() {
        let mut effects = Effects { glare: 0.5, ..Effects::default() };
        assert!(effects.asks(Pass::Glare) && !effects.asks(Pass::Grain));
        effects.forced = effects.forced.with(Pass::Glare, Some(false));
        effects.forced = effects.forced.with(Pass::Grain, Some(true));
        assert!(!effects.asks(Pass::Glare) && effects.asks(Pass::Grain));
    }
}
