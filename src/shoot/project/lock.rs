//! The lock that lets only one program at a time write into a project.

use base::error::{Error, Result};
use base::files;
use std::fs::{File, TryLockError};
use std::io::{Read, Write};
use std::path::Path;
use std::time::{Duration, Instant};

/// Maximum time for a change of `project.toml`: it takes milliseconds, or a second on a slow network drive.
const CHANGE: Duration = Duration::from_secs(10);

/// The right to write into a project, until it is dropped. The system releases it when the process ends, even
/// after a crash.
#[derive(Debug)]
pub struct Lock {
    file: File,
}

impl Lock {
    /// Locks the project in folder `root` for `whom`, a phrase such as "the studio" for others' messages. On a
    /// file system without locks no program is kept out.
    ///
    /// # Errors
    /// When another program, or this one, holds the lock already, or the folder cannot be written.
    pub fn take(root: &Path, whom: &str) -> Result<Self> {
        let path = root.join(".lock");
        let mut options = File::options();
        options.read(true).write(true).create(true).truncate(false);
        let mut file = files::open_own(&path, &options)
            .map_err(|e| Error::io("write", &path, e, "Check that the project's folder can be written"))?;
        if let Err(TryLockError::WouldBlock) = file.try_lock() {
            return Err(Error::busy(
                format!("{} is in use by {}", root.display(), holder(&mut file)),
                "Close the project there, or wait until that job is done",
            ));
        }
        let host = host_name().map_or(String::new(), |host| format!(" on {host}"));
        let line = format!("{whom}, process {}{host}\n", std::process::id());
        // The name is only for messages; the lock holds without it.
        let _ = file.set_len(0).and_then(|()| file.write_all(line.as_bytes()));
        // No other program writes here now.
        files::remove_left_over(root);
        files::remove_left_over(&root.join("checkpoint"));
        Ok(Self { file })
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // A failure is harmless: the name is read only while the lock is held.
        let _ = self.file.set_len(0);
    }
}

/// Locks a project's `folder`, which is `root`, for a change. On a file system without folder locks no program is
/// kept out.
///
/// # Errors
/// [`Error::Busy`] if another process holds it for longer than a change can take.
pub(super) fn wait_for(folder: &File, root: &Path) -> Result<()> {
    let until = Instant::now() + CHANGE;
    while let Err(TryLockError::WouldBlock) = folder.try_lock() {
        if Instant::now() >= until {
            return Err(Error::busy(
                format!("{} has been in use for {CHANGE:?}", root.join("project.toml").display()),
                "Another program is changing it and hangs: close that program",
            ));
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    Ok(())
}

/// Holder of the lock, if it can be read: some systems lock the file's contents too.
fn holder(file: &mut File) -> String {
    let mut text = String::new();
    let read = file.take(400).read_to_string(&mut text);
    match text.trim() {
        "" => "another program".to_owned(),
        _ if read.is_err() => "another program".to_owned(),
        line => line.to_owned(),
    }
}

/// The name of this machine.
pub fn host_name() -> Option<String> {
    let kernel = std::fs::read_to_string("/proc/sys/kernel/hostname").ok();
    let name = kernel.or_else(|| ["HOSTNAME", "COMPUTERNAME"].iter().find_map(|name| std::env::var(name).ok()))?;
    let name = name.trim();
    (!name.is_empty()).then(|| name.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_holds_it_the_next_is_told_who_and_a_dead_one_does_not_block() {
        let folder = tempfile::tempdir().unwrap();
        let lock = Lock::take(folder.path(), "the studio").unwrap();
        let refused = Lock::take(folder.path(), "training").unwrap_err().to_string();
        let process = format!("the studio, process {}", std::process::id());
        assert!(refused.contains(&process), "{refused}");
        drop(lock);
        // As left behind by a killed process.
        std::fs::write(folder.path().join(".lock"), "training, process 1 on nowhere\n").unwrap();
        Lock::take(folder.path(), "the studio").unwrap();
        // The target of a link is not ours.
        #[cfg(unix)]
        {
            let linked = folder.path().join("linked");
            std::fs::create_dir(&linked).unwrap();
            let (diary, lock) = (folder.path().join("diary"), linked.join(".lock"));
            std::fs::write(&diary, "dear diary").unwrap();
            std::os::unix::fs::symlink(&diary, lock).unwrap();
            let refused = Lock::take(&linked, "the studio").unwrap_err().to_string();
            assert!(refused.contains(".lock") && refused.contains("a link"), "{refused}");
            assert_eq!(std::fs::read_to_string(&diary).unwrap(), "dear diary");
        }
        let gone = folder.path().join("gone");
        let refused = Lock::take(&gone, "the studio").unwrap_err().to_string();
        assert!(refused.contains("gone"), "{refused}");
        test_support::shown!(
            Strangers,
            "`.lock` is a link",
            done: "a link is refused",
        );
        test_support::shown!(
            Accidents,
            "A program was killed while it held a project's lock",
            done: "the system releases the lock",
        );
    }
}
