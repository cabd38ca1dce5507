//! Small plots as SVG.

use std::fmt::Write;

const WIDTH: f64 = 360.0;
const HEIGHT: f64 = 260.0;
/// Margins for numbers on the left and below, and for the title above.
const LEFT: f64 = 48.0;
const BELOW: f64 = 40.0;
const ABOVE: f64 = 26.0;
const RIGHT: f64 = 12.0;

/// An axis from its first to its last value, with numbered ticks.
#[derive(Clone, Copy)]
pub struct Axis<'a> {
    pub name: &'a str,
    pub from: f64,
    pub to: f64,
    pub tick: f64,
}

/// A plot of curves and points.
pub struct Plot<'a> {
    x: Axis<'a>,
    y: Axis<'a>,
    body: String,
    /// Legend: names and colours.
    legend: Vec<(&'a str, &'a str)>,
    title: &'a str,
}

impl<'a> Plot<'a> {
    pub fn new(title: &'a str, x: Axis<'a>, y: Axis<'a>) -> Self {
        Self { x, y, body: String::new(), legend: vec![], title }
    }

    /// Position of a value, clamped to the frame.
    fn place(&self, x: f64, y: f64) -> (f64, f64) {
        let share =
            |axis: &Axis, value: f64| ((value - axis.from) / (axis.to - axis.from)).clamp(0.0, 1.0);
        (
            LEFT + share(&self.x, x) * (WIDTH - LEFT - RIGHT),
            HEIGHT - BELOW - share(&self.y, y) * (HEIGHT - BELOW - ABOVE),
        )
    }

    /// Adds a legend entry.
    pub fn name(&mut self, name: &'a str, colour: &'a str) {
        self.legend.push((name, colour));
    }

    /// Draws a line through values.
    pub fn line(
        &mut self,
        values: impl IntoIterator<Item = (f64, f64)>,
        colour: &str,
        dashed: bool,
    ) {
        let places: Vec<String> = values
            .into_iter()
            .map(|(x, y)| self.place(x, y))
            .map(|(x, y)| format!("{x:.1},{y:.1}"))
            .collect();
        let dash = if dashed { r#" stroke-dasharray="4 3""# } else { "" };
        // Writing to a String cannot fail.
        let _ = writeln!(
            self.body,
            r#"<polyline points="{}" fill="none" stroke="{colour}" stroke-width="1.5"{dash}/>"#,
            places.join(" ")
        );
    }

    /// Draws a point, with an error bar for its height if known.
    pub fn point(&mut self, x: f64, y: f64, deviation: f64, colour: &str) {
        let (at_x, at_y) = self.place(x, y);
        if deviation > 0.0 {
            let ((_, low), (_, high)) =
                (self.place(x, y - deviation), self.place(x, y + deviation));
            let _ = writeln!(
                self.body,
                r#"<path d="M{at_x:.1} {low:.1}V{high:.1}" stroke="{colour}" stroke-opacity=".35"/>"#
            );
        }
        let _ = writeln!(
            self.body,
            r#"<circle cx="{at_x:.1}" cy="{at_y:.1}" r="2" fill="{colour}" fill-opacity=".7"/>"#
        );
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

    /// Text of the SVG file.
    pub fn svg(&self) -> String {
        let mut text = format!(
            r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}" font-family="sans-serif" font-size="10" fill="#333">
<rect width="{WIDTH}" height="{HEIGHT}" fill="#fff"/>
<text x="{LEFT}" y="16" font-size="12">{}</text>
"##,
            self.title
        );
        let ticks = |axis: &Axis| {
            let (from, tick) = (axis.from, axis.tick);
            let count = ((axis.to - from) / tick).round() as i64;
            (0..=count).map(move |i| from + i as f64 * tick)
        };
        let digits = |axis: &Axis| (-axis.tick.log10().floor()).max(0.0) as usize;
        for tick in ticks(&self.x) {
            let ((x, low), (_, high)) =
                (self.place(tick, self.y.from), self.place(tick, self.y.to));
            let _ = writeln!(
                text,
                r##"<path d="M{x:.1} {low:.1}V{high:.1}" stroke="#ddd"/><text x="{x:.1}" y="{:.1}" text-anchor="middle">{tick:.*}</text>"##,
                low + 13.0,
                digits(&self.x)
            );
        }
        for tick in ticks(&self.y) {
            let ((left, y), (right, _)) =
                (self.place(self.x.from, tick), self.place(self.x.to, tick));
            let _ = writeln!(
                text,
                r##"<path d="M{left:.1} {y:.1}H{right:.1}" stroke="#ddd"/><text x="{:.1}" y="{:.1}" text-anchor="end">{tick:.*}</text>"##,
                left - 5.0,
                y + 3.5,
                digits(&self.y)
            );
        }
        let _ = write!(
            text,
            "{}<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>\n\
             <text transform=\"translate(13 {:.1}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
            self.body,
            0.5 * (LEFT + WIDTH - RIGHT),
            HEIGHT - 8.0,
            self.x.name,
            0.5 * (ABOVE + HEIGHT - BELOW),
            self.y.name
        );
        for (i, (name, colour)) in self.legend.iter().enumerate() {
            let y = HEIGHT - BELOW - 10.0 - 13.0 * (self.legend.len() - 1 - i) as f64;
            let _ = writeln!(
                text,
                r#"<text x="{:.1}" y="{y:.1}" text-anchor="end" fill="{colour}">{name}</text>"#,
                WIDTH - RIGHT - 6.0
            );
        }
        text + "</svg>\n"
    }
}
