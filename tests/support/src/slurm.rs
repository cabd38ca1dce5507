//! A farm of one machine: Slurm's daemons on the loopback interface, with their own configuration in a temporary
//! folder.

use super::need::{Need, found};
use super::waiting::PATIENCE;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Slurm with one node. Dropping it ends its daemons.
pub struct Slurm {
    folder: TempDir,
    config: PathBuf,
}

impl Slurm {
    /// Starts Slurm; None if this machine cannot, and the test returns.
    pub fn start() -> Option<Self> {
        found(Need::Slurm, Self::started())
    }

    fn started() -> Result<Self, String> {
        let folder = tempfile::tempdir().map_err(|e| e.to_string())?;
        let config = folder.path().join("slurm.conf");
        let slurm = Self { folder, config };
        let at = |name: &str| slurm.folder.path().join(name);
        let key: Vec<u8> = (0..1024u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
        std::fs::write(at("munge.key"), key).map_err(|e| e.to_string())?;
        private(&at("munge.key"))?;
        for name in ["state", "spool"] {
            std::fs::create_dir(at(name)).map_err(|e| e.to_string())?;
        }
        let option = |option: &str, name: &str| format!("--{option}={}", at(name).display());
        let munged = [
            "--force".to_owned(),
            option("key-file", "munge.key"),
            option("socket", "munge.sock"),
            option("pid-file", "munged.pid"),
            option("log-file", "munged.log"),
            option("seed-file", "munge.seed"),
        ];
        run(Command::new("munged").args(munged))?;
        let host = std::fs::read_to_string("/proc/sys/kernel/hostname").map_err(|e| e.to_string())?;
        let host = host.trim().split('.').next().unwrap_or_default().to_owned();
        let ports = [free_port()?, free_port()?];
        std::fs::write(&slurm.config, slurm.text(&host, ports)).map_err(|e| e.to_string())?;
        run(slurm.command("slurmctld").arg("-c"))?;
        run(slurm.command("slurmd").args(["-N", &host]))?;
        let end = Instant::now() + PATIENCE;
        loop {
            let nodes = slurm.command("sinfo").args(["-h", "-o", "%T"]).output();
            let nodes = nodes.map_err(|e| e.to_string())?;
            if String::from_utf8_lossy(&nodes.stdout).contains("idle") {
                return Ok(slurm);
            }
            if Instant::now() > end {
                let log = std::fs::read_to_string(at("slurmctld.log")).unwrap_or_default();
                let last = log.lines().last().unwrap_or("it says nothing").to_owned();
                return Err(format!("its node does not come up: {last}"));
            }
            std::thread::sleep(Duration::from_millis(100));
        }
    }

    fn text(&self, host: &str, [controller, node]: [u16; 2]) -> String {
        let at = |name: &str| self.folder.path().join(name).display().to_string();
        let user = "root";
        [
            "ClusterName=test".to_owned(),
            format!("SlurmctldHost={host}(127.0.0.1)"),
            format!("SlurmctldPort={controller}\nSlurmdPort={node}"),
            format!("AuthType=auth/munge\nAuthInfo=socket={}", at("munge.sock")),
            format!("SlurmUser={user}\nSlurmdUser={user}"),
            format!("StateSaveLocation={}\nSlurmdSpoolDir={}", at("state"), at("spool")),
            format!("SlurmctldPidFile={}\nSlurmdPidFile={}", at("slurmctld.pid"), at("slurmd.pid")),
            format!("SlurmctldLogFile={}\nSlurmdLogFile={}", at("slurmctld.log"), at("slurmd.log")),
            "ProctrackType=proctrack/linuxproc\nTaskPlugin=task/none".to_owned(),
            "SchedulerType=sched/builtin\nSelectType=select/cons_tres".to_owned(),
            "SelectTypeParameters=CR_Core\nJobAcctGatherType=jobacct_gather/none".to_owned(),
            "AccountingStorageType=accounting_storage/none\nReturnToService=2\nMpiDefault=none".to_owned(),
            // Failed tasks are retried at once.
            "SchedulerParameters=batch_sched_delay=0,sched_interval=1".to_owned(),
            format!("NodeName={host} NodeAddr=127.0.0.1 CPUs=2 RealMemory=1024 State=UNKNOWN"),
            format!("PartitionName=main Nodes={host} Default=YES MaxTime=INFINITE State=UP"),
        ]
        .join("\n")
            + "\n"
    }

    /// A command that talks to this Slurm.
    pub fn command(&self, program: &str) -> Command {
        let mut command = Command::new(program);
        command.env("SLURM_CONF", &self.config);
        command
    }

    /// Waits until the queue is empty.
    ///
    /// # Errors
    /// When jobs stay in the queue: its listing.
    pub fn wait_until_empty(&self) -> Result<(), String> {
        let end = Instant::now() + PATIENCE;
        loop {
            let queue = self.command("squeue").arg("-h").output();
            let queue = queue.map_err(|e| e.to_string())?;
            let jobs = String::from_utf8_lossy(&queue.stdout).into_owned();
            if queue.status.success() && jobs.trim().is_empty() {
                return Ok(());
            }
            if Instant::now() > end {
                return Err(jobs);
            }
            std::thread::sleep(Duration::from_millis(100));
        }
    }
}

impl Drop for Slurm {
    fn drop(&mut self) {
        for name in ["slurmd", "slurmctld", "munged"] {
            let pid = std::fs::read_to_string(self.folder.path().join(format!("{name}.pid")));
            let Ok(pid) = pid.unwrap_or_default().trim().parse::<u32>() else { continue };
            let _ = Command::new("kill").arg(pid.to_string()).status();
            let end = Instant::now() + PATIENCE;
            let process = PathBuf::from(format!("/proc/{pid}"));
            while process.exists() && Instant::now() < end {
                std::thread::sleep(Duration::from_millis(20));
            }
        }
    }
}

fn run(command: &mut Command) -> Result<(), String> {
    let name = command.get_program().to_string_lossy().into_owned();
    match command.output() {
        Ok(Output { status, .. }) if status.success() => Ok(()),
        Ok(Output { stderr, .. }) => Err(format!("{name}: {}", String::from_utf8_lossy(&stderr))),
        Err(e) => Err(format!("{name} does not start: {e}")),
    }
}

/// A port that was free a moment ago.
fn free_port() -> Result<u16, String> {
    let listener = TcpListener::bind("127.0.0.1:0").map_err(|e| e.to_string())?;
    listener.local_addr().map(|at| at.port()).map_err(|e| e.to_string())
}

/// MUNGE refuses a key that others can read.
fn private(path: &Path) -> Result<(), String> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let mode = std::fs::Permissions::from_mode(0o400);
        std::fs::set_permissions(path, mode).map_err(|e| e.to_string())?;
    }
    let _ = path;
    Ok(())
}
