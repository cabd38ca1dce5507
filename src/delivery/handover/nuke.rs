//! Nuke script: the light layers, each times its lamp's weight, in three groups, and their sum.
//!
//! A script is a list of commands. A node takes its inputs from a stack, the first from the top, and is pushed there;
//! `set N [stack 0]` names the top, and `push $N` pushes it again.

use crate::group::Group;
use crate::lamps::{LampLayer, Layers};
use crate::light::Light;
use crate::media::{Media, Stills};
use crate::shot::Shot;
use crate::tcl::{animated, literal, quoted};
use base::error::{Error, Result};
use export::ExrAlpha;
use std::fmt::Write;

/// Distance of two lamps and of two rows in the graph, in pixels.
const STEP: (i64, i64) = (110, 60);
/// Characters in a name that Nuke does not read as letters.
const SIGNS: [char; 2] = ['#', '%'];

/// Refuses files that Nuke would not find.
///
/// # Errors
/// When the file names have characters that mean frame numbers in Nuke.
pub fn check(media: &Media) -> Result<()> {
    match media {
        Media::Movie(_) => Ok(()),
        Media::Stills(Stills { before, after, .. }) => {
            match [before, after].into_iter().find(|part| part.contains(SIGNS)) {
                None => Ok(()),
                Some(part) => Err(Error::invalid(
                    format!("Nuke reads # and % in {part:?} as the frame's number"),
                    "Name the files without these characters",
                )),
            }
        }
    }
}

/// Script of a shot, to be stored beside its files.
pub fn script(shot: &Shot) -> String {
    let mut script = Script::default();
    if let (Some(layers), Media::Stills(stills)) = (&shot.layers, &shot.media) {
        script.begin(shot, layers);
        if let Some(light) = &shot.light {
            script.turn(shot, light);
        }
        script.head = std::mem::take(&mut script.text);
        script.rebuild(shot, layers, stills);
    }
    script.head + &script.text
}

#[derive(Default)]
struct Script {
    /// Unconnected nodes come first, while the stack is empty.
    head: String,
    text: String,
    /// Number of used columns of the graph.
    columns: i64,
}

/// Rows of the graph.
enum Row {
    Read = 0,
    Layer = 2,
    Lamp = 4,
    Sum = 6,
    Group = 8,
    Whole = 10,
    Alpha = 12,
    Difference = 14,
}

impl Script {
    fn line(&mut self, line: &str) {
        self.text.push_str(line);
        self.text.push('\n');
    }

    /// Node with its knobs, at a column and row.
    fn node(&mut self, class: &str, knobs: &[(&str, &str)], (column, row): (i64, Row)) {
        let _ = writeln!(self.text, "{class} {{");
        for (knob, value) in knobs {
            let _ = writeln!(self.text, " {knob} {value}");
        }
        let (x, y) = (column * STEP.0, row as i64 * STEP.1);
        let _ = writeln!(self.text, " xpos {x}\n ypos {y}\n}}");
    }

    fn begin(&mut self, shot: &Shot, layers: &Layers) {
        let (first, last) = shot.frames;
        let (width, height) = layers.size;
        let version = env!("CARGO_PKG_VERSION");
        self.line(&format!("#! nuke -nx\n# Written by Afterlight {version}.\nversion 12.0 v1"));
        let name = quoted(&format!("{}.nk", shot.name));
        let fps = shot.frame_rate();
        self.line(&format!(
            "Root {{\n inputs 0\n name {name}\n project_directory \"\\[python \\{{nuke.script_directory()\\}}]\"\n \
             frame {first}\n first_frame {first}\n last_frame {last}\n lock_range true\n fps {fps}\n \
             format \"{width} {height} 0 0 {width} {height} 1 \"\n}}"
        ));
        let names = layers.lamps.iter().map(|lamp| lamp.layer.as_str());
        for name in names.chain(layers.rest.as_ref().map(|_| "rest")) {
            self.line(&format!("add_layer {{{name} {name}.red {name}.green {name}.blue}}"));
        }
    }

    /// Node with the rotation of the light: for the artist's own lights, and for reading.
    fn turn(&mut self, shot: &Shot, light: &Light) {
        let yaws = light.frames.iter().map(|frame| frame.yaw_deg);
        let yaw = animated(shot.frames.0, yaws);
        let yaw = if yaw.starts_with('{') { format!("{{{yaw}}}") } else { yaw };
        let environment = quoted(&literal(&shot.environment));
        self.node(
            "NoOp",
            &[
                ("inputs", "0"),
                ("name", "Light"),
                ("label", "\"the environment's turn\""),
                ("addUserKnob", "{20 Afterlight}"),
                ("addUserKnob", "{1 environment l Environment}"),
                ("environment", &environment),
                ("addUserKnob", "{7 yaw l \"Yaw in degrees\" R -180 180}"),
                ("yaw", &yaw),
                ("addUserKnob", "{7 rotate_y l \"rotate y of a GeoDomeLight\" R -180 180}"),
                ("rotate_y", "{{180-yaw}}"),
            ],
            (-2, Row::Read),
        );
    }

    /// Read node; its output is called `name` from here on.
    fn read(&mut self, shot: &Shot, layers: &Layers, stills: &Stills, name: &str, column: i64) {
        let (first, last) = shot.frames;
        let (width, height) = layers.size;
        let number = stills.digits.map_or(String::new(), |digits| match digits {
            0 | 1 => "%d".to_owned(),
            digits => format!("%0{digits}d"),
        });
        let file = format!("{}{number}{}", literal(&stills.before), literal(&stills.after));
        let (first, last) = (first.to_string(), last.to_string());
        self.node(
            "Read",
            &[
                ("inputs", "0"),
                ("file_type", "exr"),
                ("file", &quoted(&file)),
                ("format", &format!("\"{width} {height} 0 0 {width} {height} 1 \"")),
                ("first", &first),
                ("last", &last),
                ("origfirst", &first),
                ("origlast", &last),
                ("origset", "true"),
                // Raw values of the file: linear, so that the difference is black.
                ("raw", "true"),
                ("name", name),
            ],
            (column, Row::Read),
        );
        self.line(&format!("set {name} [stack 0]"));
    }

    fn rebuild(&mut self, shot: &Shot, layers: &Layers, stills: &Stills) {
        self.read(shot, layers, stills, "Layers", -1);
        let mut has_sum = false;
        for group in Group::ALL {
            if self.group(shot, layers, group) {
                if has_sum {
                    self.add(&format!("With{}", group.name()), self.columns, Row::Whole);
                }
                has_sum = true;
            }
        }
        if let Some(rest) = &layers.rest {
            let column = self.columns;
            self.layer(shot, layers, rest.files.as_ref(), "rest", "background and effects", column);
            if has_sum {
                self.add("WithRest", column, Row::Whole);
            }
            self.columns += 2;
        }
        self.line("set Sum [stack 0]\npush $Layers\npush $Sum");
        let column = self.columns;
        self.node(
            "Copy",
            &[
                ("inputs", "2"),
                ("from0", "rgba.alpha"),
                ("to0", "rgba.alpha"),
                ("name", "Rebuilt"),
                ("label", "\"equals the picture in the files\""),
            ],
            (column, Row::Alpha),
        );
        self.line("set Rebuilt [stack 0]");
        if layers.alpha == ExrAlpha::Straight {
            self.node("Premult", &[("name", "Premultiplied")], (column + 2, Row::Alpha));
        }
        self.line("push $Layers\npush $Rebuilt");
        self.node(
            "Merge2",
            &[
                ("inputs", "2"),
                ("operation", "difference"),
                ("name", "Difference"),
                ("label", "\"must be black: half floats round by\\n1/1024 of the brightest value at most\""),
            ],
            (column, Row::Difference),
        );
    }

    /// Adds the lamps of a group and applies the group's gain. Returns true if there are any.
    fn group(&mut self, shot: &Shot, layers: &Layers, group: Group) -> bool {
        let start = self.columns;
        for (index, lamp) in layers.lamps_in(group).enumerate() {
            self.lamp(shot, layers, lamp);
            if index > 0 {
                self.add(&format!("Add_{}", lamp.layer), self.columns, Row::Sum);
            }
            self.columns += 1;
        }
        if self.columns == start {
            return false;
        }
        let name = group.name();
        self.node(
            "Multiply",
            &[("channels", "rgb"), ("value", "1"), ("name", name), ("label", "\"all of its lamps\"")],
            (self.columns - 1, Row::Group),
        );
        let (x, y) = (start * STEP.0 - 20, Row::Layer as i64 * STEP.1 - 50);
        let (width, height) =
            ((self.columns - start) * STEP.0 + 20, (Row::Group as i64 - Row::Layer as i64) * STEP.1 + 100);
        let color = match group {
            Group::Key => "0x7a6a3aff",
            Group::Fill => "0x3a5a7aff",
            Group::Rim => "0x5a3a6aff",
        };
        let _ = writeln!(
            self.head,
            "BackdropNode {{\n inputs 0\n name {name}Lamps\n tile_color {color}\n label {name}\n note_font_size 42\n \
             xpos {x}\n ypos {y}\n bdwidth {width}\n bdheight {height}\n z_order -1\n}}"
        );
        self.columns += 1;
        true
    }

    /// Lamp layer times its weight and a gain.
    fn lamp(&mut self, shot: &Shot, layers: &Layers, lamp: &LampLayer) {
        let column = self.columns;
        self.layer(shot, layers, lamp.files.as_ref(), &lamp.layer, &lamp.lamp, column);
        let [r, g, b] = [0, 1, 2].map(|c| {
            let weights = lamp.weights.iter().map(move |weight| weight[c]);
            animated(shot.frames.0, weights)
        });
        self.node(
            "Multiply",
            &[
                ("channels", "rgb"),
                ("value", "{{written.r*gain} {written.g*gain} {written.b*gain} 1}"),
                ("name", &format!("Lamp_{}", lamp.layer)),
                ("label", &quoted(&literal(&lamp.lamp))),
                ("addUserKnob", "{20 Afterlight}"),
                ("addUserKnob", "{7 gain l Gain R 0 4}"),
                ("gain", "1"),
                ("addUserKnob", "{18 written l \"Weight in the picture\"}"),
                ("written", &format!("{{{r} {g} {b}}}")),
            ],
            (column, Row::Lamp),
        );
    }

    /// One layer as rgb, from the pictures' files or from its own.
    fn layer(&mut self, shot: &Shot, layers: &Layers, files: Option<&Stills>, layer: &str, label: &str, column: i64) {
        let input = match files {
            Some(files) => {
                self.read(shot, layers, files, &format!("Read_{layer}"), column);
                "rgb"
            }
            None => {
                self.line("push $Layers");
                layer
            }
        };
        self.node(
            "Shuffle",
            &[
                ("in", input),
                ("alpha", "black"),
                ("name", &format!("Shuffle_{layer}")),
                ("label", &quoted(&literal(label))),
            ],
            (column, Row::Layer),
        );
    }

    /// Adds the two pictures on top of the stack.
    fn add(&mut self, name: &str, column: i64, row: Row) {
        self.node("Merge2", &[("inputs", "2"), ("operation", "plus"), ("name", name)], (column, row));
    }
}

#[cfg(test)]
#[path = "nuke_tests.rs"]
mod tests;
