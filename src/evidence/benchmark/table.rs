//! The report in Markdown.

use super::LAMPS;
use super::names::{FIRST, PICTURES, PREDICTION, STEP};
use super::report::{DeviceReport, MachineReport, Row, ms};
use std::fmt::Write;
use training::Preset;

/// Frames of a minute of an interview.
const MINUTE_FRAMES: f64 = 1500.0;

fn megabytes(bytes: Option<u64>) -> String {
    bytes.map_or("–".to_owned(), |bytes| format!("{}", bytes / 1_000_000))
}

/// A question that people ask first.
struct Question {
    what: &'static str,
    preset: Preset,
    size: usize,
    words: &'static str,
    /// Turns milliseconds into words.
    amount: fn(f64) -> String,
}

/// Rate per second, or seconds for one.
fn rate(ms: f64) -> String {
    match 1e3 / ms {
        rate if rate >= 1.0 => format!("{rate:.1} a second"),
        _ => format!("{:.1} s each", ms / 1e3),
    }
}

fn minute(ms: f64) -> String {
    match MINUTE_FRAMES * ms / 1e3 {
        seconds if seconds < 100.0 => format!("{seconds:.0} s"),
        seconds if seconds < 6000.0 => format!("{:.0} min", seconds / 60.0),
        seconds => format!("{:.1} h", seconds / 3600.0),
    }
}

fn steps(ms: f64) -> String {
    format!("{:.0} steps", 600e3 / ms)
}

const QUESTIONS: [Question; 9] = {
    const fn ask(what: &'static str, size: usize, words: &'static str, amount: fn(f64) -> String) -> Question {
        Question { what, preset: Preset::Quick, size, words, amount }
    }
    let [whole, _, turned] = PICTURES;
    [
        ask(whole, 512, "frames relit, network included, 512 pixels", rate),
        ask(whole, 1024, "frames relit, network included, 1024 pixels", rate),
        ask(turned, 512, "pictures while the light is turned, 512 pixels", rate),
        ask(turned, 1024, "pictures while the light is turned, 1024 pixels", rate),
        ask(whole, 1024, "a minute of interview (1500 frames) relit, 1024 pixels", minute),
        ask(STEP, 128, "ten minutes of training `quick`, 128 pixels", steps),
        ask(STEP, 256, "ten minutes of training `quick`, 256 pixels", steps),
        ask(STEP, 512, "ten minutes of training `quick`, 512 pixels", steps),
        Question { preset: Preset::Paper, ..ask(STEP, 512, "ten minutes of training `paper`, 512 pixels", steps) },
    ]
};

impl Question {
    /// The row that answers it on a device, if it has a figure.
    fn row<'a>(&self, device: &'a DeviceReport) -> Option<&'a Row> {
        let key = (self.what, Some(self.preset.name()), Some(self.size));
        device.rows.iter().find(|row| {
            (row.what.as_str(), row.network.as_deref(), row.size) == key
                && (row.median_ms.is_some() || row.predicted_ms.is_some())
        })
    }

    fn cell(&self, row: Option<&Row>) -> String {
        let Some(row) = row else { return "–".to_owned() };
        match (row.median_ms, row.predicted_ms) {
            (Some(ms), _) => (self.amount)(ms),
            (None, Some(ms)) => format!("about {}", (self.amount)(ms)),
            (None, None) => "–".to_owned(),
        }
    }
}

impl MachineReport {
    /// The whole report in Markdown.
    pub fn markdown(&self) -> String {
        let mut text = format!("# What this machine can do\n\n{}.\n", self.machine.words());
        let part = if self.stopped { ", and was stopped before its end" } else { "" };
        let _ = writeln!(
            text,
            "Measured in {:.1} of {} minutes{part}, with {LAMPS} lamps and made-up pictures. Other programs that ran \
             meanwhile made it slower.\n",
            self.seconds / 60.0,
            self.minutes,
        );
        self.adapters(&mut text);
        self.in_short(&mut text);
        for device in &self.devices {
            device.markdown(&mut text);
        }
        text.push_str(NOTES);
        text
    }

    fn adapters(&self, text: &mut String) {
        if self.adapters.is_empty() {
            text.push_str("The system offers no GPU: networks are trained and pictures are made on the CPU.\n\n");
            return;
        }
        text.push_str("| adapter | kind | interface | driver | largest block, MB | read by a shader, MB |\n");
        text.push_str("|---|---|---|---|---:|---:|\n");
        for a in &self.adapters {
            let _ = writeln!(
                text,
                "| {} | {} | {} | {} | {} | {} |",
                a.name,
                a.kind,
                a.backend,
                a.driver,
                megabytes(Some(a.largest_buffer_bytes)),
                megabytes(Some(a.largest_binding_bytes))
            );
        }
        text.push('\n');
        if !self.adapters.iter().any(gpu::Adapter::is_hardware) {
            text.push_str("No hardware GPU is among them: networks are trained and pictures are made on the CPU.\n\n");
        }
    }

    /// Answers to the first questions, one column per device.
    fn in_short(&self, text: &mut String) {
        let rows = |question: &Question| -> Vec<Option<&Row>> {
            self.devices.iter().map(|device| question.row(device)).collect()
        };
        let mut lines = String::new();
        for question in &QUESTIONS {
            let rows = rows(question);
            if rows.iter().all(Option::is_none) {
                continue;
            }
            let _ = write!(lines, "| {} |", question.words);
            for row in &rows {
                let _ = write!(lines, " {} |", question.cell(*row));
            }
            if let [Some(gpu), Some(cpu)] = rows[..] {
                let times = cpu.median_ms.zip(gpu.median_ms).map(|(cpu, gpu)| cpu / gpu);
                let _ = write!(lines, " {} |", times.map_or("–".to_owned(), ms));
            } else if rows.len() > 1 {
                lines.push_str(" – |");
            }
            lines.push('\n');
        }
        if lines.is_empty() {
            return;
        }
        text.push_str("## In short\n\n| |");
        for device in &self.devices {
            let _ = write!(text, " {} |", device.kind.to_uppercase());
        }
        let many = self.devices.len() > 1;
        text.push_str(if many { " times as fast |\n|---|" } else { "\n|---|" });
        for _ in 0..self.devices.len() + usize::from(many) {
            text.push_str("---:|");
        }
        let _ = writeln!(text, "\n{lines}");
    }
}

impl DeviceReport {
    fn markdown(&self, text: &mut String) {
        let _ = writeln!(text, "## {}: {}\n", self.kind.to_uppercase(), self.name);
        if let Some(verdict) = &self.self_test {
            let _ = writeln!(text, "Self-test: {verdict}.\n");
        }
        if let Some(bytes) = self.copied_per_second {
            let _ = writeln!(text, "Memory is copied at {:.1} GB/s, read and written both counted.\n", bytes / 1e9);
        }
        self.networks(text);
        self.pictures(text);
        self.passes(text);
        self.left_out(text);
    }

    /// Rows named in `names`, by network and size.
    fn sorted(&self, names: &[&str]) -> Vec<&Row> {
        let mut rows: Vec<&Row> = (self.rows.iter()).filter(|row| names.contains(&row.what.as_str())).collect();
        rows.sort_by_key(|row| {
            let preset = Preset::ALL.iter().position(|preset| Some(preset.name()) == row.network.as_deref());
            let name = names.iter().position(|name| *name == row.what);
            (preset, row.size, name)
        });
        rows
    }

    fn networks(&self, text: &mut String) {
        let steps = self.sorted(&[STEP]);
        if steps.is_empty() {
            return;
        }
        text.push_str(
            "| network | pixels | training step, ms | steps in ten minutes | prediction, ms | first step, s | memory, MB \
             | on the GPU, MB |\n|---|---:|---:|---:|---:|---:|---:|---:|\n",
        );
        for step in steps {
            let same = |row: &&Row| row.what == PREDICTION && (&row.network, row.size) == (&step.network, step.size);
            let prediction = self.rows.iter().find(same);
            let many = step.median_ms.or(step.predicted_ms);
            let peak = prediction.and_then(|row| row.peak_bytes).max(step.peak_bytes);
            let on_gpu = prediction.and_then(|row| row.gpu_bytes).max(step.gpu_bytes);
            let _ = writeln!(
                text,
                "| {} | {} | {} | {} | {} | {} | {} | {} |",
                step.network.as_deref().unwrap_or_default(),
                step.size.unwrap_or_default(),
                step.time(),
                many.map_or("–".to_owned(), |ms| format!("{:.0}", 600e3 / ms)),
                prediction.map_or("–".to_owned(), Row::time),
                step.first_ms.map_or("–".to_owned(), |ms| format!("+{:.1}", ms / 1e3)),
                megabytes(peak),
                megabytes(on_gpu)
            );
        }
        let is_first = |row: &&Row| FIRST.iter().any(|(_, first)| row.what.starts_with(first));
        for row in self.rows.iter().filter(is_first) {
            if let Some(first) = row.first_ms {
                let _ = writeln!(text, "\n{}: {:.1} s above the median.", row.name(), first / 1e3);
            }
        }
        text.push('\n');
    }

    fn pictures(&self, text: &mut String) {
        let pictures = self.sorted(&PICTURES);
        if pictures.is_empty() {
            return;
        }
        text.push_str(
            "| picture | network | pixels | time, ms | a second | memory, MB | on the GPU, MB | aim |\n\
             |---|---|---:|---:|---:|---:|---:|---|\n",
        );
        for row in pictures {
            let _ = writeln!(
                text,
                "| {} | {} | {} | {} | {} | {} | {} | {} |",
                row.what,
                row.network.as_deref().unwrap_or_default(),
                row.size.unwrap_or_default(),
                row.time(),
                (row.median_ms.or(row.predicted_ms)).map_or("–".to_owned(), |ms| format!("{:.1}", 1e3 / ms)),
                megabytes(row.peak_bytes),
                megabytes(row.gpu_bytes),
                row.aim()
            );
        }
        text.push('\n');
    }

    fn passes(&self, text: &mut String) {
        let is_pass = |row: &&Row| row.network.is_none() && row.size.is_some();
        let mut passes: Vec<&Row> = self.rows.iter().filter(is_pass).collect();
        if passes.is_empty() {
            return;
        }
        // Sums of lamps first, then the passes in order.
        passes.sort_by_key(|row| (row.size, !row.is_sum()));
        text.push_str(
            "| pass | pixels | time, ms | copying, ms | times copying | aim |\n|---|---:|---:|---:|---:|---|\n",
        );
        for row in passes {
            let ratio = row.median_ms.zip(row.copy_ms).map(|(ms, copy)| ms / copy);
            let _ = writeln!(
                text,
                "| {} | {} | {} | {} | {} | {} |",
                row.what,
                row.size.unwrap_or_default(),
                row.time(),
                row.copy_ms.map_or("–".to_owned(), ms),
                ratio.map_or("–".to_owned(), |ratio| format!("{ratio:.2}")),
                row.aim()
            );
        }
        text.push('\n');
    }

    fn left_out(&self, text: &mut String) {
        let mut last = None;
        for row in &self.rows {
            let Some(why) = &row.left_out else { continue };
            let key = (&row.network, row.size, why);
            if last == Some(key) {
                continue;
            }
            if last.is_none() {
                text.push_str("Left out:\n\n");
            }
            last = Some(key);
            let _ = writeln!(text, "- {}: {why}.", row.name());
        }
        if last.is_some() {
            text.push('\n');
        }
    }
}

/// Meaning of the words.
const NOTES: &str = "\
## What the words mean

Times are medians, with the 5th and 95th percentiles in brackets. \"About\" marks a prediction from what was measured. \
A training step is one of the preset: both losses, gradients, optimiser and moving average. `quick` is the preset for \
ten minutes on a CPU, `fast-gpu` the same on a GPU, `paper` the paper's network. \"First step\" is the extra time of the \
first step: kernels are compiled and, on a GPU, timed against each other. \"Ever\" is a start without cached kernels, \
\"again\" the next start of the program; a build without `keep-autotune` caches none.

A relit frame goes from the plate to codes in memory, as in an export; the network works at 512 pixels, and larger \
pictures take their detail from the plate. A turn of the light is the window's picture while a yaw is dragged, at full \
size. Copying is the time in which the same device copies the bytes that a pass has to read and write. `relight` and \
`sum` are the sum of lamps; unless noted, the OLATs are f32.

Memory is the peak of the measure's process. The GPU's memory is missing where its driver does not report it.
";
