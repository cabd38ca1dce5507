//! Checks before OpenColorIO reads a configuration, which comes from a stranger.

use base::error::{Error, Result};
use ocio::{ColorSpaceDirection, Config, Transform, TransformDirection, ViewTransformDirection};
use std::collections::HashSet;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

pub(super) const REMEDY: &str = "Check the configuration with `ociocheck`, or choose another one";
/// Maximum size of a table in bytes: a cube of 129 with 60 bytes per line, twice.
const MOST_TABLE: u64 = 256 << 20;
/// Maximum nesting of lists. Real configurations have fewer than 10 levels.
const DEEPEST: usize = 64;
/// Maximum number of YAML aliases: a few can repeat a text without end.
const MOST_ALIASES: usize = 64;
/// Number of bytes of an anchor's name that are compared.
const LONGEST_NAME: usize = 64;

/// Runs a call into OpenColorIO, a port of a library that throws exceptions, and turns a panic into an error.
///
/// # Errors
/// When it panics.
pub(super) fn caught<T>(path: &Path, act: impl FnOnce() -> T) -> Result<T> {
    catch_unwind(AssertUnwindSafe(act))
        .map_err(|_| Error::invalid(format!("{} contains text that OpenColorIO cannot parse", path.display()), REMEDY))
}

/// Rejects texts that are nested too deeply for the reader, or repeat themselves without end.
///
/// # Errors
/// When the text does either.
pub(super) fn check_text<'a>(path: &Path, text: &'a str) -> Result<()> {
    let wrong = |problem: &str| Error::invalid(format!("{} is not a configuration: {problem}", path.display()), REMEDY);
    let mut open = 0usize;
    let (mut anchors, mut aliases) = (HashSet::new(), 0);
    // Names differ in their first bytes; a line may be one name of megabytes.
    let word = |text: &'a str| {
        let text = &text.as_bytes()[..text.len().min(LONGEST_NAME)];
        let mut words = text.split(|byte| b" \t,]}".contains(byte));
        words.next().unwrap_or_default()
    };
    for line in text.lines() {
        let indent = line.len() - line.trim_start_matches([' ', '-', '?']).len();
        // Lists open with at least one character per level.
        if indent > 4 * DEEPEST {
            return Err(wrong("its lists are nested too deeply"));
        }
        for (at, c) in line.char_indices() {
            match c {
                '[' | '{' => open += 1,
                ']' | '}' => open = open.saturating_sub(1),
                '&' if !word(&line[at + 1..]).is_empty() => {
                    anchors.insert(word(&line[at + 1..]));
                }
                // Other asterisks are not aliases, but part of a sentence.
                '*' if anchors.contains(word(&line[at + 1..])) => aliases += 1,
                _ => (),
            }
            if open > DEEPEST {
                return Err(wrong("its lists are nested too deeply"));
            }
        }
    }
    if aliases > MOST_ALIASES {
        return Err(wrong("it has too many aliases (*)"));
    }
    Ok(())
}

/// Rejects a configuration with oversized tables. OpenColorIO does not open missing tables, devices, pipes or
/// folders; they give an error when they are needed.
///
/// # Errors
/// When a table is too large; the error names it.
pub(super) fn check_files(path: &Path, config: &Config) -> Result<()> {
    let mut steps: Vec<&Transform> = Vec::new();
    for space in config.all_color_spaces().iter() {
        steps.extend(space.transform(ColorSpaceDirection::ToReference));
        steps.extend(space.transform(ColorSpaceDirection::FromReference));
    }
    for i in 0..config.num_looks() {
        if let Some(look) = config.look(config.look_name_by_index(i)) {
            steps.extend(look.transform().into_iter().chain(look.inverse_transform()));
        }
    }
    for i in 0..config.num_view_transforms() {
        if let Some(view) = config.view_transform(config.view_transform_name_by_index(i)) {
            steps.extend(view.transform(ViewTransformDirection::ToReference));
            steps.extend(view.transform(ViewTransformDirection::FromReference));
        }
    }
    for i in 0..config.num_named_transforms() {
        let named = config.get_named_transform(config.named_transform_name_by_index(i));
        if let Some(named) = named {
            steps.extend(named.transform(TransformDirection::Forward));
            steps.extend(named.transform(TransformDirection::Inverse));
        }
    }
    while let Some(step) = steps.pop() {
        match step {
            Transform::Group(group) => steps.extend(&group.transforms),
            Transform::File(file) => check_file(path, config, &file.src)?,
            _ => (),
        }
    }
    Ok(())
}

fn check_file(path: &Path, config: &Config, named: &str) -> Result<()> {
    let Ok(table) = config.current_context().resolve_file_location(named) else { return Ok(()) };
    let Ok(data) = std::fs::metadata(&table) else { return Ok(()) };
    if data.len() <= MOST_TABLE {
        return Ok(());
    }
    Err(Error::invalid(
        format!("the table {table} of {} has {} bytes, but the limit is {MOST_TABLE}", path.display(), data.len()),
        REMEDY,
    ))
}
