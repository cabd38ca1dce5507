//! Edited, damaged and hostile checkpoints.

use super::*;
use crate::kernels::Precision;
use crate::unet::{Formulation, Normalization, Statistics};

fn info() -> CheckpointInfo {
    CheckpointInfo {
        step: 7,
        seconds: 1.0,
        scale: 1.0,
        training_frames: vec![0],
        network: UNetConfig {
            size: 16,
            lamps: 2,
            depth: Some(2),
            width: 8,
            most_channels: 8,
            normalization: Normalization::None,
            statistics: Statistics::default(),
            formulation: Formulation::Direct,
            precision: Precision::default(),
        },
        held_out: None,
    }
}

/// A small checkpoint in its own folder.
fn saved() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let network = info().network.init(0.5, &Device::flex());
    save_network(folder.path(), &network);
    folder
}

fn save_network(folder: &Path, network: &UNet) {
    let state = TrainingState {
        average_weights: None,
        live_weights: weight_bytes(network).unwrap(),
        optimizer: Bytes::from_bytes_vec(b"moments".to_vec()),
    };
    save(folder, &info(), network, &state).unwrap();
}

fn refused(folder: &Path) -> String {
    load_training(folder, &Device::flex()).err().expect("a refused checkpoint").to_string()
}

fn table_of(folder: &Path) -> String {
    std::fs::read_to_string(folder.join("checkpoint.toml")).unwrap()
}

fn change_table(folder: &Path, from: &str, to: &str) {
    let text = table_of(folder);
    assert!(text.contains(from), "{text}");
    std::fs::write(folder.join("checkpoint.toml"), text.replace(from, to)).unwrap();
}

#[test]
fn one_flipped_byte_in_any_file_is_noticed() {
    for name in ["weights", "live", "optimizer"] {
        let folder = saved();
        load_training(folder.path(), &Device::flex()).unwrap();
        let path = folder.path().join(format!("{name}-0000007.bpk"));
        let mut bytes = std::fs::read(&path).unwrap();
        let last = bytes.len() - 1;
        bytes[last] ^= 1;
        std::fs::write(&path, bytes).unwrap();
        let said = refused(folder.path());
        assert!(said.contains(name) && said.contains("damaged"), "{said}");
    }
    test_support::shown!(
        Strangers,
        "One byte of the weights, or of the optimiser's state, changes on the disk",
        done: "the table holds a checksum of each file",
    );
}

#[test]
fn older_names_of_precisions_are_read() {
    for (name, precision) in [("full", Precision::Full), ("split", Precision::Mixed), ("half", Precision::Mixed)] {
        let folder = saved();
        change_table(folder.path(), "\"auto\"", &format!("{name:?}"));
        let read = load_training(folder.path(), &Device::flex()).unwrap();
        assert_eq!(read.info.network.precision, precision);
        assert_eq!(<Precision as clap::ValueEnum>::from_str(name, false), Ok(precision));
    }
}

#[test]
fn weights_that_are_nan_are_refused_where_no_checksum_tells() {
    struct Broken;
    impl burn::module::ModuleMapper for Broken {
        fn map_float<const D: usize>(
            &mut self,
            param: burn::module::Param<burn::tensor::Tensor<D>>,
        ) -> burn::module::Param<burn::tensor::Tensor<D>> {
            param.map(|value| value * f32::NAN)
        }
    }
    let folder = saved();
    let network = load(folder.path(), &Device::flex()).unwrap().1;
    save_network(folder.path(), &network.map(&mut Broken));
    let said = load(folder.path(), &Device::flex()).unwrap_err().to_string();
    assert!(said.contains("NaN"), "{said}");
    test_support::shown!(
        Strangers,
        "Weights from elsewhere are NaN",
        done: "the network is refused; the message names the file",
    );
}

#[test]
fn a_table_names_only_files_beside_it() {
    for name in ["../weights.bpk", "/dev/zero", "a/b.bpk", ""] {
        let folder = saved();
        change_table(folder.path(), "weights-0000007.bpk", name);
        let said = refused(folder.path());
        assert!(said.contains("file in its folder"), "{said}");
        let to = folder.path().join("to");
        assert!(link(folder.path(), &to).is_err());
        assert!(!folder.path().join("weights.bpk").exists());
    }
    test_support::shown!(
        Strangers,
        "`checkpoint.toml` names files in other folders, such as `../../x` or `/dev/zero`",
        done: "a table may only name files in its own folder",
    );
}

#[test]
fn an_impossible_network_is_refused_before_memory_is_taken() {
    for lamps in ["0", "1000000000", "4611686018427387904"] {
        let folder = saved();
        change_table(folder.path(), "lamps = 2", &format!("lamps = {lamps}"));
        let said = refused(folder.path());
        assert!(said.contains(lamps), "{said}");
    }
    test_support::shown!(
        Strangers,
        "`checkpoint.toml` describes a network of a billion lamps",
        done: "the shape is checked before memory is allocated",
    );
}

#[test]
fn a_checkpoint_of_the_same_step_does_not_touch_the_one_before() {
    let folder = saved();
    let kept = tempfile::tempdir().unwrap();
    link(folder.path(), kept.path()).unwrap();
    let before = std::fs::read(kept.path().join("weights-0000007.bpk")).unwrap();
    let network = info().network.init(0.9, &Device::flex());
    save_network(folder.path(), &network);
    assert_eq!(std::fs::read(kept.path().join("weights-0000007.bpk")).unwrap(), before);
    assert!(table_of(folder.path()).contains("weights-0000007-2.bpk"));
    for folder in [folder.path(), kept.path()] {
        load_training(folder, &Device::flex()).unwrap();
    }
    // Going back gives the files free names, and their checksums move along.
    link(kept.path(), folder.path()).unwrap();
    load_training(folder.path(), &Device::flex()).unwrap();
    assert!(table_of(folder.path()).contains("[checksums]"));
}

#[test]
fn weights_of_another_shape_are_told_in_words() {
    let folder = saved();
    let other = UNetConfig { width: 16, most_channels: 16, ..info().network };
    let network = other.init(0.5, &Device::flex());
    let weights = folder.path().join("weights-0000007.bpk");
    std::fs::write(weights, &weight_bytes(&network).unwrap()[..]).unwrap();
    let text = table_of(folder.path());
    let (before, after) = text.split_once("[checksums]").unwrap();
    let rest = &after[after.find("[info").unwrap()..];
    std::fs::write(folder.path().join("checkpoint.toml"), format!("{before}{rest}")).unwrap();
    let said = refused(folder.path());
    assert!(said.contains("weights-0000007.bpk") && said.contains("another shape"), "{said}");
    let differs = info().network.differences(&other);
    assert_eq!(differs, "most_channels is 8, not 16; width is 8, not 16");
    let deeper = UNetConfig { depth: None, ..info().network };
    assert_eq!(info().network.differences(&deeper), "depth is 2, not the default");
    assert!(!said.contains(['{', '[']), "{said}");
    test_support::shown!(
        Network,
        "Weights of another network",
        done: "the message names the file; differing settings have their names in checkpoint.toml"
    );
}

#[test]
fn only_weights_that_training_wrote_are_removed() {
    let folder = saved();
    let at = |name: &str| folder.path().join(name);
    let (old, mine) = (
        ["weights.bpk", "live-0000003.bpk", "optimizer-0000007-2.bpk"],
        ["backup.bpk", "live-best.bpk", "weights-0000003-mine.bpk", "live-0000003.bpk.txt"],
    );
    for name in old.iter().chain(&mine) {
        std::fs::write(at(name), "").unwrap();
    }
    save_network(folder.path(), &info().network.init(0.5, &Device::flex()));
    assert!(old.iter().all(|name| !at(name).exists()));
    assert!(mine.iter().all(|name| at(name).exists()));
    test_support::shown!(
        Strangers,
        "The user's own files in `checkpoint/`",
        done: "training removes only files with its own naming scheme"
    );
}

#[test]
fn a_checkpoint_is_read_whole_while_another_program_replaces_it() {
    let folder = saved();
    let over = std::sync::atomic::AtomicBool::new(false);
    let is_over = || over.load(std::sync::atomic::Ordering::Relaxed);
    let (saves, reads) = std::thread::scope(|threads| {
        let saving = threads.spawn(|| {
            let network = info().network.init(0.5, &Device::flex());
            let mut saves = 0;
            while !is_over() {
                save_network(folder.path(), &network);
                saves += 1;
            }
            saves
        });
        let mut reads = 0;
        let failed = (0..300).find_map(|_| {
            reads += 1;
            let resumed = load_training(folder.path(), &Device::flex());
            resumed.and(load(folder.path(), &Device::flex())).err()
        });
        over.store(true, std::sync::atomic::Ordering::Relaxed);
        let saves: u32 = saving.join().unwrap();
        assert!(failed.is_none(), "{failed:?} at read {reads}");
        (saves, reads)
    });
    test_support::shown!(
        Accidents,
        "A network is read while training saves the next one",
        bound: "no read fails",
        measured: format!("{reads} reads beside {saves} saves")
    );
}

#[test]
fn a_packed_network_is_small_and_keeps_its_steps() {
    let (folder, to) = (saved(), tempfile::tempdir().unwrap());
    let packed = pack(folder.path(), to.path()).unwrap();
    let (read, network) = load(to.path(), &Device::flex()).unwrap();
    assert_eq!((packed.step, read.step, read.seconds), (7, 7, 1.0));
    assert!(!has_optimizer(to.path()).unwrap());
    let (_, whole) = load(folder.path(), &Device::flex()).unwrap();
    let bytes = std::fs::metadata(to.path().join(PACKED_WEIGHTS)).unwrap().len();
    let whole_bytes = weight_bytes(&whole).unwrap().len() as u64;
    assert!(bytes < whole_bytes * 7 / 10, "{bytes} of {whole_bytes}");
    let input = || burn::tensor::Tensor::<4>::full([1, 3, 16, 16], 0.3, &Device::flex());
    let [a, b] = [whole, network]
        .map(|network| network.forward(input()).into_data().convert::<f32>().try_to_vec::<f32>().unwrap());
    let apart = a.iter().zip(&b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(apart < 2e-3, "{apart}");
}
