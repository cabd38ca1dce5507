//! Picture files as other programs write them: the same light at every entrance.

mod layers;
mod scene_linear;

use afterlight::imaging::color::{linear_from_srgb, srgb_from_linear};
use afterlight::imaging::{file, picture};
use afterlight::light::panorama;
use afterlight::movies;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use test_support::{python, repository};

/// Columns, rows and linear Rec. 709 of each pixel.
type Light = ((usize, usize), Vec<[f32; 3]>);

/// A file and the light that it holds, or words of its refusal.
struct Case {
    path: PathBuf,
    right: Result<Light, String>,
    tolerance: f32,
    /// Layer to choose.
    layer: Option<String>,
    /// Description by the reader; None if it is not compared.
    said: Option<String>,
    /// True if the tolerance is a share of the light.
    is_share: bool,
}

impl Case {
    fn new(folder: &Path, case: &Value) -> Self {
        let number = |value: &Value| value.as_f64().unwrap() as f32;
        let right = match case["refused"].as_str() {
            Some(words) => Err(words.to_owned()),
            None => {
                let size = [0, 1].map(|i| case["size"][i].as_u64().unwrap() as usize);
                let light = case["light"].as_array().unwrap().iter();
                let light = light.map(|pixel| [0, 1, 2].map(|c| number(&pixel[c])));
                Ok((size.into(), light.collect()))
            }
        };
        Self {
            path: folder.join(case["file"].as_str().unwrap()),
            right,
            tolerance: case["tolerance"].as_f64().unwrap_or_default() as f32,
            layer: case["layer"].as_str().map(str::to_owned),
            said: case["said"].as_str().map(str::to_owned),
            is_share: case["share"].as_bool().unwrap_or_default(),
        }
    }

    /// Faults of light that an entrance gives.
    fn compare(&self, entrance: &str, found: &[[f32; 3]], right: &[[f32; 3]]) -> Option<String> {
        let mut pairs = found.iter().flatten().zip(right.iter().flatten());
        let far = |(found, right): &(&f32, &f32)| {
            let limit = self.tolerance * if self.is_share { right.abs().max(0.01) } else { 1.0 };
            (**found - **right).is_nan() || (**found - **right).abs() > limit
        };
        let (found, right) = pairs.find(far)?;
        Some(format!("{} by {entrance}: {found} is not {right}", self.path.display()))
    }

    fn faults(&self) -> Vec<String> {
        let path = &self.path;
        let name = path.display();
        picture::choose_layer(path, self.layer.as_deref());
        let (size, light) = match &self.right {
            Ok(right) => right,
            Err(words) => {
                let said = picture::read(path).err().map(|e| e.to_string()).unwrap_or_default();
                let is_named = said.contains(words.as_str()) && said.contains(&*name.to_string());
                return (!is_named).then(|| format!("{name}: \"{said}\"")).into_iter().collect();
            }
        };
        let mut faults = Vec::new();
        let mut check = |fault: Option<String>| faults.extend(fault);
        let other_size = |found| (found != *size).then(|| format!("{name}: {found:?}, not {size:?}"));
        let about = picture::about(path).unwrap();
        check(other_size(about.size));
        let said = about.sentence();
        check(self.said.as_ref().filter(|right| said != **right).map(|_| format!("{name}: {said}")));
        let read = file::read_linear(path).unwrap();
        check(other_size(read.size()));
        check(self.compare("read_linear", &read.pixels, light));

        // Cameras' pictures are codes: what fits into them.
        let codes: Vec<[f32; 3]> = light.iter().map(|p| p.map(|v| linear_from_srgb(srgb_from_linear(v)))).collect();
        let encoded = file::read_encoded(path).unwrap();
        let decoded = |codes: [f32; 3]| codes.map(linear_from_srgb);
        let found: Vec<[f32; 3]> = encoded.0.pixels.iter().map(|p| decoded(*p)).collect();
        check(self.compare("read_encoded", &found, &codes));
        if path.extension().is_some_and(|e| e != "hdr") {
            let movie = movies::open(path).unwrap();
            let frame = movie.frame(0).unwrap();
            let channels = 3 + usize::from(frame.has_alpha);
            let pixels = frame.codes.chunks_exact(channels);
            let found: Vec<[f32; 3]> = pixels.map(|p| decoded([0, 1, 2].map(|c| f32::from(p[c]) / 65535.0))).collect();
            check(self.compare("a sequence", &found, &codes));
        }

        // An environment has no negative light.
        if size.0 == 2 * size.1 {
            let positive: Vec<[f32; 3]> = light.iter().map(|p| p.map(|v| v.max(0.0))).collect();
            let environment = panorama::load(path).unwrap();
            check(self.compare("a panorama", &environment.radiance.pixels, &positive));
        }
        faults
    }
}

#[test]
fn every_entrance_gives_the_light_that_a_file_holds() {
    let modules = ["OpenImageIO", "PIL", "tifffile", "numpy"];
    let Some(python) = python(&modules) else { return };
    let folder = tempfile::tempdir().unwrap();
    let script = repository("tests/peers/brought.py");
    let ran = std::process::Command::new(python).arg(script).arg(folder.path()).output().unwrap();
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    let text = std::fs::read_to_string(folder.path().join("cases.json")).unwrap();
    let cases: Vec<Value> = serde_json::from_str(&text).unwrap();
    assert!(cases.len() > 80, "{} cases", cases.len());
    let faults: Vec<String> = cases.iter().flat_map(|case| Case::new(folder.path(), case).faults()).collect();
    assert!(faults.is_empty(), "{} faults:\n{}", faults.len(), faults.join("\n"));
    assert_page(&cases);
}

/// Compares the list of cases at the end of docs/files.md, or writes it with UPDATE_SNAPSHOTS.
fn assert_page(cases: &[Value]) {
    const HEADING: &str = "## Compared files\n";
    let mut kinds = BTreeMap::<(String, bool), Vec<String>>::new();
    for case in cases {
        let file = Path::new(case["file"].as_str().unwrap());
        let format = file.extension().unwrap_or_default().to_string_lossy().to_uppercase();
        let stem = file.file_stem().unwrap().to_string_lossy().replace('_', " ");
        let kind = kinds.entry((format, case["refused"].is_string())).or_default();
        kind.push(stem);
    }
    let mut table = format!(
        "{HEADING}\n`tests/brought` writes this list: {} files of other programs, each read by every entrance that takes it.\n\n\
         | format | files | outcome |\n|---|---|---|\n",
        cases.len()
    );
    for ((format, is_refused), files) in kinds {
        let outcome = if is_refused { "refused by name" } else { "right light" };
        table += &format!("| {format} | {} | {outcome} |\n", files.join(", "));
    }
    let path = repository("docs/files.md");
    let page = std::fs::read_to_string(&path).unwrap();
    let (before, found) = page.split_at(page.find(HEADING).unwrap_or(page.len()));
    if std::env::var_os("UPDATE_SNAPSHOTS").is_some() {
        std::fs::write(&path, format!("{before}{table}")).unwrap();
    } else {
        assert_eq!(found, table, "docs/files.md: run with UPDATE_SNAPSHOTS=1");
    }
}
