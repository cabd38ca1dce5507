//! Plots as SVG.

use std::fmt::Write;

/// Margins in pixels: for numbers on the left and below, and for the title above.
const LEFT: f64 = 48.0;
const BELOW: f64 = 40.0;
const ABOVE: f64 = 26.0;
const RIGHT: f64 = 12.0;

/// An axis from its first to its last value.
#[derive(Clone, Copy)]
pub struct Axis<'a> {
    pub name: &'a str,
    pub from: f64,
    pub to: f64,
    pub scale: Scale,
}

/// Numbered ticks of an axis.
#[derive(Clone, Copy)]
pub enum Scale {
    /// Ticks at this distance.
    Even(f64),
    /// Ticks at round numbers, also within a decade; both ends are above 0.
    Logarithmic,
}

impl Axis<'_> {
    /// Share of the axis below a value, clamped to 0 to 1.
    fn share(&self, value: f64) -> f64 {
        let along = |value: f64| match self.scale {
            Scale::Even(_) => value,
            Scale::Logarithmic => value.ln(),
        };
        let from = along(self.from);
        ((along(value) - from) / (along(self.to) - from)).clamp(0.0, 1.0)
    }

    /// Ticks and their numbers.
    fn ticks(&self) -> Vec<(f64, String)> {
        const ROUND: [f64; 11] = [1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0];
        match self.scale {
            Scale::Even(tick) => {
                let digits = (-tick.log10().floor()).max(0.0) as usize;
                let count = ((self.to - self.from) / tick).round() as i64;
                let values = (0..=count).map(|i| self.from + i as f64 * tick);
                values.map(|value| (value, format!("{value:.digits$}"))).collect()
            }
            Scale::Logarithmic => {
                let decades = self.from.log10().floor() as i32..=self.to.log10().ceil() as i32;
                let values = decades.flat_map(|decade| {
                    ROUND.map(|round| {
                        let digits = (i32::from(round.fract() > 0.0) - decade).max(0) as usize;
                        let value = round * 10f64.powi(decade);
                        (value, format!("{value:.digits$}"))
                    })
                });
                values.filter(|(value, _)| (self.from..self.to).contains(value)).collect()
            }
        }
    }
}

/// A plot of curves and points.
pub struct Plot<'a> {
    /// Width and height in pixels.
    size: (f64, f64),
    x: Axis<'a>,
    y: Axis<'a>,
    body: String,
    /// Legend: names and colours.
    legend: Vec<(&'a str, &'a str)>,
    title: &'a str,
}

impl<'a> Plot<'a> {
    /// An empty plot of this width and height in pixels.
    pub fn new(title: &'a str, size: (f64, f64), x: Axis<'a>, y: Axis<'a>) -> Self {
        Self { size, x, y, body: String::new(), legend: vec![], title }
    }

    /// Position of a value, clamped to the frame.
    fn place(&self, (x, y): (f64, f64)) -> (f64, f64) {
        let (width, height) = self.size;
        (LEFT + self.x.share(x) * (width - LEFT - RIGHT), height - BELOW - self.y.share(y) * (height - BELOW - ABOVE))
    }

    /// Adds a legend entry.
    pub fn name(&mut self, name: &'a str, colour: &'a str) {
        self.legend.push((name, colour));
    }

    /// Draws a line through values.
    pub fn line(&mut self, values: impl IntoIterator<Item = (f64, f64)>, colour: &str, dashed: bool) {
        let places: Vec<String> =
            values.into_iter().map(|value| self.place(value)).map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
        let dash = if dashed { r#" stroke-dasharray="4 3""# } else { "" };
        // Writing to a String cannot fail.
        let _ = writeln!(
            self.body,
            r#"<polyline points="{}" fill="none" stroke="{colour}" stroke-width="1.5"{dash}/>"#,
            places.join(" ")
        );
    }

    /// Draws a faint error bar between two values.
    pub fn bar(&mut self, from: (f64, f64), to: (f64, f64), colour: &str) {
        let ((x, y), (to_x, to_y)) = (self.place(from), self.place(to));
        let _ = writeln!(
            self.body,
            r#"<path d="M{x:.1} {y:.1}L{to_x:.1} {to_y:.1}" stroke="{colour}" stroke-opacity=".35"/>"#
        );
    }

    /// Draws a point of this radius in pixels.
    pub fn point(&mut self, at: (f64, f64), radius: u32, colour: &str) {
        let (x, y) = self.place(at);
        let _ =
            writeln!(self.body, r#"<circle cx="{x:.1}" cy="{y:.1}" r="{radius}" fill="{colour}" fill-opacity=".7"/>"#);
    }

    /// Draws the cumulative share of values.
    pub fn distribution(&mut self, values: impl IntoIterator<Item = f64>, colour: &str) {
        let mut values: Vec<f64> = values.into_iter().filter(|v| v.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        let count = values.len().max(1) as f64;
        let steps = values
            .iter()
            .enumerate()
            .flat_map(|(i, &value)| [(value, i as f64 / count), (value, (i + 1) as f64 / count)]);
        let steps: Vec<(f64, f64)> = std::iter::once((self.x.from, 0.0)).chain(steps).collect();
        self.line(steps, colour, false);
    }

    /// Writes names, with their colours, beside points. A name that meets another point or an earlier name is left out.
    pub fn label(&mut self, points: &[((f64, f64), &str, &str)]) {
        let places: Vec<_> = points.iter().map(|(at, ..)| self.place(*at)).collect();
        let (width, height) = self.size;
        let frame = Area { left: LEFT, top: ABOVE, right: width - RIGHT, bottom: height - BELOW };
        let mut taken: Vec<Area> = places.iter().map(|&place| Area::around(place)).collect();
        for (number, (place, (_, name, colour))) in places.into_iter().zip(points).enumerate() {
            let is_free = |area: &Area| {
                let mut others = taken.iter().enumerate().filter(|(other, _)| *other != number);
                frame.holds(area) && others.all(|(_, other)| !area.meets(other))
            };
            let Some(area) = Area::beside(place, name).into_iter().find(is_free) else { continue };
            let _ = writeln!(
                self.body,
                r#"<text x="{:.1}" y="{:.1}" fill="{colour}">{}</text>"#,
                area.left,
                area.bottom - 1.0,
                escaped(name)
            );
            taken.push(area);
        }
    }

    /// Text of the SVG file.
    pub fn svg(&self) -> String {
        let (width, height) = self.size;
        let mut text = format!(
            r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" font-family="sans-serif" font-size="10" fill="#333">
<rect width="{width}" height="{height}" fill="#fff"/>
<text x="{LEFT}" y="16" font-size="12">{}</text>
"##,
            escaped(self.title)
        );
        for (tick, number) in self.x.ticks() {
            let ((x, low), (_, high)) = (self.place((tick, self.y.from)), self.place((tick, self.y.to)));
            let _ = writeln!(
                text,
                r##"<path d="M{x:.1} {low:.1}V{high:.1}" stroke="#ddd"/><text x="{x:.1}" y="{:.1}" text-anchor="middle">{number}</text>"##,
                low + 13.0
            );
        }
        for (tick, number) in self.y.ticks() {
            let ((left, y), (right, _)) = (self.place((self.x.from, tick)), self.place((self.x.to, tick)));
            let _ = writeln!(
                text,
                r##"<path d="M{left:.1} {y:.1}H{right:.1}" stroke="#ddd"/><text x="{:.1}" y="{:.1}" text-anchor="end">{number}</text>"##,
                left - 5.0,
                y + 3.5
            );
        }
        let _ = write!(
            text,
            "{}<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>\n\
             <text transform=\"translate(13 {:.1}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
            self.body,
            0.5 * (LEFT + width - RIGHT),
            height - 8.0,
            self.x.name,
            0.5 * (ABOVE + height - BELOW),
            self.y.name
        );
        for (i, (name, colour)) in self.legend.iter().enumerate() {
            let y = height - BELOW - 10.0 - 13.0 * (self.legend.len() - 1 - i) as f64;
            let _ = writeln!(
                text,
                r#"<text x="{:.1}" y="{y:.1}" text-anchor="end" fill="{colour}">{name}</text>"#,
                width - RIGHT - 6.0
            );
        }
        text + "</svg>\n"
    }
}

/// Text without the signs that mean something in XML.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;")
}

/// A box in the plot, in pixels.
#[derive(Clone, Copy)]
struct Area {
    left: f64,
    top: f64,
    right: f64,
    bottom: f64,
}

impl Area {
    /// Box of a point's marker.
    fn around((x, y): (f64, f64)) -> Self {
        Self { left: x - 4.0, top: y - 4.0, right: x + 4.0, bottom: y + 4.0 }
    }

    /// Candidate positions of a point's label: right, left, above and below.
    fn beside((x, y): (f64, f64), name: &str) -> [Self; 4] {
        let width = 6.0 * name.chars().count() as f64;
        [(6.0, -5.0), (-6.0 - width, -5.0), (-width / 2.0, -16.0), (-width / 2.0, 6.0)].map(|(by_x, by_y)| Self {
            left: x + by_x,
            top: y + by_y,
            right: x + by_x + width,
            bottom: y + by_y + 10.0,
        })
    }

    fn meets(&self, other: &Self) -> bool {
        self.left < other.right && other.left < self.right && self.top < other.bottom && other.top < self.bottom
    }

    fn holds(&self, other: &Self) -> bool {
        other.left >= self.left && other.right <= self.right && other.top >= self.top && other.bottom <= self.bottom
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(name: &str, from: f64, to: f64, scale: Scale) -> Axis<'_> {
        Axis { name, from, to, scale }
    }

    #[test]
    fn ticks_are_round_numbers_with_their_digits() {
        let numbers = |from, to, scale| -> Vec<String> {
            axis("", from, to, scale).ticks().into_iter().map(|(_, number)| number).collect()
        };
        assert_eq!(numbers(1.0, 2.0, Scale::Even(0.5)), ["1.0", "1.5", "2.0"]);
        assert_eq!(numbers(0.25, 0.45, Scale::Logarithmic), ["0.25", "0.3", "0.4"]);
        assert_eq!(numbers(7.5, 21.0, Scale::Logarithmic), ["8", "9", "10", "15", "20"]);
        let log = axis("", 1.0, 100.0, Scale::Logarithmic);
        assert_eq!([0.1, 10.0, 1000.0].map(|value| log.share(value)), [0.0, 0.5, 1.0]);
    }

    #[test]
    fn a_name_without_room_is_left_out() {
        let even = |name| axis(name, 0.0, 1.0, Scale::Even(0.5));
        let mut plot = Plot::new("a < b", (400.0, 300.0), even("x"), even("y"));
        let (at, long) = ((0.5, 0.5), "x".repeat(80));
        plot.label(&[(at, "first", "#111"), (at, "second", "#222"), ((0.2, 0.2), &long, "#333")]);
        let svg = plot.svg();
        assert!(svg.contains("a &lt; b") && !svg.contains(&long), "{svg}");
        let place = |name: &str| svg.lines().find(|line| line.contains(name)).unwrap();
        // The margins are 60 and 66: a value of 0.5 is at 218, 143.
        assert!(place(">first<").contains("x=\"224.0\" y=\"147.0\""), "{svg}");
        assert!(place(">second<").contains("x=\"176.0\" y=\"147.0\""), "{svg}");
    }
}
