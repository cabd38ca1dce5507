//! Tensors by name from `.safetensors` and `.pth` files.
//!
//! A `.pth` file is a pickle, which Python runs as a program. The reader used here interprets the calls
//! that rebuild tensors and containers and keeps all others as names: nothing in the file is run.

use base::error::{Error, Result};
use base::files;
use burn::module::{Module, Param};
use burn::store::pytorch_reader::PytorchReader;
use burn::store::{ModuleStore, SafetensorsStore, bridge, burn_pack};
use burn::tensor::{DType, Device, Tensor, TensorData};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Remedy for an unusable file, and its option.
const REMEDY: (&str, &str) = (
    "Give a complete .safetensors or .pth file of torchvision's VGG-16, VGG-19 or SqueezeNet 1.1, or leave it out",
    "--features FILE",
);

/// A file of named tensors, whose values are read on demand.
pub struct WeightFile {
    path: PathBuf,
    tensors: BTreeMap<String, burn_pack::Tensor>,
}

impl WeightFile {
    /// # Errors
    /// When the file has another format, cannot be read or is incomplete.
    pub fn open(path: &Path) -> Result<Self> {
        let refuse = |cause: &dyn std::fmt::Display| Error::codec("read", path, cause, REMEDY);
        // Each reader words a missing file differently; the system's message is uniform.
        files::open(path).map_err(|e| Error::io("open", path, e, REMEDY))?;
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("");
        let tensors = match extension.to_ascii_lowercase().as_str() {
            "safetensors" => SafetensorsStore::from_file(path).get_all_tensors().map_err(|e| refuse(&e))?.clone(),
            "pth" | "pt" => PytorchReader::new(path)
                .map_err(|e| refuse(&e))?
                .into_tensors()
                .into_iter()
                .map(|(name, tensor)| (name, bridge::from_pytorch(tensor)))
                .collect(),
            _ => {
                return Err(Error::invalid(
                    format!("{} ends in {extension:?}, not in .safetensors or .pth", path.display()),
                    REMEDY,
                ));
            }
        };
        Ok(Self { path: path.to_path_buf(), tensors })
    }

    /// True if there is a tensor of this name.
    pub fn has(&self, name: &str) -> bool {
        self.tensors.contains_key(name)
    }

    /// The parameter `name`, without a gradient.
    ///
    /// # Errors
    /// When it is missing, or has another shape, integers, or NaN or infinite values.
    pub fn parameter<const D: usize>(
        &self,
        name: &str,
        shape: [usize; D],
        device: &Device,
    ) -> Result<Param<Tensor<D>>> {
        let refuse = |found: String| self.invalid(format!("expected {name} of shape {shape:?}, found {found}"));
        let tensor = self.tensors.get(name).ok_or_else(|| refuse("no tensor of that name".to_owned()))?;
        if tensor.shape.as_slice() != shape {
            return Err(refuse(format!("shape {:?}", tensor.shape.as_slice())));
        }
        if !matches!(tensor.dtype, DType::F64 | DType::F32 | DType::F16 | DType::BF16) {
            return Err(refuse(format!("values of type {:?}", tensor.dtype)));
        }
        let values = tensor
            .to_bytes()
            .map_err(|e| e.to_string())
            .and_then(|bytes| TensorData::try_from_bytes(bytes, shape, tensor.dtype).map_err(|e| e.to_string()))
            .and_then(|data| data.try_into_vec_as::<f32>().map_err(|e| e.to_string()))
            .map_err(|e| Error::codec("read", &self.path, format!("{name}: {e}"), REMEDY))?;
        if !values.iter().all(|v| v.is_finite()) {
            return Err(refuse("NaN or infinite values".to_owned()));
        }
        let tensor = Tensor::from_data(TensorData::new(values, shape), device);
        Ok(Param::from_tensor(tensor).no_grad())
    }

    /// Error for a file with an unknown network.
    pub fn unknown(&self) -> Error {
        let mut names: Vec<&str> = self.tensors.keys().map(String::as_str).collect();
        let count = names.len();
        names.truncate(4);
        let found = match count {
            0 => "it holds no tensors".to_owned(),
            _ => format!("it holds {count} tensors, the first of them {}", names.join(", ")),
        };
        self.invalid(format!(
            "{found}, not those of VGG-16, VGG-19 or SqueezeNet 1.1 under torchvision's names, such as \
             features.0.weight"
        ))
    }

    fn invalid(&self, problem: String) -> Error {
        Error::invalid(format!("{}: {problem}", self.path.display()), REMEDY)
    }
}
