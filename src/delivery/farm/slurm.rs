//! Job for Slurm: an array of chunks, and a last step that waits for them.

use super::job::{RelightWork, TrainTask};
use super::settings::FarmSettings;
use super::shell::word;
use base::error::Result;
use base::files::write_beside;
use base::shell::quoted;
use gpu::DeviceChoice;
use std::io::Write;
use std::path::Path;

/// Most tasks of one array: Slurm's default limit (`MaxArraySize`) is 1001.
const ARRAY: usize = 1000;

/// Writes the scripts of an export; returns the command that submits them.
///
/// # Errors
/// When a file cannot be written.
pub(crate) fn write(job: &Path, name: &str, program: &str, farm: &FarmSettings, work: &RelightWork) -> Result<String> {
    let (first, last) = work.frames;
    let (size, device) = (work.chunk, work.settings.device);
    let chunk = format!(
        "from=$(({first} + task * {size}))\nexec {} farm-chunk \"$PWD\" --frames \"$from+{size}\" --device {}\n",
        quoted(program),
        word(device)
    );
    script(job, "chunk.sh", &task_script(farm, device, "chunk", &chunk))?;
    let assemble = format!(
        "{}exec >>logs/assemble.log 2>&1\nexec {} farm-assemble \"$PWD\"\n",
        head(farm, DeviceChoice::Cpu),
        quoted(program)
    );
    script(job, "assemble.sh", &assemble)?;
    let chunks = (last - first + 1).div_ceil(size);
    let submit = format!(
        "{}sbatch --job-name={} --chdir=\"$job\" --output=/dev/null --kill-on-invalid-dep=yes --dependency=\"afterok$ids\" assemble.sh\n",
        submit_script(name, "chunk.sh", chunks),
        quoted(&job_name(name))
    );
    script(job, "submit.sh", &submit)?;
    Ok(command(job))
}

/// Writes the scripts of trainings; returns the command that submits them.
///
/// # Errors
/// When a file cannot be written.
pub(crate) fn write_training(
    job: &Path,
    name: &str,
    program: &str,
    farm: &FarmSettings,
    tasks: &[TrainTask],
) -> Result<String> {
    let device = TrainTask::device(tasks);
    let train = format!("exec {} farm-chunk \"$PWD\" --task \"$task\"\n", quoted(program));
    script(job, "train.sh", &task_script(farm, device, "task", &train))?;
    script(job, "submit.sh", &submit_script(name, "train.sh", tasks.len()))?;
    Ok(command(job))
}

fn command(job: &Path) -> String {
    format!("sh {}", quoted(&job.join("submit.sh").display().to_string()))
}

/// Head of the scripts, with the requested resources. Slurm puts a lost worker's task back into the queue.
fn head(farm: &FarmSettings, device: DeviceChoice) -> String {
    let gpu = match device {
        DeviceChoice::Gpu => "#SBATCH --gres=gpu:1\n",
        _ => "",
    };
    format!(
        "#!/bin/sh\n#SBATCH --nodes=1\n#SBATCH --ntasks=1\n#SBATCH --mem={}M\n#SBATCH --requeue\n\
         #SBATCH --open-mode=append\n{gpu}set -eu\nmkdir -p logs\n",
        farm.memory_mib()
    )
}

/// Script that runs once per task, with a log for each task.
fn task_script(farm: &FarmSettings, device: DeviceChoice, what: &str, run: &str) -> String {
    format!(
        "{}task=$((${{1:-0}} + SLURM_ARRAY_TASK_ID))\nexec >>\"logs/{what}-$task.log\" 2>&1\n{run}",
        head(farm, device)
    )
}

/// Script that submits the job; `$ids` are the arrays, each after a colon.
fn submit_script(name: &str, script: &str, tasks: usize) -> String {
    format!(
        "#!/bin/sh\n\
         # Submits the job. It can be submitted again: complete frames of this job are kept.\n\
         # sbatch options, such as --partition=NAME, come from variables such as SBATCH_PARTITION.\n\
         set -eu\n\
         cd \"$(dirname \"$0\")\"\n\
         job=$(pwd)\n\
         ids=\n\
         first=0\n\
         while [ \"$first\" -lt {tasks} ]; do\n\
         \tlast=$(({tasks} - first - 1))\n\
         \t[ \"$last\" -lt {ARRAY} ] || last=$(({ARRAY} - 1))\n\
         \tid=$(sbatch --parsable --job-name={} --chdir=\"$job\" --output=/dev/null --array=\"0-$last\" {script} \"$first\")\n\
         \techo \"Submitted array ${{id%%;*}}: tasks $first to $((first + last))\"\n\
         \tids=\"$ids:${{id%%;*}}\"\n\
         \tfirst=$((first + last + 1))\n\
         done\n",
        quoted(&job_name(name))
    )
}

/// Job name shown in queues.
fn job_name(project: &str) -> String {
    let plain = |c: char| if c.is_control() { ' ' } else { c };
    let name: String = project.chars().map(plain).take(60).collect();
    format!("afterlight {name}")
}

fn script(job: &Path, name: &str, text: &str) -> Result<()> {
    let path = job.join(name);
    write_beside(&path, |out| out.write_all(text.as_bytes()))?;
    #[cfg(unix)]
    {
        use base::error::Error;
        use std::os::unix::fs::PermissionsExt;
        let mode = std::fs::Permissions::from_mode(0o755);
        std::fs::set_permissions(&path, mode)
            .map_err(|e| Error::io("write", &path, e, "Check that the folder can be written"))?;
    }
    Ok(())
}
