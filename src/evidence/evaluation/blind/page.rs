//! The page, and the key to its codes.

use super::answers::{HEADER, Question};
use super::clips::Clips;
use super::key::{Key, Shown};
use base::Fnv;
use base::error::{Error, Result};
use base64::prelude::{BASE64_STANDARD, Engine};
use project::Project;
use serde::Serialize;
use std::collections::BTreeMap;

/// The page without its study.
const PAGE: &str = include_str!("page.html");
/// Placeholder for the study in the page.
const PLACE: &str = "{{STUDY}}";

/// Input of the page's script.
#[derive(Serialize)]
struct Study {
    study: String,
    /// Frames a second.
    rate: f64,
    header: &'static str,
    questions: Vec<Asked>,
    /// Reference → picture.
    references: BTreeMap<String, String>,
    /// Clip → pictures.
    clips: BTreeMap<String, Vec<String>>,
    /// Trial → its two clips and reference.
    trials: BTreeMap<String, Trial>,
}

#[derive(Serialize)]
struct Asked {
    name: &'static str,
    text: &'static str,
}

#[derive(Serialize)]
struct Trial {
    clips: [String; 2],
    reference: String,
}

/// Page of these clips, and its key. Codes are derived from the pictures alone: they reveal nothing, and the same clips
/// give the same page.
///
/// # Errors
/// When the study cannot be encoded as JSON.
pub(super) fn page(project: &Project, clips: &Clips) -> Result<(Key, String)> {
    let mut order: Vec<(u64, usize)> =
        (clips.clips.iter().enumerate()).map(|(i, clip)| (hash(&clip.pictures).0, i)).collect();
    order.sort_unstable();
    let study = hash(order.iter().map(|(own, _)| own.to_le_bytes())).to_string();
    let code = |place: usize| format!("c{:02}", place + 1);
    let codes: BTreeMap<usize, String> =
        (order.iter().enumerate()).map(|(place, (_, clip))| (*clip, code(place))).collect();
    let mut pairs = Vec::new();
    for (a, (_, first)) in order.iter().enumerate() {
        for (_, second) in &order[a + 1..] {
            let [one, two] = [first, second].map(|&clip| &clips.clips[clip]);
            if one.lamp == two.lamp {
                pairs.push(([codes[first].clone(), codes[second].clone()], one.lamp));
            }
        }
    }
    // Lamps are numbered in the order of their pairs.
    let mut references: BTreeMap<usize, String> = BTreeMap::new();
    for (_, lamp) in &pairs {
        let next = format!("r{:02}", references.len() + 1);
        references.entry(*lamp).or_insert(next);
    }
    let trial = |place: usize| format!("t{:02}", place + 1);
    let key = Key::new(
        study.clone(),
        clips.frames.clone(),
        clips.minutes.clone(),
        (pairs.iter().enumerate()).map(|(place, (pair, _))| (trial(place), pair.clone())).collect(),
        (codes.iter())
            .map(|(&clip, code)| {
                let clip = &clips.clips[clip];
                let lamp = project.settings.shoot.lamps[clip.lamp].clone();
                let method = clip.method;
                (code.clone(), Shown { method, lamp })
            })
            .collect(),
    );
    let contents = Study {
        study,
        rate: project.settings.shoot.frame_rate,
        header: HEADER,
        questions: (Question::ALL.into_iter()).map(|q| Asked { name: q.name(), text: q.text() }).collect(),
        references: (references.iter()).map(|(lamp, code)| (code.clone(), data_uri(&clips.references[lamp]))).collect(),
        clips: (codes.iter())
            .map(|(&clip, code)| {
                let pictures = &clips.clips[clip].pictures;
                (code.clone(), pictures.iter().map(|p| data_uri(p)).collect())
            })
            .collect(),
        trials: (pairs.into_iter().enumerate())
            .map(|(place, (clips, lamp))| {
                let reference = references[&lamp].clone();
                (trial(place), Trial { clips, reference })
            })
            .collect(),
    };
    let json = serde_json::to_string(&contents).map_err(|e| Error::bug(format!("cannot write the study: {e}")))?;
    // Nothing in the JSON may close the script element.
    let json = json.replace('<', "\\u003c");
    Ok((key, PAGE.replace(PLACE, &json)))
}

fn data_uri(jpeg: &[u8]) -> String {
    format!("data:image/jpeg;base64,{}", BASE64_STANDARD.encode(jpeg))
}

/// Hash of all parts.
fn hash(parts: impl IntoIterator<Item = impl AsRef<[u8]>>) -> Fnv {
    let mut hash = Fnv::default();
    parts.into_iter().for_each(|part| hash.bytes(part.as_ref()));
    hash
}
