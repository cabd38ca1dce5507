//! An exposure bracket: several photographs of one ball, merged for more dynamic range.
//!
//! Each photograph measures a pixel's radiance as x/t, with x its linear light and t its exposure time (Debevec and
//! Malik 1997). The average, weighted by reciprocal variances, is the most likely radiance under the sensor's noise
//! (Granados et al. 2010): quantisation and photon noise. Clipped pixels and those within two deviations of black
//! do not count.

use super::photograph::Photograph;
use base::error::{Error, Result};
use imaging::{Image, Raster};
use std::fmt::Display;

/// One photograph of a bracket.
#[derive(Clone, Copy, Debug)]
pub struct Exposure<'a> {
    pub photograph: &'a Photograph,
    /// Exposure in stops: log2 of the exposure time relative to a common time. Aperture and sensitivity changes
    /// count in the same way.
    pub stops: f32,
}

/// A merged bracket with quality figures.
#[derive(Clone, Debug)]
pub struct Bracket {
    /// Light at an exposure of 0 stops. Pixels clipped even in the shortest exposure stay clipped.
    pub photograph: Photograph,
    /// Number of pixels with a channel clipped even in the shortest exposure.
    pub clipped_pixels: usize,
    /// Number of pixels with a channel black even in the longest exposure.
    pub dark_pixels: usize,
    /// Number of pixels with a channel that is clipped in one exposure and black in the next.
    pub gap_pixels: usize,
    /// Exposure of each photograph in stops above the first, measured from the pictures; `None` if it shares too
    /// few well-exposed pixels with its neighbour.
    pub measured_stops: Vec<Option<f32>>,
    /// Largest difference between measured and given steps from one exposure to the next, in stops; 0 if nothing
    /// could be measured. Shutters are off by a tenth; more means wrong exposures, a wrong response or changing
    /// light.
    pub disagreement_stops: f32,
}

/// Smallest number of well-exposed pixels shared by two photographs for a comparison of their exposures.
const MIN_SHARED_PIXELS: usize = 32;
/// Exposures closer than this many stops count as equal.
const SAME_STOPS: f32 = 0.05;
/// Smallest reversal in stops that is more than a measuring error.
const REVERSED_STOPS: f32 = 0.25;
/// Shoulder: above this share of the clipping level a sensor's response bends, so weights fall to almost 0.
const SHOULDER: f32 = 0.85;
const SHOULDER_WEIGHT: f32 = 1e-3;

/// Merges an exposure bracket, given in any order.
///
/// # Errors
/// When there is no photograph, sizes differ, an exposure is NaN or infinite, two exposures are equal, or the
/// pictures contradict the order of the exposures.
pub fn merge(exposures: &[Exposure]) -> Result<Bracket> {
    let size = check(exposures)?;
    let (ordered, disagreement_stops) = by_length(exposures)?;
    let mut light = Image::filled(size.0, size.1, [0.0; 3]);
    let mut deviation = light.clone();
    let mut clipped = Raster::filled(size.0, size.1, [false; 3]);
    let (mut dark_pixels, mut gap_pixels) = (0, 0);
    for i in 0..light.pixels.len() {
        let channels = [0, 1, 2].map(|c| channel(exposures, &ordered, i, c));
        light.pixels[i] = channels.each_ref().map(|channel| finite(channel.light));
        deviation.pixels[i] = channels.each_ref().map(|channel| finite(channel.deviation));
        let any = |source: Source| channels.iter().any(|channel| channel.source == source);
        clipped.pixels[i] = channels.each_ref().map(|channel| channel.source == Source::Clipped);
        dark_pixels += usize::from(any(Source::Dark));
        gap_pixels += usize::from(any(Source::Gap));
    }
    let photographs: Vec<&Photograph> = exposures.iter().map(|e| e.photograph).collect();
    let shortest = ordered[ordered.len() - 1];
    let photograph = Photograph {
        light,
        clipped,
        deviation,
        white: shortest.photograph.white / shortest.stops.exp2(),
        repaired_pixels: photographs.iter().map(|p| p.repaired_pixels).sum(),
    };
    Ok(Bracket {
        clipped_pixels: photograph.clipped_pixels(),
        photograph,
        dark_pixels,
        gap_pixels,
        measured_stops: measured_stops(&photographs),
        disagreement_stops,
    })
}

fn refuse<T>(problem: impl Display, remedy: &str) -> Result<T> {
    Err(Error::invalid(format!("the exposure bracket {problem}"), remedy))
}

/// Checks photographs and exposures of a bracket and returns the photographs' size.
fn check(exposures: &[Exposure]) -> Result<(usize, usize)> {
    let Some(first) = exposures.first() else {
        return refuse("has no photograph", "Choose the photographs of the ball");
    };
    let size = first.photograph.size();
    for (i, exposure) in exposures.iter().enumerate() {
        let found = exposure.photograph.size();
        if found != size {
            return refuse(
                format!("has photographs of {} × {} and {} × {} pixels", size.0, size.1, found.0, found.1),
                "Use uncropped photographs from one fixed camera",
            );
        }
        if !exposure.stops.is_finite() || exposure.stops.abs() > 64.0 {
            return refuse(
                format!("has the exposure {} stops for photograph {}", exposure.stops, i + 1),
                "Give each photograph's exposure relative to the first, such as 0, -2, -4",
            );
        }
    }
    Ok(size)
}

/// Exposures from longest to shortest, and [`Bracket::disagreement_stops`].
fn by_length<'a, 'b>(exposures: &'b [Exposure<'a>]) -> Result<(Vec<&'b Exposure<'a>>, f32)> {
    let mut order: Vec<usize> = (0..exposures.len()).collect();
    order.sort_by(|&a, &b| exposures[b].stops.total_cmp(&exposures[a].stops));
    let mut disagreement = 0.0f32;
    for pair in order.windows(2) {
        let (long, short) = (&exposures[pair[0]], &exposures[pair[1]]);
        let given = long.stops - short.stops;
        let names = format!("photographs {} and {}", pair[0] + 1, pair[1] + 1);
        if given < SAME_STOPS {
            return refuse(
                format!("has the same exposure, {} stops, for {names}", long.stops),
                "Leave one of them out, or correct its exposure",
            );
        }
        if let Some(measured) = stops_between(short.photograph, long.photograph) {
            if measured < -REVERSED_STOPS {
                return refuse(
                    format!(
                        "has {names} in the wrong order: the one given as {given:.1} stops longer is {:.1} stops darker",
                        -measured
                    ),
                    "Correct the order of the photographs or of their exposures",
                );
            }
            disagreement = disagreement.max((measured - given).abs());
        }
    }
    let ordered = order.into_iter().map(|i| &exposures[i]).collect();
    Ok((ordered, disagreement))
}

/// Source of a merged channel's light.
#[derive(Clone, Copy, PartialEq)]
enum Source {
    /// Measured from the exposures that are neither clipped nor black there.
    Measured,
    /// Clipped even in the shortest exposure.
    Clipped,
    /// Clipped in one exposure and black in the next.
    Gap,
    /// Black even in the longest exposure.
    Dark,
}

/// One merged channel of a pixel, at 0 stops.
struct Channel {
    light: f64,
    deviation: f64,
    source: Source,
}

/// Merges channel `c` of pixel `i`. `ordered` are the exposures from the longest to the shortest.
fn channel(exposures: &[Exposure], ordered: &[&Exposure], i: usize, c: usize) -> Channel {
    let (mut sum, mut weights) = (0.0f64, 0.0f64);
    for Exposure { photograph, stops } in exposures {
        let (x, sigma) = (photograph.light.pixels[i][c], photograph.deviation.pixels[i][c]);
        if photograph.clipped.pixels[i][c] || x <= 2.0 * sigma {
            continue;
        }
        let bend = 1.0 - (x / photograph.white - SHOULDER) / (1.0 - SHOULDER);
        let time = f64::from(*stops).exp2();
        let weight = (time / f64::from(sigma)).powi(2) * f64::from(bend.clamp(SHOULDER_WEIGHT, 1.0));
        sum += weight * f64::from(x) / time;
        weights += weight;
    }
    let measured = Channel { light: sum / weights, deviation: weights.recip().sqrt(), source: Source::Measured };
    if weights > 0.0 {
        return measured;
    }
    // All exposures are clipped or black: the shortest tells most about clipping, the longest about black.
    let is_clipped = |exposure: &Exposure| exposure.photograph.clipped.pixels[i][c];
    let (longest, shortest) = (ordered[0], ordered[ordered.len() - 1]);
    let (exposure, source) = if is_clipped(shortest) {
        (shortest, Source::Clipped)
    } else if is_clipped(longest) {
        let open = ordered.iter().find(|exposure| !is_clipped(exposure));
        (*open.unwrap_or(&shortest), Source::Gap)
    } else {
        (longest, Source::Dark)
    };
    let time = f64::from(exposure.stops).exp2();
    Channel {
        light: f64::from(exposure.photograph.light.pixels[i][c]) / time,
        deviation: f64::from(exposure.photograph.deviation.pixels[i][c]) / time,
        source,
    }
}

fn finite(value: f64) -> f32 {
    value.min(f64::from(f32::MAX)) as f32
}

/// Exposure of each photograph in stops above the first, from the pictures alone: in order from bright to dark, the
/// median ratio of pixels well exposed in both neighbours. `None` for photographs that such pixels do not connect
/// to the first.
pub fn measured_stops(photographs: &[&Photograph]) -> Vec<Option<f32>> {
    let brightness = |p: &Photograph| -> f64 {
        let values = p.light.pixels.iter().flatten();
        values.map(|&v| f64::from(v.min(p.white))).sum()
    };
    let mut order: Vec<(usize, f64)> = (photographs.iter().enumerate()).map(|(i, p)| (i, brightness(p))).collect();
    order.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut stops = vec![None; photographs.len()];
    let Some(start) = order.iter().position(|(i, _)| *i == 0) else { return stops };
    stops[0] = Some(0.0);
    let mut walk = |path: &mut dyn Iterator<Item = usize>| {
        let (mut from, mut sum) = (0, 0.0);
        for to in path {
            match stops_between(photographs[from], photographs[to]) {
                Some(step) if photographs[from].size() == photographs[to].size() => sum += step,
                _ => break,
            }
            stops[to] = Some(sum);
            from = to;
        }
    };
    walk(&mut order[start + 1..].iter().map(|(i, _)| *i));
    walk(&mut order[..start].iter().rev().map(|(i, _)| *i));
    stops
}

/// Exposure difference of two photographs in stops: the median over channels well above the noise and below the
/// shoulder in both.
fn stops_between(short: &Photograph, long: &Photograph) -> Option<f32> {
    let good = |p: &Photograph, i: usize, c: usize| {
        let x = p.light.pixels[i][c];
        let clear = x > 10.0 * p.deviation.pixels[i][c] && x < SHOULDER * p.white;
        (clear && !p.clipped.pixels[i][c]).then_some(x)
    };
    let pixels = short.light.pixels.len().min(long.light.pixels.len());
    let mut ratios: Vec<f32> = (0..pixels)
        .flat_map(|i| (0..3).map(move |c| (i, c)))
        .filter_map(|(i, c)| Some((good(long, i, c)? / good(short, i, c)?).log2()))
        .collect();
    if ratios.len() < MIN_SHARED_PIXELS {
        return None;
    }
    let middle = ratios.len() / 2;
    Some(*ratios.select_nth_unstable_by(middle, f32::total_cmp).1)
}
