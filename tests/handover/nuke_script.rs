//! A Nuke script as Nuke reads it: Tcl words, the stack of nodes, and the nodes' pictures.

use crate::exr_file::{Channels, read};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// A word of a command. Braces prevent substitution.
#[derive(Clone, Debug, PartialEq)]
pub enum Word {
    Plain(String),
    Braced(String),
}

impl Word {
    fn text(&self) -> &str {
        match self {
            Self::Plain(text) | Self::Braced(text) => text,
        }
    }
}

#[derive(Clone, Debug)]
pub struct Node {
    pub class: String,
    /// In order; a later one overrides.
    pub knobs: Vec<(String, Word)>,
    /// The first is input 0.
    pub inputs: Vec<usize>,
}

#[derive(Clone, Debug)]
pub struct Script {
    pub nodes: Vec<Node>,
    /// Folder of the script.
    folder: PathBuf,
}

/// Commands in Tcl, as words.
fn commands(text: &str) -> Vec<Vec<Word>> {
    let (mut commands, mut words) = (Vec::new(), Vec::new());
    let mut letters = text.chars().peekable();
    while let Some(&next) = letters.peek() {
        match next {
            '\n' | ';' => {
                letters.next();
                commands.push(std::mem::take(&mut words));
            }
            c if c.is_whitespace() => {
                letters.next();
            }
            '#' if words.is_empty() => while letters.next_if(|c| *c != '\n').is_some() {},
            '{' => {
                letters.next();
                let (mut depth, mut word) = (1, String::new());
                loop {
                    match letters.next().expect("a brace is closed") {
                        '\\' => word.extend(['\\', letters.next().expect("a letter")]),
                        '{' => {
                            depth += 1;
                            word.push('{');
                        }
                        '}' if depth == 1 => break,
                        '}' => {
                            depth -= 1;
                            word.push('}');
                        }
                        c => word.push(c),
                    }
                }
                words.push(Word::Braced(word));
            }
            '"' => {
                letters.next();
                let mut word = String::new();
                loop {
                    match letters.next().expect("a quote is closed") {
                        '"' => break,
                        '\\' => word.push(match letters.next().expect("a letter") {
                            'n' => '\n',
                            c => c,
                        }),
                        c @ ('[' | '$') => panic!("{c} would be evaluated in {text}"),
                        c => word.push(c),
                    }
                }
                words.push(Word::Plain(word));
            }
            _ => {
                let mut word = String::new();
                let mut depth = 0;
                while let Some(c) = letters.next_if(|c| depth > 0 || !c.is_whitespace()) {
                    depth += i32::from(c == '[') - i32::from(c == ']');
                    word.push(c);
                }
                words.push(Word::Plain(word));
            }
        }
    }
    commands.push(words);
    commands.retain(|words| !words.is_empty());
    commands
}

impl Script {
    /// Reads the script `path`, whose text is `text`.
    pub fn parse(path: &Path, text: &str) -> Self {
        let mut nodes: Vec<Node> = Vec::new();
        let (mut stack, mut names) = (Vec::<usize>::new(), HashMap::new());
        for command in commands(text) {
            let texts: Vec<&str> = command.iter().map(Word::text).collect();
            match texts[..] {
                ["version" | "add_layer", ..] => (),
                ["set", name, "[stack 0]"] => {
                    names.insert(name.to_owned(), *stack.last().expect("a node"));
                }
                ["push", name] => {
                    let name = name.strip_prefix('$').expect("a variable");
                    stack.push(*names.get(name).unwrap_or_else(|| panic!("no ${name}")));
                }
                [class, body] => {
                    let knobs: Vec<_> = (commands(body).into_iter())
                        .filter(|words| words[0].text() != "addUserKnob")
                        .map(|words| {
                            let [name, value] = &words[..] else {
                                panic!("{words:?} is not a knob with a value");
                            };
                            (name.text().to_owned(), value.clone())
                        })
                        .collect();
                    let count = knobs.iter().find(|(name, _)| name == "inputs");
                    let count = count.map_or(1, |(_, word)| word.text().parse().unwrap());
                    let taken = (0..count).map(|_| stack.pop().expect("an input")).collect();
                    nodes.push(Node { class: class.to_owned(), knobs, inputs: taken });
                    if class != "Root" {
                        stack.push(nodes.len() - 1);
                    }
                }
                _ => panic!("{texts:?} is not a command"),
            }
        }
        Self { nodes, folder: path.parent().unwrap().to_path_buf() }
    }

    /// The node with this name.
    pub fn named(&self, name: &str) -> usize {
        let is_named = |node: &Node| node.knob("name").is_some_and(|word| word.text() == name);
        let found = self.nodes.iter().position(is_named);
        found.unwrap_or_else(|| panic!("no node {name}"))
    }

    /// Picture of a node at a frame.
    pub fn picture(&self, node: usize, frame: usize) -> Channels {
        let node = &self.nodes[node];
        let input = |index: usize| self.picture(node.inputs[index], frame);
        let rgb = ["rgba.red", "rgba.green", "rgba.blue"];
        match &*node.class {
            "Read" => {
                assert_eq!(node.knob("raw").unwrap().text(), "true");
                let path = node.file(frame);
                assert!(path.is_relative(), "{}", path.display());
                read(&self.folder.join(path))
            }
            "Shuffle" => {
                let (mut picture, layer) = (input(0), node.knob("in").unwrap().text());
                let layer = if layer == "rgb" { "rgba" } else { layer };
                let found = ["red", "green", "blue"].map(|c| {
                    let channel = format!("{layer}.{c}");
                    assert!(picture.values.contains_key(&channel), "no {channel}");
                    picture.get(&channel)
                });
                for (name, values) in rgb.into_iter().zip(found) {
                    picture.values.insert(name.to_owned(), values);
                }
                assert_eq!(node.knob("alpha").unwrap().text(), "black");
                picture.values.remove("rgba.alpha");
                picture
            }
            "Multiply" => {
                let mut picture = input(0);
                assert_eq!(node.knob("channels").unwrap().text(), "rgb");
                for (c, name) in rgb.into_iter().enumerate() {
                    let factor = node.number("value", c, frame);
                    let values = picture.get(name).into_iter().map(|v| v * factor);
                    picture.values.insert(name.to_owned(), values.collect());
                }
                picture
            }
            "Merge2" => {
                let (mut below, above) = (input(0), input(1));
                let operation = node.knob("operation").unwrap().text();
                for name in rgb.into_iter().chain(["rgba.alpha"]) {
                    let pairs = above.get(name).into_iter().zip(below.get(name));
                    let values = pairs.map(|(a, b)| match operation {
                        "plus" => a + b,
                        "difference" => (a - b).abs(),
                        other => panic!("{other} is unknown here"),
                    });
                    let values = values.collect();
                    below.values.insert(name.to_owned(), values);
                }
                below
            }
            "Copy" => {
                let (mut below, above) = (input(0), input(1));
                let [from, to] = ["from0", "to0"].map(|name| node.knob(name).unwrap().text());
                below.values.insert(to.to_owned(), above.get(from));
                below
            }
            "Premult" => {
                let mut picture = input(0);
                let alpha = picture.get("rgba.alpha");
                for name in rgb {
                    let pairs = picture.get(name).into_iter().zip(&alpha);
                    let values = pairs.map(|(v, a)| v * a).collect();
                    picture.values.insert(name.to_owned(), values);
                }
                picture
            }
            other => panic!("{other} has no picture"),
        }
    }
}

impl Node {
    pub fn knob(&self, name: &str) -> Option<&Word> {
        let named = self.knobs.iter().rev().find(|(knob, _)| knob == name);
        named.map(|(_, word)| word)
    }

    /// Text of a knob after Nuke's evaluation.
    pub fn evaluated(&self, name: &str) -> String {
        let mut text = String::new();
        let mut letters = self.knob(name).unwrap().text().chars();
        while let Some(c) = letters.next() {
            match c {
                '\\' => text.extend(letters.next()),
                '[' | '$' => panic!("{name} of {self:?} would run something"),
                c => text.push(c),
            }
        }
        text
    }

    /// File of a frame, relative to the script.
    pub fn file(&self, frame: usize) -> PathBuf {
        let name = self.evaluated("file");
        let Some((before, rest)) = name.split_once('%') else { return name.into() };
        let (digits, after) = rest.split_once('d').expect("%d");
        let digits: usize = digits.trim_start_matches('0').parse().unwrap_or(1);
        format!("{before}{frame:0digits$}{after}").into()
    }

    /// Component `index` of a knob that holds a number, a curve, or an expression of both.
    pub fn number(&self, name: &str, index: usize, frame: usize) -> f32 {
        let word = self.knob(name).unwrap_or_else(|| panic!("no knob {name}"));
        let Word::Braced(list) = word else { return word.text().parse().unwrap() };
        let elements: Vec<Word> = commands(list).into_iter().flatten().collect();
        match &elements[index.min(elements.len() - 1)] {
            Word::Plain(number) => number.parse().unwrap(),
            Word::Braced(text) => match text.strip_prefix("curve ") {
                Some(keys) => {
                    let keys: Vec<&str> = keys.split(' ').collect();
                    let at = format!("x{frame}");
                    let key = keys.chunks(2).find(|key| key[0] == at);
                    key.unwrap_or_else(|| panic!("no key {at} in {name}"))[1].parse().unwrap()
                }
                None => self.expression(text, frame),
            },
        }
    }

    /// Products and differences of numbers and knobs.
    fn expression(&self, text: &str, frame: usize) -> f32 {
        if let Some((a, b)) = text.split_once('-') {
            return self.expression(a, frame) - self.expression(b, frame);
        }
        let factor = |factor: &str| match (factor.parse(), factor.split_once('.')) {
            (Ok(number), _) => number,
            (_, Some((name, channel))) => {
                let index = "rgb".find(channel).expect("r, g or b");
                self.number(name, index, frame)
            }
            _ => self.number(factor, 0, frame),
        };
        text.split('*').map(factor).product()
    }
}

#[test]
fn words_are_read_as_tcl_does() {
    let words = commands("set N [stack 0]\nRead {\n file \"a \\\"b\\\" \\{\"\n v {{curve x1 2} 3}\n}\n");
    assert_eq!(words.len(), 2);
    assert_eq!(words[0][2], Word::Plain("[stack 0]".into()));
    let knobs = commands(words[1][1].text());
    assert_eq!(knobs[0][1], Word::Plain("a \"b\" {".into()));
    assert_eq!(knobs[1][1], Word::Braced("{curve x1 2} 3".into()));
}

#[test]
fn nodes_take_their_inputs_from_the_stack() {
    let text = "A {\n inputs 0\n}\nset A [stack 0]\nB {\n inputs 0\n}\npush $A\nMerge2 {\n inputs 2\n}\n";
    let script = Script::parse(Path::new("/x.nk"), text);
    assert_eq!(script.nodes[2].inputs, [0, 1], "the last pushed is input 0");
}
