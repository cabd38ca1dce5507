//! Page of the trials, and its plots.

use crate::faults::{self, FaultRow};
use crate::motion;
use crate::networks::Pair;
use crate::results::Row;
use crate::summary::{Estimate, LEVELS, coverage, exposure, gammas, quantile};
use base::Result;
use base::files::write_beside;
use measuring::{Axis, Plot, Scale};
use std::io::Write;
use std::path::Path;

const BLUE: &str = "#1f6fb4";
const ORANGE: &str = "#c8641e";
const GREEN: &str = "#3a8a3a";
const GREY: &str = "#999";
/// Width and height of plots in pixels.
const SIZE: (f64, f64) = (360.0, 260.0);

/// Writes the page to `path`, and its plots into the folder of that name beside it.
///
/// # Errors
/// When a file cannot be written.
pub fn write(path: &Path, rows: &[Row], faults: &[FaultRow], pairs: &[Pair]) -> Result<()> {
    let folder = path.with_extension("");
    let name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let calibrated: Vec<&Row> = rows.iter().filter(|row| row.refused.is_empty()).collect();
    for (plot, svg) in plots(&calibrated) {
        write_beside(&folder.join(format!("{plot}.svg")), |out| out.write_all(svg.as_bytes()))?;
    }
    let text = text(&name, rows, &calibrated)
        + &groups(&calibrated)
        + &wrong(&calibrated)
        + &motion::section(&calibrated)
        + &faults::section(faults)
        + &networks(pairs);
    write_beside(path, |out| out.write_all(text.as_bytes()))
}

fn all_gammas(rows: &[&Row]) -> Vec<Estimate> {
    rows.iter().flat_map(|row| gammas(row)).collect()
}

fn exposures(rows: &[&Row]) -> Vec<Estimate> {
    rows.iter().map(|row| exposure(row)).collect()
}

fn share(name: &str) -> Axis<'_> {
    Axis { name, from: 0.0, to: 1.0, scale: Scale::Even(0.25) }
}

/// Empty plot of cumulative shares; the value axis has a name, an end and a tick distance.
fn shares_below<'a>(title: &'a str, values: (&'a str, f64, f64), shares: &'a str) -> Plot<'a> {
    let (name, to, tick) = values;
    let values = Axis { name, from: 0.0, to, scale: Scale::Even(tick) };
    Plot::new(title, SIZE, values, share(shares))
}

/// The plots by file name.
fn plots(rows: &[&Row]) -> Vec<(&'static str, String)> {
    let axis = |name| Axis { name, from: 1.0, to: 4.0, scale: Scale::Even(0.5) };
    let mut gamma = Plot::new("γ found and true", SIZE, axis("true"), axis("found ± σ"));
    gamma.line([(1.0, 1.0), (4.0, 4.0)], GREY, true);
    for row in rows {
        for (x, y, deviation, colour) in
            [(row.gamma1, row.found1, row.deviation1, BLUE), (row.gamma2, row.found2, row.deviation2, ORANGE)]
        {
            gamma.bar((x, y - deviation), (x, y + deviation), colour);
            gamma.point((x, y), 2, colour);
        }
    }
    gamma.name("γ1", BLUE);
    gamma.name("γ2", ORANGE);

    let mut covered = Plot::new("How often the truth is inside", SIZE, share("what is stated"), share("what holds"));
    covered.line([(0.0, 0.0), (1.0, 1.0)], GREY, true);
    let both = [0, 1].map(|i| rows.iter().map(|row| gammas(row)[i]).collect::<Vec<_>>());
    for (estimates, name, colour) in
        [(&both[0], "γ1", BLUE), (&both[1], "γ2", ORANGE), (&exposures(rows), "exposure", GREEN)]
    {
        if !estimates.iter().any(|e| e.within > 0.0) {
            continue;
        }
        let levels = LEVELS.map(|level| (level, coverage(estimates, level)));
        covered.line([(0.0, 0.0)].into_iter().chain(levels).chain([(1.0, 1.0)]), colour, false);
        for (level, share) in levels {
            covered.point((level, share), 2, colour);
        }
        covered.name(name, colour);
    }

    let mut errors = shares_below("Error of γ and of ln exposure", ("error", 0.5, 0.1), "share of values below");
    errors.distribution(all_gammas(rows).iter().map(|e| e.off.abs()), BLUE);
    errors.distribution(exposures(rows).iter().map(|e| e.off.abs()), GREEN);
    errors.name("γ", BLUE);
    errors.name("ln exposure", GREEN);

    let mut light = shares_below(
        "Error of the interview's light on the subject",
        ("relative error", 0.5, 0.1),
        "share of shoots below",
    );
    light.distribution(rows.iter().map(|row| row.light_error), BLUE);
    light.distribution(rows.iter().map(|row| row.off_span), GREY);
    light.name("found", BLUE);
    light.name("best that the lamps can be", GREY);

    let mut directions =
        shares_below("Error of the lamps' directions", ("degrees", 20.0, 5.0), "share of shoots below");
    directions.distribution(rows.iter().map(|row| row.direction_median), BLUE);
    directions.distribution(rows.iter().map(|row| row.direction_worst), ORANGE);
    directions.name("median lamp", BLUE);
    directions.name("worst trusted lamp", ORANGE);
    vec![
        ("gamma", gamma.svg()),
        ("coverage", covered.svg()),
        ("errors", errors.svg()),
        ("light", light.svg()),
        ("directions", directions.svg()),
    ]
}

/// Condition of a group of shoots.
type Belongs = fn(&Row) -> bool;

/// Groups of shoots with something in common. The first table has the figures of all.
const GROUPS: &[(&str, Belongs)] = &[
    ("a sum of the lamps", |r| r.light == "banks" && r.ambient == 0.0),
    ("lamps and the room", |r| r.light == "banks" && r.ambient > 0.0),
    ("bare lamps elsewhere", |r| r.light == "lamps"),
    ("a window", |r| r.light == "window"),
    ("softboxes", |r| r.light == "softboxes"),
    ("exposure changed", |r| r.exposure_change != 1.0),
    ("dual gamma", |r| r.response == "dual"),
    ("sRGB", |r| r.response == "srgb"),
    ("log-like", |r| r.response == "log"),
    ("balls clipped", |r| r.ball_exposure > 1.0),
    ("clean ball in a dark room", |r| r.dust == 0.0 && r.room == 0.0),
    ("the subject sways", |r| r.sway > 0.0),
    ("light skin", |r| r.skin < 1.0 / 3.0),
    ("dark skin", |r| r.skin > 2.0 / 3.0),
];

/// The page down to its plots, from all trials and the calibrated ones.
fn text(name: &str, trials: &[Row], rows: &[&Row]) -> String {
    let (gammas, exposures) = (all_gammas(rows), exposures(rows));
    let off = |estimates: &[Estimate], share: f64| quantile(estimates.iter().map(|e| e.off.abs()), share);
    let sure = |estimates: &[Estimate]| estimates.iter().filter(|e| e.is_sure_and_wrong()).count();
    let size = trials.first().map_or(0, |row| row.size);
    let refused = trials.len() - rows.len();
    let named = rows.iter().filter(|row| row.within1 == 0.0).count();
    let figure = |value: fn(&Row) -> f64, share: f64| quantile(rows.iter().map(|row| value(row)), share);
    let seconds: f64 = trials.iter().map(|row| row.seconds + row.shoot_seconds).sum();
    format!(
        "# Robustness of the calibration

`make trials` writes this page: {count} shoots of the virtual stage with [random
troubles](method-mattes.md#shoots-with-trouble) (`afterlight stage DIR --trouble --seed N`, seeds {first} to {last}),
calibrated with default settings and compared with the truth. Seeds below 101 chose the calibration's constants; seeds
101 to 190 showed where the balls mislead it. {size} × {size} pixels, 9 to 24 lamps, 4 frames; {refused} refused; {minutes:.0} minutes.

True γ of responses other than a dual gamma: the nearest dual gamma's. {named} shoots got a standard curve, without an
interval.

| | aim | found |
|---|---:|---:|
| median error of γ | ≤ 0.05 | {g50:.3} |
| error of γ that 90 % stay below | ≤ 0.15 | {g90:.3} |
| γ: truth within the stated 50 / 90 / 99 % | 45–55 / 85–95 / 94–100 % | {gc} |
| ln exposure: truth within the stated 50 / 90 / 99 % | the same | {ec} |
| values of γ (of {values}) beyond five stated deviations | 0 | {gs} |
| exposures beyond five stated deviations | 0 | {es} |
| error of ln exposure, median / 90 % | | {e50:.3} / {e90:.3} |
| the interview's light on the subject, median / 90 % | | {l50:.1} / {l90:.1} % |
| the same for the best sum of the lamps | | {b50:.1} / {b90:.1} % |
| lamps' directions, median of the shoots' medians / worst | | {d50:.2}° / {dw:.2}° |
| lamps off by more than 5° with a confidence above ½ | 0 | {misled} |

![γ found and true]({name}/gamma.svg) ![coverage]({name}/coverage.svg)
![errors]({name}/errors.svg) ![light]({name}/light.svg) ![directions]({name}/directions.svg)
",
        first = trials.iter().map(|row| row.seed).min().unwrap_or(0),
        last = trials.iter().map(|row| row.seed).max().unwrap_or(0),
        count = trials.len(),
        minutes = seconds / 60.0,
        g50 = off(&gammas, 0.5),
        g90 = off(&gammas, 0.9),
        gc = percentages(&gammas),
        ec = percentages(&exposures),
        values = gammas.len(),
        gs = sure(&gammas),
        es = sure(&exposures),
        e50 = off(&exposures, 0.5),
        e90 = off(&exposures, 0.9),
        l50 = 100.0 * figure(|r| r.light_error, 0.5),
        l90 = 100.0 * figure(|r| r.light_error, 0.9),
        b50 = 100.0 * figure(|r| r.off_span, 0.5),
        b90 = 100.0 * figure(|r| r.off_span, 0.9),
        d50 = figure(|r| r.direction_median, 0.5),
        dw = figure(|r| r.direction_median, 1.0),
        misled = rows.iter().map(|row| row.misled).sum::<usize>(),
    )
}

/// The same figures by group.
fn groups(rows: &[&Row]) -> String {
    let mut page = String::from(
        "\n## Errors by condition

| shoots | number | error of γ, median / 90 % | γ within the stated 50 / 90 / 99 % | light, median |
|---|---:|---:|---:|---:|
",
    );
    for (what, belongs) in GROUPS {
        let group: Vec<&Row> = rows.iter().copied().filter(|row| belongs(row)).collect();
        if group.is_empty() {
            continue;
        }
        let gammas = all_gammas(&group);
        let off = |share| quantile(gammas.iter().map(|e| e.off.abs()), share);
        page += &format!(
            "| {what} | {} | {:.3} / {:.3} | {} | {:.1} % |\n",
            group.len(),
            off(0.5),
            off(0.9),
            percentages(&gammas),
            100.0 * quantile(group.iter().map(|row| row.light_error), 0.5)
        );
    }
    page
}

/// Shoots where γ was confident and wrong, if there are any.
fn wrong(rows: &[&Row]) -> String {
    let is_wrong = |row: &&&Row| gammas(row).iter().any(Estimate::is_sure_and_wrong);
    let mut page = String::new();
    for row in rows.iter().filter(is_wrong) {
        if page.is_empty() {
            page += "\n## Sure and wrong\n\nγ1 or γ2 off by more than five stated deviations:\n\n\
                     | seed | light | response | γ true | found | exposure true | found |\n|---:|---|---|---|---|---:|---:|\n";
        }
        page += &format!(
            "| {} | {} | {} | {:.2}, {:.2} | {:.2} ± {:.2}, {:.2} ± {:.2} | {:.2} | {:.2} ± {:.0} % |\n",
            row.seed,
            row.light,
            row.response,
            row.gamma1,
            row.gamma2,
            row.found1,
            row.deviation1,
            row.found2,
            row.deviation2,
            row.exposure_change,
            row.found_exposure,
            100.0 * row.exposure_deviation
        );
    }
    page
}

/// Cost of the calibration in the picture, if networks were trained.
fn networks(pairs: &[Pair]) -> String {
    let Some(first) = pairs.first() else { return String::new() };
    let losses = || pairs.iter().map(Pair::loss);
    format!(
        "\n## Cost in the picture

`make trials NETWORKS=8` trains two networks with equal steps on each of the first shoots, with the estimated and the
true response and exposure: {size} × {size} pixels, {epochs} epochs, 12 frames, four of them the truth. In PSNR of relit
frames ([accuracy.md](accuracy.md)) the calibration costs {median:.2} dB in the median of {count} pictures (aim: at most
0.5) and {worst:.2} dB in the worst (aim: at most 1.5).
",
        count = pairs.len(),
        size = first.size,
        epochs = first.epochs,
        median = quantile(losses(), 0.5),
        worst = quantile(losses(), 1.0),
    )
}

/// Coverage at each of [`LEVELS`], or a dash without intervals.
fn percentages(estimates: &[Estimate]) -> String {
    if !estimates.iter().any(|e| e.within > 0.0) {
        return "–".into();
    }
    let shares = LEVELS.map(|level| format!("{:.0}", 100.0 * coverage(estimates, level)));
    format!("{} %", shares.join(" / "))
}
