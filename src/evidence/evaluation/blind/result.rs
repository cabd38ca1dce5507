//! Results: each method's share of choices, with the exact interval.

use super::super::Method;
use super::answers::{Answers, Keys, Question};
use super::interval::exact_interval;
use base::error::{Error, Result};
use clap::ValueEnum;
use project::Project;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

/// Number of choices and of answers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Share {
    pub chosen: u64,
    pub of: u64,
    /// chosen / of; None without answers.
    pub share: Option<f64>,
    /// Exact 95 % interval, assuming independent answers.
    pub low: f64,
    pub high: f64,
}

/// A method over all its comparisons.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MethodShare {
    pub method: Method,
    #[serde(flatten)]
    pub share: Share,
}

/// Two methods compared: share of choices of the first.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PairShare {
    pub methods: [Method; 2],
    #[serde(flatten)]
    pub first: Share,
}

/// The answers to one question.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct QuestionResult {
    pub question: Question,
    pub text: &'static str,
    pub methods: Vec<MethodShare>,
    pub pairs: Vec<PairShare>,
}

/// The answers to a page.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StudyResult {
    pub study: String,
    pub people: usize,
    pub answers: usize,
    pub questions: Vec<QuestionResult>,
    /// Share of choices of the left clip: about one half, since sides are random.
    pub left: Share,
}

/// Results of all collected answers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AnswersReport {
    /// Number of new answers in the given files.
    pub new: usize,
    /// Path of the collected answers.
    pub collected: PathBuf,
    pub studies: Vec<StudyResult>,
}

impl Share {
    /// `chosen` out of `of`, with its interval.
    pub fn new(chosen: u64, of: u64) -> Self {
        let [low, high] = exact_interval(chosen, of);
        Self { chosen, of, share: (of > 0).then(|| chosen as f64 / of as f64), low, high }
    }

    fn text(&self) -> String {
        let percent = |v: f64| format!("{:.1}", 100.0 * v);
        match self.share {
            None => "never shown".to_owned(),
            Some(share) => format!(
                "{} of {} ({} %, 95 % interval {} to {} %)",
                self.chosen,
                self.of,
                percent(share),
                percent(self.low),
                percent(self.high)
            ),
        }
    }
}

/// Number of choices, and of answers in which there was the choice.
#[derive(Clone, Copy, Debug, Default)]
struct Count {
    chosen: u64,
    answers: u64,
}

impl Count {
    fn add(&mut self, is_chosen: bool) {
        self.chosen += u64::from(is_chosen);
        self.answers += 1;
    }

    fn share(self) -> Share {
        Share::new(self.chosen, self.answers)
    }
}

/// Adds the answers in `files` to the project's collection, and counts the whole collection.
///
/// # Errors
/// When a file or one of its lines is invalid; then nothing is added. When there are no answers at all.
pub fn answers(project: &Project, files: &[PathBuf]) -> Result<AnswersReport> {
    let mut keys = Keys::default();
    let mut all = Answers::collected(project, &mut keys)?;
    let mut new = 0;
    for file in files {
        new += all.add(project, file, &mut keys)?;
    }
    if all.0.is_empty() {
        return Err(Error::missing(
            format!("{} has no answers yet", project.root.display()),
            "Give the files that came back: afterlight blind PROJECT --answers FILE...",
        ));
    }
    if new > 0 {
        all.save(project)?;
    }
    let studies: BTreeSet<&String> = all.0.keys().map(|asked| &asked.study).collect();
    let mut results = Vec::new();
    for study in studies {
        results.push(result(project, study, &all, &mut keys)?);
    }
    Ok(AnswersReport { new, collected: Answers::path(project), studies: results })
}

fn result(project: &Project, study: &str, all: &Answers, keys: &mut Keys) -> Result<StudyResult> {
    let key = keys.load(project, study)?;
    let key = key.ok_or_else(|| Error::bug(format!("the key of study {study} is gone")))?;
    let method = |clip: &str| -> Result<Method> {
        let shown = key.clips.get(clip);
        let shown = shown.ok_or_else(|| Error::bug(format!("the key has no clip {clip}")))?;
        Ok(shown.method)
    };
    let order = |method: Method| {
        let place = Method::value_variants().iter().position(|m| *m == method);
        place.unwrap_or(usize::MAX)
    };
    let mine: Vec<_> = (all.0.iter()).filter(|(a, _)| a.study == study).collect();
    let mut questions = Vec::new();
    for question in Question::ALL {
        let mut methods: BTreeMap<usize, (Method, Count)> = BTreeMap::new();
        let mut pairs: BTreeMap<[usize; 2], ([Method; 2], Count)> = BTreeMap::new();
        for (_, answer) in mine.iter().filter(|(a, _)| a.question == question) {
            let chosen = method(&answer.chosen)?;
            let mut both = [method(&answer.left)?, method(&answer.right)?];
            for shown in both {
                let (_, count) = methods.entry(order(shown)).or_insert((shown, Count::default()));
                count.add(shown == chosen);
            }
            both.sort_by_key(|m| order(*m));
            let (_, count) = pairs.entry(both.map(order)).or_insert((both, Count::default()));
            count.add(chosen == both[0]);
        }
        questions.push(QuestionResult {
            question,
            text: question.text(),
            methods: (methods.into_values())
                .map(|(method, count)| MethodShare { method, share: count.share() })
                .collect(),
            pairs: (pairs.into_values()).map(|(methods, count)| PairShare { methods, first: count.share() }).collect(),
        });
    }
    let people: BTreeSet<&String> = mine.iter().map(|(asked, _)| &asked.person).collect();
    let left = mine.iter().filter(|(_, a)| a.chosen == a.left).count();
    Ok(StudyResult {
        study: study.to_owned(),
        people: people.len(),
        answers: mine.len(),
        questions,
        left: Share::new(left as u64, mine.len() as u64),
    })
}

impl AnswersReport {
    /// Summary of the results.
    pub fn sentence(&self) -> String {
        let mut text = format!("{} answers were new; all are in {}", self.new, self.collected.display());
        for study in &self.studies {
            let (people, answers) = (study.people, study.answers);
            let persons = if people == 1 { "person" } else { "people" };
            text += &format!("\n\nStudy {}: {people} {persons}, {answers} answers", study.study);
            for question in &study.questions {
                text += &format!("\n{}", question.text);
                for MethodShare { method, share } in &question.methods {
                    text += &format!("\n  {:<12} {}", name(*method), share.text());
                }
                for PairShare { methods, first } in &question.pairs {
                    let [a, b] = methods.map(name);
                    text += &format!("\n  {a} against {b}: {}", first.text());
                }
            }
            text += &format!("\nThe left clip was chosen in {}.", study.left.text());
        }
        text + "\nThe intervals assume independent answers; those of one person are only nearly independent."
    }
}

/// Name of a method on the command line.
pub fn name(method: Method) -> String {
    let value = method.to_possible_value();
    value.map_or_else(String::new, |value| value.get_name().to_owned())
}
