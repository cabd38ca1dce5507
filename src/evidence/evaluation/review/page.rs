//! HTML of a review page. It loads no files, and all user text is escaped.

use super::{Marks, Means, Metric, Review, badness, heat, place_by_direction};
use glam::Vec3;
use imaging::color::byte_from_unit;
use std::fmt::Write;

/// Contents of the page.
pub(super) struct Contents<'a> {
    pub name: &'a str,
    pub date: &'a str,
    /// Facts about network and calibration, as names and values.
    pub facts: Vec<(&'static str, String)>,
    pub review: &'a Review,
    pub marks: &'a Marks,
    /// Direction of each lamp.
    pub directions: Vec<Vec3>,
    /// Worst OLATs first.
    pub worst: Vec<WorstPictures>,
    pub sheet: Sheet,
}

/// True OLAT, predicted OLAT and their FLIP, as data URIs.
pub(super) struct WorstPictures {
    pub case: usize,
    pub lamp: usize,
    pub pictures: [String; 3],
}

/// Predicted picture of a case under every lamp, as data URIs.
pub(super) struct Sheet {
    pub case: usize,
    pub pictures: Vec<String>,
}

const STYLE: &str = "\
:root{color-scheme:dark}
body{margin:0 auto;padding:2rem;max-width:68rem;background:#262626;color:#dedede;font:15px/1.5 system-ui,sans-serif}
h1{font-size:1.7rem;font-weight:600;margin:0}h2{font-size:1.15rem;font-weight:600;margin:2.5rem 0 .6rem}
p,td,th,figcaption{color:#b8b8b8}strong{color:#fff;font-weight:600}
table{border-collapse:collapse;width:100%}th{font-weight:400;text-align:left;color:#909090}
th,td{padding:.25rem .8rem .25rem 0;border-bottom:1px solid #3a3a3a;vertical-align:top}
.n{text-align:right;font-variant-numeric:tabular-nums;white-space:nowrap}
.bar{display:inline-block;height:.6rem;border-radius:2px;vertical-align:middle}
.cells{display:grid;grid-template-columns:repeat(auto-fill,minmax(20rem,1fr));gap:1.2rem}
figure{margin:0}figure div{display:flex;gap:2px;background:#181818}figure img{width:33.3%;min-width:0}
figcaption{font-size:.85rem;padding-top:.2rem}svg{width:100%;height:auto;background:#181818;border-radius:4px}
svg text{fill:#b8b8b8;font:10px system-ui,sans-serif}.bad{color:#ff8f7d}.doubtful{color:#ffc46b}.good{color:#9ed48a}
@media print{body{background:#fff;color:#000}p,td,th,figcaption{color:#333}strong{color:#000}}
";

/// The whole page.
pub(super) fn page(contents: &Contents) -> String {
    let Contents { name, review, .. } = contents;
    let name = escape(name);
    let mut out = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width\">\n<title>{name}: review</title>\n\
         <style>\n{STYLE}</style>\n</head>\n<body>\n<h1>{name}</h1>\n"
    );
    let date = escape(contents.date);
    out += &format!("<p>Predicted OLATs compared with the true ones. Written {date}.</p>\n");
    out += &summary(review);
    out += &marked(contents);
    out += "<h2>Every lamp and frame</h2>\n";
    out += "<p>Each square is one lamp in one frame or pose; brighter is worse. A dot marks a reviewer's verdict or \
            note.</p>\n";
    for metric in Metric::ALL {
        out += &heat_map(contents, metric);
    }
    out += &worst(contents);
    out += &sheet(contents);
    out += &lamps(contents);
    out += "<h2>Network, training and calibration</h2>\n<table>\n";
    for (what, value) in &contents.facts {
        out += &format!("<tr><th>{}</th><td>{}</td></tr>\n", escape(what), escape(value));
    }
    out += "</table>\n<h2>How it was measured</h2>\n<p>Each predicted picture of the subject under one lamp is compared \
            with the true one at the exposure of its frame, encoded by a power of 1/2.2, over the pixels that the matte \
            covers by more than 98 %. FLIP is the mean difference that a viewer sees when one is flipped into the other \
            on a screen at arm's length, from 0 to 1. PSNR is in decibels over all channels with white as the peak. \
            SSIM is the mean of the luma's. Poses are shown to the network relit as the interview.</p>\n</body>\n</html>\n";
    out
}

/// Escapes text for HTML.
fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '"' => out += "&quot;",
            '\'' => out += "&#39;",
            // Control characters, which HTML cannot hold.
            '\0'..='\x08' | '\x0b' | '\x0c' | '\x0e'..='\x1f' => out.push('\u{fffd}'),
            _ => out.push(letter),
        }
    }
    out
}

fn color(error: f32) -> String {
    let [r, g, b] = heat(error).map(byte_from_unit);
    format!("#{r:02x}{g:02x}{b:02x}")
}

fn summary(review: &Review) -> String {
    let (seen, unseen): (Vec<_>, Vec<_>) = review.cases.iter().partition(|case| case.seen);
    let mut out = "<table>\n<tr><th></th><th class=\"n\">frames and poses</th>".to_owned();
    for metric in Metric::ALL {
        let _ = write!(out, "<th class=\"n\">{}</th>", metric.name());
    }
    out += "</tr>\n";
    for (what, cases) in [("Held out of training", unseen), ("Seen in training", seen)] {
        let Some(Means { cases, over_cells }) = Means::from_cases(&cases) else { continue };
        let _ = write!(out, "<tr><td>{what}</td><td class=\"n\">{cases}</td>");
        for metric in Metric::ALL {
            let figure = metric.text(metric.score(&over_cells));
            let _ = write!(out, "<td class=\"n\"><strong>{figure}</strong></td>");
        }
        out += "</tr>\n";
    }
    out += "</table>\n";
    if let Some(flicker) = &review.flicker {
        let _ = writeln!(out, "<p>{}.</p>", escape(&flicker.sentence()));
    }
    out
}

fn marked(contents: &Contents) -> String {
    let mut all: Vec<_> = contents.marks.all().iter().collect();
    // Verdicts first, bad ones at the top, then notes without a verdict.
    all.sort_by_key(|m| (m.mark.is_none(), m.mark));
    let mut out = "<h2>The reviewer's marks</h2>\n".to_owned();
    if all.is_empty() {
        return out + "<p>No marks were made.</p>\n";
    }
    out += "<table>\n<tr><th>mark</th><th>frame or pose</th><th>lamp</th><th>note</th></tr>\n";
    for marked in all {
        let mark = marked.mark.map_or("", |m| m.name());
        let note = escape(&marked.note).replace('\n', "<br>");
        let (case, lamp) = (escape(&marked.case), escape(&marked.lamp));
        let _ = writeln!(out, "<tr><td class=\"{mark}\">{mark}</td><td>{case}</td><td>{lamp}</td><td>{note}</td></tr>");
    }
    out + "</table>\n"
}

/// Heat map of all OLATs: lamps to the right, cases downward.
fn heat_map(Contents { review, marks, .. }: &Contents, metric: Metric) -> String {
    const LABEL: f32 = 130.0;
    const WIDTH: f32 = 1040.0;
    const ROW: f32 = 18.0;
    const HEAD: f32 = 16.0;
    let lamps = review.lamps.len();
    let step = ((WIDTH - LABEL) / lamps.max(1) as f32).min(3.0 * ROW);
    let height = HEAD + ROW * review.cases.len() as f32 + 2.0;
    let [good, bad] = metric.range().map(|v| metric.text(v));
    let name = metric.name();
    let mut out = format!(
        "<p><strong>{name}</strong>, from {good} (dark) to {bad} (bright)</p>\n\
         <svg viewBox=\"0 0 {WIDTH} {height}\" role=\"img\" aria-label=\"{name} of every lamp and frame\">\n"
    );
    // As many lamp names as fit.
    let every = [1, 2, 5, 10, 20, 50, 100].into_iter().find(|n| *n as f32 * step >= 18.0);
    for lamp in (0..lamps).step_by(every.unwrap_or(lamps.max(1))) {
        let x = LABEL + (lamp as f32 + 0.5) * step;
        let _ = writeln!(out, "<text x=\"{x:.1}\" y=\"11\" text-anchor=\"middle\">{lamp}</text>");
    }
    for (row, case) in review.cases.iter().enumerate() {
        let y = HEAD + row as f32 * ROW;
        let seen = if case.seen { " (seen)" } else { "" };
        let label = escape(&case.name);
        let _ = writeln!(out, "<text x=\"4\" y=\"{:.1}\">{label}{seen}</text>", y + 12.5);
        for (lamp, cell) in case.cells.iter().enumerate() {
            let value = metric.score(cell);
            let x = LABEL + lamp as f32 * step;
            let lamp_name = &review.lamps[lamp];
            let marked = marks.get(&case.name, lamp_name);
            let note = marked
                .map_or(String::new(), |m| format!(": {} {}", m.mark.map_or("", |mark| mark.name()), escape(&m.note)));
            let _ = writeln!(
                out,
                "<rect x=\"{x:.2}\" y=\"{y:.1}\" width=\"{:.2}\" height=\"{:.1}\" fill=\"{}\"><title>{label}, {}: {}{note}</title></rect>",
                step - 1.0f32.min(0.2 * step),
                ROW - 1.0,
                color(badness(metric, value)),
                escape(lamp_name),
                metric.text(value),
            );
            if marked.is_some() {
                let _ = writeln!(
                    out,
                    "<circle cx=\"{:.2}\" cy=\"{:.1}\" r=\"{:.1}\" fill=\"#fff\" stroke=\"#000\" pointer-events=\"none\"/>",
                    x + 0.5 * step,
                    y + 0.5 * ROW,
                    (0.3 * step).min(3.0)
                );
            }
        }
    }
    out + "</svg>\n"
}

fn worst(Contents { review, worst, marks, .. }: &Contents) -> String {
    let mut out = format!(
        "<h2>The {} OLATs that differ most</h2>\n<p>True, predicted, and FLIP, the visible difference.</p>\n\
         <div class=\"cells\">\n",
        worst.len()
    );
    for WorstPictures { case, lamp, pictures } in worst {
        let case = &review.cases[*case];
        let lamp_name = &review.lamps[*lamp];
        let figures = Metric::ALL.map(|m| format!("{} {}", m.name(), m.text(m.score(&case.cells[*lamp]))));
        let seen = if case.seen { ", seen in training" } else { "" };
        let (case_name, lamp_text) = (escape(&case.name), escape(lamp_name));
        out += "<figure><div>";
        for (what, picture) in ["true", "predicted", "FLIP of"].into_iter().zip(pictures) {
            let _ = write!(out, "<img src=\"{}\" alt=\"{what} {lamp_text} in {case_name}\">", escape(picture));
        }
        let _ =
            write!(out, "</div><figcaption><strong>{case_name}, {lamp_text}</strong>{seen}<br>{}", figures.join(", "));
        if let Some(marked) = marks.get(&case.name, lamp_name) {
            let mark = marked.mark.map_or("", |m| m.name());
            let _ = write!(out, "<br><span class=\"{mark}\">{mark}</span> {}", escape(&marked.note));
        }
        out += "</figcaption></figure>\n";
    }
    out + "</div>\n"
}

/// Predicted pictures of a case, each at its lamp's position.
fn sheet(Contents { review, directions, sheet, .. }: &Contents) -> String {
    const SIZE: [f32; 2] = [1000.0, 500.0];
    let [width, height] = SIZE;
    let placed = place_by_direction(directions, width, height);
    let case = &review.cases[sheet.case];
    let mut out = format!(
        "<h2>{} under every lamp</h2>\n<p>Predicted. Each picture stands where its lamp is: up at the top, in the \
         middle what the camera looks at behind the subject.</p>\n\
         <svg viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"contact sheet\">\n",
        escape(&case.name)
    );
    let side = placed.side - 2.0;
    let pictures = sheet.pictures.iter().zip(&placed.corners).zip(&review.lamps);
    for ((picture, [x, y]), lamp) in pictures {
        let _ = writeln!(
            out,
            "<image x=\"{:.1}\" y=\"{:.1}\" width=\"{side:.1}\" height=\"{side:.1}\" href=\"{}\"><title>{}</title></image>",
            x + 1.0,
            y + 1.0,
            escape(picture),
            escape(lamp)
        );
    }
    out + "</svg>\n"
}

/// Table of all lamps, the worst first.
fn lamps(Contents { review, directions, .. }: &Contents) -> String {
    let means = Metric::ALL.map(|metric| review.lamp_means(metric));
    let mut out = "<h2>Lamps, the worst first</h2>\n<p>Means over frames and poses that training has not seen, if there are any.</p>\n\
                   <table>\n<tr><th>lamp</th><th class=\"n\">azimuth</th><th class=\"n\">elevation</th>"
        .to_owned();
    for metric in Metric::ALL {
        let _ = write!(out, "<th class=\"n\">{}</th>", metric.name());
    }
    out += "<th></th></tr>\n";
    for lamp in review.worst_lamps(Metric::Flip) {
        let _ = write!(out, "<tr><td>{}</td>", escape(&review.lamps[lamp]));
        let direction = directions.get(lamp).copied().filter(|d| d.is_finite());
        let angles = direction.map_or([String::new(), String::new()], |d| {
            [d.x.atan2(-d.z), d.y.clamp(-1.0, 1.0).asin()].map(|a| format!("{:.0}°", a.to_degrees()))
        });
        for angle in angles {
            let _ = write!(out, "<td class=\"n\">{angle}</td>");
        }
        for (metric, means) in Metric::ALL.into_iter().zip(&means) {
            let _ = write!(out, "<td class=\"n\">{}</td>", metric.text(means[lamp]));
        }
        let error = badness(Metric::Flip, means[0][lamp]);
        let _ = writeln!(
            out,
            "<td><span class=\"bar\" style=\"width:{:.1}rem;background:{}\"></span></td></tr>",
            0.2 + 12.0 * error,
            color(0.25 + 0.75 * error)
        );
    }
    out + "</table>\n"
}

#[cfg(test)]
mod tests {
    use super::super::{Mark, MarkedOlat};
    use super::*;

    const NASTY: &str = "<script>alert(\"a&b\")</script>'\u{1}";

    fn example() -> String {
        let mut review = super::super::tests::example();
        review.lamps[1] = format!("olat {NASTY}");
        review.cases[0].name = format!("frame {NASTY}");
        let mut marks = Marks::default();
        marks.set(MarkedOlat::new(&review.cases[0].name, &review.lamps[1], Some(Mark::Bad), NASTY));
        marks.set(MarkedOlat::new("gone", "away", None, "two\nlines"));
        page(&Contents {
            name: NASTY,
            date: "2000-02-29",
            facts: vec![("Training", NASTY.to_owned())],
            review: &review,
            marks: &marks,
            directions: vec![Vec3::X, Vec3::NAN, Vec3::Y],
            worst: vec![WorstPictures {
                case: 0,
                lamp: 1,
                pictures: ["a", "b", "c"].map(|p| format!("data:image/png;base64,{p}")),
            }],
            sheet: Sheet { case: 0, pictures: ["d", "e", "f"].map(|p| format!("data:image/png;base64,{p}")).to_vec() },
        })
    }

    /// Checks that every tag is closed in order and every attribute is quoted.
    fn check_tags(text: &str) {
        const ALONE: [&str; 5] = ["!DOCTYPE", "meta", "img", "br", "circle"];
        let mut open: Vec<&str> = Vec::new();
        for piece in text.split('<').skip(1) {
            let (tag, _) = piece.split_once('>').expect("a tag is closed");
            assert_eq!(tag.matches('"').count() % 2, 0, "{tag}");
            let name = tag.split([' ', '\n']).next().unwrap();
            if let Some(name) = name.strip_prefix('/') {
                assert_eq!(open.pop(), Some(name));
            } else if !ALONE.contains(&name) {
                open.push(name);
            }
        }
        assert!(open.is_empty(), "{open:?}");
    }

    #[test]
    fn the_page_is_whole_and_what_people_wrote_stays_text() {
        let text = example();
        check_tags(&text);
        assert!(!text.contains("<script") && !text.contains('\u{1}'), "{text}");
        assert!(text.contains("&lt;script&gt;alert(&quot;a&amp;b&quot;)&lt;/script&gt;&#39;\u{fffd}"));
        assert!(text.contains("two<br>lines") && text.contains("class=\"bad\""));
        assert!(!text.contains("http"), "nothing is loaded from elsewhere");
    }

    #[test]
    fn it_has_every_cell_once_for_each_figure_and_every_picture() {
        let text = example();
        assert_eq!(text.matches("<rect").count(), 3 * 9);
        assert_eq!(text.matches("<circle").count(), 3, "one marked cell in each map");
        for picture in ["a", "b", "c", "d", "e", "f"] {
            assert_eq!(text.matches(&format!("base64,{picture}\"")).count(), 1, "{picture}");
        }
        assert!(!text.contains("NaN"));
    }
}
