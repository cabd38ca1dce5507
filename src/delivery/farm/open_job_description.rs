//! Job for Open Job Description: one template for schedulers (specification `jobtemplate-2023-09`).
//! <https://github.com/OpenJobDescription/openjd-specifications>

use super::job::{RelightWork, TrainTask};
use super::settings::FarmSettings;
use super::shell::word;
use base::error::{Error, Result};
use base::files::write_beside;
use base::shell::quoted;
use gpu::DeviceChoice;
use serde_json::{Value, json};
use std::io::Write;
use std::path::Path;

const NAME: &str = "template.json";
/// Longest job name in letters: the specification allows 128.
const LONGEST: usize = 100;

/// Writes the template of an export; returns the command that submits it.
///
/// # Errors
/// When the file cannot be written.
pub(crate) fn write(job: &Path, name: &str, program: &str, farm: &FarmSettings, work: &RelightWork) -> Result<String> {
    let device = work.settings.device;
    let parameters = json!([
        program_parameter(program),
        job_parameter(),
        {
            "name": "Shoot", "type": "STRING", "default": shoot(job)?,
            "description": "The folder of the footage, as the workers see it.",
        },
        number("FirstFrame", work.frames.0, "The first frame that is relit."),
        number("LastFrame", work.frames.1, "The last frame."),
        {
            "name": "ChunkSize", "type": "INT", "minValue": 1, "default": work.chunk,
            "description": "Frames of a task.",
        },
        {
            "name": "Device", "type": "STRING", "default": word(device),
            "allowedValues": ["auto", "cpu", "gpu"],
            "description": "Device of the network.",
        },
    ]);
    let template = json!({
        "specificationVersion": "jobtemplate-2023-09",
        "name": job_name(name),
        "parameterDefinitions": parameters,
        "steps": [
            {
                "name": "Relight",
                "description": "Relights the frames of a chunk. It goes on where a lost worker stopped.",
                "hostRequirements": requirements(farm, device),
                "parameterSpace": { "taskParameterDefinitions": [{
                    "name": "Frame",
                    "type": "INT",
                    "range": "{{Param.FirstFrame}}-{{Param.LastFrame}}:{{Param.ChunkSize}}",
                }] },
                "script": run(&[
                    "farm-chunk", "{{Param.Job}}",
                    "--frames", "{{Task.Param.Frame}}+{{Param.ChunkSize}}",
                    "--device", "{{Param.Device}}",
                    "--shoot", "{{Param.Shoot}}",
                ]),
            },
            {
                "name": "Assemble",
                "description": "Checks every frame, then makes the movie.",
                "dependencies": [{ "dependsOn": "Relight" }],
                "hostRequirements": requirements(farm, DeviceChoice::Cpu),
                "script": run(&["farm-assemble", "{{Param.Job}}", "--shoot", "{{Param.Shoot}}"]),
            },
        ],
    });
    save(job, &template)
}

/// Writes the template of trainings; returns the command that submits it.
///
/// # Errors
/// When the file cannot be written.
pub(crate) fn write_training(
    job: &Path,
    name: &str,
    program: &str,
    farm: &FarmSettings,
    tasks: &[TrainTask],
) -> Result<String> {
    let device = TrainTask::device(tasks);
    let template = json!({
        "specificationVersion": "jobtemplate-2023-09",
        "name": job_name(name),
        "parameterDefinitions": [program_parameter(program), job_parameter()],
        "steps": [{
            "name": "Train",
            "description": "Trains a network. It goes on where a lost worker stopped.",
            "hostRequirements": requirements(farm, device),
            "parameterSpace": { "taskParameterDefinitions": [{
                "name": "Task", "type": "INT", "range": format!("0-{}", tasks.len().saturating_sub(1)),
            }] },
            "script": run(&["farm-chunk", "{{Param.Job}}", "--task", "{{Task.Param.Task}}"]),
        }],
    });
    save(job, &template)
}

fn save(job: &Path, template: &Value) -> Result<String> {
    let text =
        serde_json::to_string_pretty(template).map_err(|e| Error::bug(format!("cannot write the template: {e}")))?;
    let path = job.join(NAME);
    write_beside(&path, |out| out.write_all(text.as_bytes()))?;
    Ok(format!("openjd run {}", quoted(&path.display().to_string())))
}

/// Folder of the footage, from the snapshot.
fn shoot(job: &Path) -> Result<String> {
    let copy = project::Project::open(&job.join(super::job::SNAPSHOT))?;
    Ok(copy.settings.shoot.folder.display().to_string())
}

fn number(name: &str, default: usize, description: &str) -> Value {
    json!({ "name": name, "type": "INT", "minValue": 0, "default": default, "description": description })
}

/// Path parameters with a default must lie beside the template, so the program is a text parameter.
fn program_parameter(program: &str) -> Value {
    json!({
        "name": "Program", "type": "STRING", "default": program,
        "description": "Afterlight on the workers: the very build that wrote the job.",
    })
}

fn job_parameter() -> Value {
    json!({
        "name": "Job", "type": "PATH", "objectType": "DIRECTORY", "dataFlow": "INOUT", "default": ".",
        "description": "The folder of the job, which all workers see.",
    })
}

fn run(arguments: &[&str]) -> Value {
    json!({ "actions": { "onRun": { "command": "{{Param.Program}}", "args": arguments } } })
}

fn requirements(farm: &FarmSettings, device: DeviceChoice) -> Value {
    let mut amounts = vec![
        json!({ "name": "amount.worker.vcpu", "min": 1 }),
        json!({ "name": "amount.worker.memory", "min": farm.memory_mib() }),
    ];
    if device == DeviceChoice::Gpu {
        amounts.push(json!({ "name": "amount.worker.gpu", "min": 1 }));
    }
    json!({ "amounts": amounts })
}

/// Job name within the specification: limited length, no control characters, no format expressions.
fn job_name(project: &str) -> String {
    let plain = |c: char| match c {
        '{' => '(',
        '}' => ')',
        c if c.is_control() => ' ',
        c => c,
    };
    let name: String = project.chars().map(plain).take(LONGEST).collect();
    format!("Afterlight: {name}")
}
