//! `tools/setup.sh` on simulated systems: stand-ins for the programs that it calls.
#![cfg(target_os = "linux")]

use std::fs::{self, Permissions};
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::Path;
use std::process::Command;

const LIBRARIES: [&str; 6] = [
    "libvulkan.so.1",
    "libxkbcommon.so.0",
    "libxkbcommon-x11.so.0",
    "libX11-xcb.so.1",
    "libXcursor.so.1",
    "libXi.so.6",
];

/// A system: a folder with the only programs that the script finds, its libraries and its drivers.
struct System(tempfile::TempDir);

/// Result of the script.
struct Run {
    code: Option<i32>,
    said: String,
    /// Arguments of each apt-get call.
    apt: Vec<String>,
}

impl System {
    /// A complete system for an ordinary user without sudo, with apt-get.
    fn whole() -> Self {
        let system = Self(tempfile::tempdir().unwrap());
        for name in ["bin", "drivers"] {
            fs::create_dir(system.at(name)).unwrap();
        }
        for name in ["cat", "chmod", "env", "sed", "touch", "true"] {
            let real = ["/usr/bin", "/bin"].map(|folder| Path::new(folder).join(name));
            let real = real.into_iter().find(|path| path.exists()).unwrap();
            symlink(real, system.at("bin").join(name)).unwrap();
        }
        let table: String = LIBRARIES.iter().map(|name| format!("\t{name} (libc6,x86-64) => /lib/{name}\n")).collect();
        fs::write(system.at("libraries"), table).unwrap();
        fs::write(system.at("drivers/card.json"), "{}").unwrap();
        system.program("uname", "echo Linux");
        system.program("id", "echo 1000");
        system.program("ldconfig", "cat \"$SYSTEM/libraries\"");
        system.program("sleep", "echo \"sleep $*\" >> \"$SYSTEM/slept\"");
        system.program("apt-get", "echo \"$*\" >> \"$SYSTEM/apt\"");
        system.program("ffmpeg", "");
        system.program("cc", "");
        system
    }

    fn at(&self, name: &str) -> std::path::PathBuf {
        self.0.path().join(name)
    }

    fn program(&self, name: &str, script: &str) {
        let path = self.at("bin").join(name);
        fs::write(&path, format!("#!/bin/sh\n{script}\n")).unwrap();
        fs::set_permissions(&path, Permissions::from_mode(0o755)).unwrap();
    }

    fn without(&self, name: &str) {
        fs::remove_file(self.at(name)).unwrap();
    }

    /// An apt-get that also runs `script` on each call.
    fn apt_get(&self, script: &str) {
        self.program("apt-get", &format!("echo \"$*\" >> \"$SYSTEM/apt\"\n{script}"));
    }

    fn run(&self) -> Run {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tools/setup.sh");
        // The script's path holds no folder of this system except those that it adds itself.
        let output = Command::new("/bin/sh")
            .arg(script)
            .env_clear()
            .env("PATH", self.at("bin"))
            .env("SYSTEM", self.0.path())
            .env("VULKAN_DRIVERS", "drivers more")
            .current_dir(self.0.path())
            .output()
            .unwrap();
        let apt = fs::read_to_string(self.at("apt")).unwrap_or_default();
        Run {
            code: output.status.code(),
            said: String::from_utf8(output.stderr).unwrap(),
            apt: apt.lines().map(str::to_owned).collect(),
        }
    }
}

/// Effect of an apt-get that installs ffmpeg and a driver.
const INSTALLS: &str = "case $* in
*install*) touch \"$SYSTEM/bin/ffmpeg\" \"$SYSTEM/drivers/software.json\"
    chmod +x \"$SYSTEM/bin/ffmpeg\" ;;
esac";

#[test]
fn where_nothing_is_missing_nothing_is_said_or_run() {
    let system = System::whole();
    let run = system.run();
    assert_eq!((run.code, run.said.as_str(), run.apt.len()), (Some(0), "", 0));
}

#[test]
fn a_driver_in_any_of_the_folders_suffices() {
    let system = System::whole();
    system.without("drivers/card.json");
    fs::create_dir(system.at("more")).unwrap();
    fs::write(system.at("more/card.json"), "{}").unwrap();
    let run = system.run();
    assert_eq!((run.code, run.said.as_str(), run.apt.len()), (Some(0), "", 0));
}

#[test]
fn without_root_the_one_line_to_run_is_printed() {
    let system = System::whole();
    system.without("drivers/card.json");
    system.without("bin/ffmpeg");
    system.without("bin/cc");
    let run = system.run();
    assert_eq!((run.code, run.apt.len()), (Some(1), 0), "{}", run.said);
    let line = "  sudo apt-get update && sudo apt-get install -y --no-install-recommends \
                mesa-vulkan-drivers ffmpeg gcc libc6-dev\n";
    assert!(run.said.ends_with(line), "{}", run.said);
    for reason in ["ffmpeg: reads and writes movies", "gcc: links the program"] {
        assert!(run.said.contains(reason), "{}", run.said);
    }
}

#[test]
fn each_missing_library_is_named() {
    let packages = ["libvulkan1", "libxkbcommon0", "libxkbcommon-x11-0", "libx11-xcb1", "libxcursor1", "libxi6"];
    for (library, package) in LIBRARIES.iter().zip(packages) {
        let system = System::whole();
        let table = fs::read_to_string(system.at("libraries")).unwrap();
        let rest: Vec<&str> = (table.lines()).filter(|line| !line.contains(&format!("\t{library} "))).collect();
        fs::write(system.at("libraries"), rest.join("\n")).unwrap();
        let run = system.run();
        assert_eq!(run.code, Some(1));
        assert!(run.said.contains(&format!("  {package}: ")), "{}", run.said);
        let line = run.said.lines().last().unwrap();
        assert!(line.ends_with(&format!("recommends {package}")), "{line}");
    }
}

#[test]
fn root_installs_what_is_missing_and_says_what_and_why() {
    let system = System::whole();
    system.without("bin/ffmpeg");
    system.without("drivers/card.json");
    system.program("id", "echo 0");
    system.apt_get(INSTALLS);
    let run = system.run();
    assert_eq!(run.code, Some(0), "{}", run.said);
    let wait = "-o DPkg::Lock::Timeout=10";
    assert_eq!(
        run.apt,
        [format!("{wait} update"), format!("{wait} install -y --no-install-recommends mesa-vulkan-drivers ffmpeg")]
    );
    assert!(run.said.contains("ffmpeg: reads and writes movies"), "{}", run.said);
    assert!(run.said.contains("Installing them: mesa-vulkan-drivers ffmpeg"), "{}", run.said);
    // A second run does nothing.
    assert_eq!(system.run().apt.len(), 2);
}

#[test]
fn sudo_installs_where_it_asks_for_no_password() {
    let system = System::whole();
    system.without("bin/ffmpeg");
    system.program("sudo", "[ \"$1\" = -n ] || exit 1\nshift\nexec \"$@\"");
    system.apt_get(INSTALLS);
    let run = system.run();
    assert_eq!((run.code, run.apt.len()), (Some(0), 2), "{}", run.said);
}

#[test]
fn sudo_with_a_password_is_not_waited_for() {
    let system = System::whole();
    system.without("bin/ffmpeg");
    system.program("sudo", "echo 'sudo: a password is required' >&2\nexit 1");
    let run = system.run();
    assert_eq!((run.code, run.apt.len()), (Some(1), 0));
    assert!(!run.said.contains("password"), "{}", run.said);
    assert!(run.said.ends_with("--no-install-recommends ffmpeg\n"), "{}", run.said);
}

#[test]
fn another_program_that_installs_packages_is_waited_for() {
    let system = System::whole();
    system.without("bin/ffmpeg");
    system.program("id", "echo 0");
    // Both commands meet a lock once.
    system.apt_get(&format!(
        "case $* in *update) lock=lists/lock ;; *) lock=archives/lock ;; esac
         if [ ! -e \"$SYSTEM/$(echo $lock | sed s:/:-:)\" ]; then
             touch \"$SYSTEM/$(echo $lock | sed s:/:-:)\"
             echo \"E: Could not get lock /var/$lock. It is held by process 7 (apt-get)\" >&2
             exit 100
         fi
         {INSTALLS}"
    ));
    let run = system.run();
    assert_eq!((run.code, run.apt.len()), (Some(0), 4), "{}", run.said);
    assert!(run.said.contains("Waiting until another program"), "{}", run.said);
    let slept = fs::read_to_string(system.at("slept")).unwrap();
    assert_eq!(slept.lines().count(), 2);
}

#[test]
fn a_lock_that_is_never_released_ends_with_who_holds_it() {
    let system = System::whole();
    system.without("bin/ffmpeg");
    system.program("id", "echo 0");
    system.apt_get("echo 'E: Could not get lock /x. It is held by process 7 (apt-get)' >&2\nexit 100");
    let run = system.run();
    assert_eq!(run.code, Some(1));
    assert!(run.said.contains("held by process 7"), "{}", run.said);
    assert!(run.said.ends_with("--no-install-recommends ffmpeg\n"), "{}", run.said);
}

#[test]
fn what_apt_says_of_a_failure_is_shown() {
    let system = System::whole();
    system.without("bin/ffmpeg");
    system.program("id", "echo 0");
    system.apt_get("echo 'E: Unable to fetch some archives' >&2\nexit 100");
    let run = system.run();
    assert_eq!((run.code, run.apt.len()), (Some(1), 2), "{}", run.said);
    assert!(run.said.contains("Unable to fetch some archives"), "{}", run.said);
    assert!(run.said.contains("could not be updated"), "{}", run.said);
}

#[test]
fn an_installation_that_mends_nothing_is_a_failure() {
    let system = System::whole();
    system.without("bin/ffmpeg");
    system.program("id", "echo 0");
    let run = system.run();
    assert_eq!(run.code, Some(1));
    assert!(run.said.contains("this is still not found:\n  ffmpeg"), "{}", run.said);
}

#[test]
fn other_distributions_get_their_own_names() {
    for (installer, line) in [
        ("dnf", "sudo dnf install -y mesa-vulkan-drivers ffmpeg-free gcc"),
        ("pacman", "sudo pacman -S --needed vulkan-swrast ffmpeg gcc"),
        ("zypper", "sudo zypper install -y libvulkan_lvp ffmpeg gcc"),
    ] {
        let system = System::whole();
        for name in ["drivers/card.json", "bin/ffmpeg", "bin/cc", "bin/apt-get"] {
            system.without(name);
        }
        system.program(installer, "exit 1");
        let run = system.run();
        assert_eq!(run.code, Some(1));
        assert!(run.said.ends_with(&format!("\n  {line}\n")), "{}", run.said);
    }
}
