//! The trained network on disk: `checkpoint/checkpoint.toml` and the weight files that it names.
//!
//! Weight files carry their step in their name and are written before the table that names them. A killed
//! process therefore leaves a table whose files are complete. Files that the table does not name are
//! removed after it is written.
//!
//! The table is untrusted input: it may only name files in its own folder, and their bytes must match its
//! checksums. (Tables of older versions have none.)

use super::unet::{Halved, UNet, UNetConfig};
use base::error::{Error, Result};
use base::files::{self, write_beside};
use burn::module::Module;
use burn::store::{ModuleRecord, RecordError};
use burn::tensor::{Bytes, Device};
use project::save_toml;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::io::{Read, Write};
use std::path::Path;

const REMEDY: (&str, &str) = ("Train again", "afterlight train PROJECT --fresh");

/// Content of `checkpoint.toml`, except for the names of the weight files.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CheckpointInfo {
    /// Number of optimiser steps.
    pub step: u64,
    /// Seconds of training so far.
    pub seconds: f64,
    /// Value of an output of 1, in linear units (of the ratio, if the network learns ratios).
    pub scale: f32,
    /// Number of interview frames used by training.
    pub training_frames: Vec<usize>,
    /// The network's shape.
    pub network: UNetConfig,
    /// Score on the held-out pose of the network used for prediction.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub held_out: Option<HeldOut>,
}

/// Score of a network on a pose held out of training.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct HeldOut {
    /// Number of the pose, from 0.
    pub pose: usize,
    /// Step of the best score.
    pub step: u64,
    /// PSNR over the encoded OLATs within the matte, in dB.
    pub decibels: f32,
}

#[derive(PartialEq, Serialize, Deserialize)]
struct Table {
    weights: String,
    average_weights: Option<String>,
    live_weights: Option<String>,
    optimizer: Option<String>,
    /// CRC-32 of each file's bytes.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    checksums: BTreeMap<String, u32>,
    info: CheckpointInfo,
}

impl Table {
    /// Names of all files.
    fn names(&mut self) -> impl Iterator<Item = &mut String> {
        let more = [self.average_weights.as_mut(), self.live_weights.as_mut(), self.optimizer.as_mut()];
        std::iter::once(&mut self.weights).chain(more.into_iter().flatten())
    }
}

/// State of a training run as bytes.
pub struct TrainingState {
    /// Weights of the averaged network, if prediction uses another one.
    pub average_weights: Option<Bytes>,
    /// Weights of the network in training.
    pub live_weights: Bytes,
    /// Moments of the optimiser.
    pub optimizer: Bytes,
}

/// Name of the weight file in a packed checkpoint.
const PACKED_WEIGHTS: &str = "weights.bpk";

/// Writes a checkpoint: the network for prediction, and the state for continuing the training.
pub fn save(folder: &Path, info: &CheckpointInfo, network: &UNet, state: &TrainingState) -> Result<()> {
    let written = || {
        let mut checksums = BTreeMap::new();
        let mut write = |what: &str, bytes: &[u8]| {
            // The current checkpoint may have the same step.
            let name = unused(folder, &format!("{what}-{:07}", info.step));
            checksums.insert(name.clone(), crc32fast::hash(bytes));
            write_beside(&folder.join(&name), |out| out.write_all(bytes)).map(|()| name)
        };
        let weights = write("weights", &weight_bytes(network)?)?;
        let average_weights = (state.average_weights.as_ref()).map(|bytes| write("average", bytes)).transpose()?;
        let live_weights = Some(write("live", &state.live_weights)?);
        let optimizer = Some(write("optimizer", &state.optimizer)?);
        let table = Table { weights, average_weights, live_weights, optimizer, checksums, info: info.clone() };
        save_table(folder, table)
    };
    written().inspect_err(|_| {
        // The files written so far are useless without the rest.
        if let Ok(table) = table(folder) {
            remove_unnamed(folder, table);
        }
    })
}

/// Writes the project's network in `from` into `to` in small form: half floats, without optimiser state.
pub fn pack(from: &Path, to: &Path) -> Result<CheckpointInfo> {
    let (info, network) = load(from, &Device::flex())?;
    let small = weight_bytes(&network.map(&mut Halved))?;
    write_beside(&to.join(PACKED_WEIGHTS), |out| out.write_all(&small))?;
    let table = Table {
        weights: PACKED_WEIGHTS.to_owned(),
        average_weights: None,
        live_weights: None,
        optimizer: None,
        checksums: [(PACKED_WEIGHTS.to_owned(), crc32fast::hash(&small))].into(),
        info: info.clone(),
    };
    save_table(to, table)?;
    Ok(info)
}

/// A name for a weight file that is not used in the folder yet.
fn unused(folder: &Path, stem: &str) -> String {
    let numbered = (2..).map(|i| format!("{stem}-{i}.bpk"));
    let mut names = std::iter::once(format!("{stem}.bpk")).chain(numbered);
    // The sequence of names is infinite.
    (names.find(|name| !folder.join(name).exists())).unwrap_or_default()
}

/// Copies the checkpoint in `from` to the folder `to`. Weight files are never changed, so both may
/// share them on disk. If the process is killed, `to` holds the old checkpoint or this one.
///
/// # Errors
/// When `from` holds no readable checkpoint, or `to` cannot be written.
pub fn link(from: &Path, to: &Path) -> Result<()> {
    let mut table = table(from)?;
    let fail = |path: &Path, e: std::io::Error| {
        let remedy = "Check that the folder can be written and the disk has room";
        Error::io("write", path, e, remedy)
    };
    std::fs::create_dir_all(to).map_err(|e| fail(to, e))?;
    let mut renamed = BTreeMap::new();
    for name in table.names() {
        let source = from.join(&*name);
        // The current checkpoint may use the same names.
        let stem = name.strip_suffix(".bpk").unwrap_or(name);
        let free = unused(to, stem);
        renamed.insert(std::mem::replace(name, free.clone()), free);
        let target = to.join(&*name);
        std::fs::hard_link(&source, &target)
            .or_else(|_| {
                std::fs::copy(&source, &target)?;
                std::fs::File::open(&target)?.sync_all()
            })
            .map_err(|e| fail(&target, e))?;
    }
    table.checksums = (std::mem::take(&mut table.checksums).into_iter())
        .filter_map(|(name, sum)| Some((renamed.remove(&name)?, sum)))
        .collect();
    save_table(to, table)
}

/// True if the checkpoint in `folder` has an optimiser state, from which training continues exactly. A packed
/// checkpoint has none.
pub fn has_optimizer(folder: &Path) -> Result<bool> {
    Ok(table(folder)?.optimizer.is_some())
}

/// Makes `table` the folder's checkpoint and removes weights that it does not name.
fn save_table(folder: &Path, table: Table) -> Result<()> {
    save_toml(&folder.join("checkpoint.toml"), &table)?;
    remove_unnamed(folder, table);
    Ok(())
}

/// Removes weights that the folder's table does not name.
fn remove_unnamed(folder: &Path, mut table: Table) {
    let named: Vec<&mut String> = table.names().collect();
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let file = entry.file_name().to_string_lossy().into_owned();
        if is_ours(&file) && named.iter().all(|name| **name != file) {
            // A leftover that cannot be removed only costs space.
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

/// True for this program's names of weight files, such as `live-0001200-2.bpk`. All other files in the folder belong to
/// the user.
fn is_ours(name: &str) -> bool {
    let Some(stem) = name.strip_suffix(".bpk") else { return false };
    let digits = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    match stem.split('-').collect::<Vec<_>>()[..] {
        [_] => name == PACKED_WEIGHTS,
        [what, step, ref more @ ..] => {
            ["weights", "average", "live", "optimizer"].contains(&what)
                && digits(step)
                && more.iter().all(|number| digits(number))
        }
        [] => false,
    }
}

/// Weights of a network as one burnpack.
pub fn weight_bytes(network: &UNet) -> Result<Bytes> {
    network
        .clone()
        .into_record()
        .into_bytes()
        .map_err(|e| Error::bug(format!("cannot pack the network's weights: {e}")))
}

/// Reads the table of the checkpoint in `folder`, without the weights.
///
/// # Errors
/// When there is no checkpoint, or it is damaged.
pub fn info(folder: &Path) -> Result<CheckpointInfo> {
    Ok(table(folder)?.info)
}

/// Loads the network of the checkpoint in `folder` for prediction.
pub fn load(folder: &Path, device: &Device) -> Result<(CheckpointInfo, UNet)> {
    read_whole(folder, |table| {
        let network = table.network(folder, &table.weights, device)?;
        Ok((table.info.clone(), network))
    })
}

/// State for continuing a training.
pub struct Resumed {
    pub info: CheckpointInfo,
    /// Network for prediction, on the plain device.
    pub best: UNet,
    /// Averaged network, on the plain device.
    pub average: UNet,
    /// Network in training, on the autodiff device.
    pub live: UNet,
    /// Moments of the optimiser; None in a packed checkpoint.
    pub optimizer: Option<Bytes>,
}

/// Loads the state for continuing a training from the checkpoint in `folder`.
pub fn load_training(folder: &Path, device: &Device) -> Result<Resumed> {
    read_whole(folder, |table| {
        let live = table.live_weights.as_ref().unwrap_or(&table.weights);
        let average = table.average_weights.as_ref().unwrap_or(&table.weights);
        Ok(Resumed {
            best: table.network(folder, &table.weights, device)?,
            average: table.network(folder, average, device)?,
            live: table.network(folder, live, &device.clone().autodiff())?,
            optimizer: (table.optimizer.as_ref()).map(|name| table.read(folder, name)).transpose()?,
            info: table.info.clone(),
        })
    })
}

/// Result of `read` for the folder's table and its files. A training in another process may replace both meanwhile; the
/// new ones are then read.
fn read_whole<T>(folder: &Path, read: impl Fn(&Table) -> Result<T>) -> Result<T> {
    let mut found = table(folder)?;
    loop {
        let failed = match read(&found) {
            Err(e) => e,
            read => return read,
        };
        let now = table(folder)?;
        if now == found {
            return Err(failed);
        }
        found = now;
    }
}

fn table(folder: &Path) -> Result<Table> {
    let path = folder.join("checkpoint.toml");
    let text = files::read_text(&path, files::MOST_TEXT)
        .map_err(|e| Error::io("open", &path, e, ("Train first", "afterlight train PROJECT")))?;
    let mut table: Table = toml::from_str(&text).map_err(|e| Error::codec("read", &path, e.message(), REMEDY))?;
    if let Some(name) = table.names().find(|name| !files::is_bare(name)) {
        let problem = format!("{name:?} is not the name of a file in its folder");
        return Err(Error::codec("read", &path, problem, REMEDY));
    }
    let info = &table.info;
    (info.network.check()).map_err(|e| e.within(&path))?;
    let is_time = info.seconds >= 0.0 && info.seconds.is_finite();
    let is_scale = info.scale > 0.0 && info.scale.is_finite();
    if !(is_time && is_scale) {
        let problem = format!(
            "`seconds` is {} and `scale` is {}; both must be finite, and `scale` above 0",
            info.seconds, info.scale
        );
        return Err(Error::codec("read", &path, problem, REMEDY));
    }
    Ok(table)
}

impl Table {
    /// Bytes of one of the table's files.
    fn read(&self, folder: &Path, name: &str) -> Result<Bytes> {
        let path = folder.join(name);
        let mut bytes = Vec::new();
        files::open(&path)
            .and_then(|mut file| file.read_to_end(&mut bytes))
            .map_err(|e| Error::io("open", &path, e, REMEDY))?;
        match self.checksums.get(name) {
            Some(sum) if *sum != crc32fast::hash(&bytes) => Err(Error::codec(
                "read",
                &path,
                "checksum mismatch with checkpoint.toml: damaged, or edited by hand",
                REMEDY,
            )),
            _ => Ok(Bytes::from_bytes_vec(bytes)),
        }
    }

    fn network(&self, folder: &Path, name: &str, device: &Device) -> Result<UNet> {
        let bytes = self.read(folder, name)?;
        let refuse = |problem| Error::codec("read", folder.join(name), problem, REMEDY);
        self.info.network_of(bytes, device).map_err(refuse)
    }
}

impl CheckpointInfo {
    /// The network with these weights, or the fault of the weights.
    fn network_of(&self, bytes: Bytes, device: &Device) -> std::result::Result<UNet, String> {
        // Checked before memory is allocated for the network: half floats are the smallest stored format.
        let weights = self.network.cost().parameters;
        if (bytes.len() as u64) < 2 * weights {
            return Err(format!(
                "checkpoint.toml describes a network of {weights} weights, but this file has only {} bytes",
                bytes.len()
            ));
        }
        let record = ModuleRecord::from_bytes(bytes).map_err(|e| e.to_string())?;
        let record = record.cast_to_module_dtype();
        let network = (self.network.init(0.5, device)).try_load_record(record).map_err(|e| match e {
            RecordError::Validation(_) => "it holds a network of another shape than in checkpoint.toml".to_owned(),
            RecordError::Io(problem) => problem,
        })?;
        if !network.is_finite() {
            return Err("it holds weights that are NaN or infinite".to_owned());
        }
        Ok(network)
    }
}

#[cfg(test)]
#[path = "checkpoint_tests.rs"]
mod tests;
