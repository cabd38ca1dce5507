//! Copy of the environment's values at the time of the job: a panorama file may be edited later, and a light made in the
//! studio has no file.

use base::error::{Error, Result};
use base::files::write_beside;
use imaging::Image;
use light::Environment;
use serde::{Deserialize, Serialize};
use std::io::{Read, Write};
use std::path::Path;

/// Name and size of an environment, which its file of values lacks.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct KeptEnvironment {
    pub name: String,
    pub width: usize,
    pub height: usize,
}

/// Most pixels of a panorama: 64 K by 32 K.
const MOST: usize = 1 << 31;

impl KeptEnvironment {
    /// Writes the values of `environment` to `path`: rows of RGB as little-endian f32.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn write(environment: &Environment, path: &Path) -> Result<Self> {
        let radiance = &environment.radiance;
        write_beside(path, |out| {
            let mut values = radiance.pixels.iter().flatten();
            values.try_for_each(|value| out.write_all(&value.to_le_bytes()))
        })?;
        Ok(Self { name: environment.name.clone(), width: radiance.width, height: radiance.height })
    }

    /// Reads the values back.
    ///
    /// # Errors
    /// When the file cannot be read, or its length is wrong.
    pub fn read(&self, path: &Path) -> Result<Environment> {
        const REMEDY: &str = "Write the job again";
        let pixels = self.width.checked_mul(self.height).filter(|n| *n <= MOST);
        let length = pixels.map(|pixels| pixels as u64 * 12);
        let mut file = base::files::open(path).map_err(|e| Error::io("open", path, e, REMEDY))?;
        let found = file.metadata().map(|data| data.len()).ok();
        if length.is_none() || length != found {
            let problem = "its length differs from the environment in job.json";
            return Err(Error::codec("read", path, problem, REMEDY));
        }
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(|e| Error::io("read", path, e, REMEDY))?;
        let value = |b: &[u8]| b.try_into().map_or(0.0, f32::from_le_bytes);
        let pixels = bytes.chunks_exact(12).map(|rgb| {
            let (r, gb) = rgb.split_at(4);
            let (g, b) = gb.split_at(4);
            [value(r), value(g), value(b)]
        });
        let radiance = Image { width: self.width, height: self.height, pixels: pixels.collect() };
        Ok(Environment::from_radiance(&*self.name, radiance))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_comes_back_as_it_was() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("environment.f32");
        let nave = light::built_in::named("nave").unwrap().environment();
        let kept = KeptEnvironment::write(&nave, &path).unwrap();
        let read = kept.read(&path).unwrap();
        assert_eq!(read.name, nave.name);
        assert_eq!(read.radiance.pixels, nave.radiance.pixels);
        let whole = std::fs::read(&path).unwrap();
        std::fs::write(&path, &whole[1..]).unwrap();
        assert!(kept.read(&path).unwrap_err().to_string().contains("length"));
    }
}
