//! Colour look-up tables in Adobe's and Resolve's `.cube` format.
//!
//! A file has a table per channel (`LUT_1D_SIZE`), a cube (`LUT_3D_SIZE`), or, as Resolve writes it, first one
//! and then the other. Tables are interpolated linearly, cubes within tetrahedra (Kasson et al. 1995), as
//! OpenColorIO does. The range of the input is `DOMAIN_MIN` and `DOMAIN_MAX` (Adobe) or `LUT_1D_INPUT_RANGE` and
//! `LUT_3D_INPUT_RANGE` (Resolve); values outside are clamped to it.

use crate::Encoded;
use base::error::{Error, Result};
use base::files::read_text;
use rayon::prelude::*;
use std::path::Path;

/// Maximum file size in bytes: a cube of [`MOST_3D`] with 60 bytes per line.
const MOST_BYTES: u64 = 128 << 20;
/// Maximum table length, by Adobe's specification.
const MOST_1D: usize = 65_536;
/// Maximum cube size, by OpenColorIO's limit.
const MOST_3D: usize = 129;
const REMEDY: &str = "Choose a .cube file as colour grading tools write it";

/// A look-up table from RGB to RGB.
#[derive(Clone, Debug, PartialEq)]
pub struct Cube {
    /// Title in the file; "" if there is none.
    pub title: String,
    curves: Option<Table>,
    cube: Option<Table>,
}

/// Values over a range of inputs.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Table {
    /// Entries along an axis, 2 or more.
    pub size: usize,
    pub least: [f32; 3],
    pub most: [f32; 3],
    /// `size` entries of a curve, or `size³` of a cube, red fastest.
    pub values: Vec<[f32; 3]>,
}

impl Cube {
    /// Reads a file.
    ///
    /// # Errors
    /// When it cannot be read, is too long, or is not such a table; the error gives the line.
    pub fn read(path: &Path) -> Result<Self> {
        let text = read_text(path, MOST_BYTES).map_err(|e| Error::io("read", path, e, REMEDY))?;
        Self::parse(&text)
            .map_err(|problem| Error::invalid(format!("{} is not a look-up table: {problem}", path.display()), REMEDY))
    }

    /// Reads a file's text.
    ///
    /// # Errors
    /// The fault and its line.
    pub fn parse(text: &str) -> std::result::Result<Self, String> {
        let mut header = Header::default();
        let mut values = Vec::new();
        for (number, line) in text.lines().enumerate() {
            let wrong = |problem: String| format!("line {}: {problem}", number + 1);
            let line = line.trim();
            if line.is_empty() || line.starts_with('#') {
                continue;
            }
            if line.starts_with(|c: char| c.is_ascii_alphabetic() && !is_nan_or_infinity(line)) {
                if !values.is_empty() {
                    return Err(wrong(format!("{} comes after the values", shortened(line))));
                }
                header.read(line).map_err(wrong)?;
            } else {
                values.push(numbers::<3>(line).map_err(wrong)?);
            }
        }
        header.tables(values)
    }

    /// The table's output for a colour. NaN counts as the smallest input.
    pub fn apply(&self, rgb: [f32; 3]) -> [f32; 3] {
        let rgb = self.curves.as_ref().map_or(rgb, |table| table.curves(rgb));
        self.cube.as_ref().map_or(rgb, |table| table.cube(rgb))
    }

    /// Applies the table to a picture's codes in place.
    pub fn apply_to(&self, codes: &mut Encoded) {
        let pixels = codes.0.pixels.par_iter_mut().with_min_len(4096);
        pixels.for_each(|code| *code = self.apply(*code));
    }
}

/// True for NaN and infinity, which begin with a letter but are left to the number reader to reject.
fn is_nan_or_infinity(line: &str) -> bool {
    let word = line.split_whitespace().next().unwrap_or_default();
    word.parse::<f32>().is_ok()
}

/// The beginning of a quoted line.
fn shortened(line: &str) -> String {
    line.chars().filter(|c| !c.is_control()).take(40).collect()
}

fn numbers<const N: usize>(text: &str) -> std::result::Result<[f32; N], String> {
    let wrong = || format!("{:?} is not {N} numbers", shortened(text));
    let mut words = text.split_whitespace();
    let mut found = [0f32; N];
    for value in &mut found {
        let word = words.next().ok_or_else(wrong)?;
        *value = word.parse().map_err(|_| wrong())?;
        if !value.is_finite() {
            return Err(format!("{word} is not finite"));
        }
    }
    words.next().is_none().then_some(found).ok_or_else(wrong)
}

/// Header before the values.
#[derive(Default)]
struct Header {
    title: String,
    curve: Option<usize>,
    cube: Option<usize>,
    domain: [Option<[f32; 3]>; 2],
    curve_range: Option<[f32; 2]>,
    cube_range: Option<[f32; 2]>,
}

impl Header {
    fn read(&mut self, line: &str) -> std::result::Result<(), String> {
        let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let rest = rest.trim();
        let size = |most: usize| {
            let size = rest.parse().ok().filter(|size| (2..=most).contains(size));
            size.ok_or_else(|| format!("{word} is {:?}, not 2 to {most}", shortened(rest)))
        };
        match word {
            "TITLE" => self.title = rest.trim_matches('"').to_owned(),
            "LUT_1D_SIZE" => self.curve = Some(size(MOST_1D)?),
            "LUT_3D_SIZE" => self.cube = Some(size(MOST_3D)?),
            "DOMAIN_MIN" => self.domain[0] = Some(numbers(rest)?),
            "DOMAIN_MAX" => self.domain[1] = Some(numbers(rest)?),
            "LUT_1D_INPUT_RANGE" => self.curve_range = Some(numbers(rest)?),
            "LUT_3D_INPUT_RANGE" => self.cube_range = Some(numbers(rest)?),
            _ => return Err(format!("{:?} is an unknown keyword", shortened(word))),
        }
        Ok(())
    }

    /// Splits the values into tables.
    fn tables(self, mut values: Vec<[f32; 3]>) -> std::result::Result<Cube, String> {
        let entries = self.curve.unwrap_or(0) + self.cube.map_or(0, |size| size.pow(3));
        if entries == 0 {
            return Err("it has neither LUT_1D_SIZE nor LUT_3D_SIZE".to_owned());
        }
        if values.len() != entries {
            return Err(format!("its sizes need {entries} lines of values, but it has {}", values.len()));
        }
        let cube_values = values.split_off(self.curve.unwrap_or(0));
        let domain = [self.domain[0].unwrap_or([0.0; 3]), self.domain[1].unwrap_or([1.0; 3])];
        // A domain belongs to the first table; the second reads the output of the first.
        let behind_curve = if self.curve.is_some() { [[0.0; 3], [1.0; 3]] } else { domain };
        let table = |size: Option<usize>, range: Option<[f32; 2]>, domain, values| {
            let [least, most]: [[f32; 3]; 2] = range.map_or(domain, |range| range.map(|v| [v; 3]));
            let is_range = (0..3).all(|c| least[c] < most[c] && (most[c] - least[c]).is_finite());
            let table = |size| Table { size, least, most, values };
            if is_range { Ok(size.map(table)) } else { Err(format!("its inputs go from {least:?} to {most:?}")) }
        };
        Ok(Cube {
            curves: table(self.curve, self.curve_range, domain, values)?,
            cube: table(self.cube, self.cube_range, behind_curve, cube_values)?,
            title: self.title,
        })
    }
}

impl Table {
    /// Index of the entry below a channel's value, and the fraction of the way to the next, in `[0, 1]`.
    fn place(&self, value: f32, c: usize) -> (usize, f32) {
        let share = (value - self.least[c]) / (self.most[c] - self.least[c]);
        let at = super::color::unit(share) * (self.size - 1) as f32;
        let index = (at as usize).min(self.size - 2);
        (index, at - index as f32)
    }

    fn curves(&self, rgb: [f32; 3]) -> [f32; 3] {
        std::array::from_fn(|c| {
            let (index, share) = self.place(rgb[c], c);
            let [below, above] = [self.values[index][c], self.values[index + 1][c]];
            below + share * (above - below)
        })
    }

    /// A cube's output for a colour.
    pub fn cube(&self, rgb: [f32; 3]) -> [f32; 3] {
        let places: [(usize, f32); 3] = std::array::from_fn(|c| self.place(rgb[c], c));
        let steps = [1, self.size, self.size * self.size];
        let mut at: usize = (0..3).map(|c| places[c].0 * steps[c]).sum();
        // From the lower corner to the upper one, along the axis with the largest fraction first.
        let mut order = [0, 1, 2];
        order.sort_by(|&a, &b| places[b].1.total_cmp(&places[a].1));
        let mut sum = self.values[at];
        for axis in order {
            let from = self.values[at];
            at += steps[axis];
            let to = self.values[at];
            for c in 0..3 {
                sum[c] += places[axis].1 * (to[c] - from[c]);
            }
        }
        sum
    }
}

#[cfg(test)]
#[path = "cube_tests.rs"]
mod tests;
