//! Answers, one comma-separated line each, as the page saves them and the project collects them.

use super::key::{Key, is_name};
use base::error::{Error, Result};
use base::files::{self, write_beside};
use project::Project;
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};

/// The first line of a file of answers.
pub const HEADER: &str = "study,person,trial,question,left,right,chosen,seconds";
/// Size limit of a file of answers in bytes: a hundred thousand answers.
const MOST: u64 = 16 << 20;
const REMEDY: &str = "Give the file as the page saved it";

/// Questions about two clips, in the words of the paper's study.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Question {
    Like,
    Better,
}

impl Question {
    pub const ALL: [Self; 2] = [Self::Like, Self::Better];

    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Like => "like",
            Self::Better => "better",
        }
    }

    pub fn text(self) -> &'static str {
        match self {
            Self::Like => "Which video clip looks more like the reference image?",
            Self::Better => "Which video clip looks better?",
        }
    }
}

/// Key of an answer: study, person, trial and question.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Asked {
    pub study: String,
    pub person: String,
    pub trial: String,
    pub question: Question,
}

/// An answer.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    pub left: String,
    pub right: String,
    pub chosen: String,
    /// Time to answer in seconds.
    pub seconds: f64,
}

/// Answers to one or more studies, without duplicates.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Answers(pub BTreeMap<Asked, Answer>);

impl Answers {
    /// Path of a project's collected answers.
    pub fn path(project: &Project) -> PathBuf {
        project.result_path("blind").join("answers.csv")
    }

    /// The project's collected answers.
    ///
    /// # Errors
    /// When the file cannot be read, or a line is not an answer.
    pub fn collected(project: &Project, keys: &mut Keys) -> Result<Self> {
        let path = Self::path(project);
        let mut answers = Self::default();
        if path.exists() {
            answers.add(project, &path, keys)?;
        }
        Ok(answers)
    }

    /// Adds the answers in a file and returns the number of new ones. Duplicates count once.
    ///
    /// # Errors
    /// When the file cannot be read, or a line is not an answer, contradicts another, or belongs to a study without a
    /// key in the project. Then nothing is added.
    pub fn add(&mut self, project: &Project, path: &Path, keys: &mut Keys) -> Result<usize> {
        let text = files::read_text(path, MOST).map_err(|e| Error::io("open", path, e, REMEDY))?;
        let mut lines = text.lines().map(str::trim_end).enumerate();
        let first = lines.next().map_or("", |(_, line)| line);
        if first != HEADER {
            let problem = format!("its first line is {:?}, not {HEADER:?}", shortened(first));
            return Err(Error::codec("read answers in", path, problem, REMEDY));
        }
        let mut added = self.clone();
        for (number, line) in lines.filter(|(_, line)| !line.is_empty()) {
            let refuse = |problem: String| {
                let problem = format!("line {}: {problem}", number + 1);
                Error::codec("read answers in", path, problem, REMEDY)
            };
            let (asked, answer) = parsed(line).map_err(refuse)?;
            let key = keys.load(project, &asked.study)?.ok_or_else(|| {
                refuse(format!("it answers study {}, which {} has no key for", asked.study, project.root.display()))
            })?;
            fits(&asked, &answer, key).map_err(refuse)?;
            match added.0.get(&asked) {
                Some(known) if known.chosen != answer.chosen => {
                    return Err(refuse(format!(
                        "person {} chose {} in trial {} ({}), but {} elsewhere",
                        asked.person,
                        answer.chosen,
                        asked.trial,
                        asked.question.name(),
                        known.chosen
                    )));
                }
                Some(_) => {}
                None => {
                    added.0.insert(asked, answer);
                }
            }
        }
        let new = added.0.len() - self.0.len();
        *self = added;
        Ok(new)
    }

    /// Writes the answers into the project, in place of the earlier file.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn save(&self, project: &Project) -> Result<()> {
        write_beside(&Self::path(project), |out| {
            writeln!(out, "{HEADER}")?;
            for (asked, answer) in &self.0 {
                let question = asked.question.name();
                let Answer { left, right, chosen, seconds } = answer;
                writeln!(
                    out,
                    "{},{},{},{question},{left},{right},{chosen},{seconds:.3}",
                    asked.study, asked.person, asked.trial
                )?;
            }
            Ok(())
        })
    }
}

/// Keys of studies, each read once.
#[derive(Default)]
pub struct Keys(BTreeMap<String, Key>);

impl Keys {
    /// The project's key of `study`, if it has one.
    ///
    /// # Errors
    /// When it is damaged.
    pub fn load(&mut self, project: &Project, study: &str) -> Result<Option<&Key>> {
        if !self.0.contains_key(study)
            && let Some(key) = Key::load(project, study)?
        {
            self.0.insert(study.to_owned(), key);
        }
        Ok(self.0.get(study))
    }
}

/// Parses a line of a file.
fn parsed(line: &str) -> std::result::Result<(Asked, Answer), String> {
    let fields: Vec<&str> = line.split(',').collect();
    let [study, person, trial, question, left, right, chosen, seconds] = fields[..] else {
        return Err(format!("expected 8 values between commas, found {} in {:?}", fields.len(), shortened(line)));
    };
    let names =
        [("study", study), ("person", person), ("trial", trial), ("left", left), ("right", right), ("chosen", chosen)];
    if let Some((what, value)) = names.into_iter().find(|(_, value)| !is_name(value)) {
        return Err(format!("{what} is {:?}, but can only be up to 32 small letters and digits", shortened(value)));
    }
    let question = Question::ALL.into_iter().find(|q| q.name() == question);
    let question = question.ok_or("question is neither like nor better")?;
    let seconds: f64 = (seconds.parse().ok())
        .filter(|s| (0.0..=1e9).contains(s))
        .ok_or_else(|| format!("seconds is {:?}, not a number from 0 up", shortened(seconds)))?;
    let asked = Asked { study: study.to_owned(), person: person.to_owned(), trial: trial.to_owned(), question };
    let [left, right, chosen] = [left, right, chosen].map(str::to_owned);
    let answer = Answer { left, right, chosen, seconds };
    Ok((asked, answer))
}

/// Refuses an answer that is impossible in the study.
fn fits(asked: &Asked, answer: &Answer, key: &Key) -> std::result::Result<(), String> {
    let Some(pair) = key.trials.get(&asked.trial) else {
        return Err(format!("the study has no trial {}", asked.trial));
    };
    let sides = [&answer.left, &answer.right];
    if sides != [&pair[0], &pair[1]] && sides != [&pair[1], &pair[0]] {
        return Err(format!(
            "trial {} compares {} and {}, not {} and {}",
            asked.trial, pair[0], pair[1], answer.left, answer.right
        ));
    }
    if !sides.contains(&&answer.chosen) {
        return Err(format!("{} was chosen, which is neither {} nor {}", answer.chosen, answer.left, answer.right));
    }
    Ok(())
}

/// First letters of untrusted text.
fn shortened(text: &str) -> String {
    const MOST_LETTERS: usize = 60;
    match text.char_indices().nth(MOST_LETTERS) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_owned(),
    }
}
