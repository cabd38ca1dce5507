//! The trained network on disk: `checkpoint/checkpoint.toml` and the weight files that it names.
//!
//! Weight files carry their step in their name and are written before the table that names them, so
//! a kill at any moment leaves a table whose files are whole. Files that no table names are removed
//! after the next one is in place.

use super::unet::{UNet, UNetConfig};
use crate::error::{Error, Result};
use crate::imaging::file::write_beside;
use crate::project::save_toml;
use burn::module::Module;
use burn::store::ModuleRecord;
use burn::tensor::{Bytes, Device};
use serde::{Deserialize, Serialize};
use std::io::Write;
use std::path::Path;

const REMEDY: &str = "Train again: afterlight train PROJECT --fresh";

/// What `checkpoint.toml` holds besides the names of the weight files.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CheckpointInfo {
    /// Optimiser steps made.
    pub step: u64,
    /// Seconds of training so far.
    pub seconds: f64,
    /// The exposure of the set: the sigmoid's 1 in linear units (of the ratio, where that is learnt).
    pub scale: f32,
    /// Interview frames that training has used.
    pub training_frames: Vec<usize>,
    /// The network's shape.
    pub network: UNetConfig,
}

#[derive(Serialize, Deserialize)]
struct Table {
    weights: String,
    live_weights: String,
    optimizer: String,
    info: CheckpointInfo,
}

/// The state of a training run as bytes.
pub struct TrainingState {
    /// Weights of the network that learns.
    pub live_weights: Bytes,
    /// Moments of the optimiser.
    pub optimizer: Bytes,
}

/// Writes a checkpoint: the averaged network that predicts, and what training needs to go on.
pub fn save(folder: &Path, info: &CheckpointInfo, network: &UNet, state: &TrainingState) -> Result<()> {
    let name = |what: &str| format!("{what}-{:07}.bpk", info.step);
    let table = Table {
        weights: name("weights"),
        live_weights: name("live"),
        optimizer: name("optimizer"),
        info: info.clone(),
    };
    let write = |name: &str, bytes: &[u8]| write_beside(&folder.join(name), |out| out.write_all(bytes));
    write(&table.weights, &weight_bytes(network)?)?;
    write(&table.live_weights, &state.live_weights)?;
    write(&table.optimizer, &state.optimizer)?;
    save_toml(&folder.join("checkpoint.toml"), &table)?;
    let named = [&table.weights, &table.live_weights, &table.optimizer];
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let file = entry.file_name().to_string_lossy().into_owned();
        if file.ends_with(".bpk") && !named.contains(&&file) {
            // A leftover that cannot be removed costs space and nothing else.
            let _ = std::fs::remove_file(entry.path());
        }
    }
    Ok(())
}

/// A network's weights as one burnpack.
pub fn weight_bytes(network: &UNet) -> Result<Bytes> {
    network
        .clone()
        .into_record()
        .into_bytes()
        .map_err(|e| Error::unexpected("the network's weights", "weights that can be packed", e.to_string(), REMEDY))
}

/// What the checkpoint in `folder` is, without its weights.
///
/// # Errors
/// When there is none, or it is not understood.
pub fn info(folder: &Path) -> Result<CheckpointInfo> {
    Ok(table(folder)?.info)
}

/// The network of the checkpoint in `folder`, for use.
pub fn load(folder: &Path, device: &Device) -> Result<(CheckpointInfo, UNet)> {
    let Table { weights, info, .. } = table(folder)?;
    let network = network_from_file(&folder.join(weights), &info.network, device)?;
    Ok((info, network))
}

/// Everything that training needs to go on.
/// The average is on `device`, the live network on `autodiff`.
pub fn load_training(
    folder: &Path,
    device: &Device,
    autodiff: &Device,
) -> Result<(CheckpointInfo, UNet, UNet, Bytes)> {
    let Table { weights, live_weights, optimizer, info } = table(folder)?;
    let average = network_from_file(&folder.join(weights), &info.network, device)?;
    let live = network_from_file(&folder.join(live_weights), &info.network, autodiff)?;
    Ok((info, average, live, read(&folder.join(optimizer))?))
}

fn table(folder: &Path) -> Result<Table> {
    let path = folder.join("checkpoint.toml");
    let text = std::fs::read_to_string(&path)
        .map_err(|e| Error::file("open", &path, e, "Train first: afterlight train PROJECT"))?;
    toml::from_str(&text).map_err(|e| Error::file("read", &path, e.message(), REMEDY))
}

fn read(path: &Path) -> Result<Bytes> {
    let bytes = std::fs::read(path).map_err(|e| Error::file("open", path, e, REMEDY))?;
    Ok(Bytes::from_bytes_vec(bytes))
}

fn network_from_file(path: &Path, config: &UNetConfig, device: &Device) -> Result<UNet> {
    config.check()?;
    let refuse = |e: &dyn std::fmt::Display| Error::file("read", path, e, REMEDY);
    let record = ModuleRecord::from_bytes(read(path)?).map_err(|e| refuse(&e))?;
    let record = record.cast_to_module_dtype();
    config.init(0.5, device).try_load_record(record).map_err(|e| refuse(&e))
}
