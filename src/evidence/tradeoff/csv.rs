//! The ladder as a CSV table.

use super::front::front;
use super::measure::Measured;
use base::machine::Machine;
use clap::ValueEnum;
use scene::{Effects, STRENGTHS};

const COLUMNS: &str = "rung,knob,seed,on_front,ms_median,ms_p10,ms_p90,ms_predicted,predict_ms,ms_as_timed,base_ms_in_turn,memory_bytes,\
disk_bytes,training_seconds,training_minutes_asked,steps,psnr_db,ssim,flip,lpips,olat_psnr_db,flicker_percent,changes_db,\
size,lamps,width,most_channels,depth,lamps_per_step,precision,against,device,processor,threads,system,version,build,\
rendering,rendering_end,perceptual,pixel,features,steadiness,storage,components,weights,environment_columns,effects";

/// One line per rung, with machine, version, seed and settings. `compared_with` names the reference of the figures in
/// words. Unknown figures are empty.
pub fn csv(rungs: &[Measured], machine: &Machine, compared_with: &str) -> String {
    let mut text = format!("{COLUMNS}\n");
    let known = |value: Option<f64>, digits: usize| value.map_or(String::new(), |value| format!("{value:.digits$}"));
    for (measured, on_front) in rungs.iter().zip(front(rungs)) {
        let (rung, config) = (&measured.rung, &measured.rung.network.config);
        let features = config.features.as_ref();
        let features = features.map(|file| file.display().to_string());
        let count = |value: Option<usize>| value.map_or(String::new(), |value| value.to_string());
        let fields = [
            quoted(&rung.name),
            rung.knob.map_or(String::new(), super::Knob::name),
            measured.seed.to_string(),
            u8::from(on_front).to_string(),
            format!("{:.3}", measured.frame.median),
            format!("{:.3}", measured.frame.low),
            format!("{:.3}", measured.frame.high),
            known(measured.predicted.map(|cost| cost.frame_ms), 3),
            format!("{:.3}", measured.predict_ms),
            format!("{:.3}", measured.timed.median),
            format!("{:.3}", measured.base_ms),
            measured.cost.memory_bytes.to_string(),
            measured.cost.disk_bytes.to_string(),
            format!("{:.1}", measured.training_seconds),
            format!("{:.3}", rung.minutes),
            measured.steps.to_string(),
            format!("{:.4}", measured.fidelity.psnr_db),
            format!("{:.5}", measured.fidelity.ssim),
            format!("{:.5}", measured.fidelity.flip),
            known(measured.fidelity.lpips, 5),
            known(measured.olat_psnr_db, 4),
            known(measured.flicker, 4),
            known(measured.changes_db, 3),
            rung.network.size.to_string(),
            rung.network.lamps.to_string(),
            config.width.to_string(),
            config.most_channels.to_string(),
            count(config.depth),
            count(config.lamps_per_step),
            format!("{:?}", config.precision).to_lowercase(),
            quoted(compared_with),
            quoted(&measured.device),
            quoted(&machine.processor),
            machine.threads.to_string(),
            quoted(&machine.system),
            quoted(&machine.version),
            measured.build.clone(),
            config.rendering.to_string(),
            known(config.rendering_end.map(f64::from), 2),
            config.perceptual.to_string(),
            config.pixel.to_string(),
            quoted(&features.unwrap_or_default()),
            config.steadiness.to_string(),
            name(rung.show.storage),
            count(rung.show.components),
            name(rung.show.weighting),
            count(rung.show.environment_columns),
            quoted(&effects(&rung.show.effects)),
        ];
        text += &fields.join(",");
        text.push('\n');
    }
    text
}

/// Name of a value on the command line.
fn name(value: impl ValueEnum) -> String {
    let value = value.to_possible_value();
    value.map_or_else(String::new, |value| value.get_name().to_owned())
}

/// The active effects, such as `glare=0.5`.
fn effects(effects: &Effects) -> String {
    let mut copy = *effects;
    let strengths = STRENGTHS.iter().filter_map(|strength| {
        let value = *(strength.of)(&mut copy);
        (value > 0.0).then(|| format!("{}={value}", strength.pass.name()))
    });
    strengths.collect::<Vec<_>>().join(" ")
}

/// A field quoted as in RFC 4180.
fn quoted(text: &str) -> String {
    if text.contains(['"', ',', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}
