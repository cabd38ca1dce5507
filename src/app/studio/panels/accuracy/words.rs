//! Rungs and figures in words.

use tradeoff::{Knob, Measured, Pick};

/// Title of a rung, such as `Working size: 64`.
pub fn title(measured: &Measured) -> String {
    let rung = &measured.rung;
    let Some(knob) = rung.knob else { return "Baseline".to_owned() };
    let value = rung.name.split_once('=').map_or("", |(_, value)| value);
    let value = match knob {
        Knob::Minutes if value == "0x" => "none".to_owned(),
        Knob::Minutes => format!("{value} as long"),
        Knob::Effects => value.replace('-', " "),
        Knob::Field => value.replace('-', " "),
        _ => value.to_owned(),
    };
    format!("{}: {value}", knob.label())
}

/// Milliseconds, with one decimal below 10.
pub fn ms(ms: f64) -> String {
    if ms < 10.0 { format!("{ms:.1} ms") } else { format!("{ms:.0} ms") }
}

/// Bytes in kB, MB or GB.
pub fn bytes(bytes: u64) -> String {
    let bytes = bytes as f64;
    if bytes >= 1e9 {
        format!("{:.1} GB", bytes / 1e9)
    } else if bytes >= 1e6 {
        format!("{:.1} MB", bytes / 1e6)
    } else {
        format!("{:.0} kB", bytes / 1e3)
    }
}

/// Message that no rung meets the target, with the best figure.
pub fn none(rungs: &[Measured], asked: Pick) -> String {
    let comparable = || rungs.iter().filter(|m| m.changes_db.is_none());
    match asked {
        Pick::Within(_) => {
            let fastest = comparable().map(|m| m.frame.median).fold(f64::INFINITY, f64::min);
            format!("No setting is that fast: the fastest takes {} a frame.", ms(fastest))
        }
        Pick::AtLeast(_) => {
            let best = comparable().map(|m| m.fidelity.psnr_db).fold(0.0, f64::max);
            format!("No setting is that accurate: the best reaches {best:.1} dB. Measure with more minutes.")
        }
    }
}

/// Duration in seconds, minutes or hours.
pub fn duration(seconds: f64) -> String {
    if seconds < 90.0 {
        format!("{seconds:.0} s")
    } else if seconds < 5400.0 {
        format!("{:.1} min", seconds / 60.0)
    } else {
        format!("{:.1} h", seconds / 3600.0)
    }
}
