//! Plan of a new project: the person's choices, and the contents of the shoot's folder.

use base::files::plain;
use footage::candidate::{Candidate, Slot, expand};
use footage::gathered::{self, Misfit};
use footage::scan::{Line, Scan, scan};
use footage::{ImportSettings, LampSettings};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use worker::{Job, Query};

/// Files that identify the folder of a project or a shoot.
pub const FILES: [&str; 2] = ["project.toml", "manifest.json"];

/// Plan of a new project.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// The shoot's folder, as typed.
    pub shoot: String,
    /// The project's folder, as typed; empty for a folder beside the shoot.
    pub folder: String,
    /// The project's name; empty for the shoot's.
    pub name: String,
    /// Working size in pixels.
    pub size: usize,
    /// Number of lamps to use; None for all.
    pub lamps: Option<usize>,
    /// Layer of EXR files that have several; None for the finished picture.
    pub layer: Option<String>,
    /// Files and folders added one by one, instead of a shoot's folder.
    pub parts: Vec<PlannedPart>,
}

/// An added file or folder.
#[derive(Clone, Debug, PartialEq)]
pub struct PlannedPart {
    pub path: PathBuf,
    /// Kind of part chosen by hand; None to guess it.
    pub slot: Option<Slot>,
    /// True if a person overruled the judgement that it does not fit.
    pub anyway: bool,
    /// Time of the drop in seconds of the window's clock, until the pointer's position is known.
    pub landed_s: Option<f64>,
}

impl Default for Plan {
    fn default() -> Self {
        Self {
            shoot: String::new(),
            folder: String::new(),
            name: String::new(),
            size: 128,
            lamps: None,
            layer: None,
            parts: vec![],
        }
    }
}

impl Plan {
    /// A plan for the shoot in a folder.
    pub fn from_shoot(shoot: &Path) -> Self {
        Self { shoot: plain(shoot), ..Self::default() }
    }

    /// The project's folder: as typed, or beside the shoot. None until a shoot is chosen.
    pub fn root(&self) -> Option<PathBuf> {
        let typed = typed(&self.folder);
        let beside = || {
            let shoot = self::typed(&self.shoot).or_else(|| self.parts_folder())?;
            let name = shoot.file_name()?.to_string_lossy().into_owned();
            Some(shoot.with_file_name(format!("{name}-project")))
        };
        typed.or_else(beside)
    }

    /// The folder that contains all parts.
    fn parts_folder(&self) -> Option<PathBuf> {
        let mut folder = self.parts.first()?.path.parent()?.to_path_buf();
        while !self.parts.iter().all(|part| part.path.starts_with(&folder)) {
            folder.pop();
        }
        Some(folder)
    }

    /// Adds files and folders, with the given kind or a guess. Existing parts are unchanged.
    pub fn bring(&mut self, paths: Vec<PathBuf>, slot: Option<Slot>, landed_s: Option<f64>) {
        for path in paths {
            if !self.parts.iter().any(|part| part.path == path) {
                self.parts.push(PlannedPart { path, slot, anyway: false, landed_s });
            }
        }
    }

    /// True if the shoot is gathered part by part.
    pub fn is_gathered(&self) -> bool {
        typed(&self.shoot).is_none() && !self.parts.is_empty()
    }
}

/// A typed path, with `~` for the home folder; None for an empty text.
pub fn typed(text: &str) -> Option<PathBuf> {
    let text = text.trim();
    let home = || dirs::home_dir().unwrap_or_default();
    match text.strip_prefix("~/") {
        Some(inside) => Some(home().join(inside)),
        None if text == "~" => Some(home()),
        None => (!text.is_empty()).then(|| PathBuf::from(text)),
    }
}

/// A shoot's folder that could not be scanned.
fn unreadable(folder: PathBuf, sentence: String) -> Scan {
    Scan {
        folder,
        name: String::new(),
        lines: vec![Line { part: "Shoot", found: String::new(), lack: Some(sentence), needed: true }],
        frames: 0,
        poses: 0,
        lamps: 0,
        picture: None,
        layers: vec![],
    }
}

/// The plan, and the queries for folders and files.
#[derive(Default)]
pub struct Wizard {
    /// The plan; None if no project is being planned.
    plan: Option<Plan>,
    /// Contents of the last scanned folder.
    scan: Option<Scan>,
    scans: Query<(PathBuf, Option<String>), Scan>,
    /// Kinds of the added files.
    candidates: HashMap<PathBuf, Candidate>,
    looks: Query<(PathBuf, Option<String>), Vec<Candidate>>,
}

/// An added file, and the knowledge about it.
#[derive(Clone, Copy)]
pub struct Brought<'a> {
    pub part: &'a PlannedPart,
    /// Result of the examination; None while reading.
    pub candidate: Option<&'a Candidate>,
}

impl Brought<'_> {
    /// Kind of part: chosen, or guessed.
    pub fn slot(&self) -> Option<Slot> {
        self.part.slot.or_else(|| self.candidate?.guess)
    }
}

/// Path of the map of gathered parts in the project's folder.
pub const MAP: &str = "shoot.toml";

impl Wizard {
    /// The plan; None if no project is being planned.
    pub fn plan(&self) -> Option<&Plan> {
        self.plan.as_ref()
    }

    /// Contents of the chosen shoot's folder; None while scanning.
    pub fn scan(&self) -> Option<&Scan> {
        let shoot = typed(&self.plan.as_ref()?.shoot)?;
        self.scan.as_ref().filter(|scan| scan.folder == shoot)
    }

    /// The added files.
    pub fn brought(&self) -> impl Iterator<Item = Brought<'_>> {
        let parts = self.plan.iter().flat_map(|plan| &plan.parts);
        parts.map(|part| Brought { part, candidate: self.candidates.get(&part.path) })
    }

    /// The added files of known kind.
    pub fn gathered(&self) -> Vec<(Slot, &Candidate)> {
        self.brought().filter_map(|one| Some((one.slot()?, one.candidate?))).collect()
    }

    /// Scan result of the gathered parts, like that of a folder; None without an interview.
    pub fn gathered_scan(&self) -> Option<Scan> {
        let parts = self.gathered();
        let interview = parts.iter().find(|(slot, _)| *slot == Slot::Interview)?.1;
        let folder = interview.path.parent().unwrap_or(Path::new("")).to_path_buf();
        Some(Scan {
            name: gathered::name(&parts).unwrap_or_default(),
            folder,
            lines: vec![],
            frames: interview.frames as usize,
            poses: parts.iter().filter(|(slot, _)| *slot == Slot::Pose).count(),
            lamps: gathered::lamps(&parts).unwrap_or(0),
            picture: interview.size,
            layers: self.layers(),
        })
    }

    /// Layers of EXR files that have several: of the folder, or of the added files.
    pub fn layers(&self) -> Vec<String> {
        let parts = self.candidates.values().map(|candidate| &candidate.layers);
        let all = self.scan().map(|scan| &scan.layers).into_iter().chain(parts);
        all.max_by_key(|layers| layers.len()).cloned().unwrap_or_default()
    }

    /// Changes or discards the plan.
    pub fn set(&mut self, plan: Option<Plan>) {
        let layer = |plan: &Option<Plan>| plan.as_ref().and_then(|plan| plan.layer.clone());
        if layer(&self.plan) != layer(&plan) {
            // Files are read again.
            self.candidates.clear();
        }
        self.plan = plan;
        if self.plan.is_none() {
            self.scans.forget();
            self.candidates.clear();
        }
    }

    /// Scans the shoot's folder if it changed, and takes in the result.
    pub fn look(&mut self, wake: impl Fn() + Clone + Send + 'static) {
        self.look_at_brought(wake.clone());
        let shoot = self.plan.as_ref().and_then(|plan| Some((typed(&plan.shoot)?, plan.layer.clone())));
        if let Some(shoot) = shoot {
            self.scans
                .ask(shoot, wake, |_| |(folder, layer): &(PathBuf, Option<String>)| Ok(scan(folder, layer.as_deref())));
        }
        if let Some(((folder, _), found)) = self.scans.answers().last() {
            self.scan = Some(found.unwrap_or_else(|sentence| unreadable(folder, sentence)));
        }
    }

    /// Examines added files one by one.
    fn look_at_brought(&mut self, wake: impl Fn() + Send + 'static) {
        for ((path, layer), found) in self.looks.answers() {
            let failed = |sentence| vec![Candidate::failed(&path, sentence)];
            let mut found = found.unwrap_or_else(failed);
            // A folder may contain several parts, or be one itself.
            found.dedup_by(|a, b| a.path == b.path);
            let Some(plan) = self.plan.as_mut().filter(|plan| plan.layer == layer) else { continue };
            let Some(at) = plan.parts.iter().position(|part| part.path == path) else { continue };
            let dropped = plan.parts.remove(at);
            let mut at = at;
            for candidate in found {
                if plan.parts.iter().all(|part| part.path != candidate.path) {
                    let path = candidate.path.clone();
                    plan.parts.insert(at, PlannedPart { path, ..dropped.clone() });
                    at += 1;
                }
                self.candidates.insert(candidate.path.clone(), candidate);
            }
        }
        let Some(plan) = &self.plan else { return };
        let mut unseen = plan.parts.iter().filter(|part| !self.candidates.contains_key(&part.path));
        if !self.looks.is_waiting()
            && let Some(part) = unseen.next()
        {
            let look = |(path, layer): &(PathBuf, Option<String>)| {
                imaging::picture::choose_layer(path, layer.as_deref());
                Ok(expand(path).iter().map(|path| Candidate::look(path)).collect())
            };
            // It may be the last one again, of another plan.
            self.looks.forget();
            self.looks.ask((part.path.clone(), plan.layer.clone()), wake, |_| look);
        }
    }

    /// Reason that an added file does not fit its kind, unless a person overruled it.
    pub fn misfit(&self, one: Brought) -> Option<Misfit> {
        let parts = self.gathered();
        let is_this = |(_, part): &(Slot, &Candidate)| part.path == one.part.path;
        let misfit = gathered::misfit(&parts, parts.iter().position(is_this)?)?;
        (!(misfit.is_guess && one.part.anyway)).then_some(misfit)
    }

    /// Reason that no project can be made of the gathered parts.
    fn obstacle(&self) -> Option<&'static str> {
        if self.brought().any(|one| one.candidate.is_none()) {
            return Some("The files are still being read");
        }
        if self.brought().any(|one| one.slot().is_none()) {
            return Some("Choose what each file is: see the marks above");
        }
        if self.brought().any(|one| self.misfit(one).is_some()) {
            return Some("Something does not fit: see the marks above");
        }
        Some(match gathered::missing(&self.gathered())? {
            Slot::Interview => "The interview is missing",
            Slot::InterviewBall => "The mirror ball in the interview's light is missing",
            Slot::Balls => "The mirror ball under each lamp is missing",
            Slot::Pose | Slot::Lamps => "The poses are missing",
        })
    }

    /// The job that makes the project, and the project's folder.
    ///
    /// # Errors
    /// The missing input.
    pub fn job(&self) -> Result<(Job, PathBuf), &'static str> {
        let plan = self.plan.as_ref().ok_or("No project is being planned")?;
        let root = || plan.root().ok_or("Choose a folder for the project");
        let (shoot, lamps) = if plan.is_gathered() {
            if let Some(obstacle) = self.obstacle() {
                return Err(obstacle);
            }
            (root()?.join(MAP), gathered::lamps(&self.gathered()))
        } else {
            let shoot = typed(&plan.shoot).ok_or("Choose the shoot's folder, or bring its parts")?;
            let scan = self.scan().ok_or("The shoot's folder is still being scanned")?;
            if !scan.is_complete() {
                return Err("The shoot is incomplete: see the marks above");
            }
            (shoot, Some(scan.lamps))
        };
        let root = root()?;
        let name = plan.name.trim();
        let job = Job::Import {
            project: root.clone(),
            shoot,
            settings: ImportSettings { size: plan.size, seed: 1, layer: plan.layer.clone() },
            corrections: LampSettings::default(),
            lamps: plan.lamps.filter(|&count| lamps.is_none_or(|all| count < all)),
            name: (!name.is_empty()).then(|| name.to_owned()),
        };
        Ok((job, root))
    }
}

/// Memory and time of training at the planned size.
pub fn cost(scan: &Scan, plan: &Plan) -> String {
    let lamps = plan.lamps.unwrap_or(scan.lamps).min(scan.lamps);
    // Each picture is kept linear (3), encoded (3) and as a matte (1); a pose also has its OLATs (3 each).
    let picture = 7;
    let values = scan.poses * (picture + 3 * lamps) + scan.frames * picture;
    let bytes = 4 * values * plan.size * plan.size;
    let memory = match bytes as f64 / 1e6 {
        mb if mb < 1000.0 => format!("{} MB", mb.round().max(1.0)),
        mb => format!("{:.1} GB", mb / 1e3),
    };
    let times = (plan.size as f64 / 128.0).powi(2);
    let time = match times {
        1.0 => String::new(),
        times if times > 1.0 => {
            format!("; a step takes about {times} times as long as at 128 px")
        }
        times => format!("; a step takes about 1/{} of the time at 128 px", 1.0 / times),
    };
    format!("Training needs {memory} of memory for its pictures{time}")
}

/// Folder of a project or a shoot, given one of its files; any other path unchanged.
pub fn folder_of(path: PathBuf) -> PathBuf {
    match path.parent() {
        Some(folder) if FILES.iter().any(|name| path.ends_with(name)) => folder.to_path_buf(),
        _ => path,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_project_stands_beside_the_shoot_until_another_folder_is_typed() {
        let mut plan = Plan::default();
        assert_eq!(plan.root(), None);
        plan.shoot = " /films/anna ".to_owned();
        assert_eq!(plan.root(), Some("/films/anna-project".into()));
        plan.folder = "/films/relit".to_owned();
        assert_eq!(plan.root(), Some("/films/relit".into()));
        let home = dirs::home_dir().unwrap();
        assert_eq!(typed("~/films"), Some(home.join("films")));
        assert_eq!(typed("  "), None);

        let mut plan = Plan::default();
        let cards = ["/cards/day 1/b/pose.mov", "/cards/day 1/a.mov"];
        plan.bring(cards.map(PathBuf::from).to_vec(), None, None);
        assert_eq!(plan.root(), Some("/cards/day 1-project".into()));
        plan.bring(vec!["/other.mov".into()], None, None);
        assert_eq!(plan.root(), None, "no folder holds all");
    }

    #[test]
    fn the_cost_of_a_size_is_in_proportion_to_its_pixels() {
        let scan = Scan {
            folder: "shoot".into(),
            name: "shoot".into(),
            lines: vec![],
            frames: 100,
            poses: 10,
            lamps: 41,
            picture: Some((1920, 1080)),
            layers: vec![],
        };
        let said = |size, lamps| {
            let plan = Plan { size, lamps, ..Plan::default() };
            cost(&scan, &plan)
        };
        // 4 · 128² · (10 · (7 + 3 · 41) + 100 · 7) bytes.
        assert!(said(128, None).contains("131 MB"), "{}", said(128, None));
        assert!(said(512, None).contains("2.1 GB"), "{}", said(512, None));
        assert!(said(512, None).contains("16 times"));
        assert!(said(64, None).contains("1/4 of the time"));
        assert!(said(128, Some(10)).contains("70 MB"), "{}", said(128, Some(10)));
    }
}
