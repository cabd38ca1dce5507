//! The making of a project: what a person chose, and what was found in the shoot's folder.

use footage::ImportSettings;
use footage::scan::{Scan, scan};
use std::path::{Path, PathBuf};
use worker::{Job, Lookup};

/// What a person chose for a new project.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// The shoot's folder, as it was typed.
    pub shoot: String,
    /// The project's folder, as it was typed; empty is beside the shoot.
    pub folder: String,
    /// What the project is called; empty is as the shoot.
    pub name: String,
    /// Working size in pixels.
    pub size: usize,
    /// So many of the lamps; none is all.
    pub lamps: Option<usize>,
}

impl Default for Plan {
    fn default() -> Self {
        Self {
            shoot: String::new(),
            folder: String::new(),
            name: String::new(),
            size: 128,
            lamps: None,
        }
    }
}

impl Plan {
    /// A plan for the shoot in a folder.
    pub fn of(shoot: &Path) -> Self {
        Self {
            shoot: shoot.display().to_string(),
            ..Self::default()
        }
    }

    /// The project's folder: beside the shoot where none was typed. None before a shoot was chosen.
    pub fn root(&self) -> Option<PathBuf> {
        let typed = typed(&self.folder);
        let beside = || {
            let shoot = self::typed(&self.shoot)?;
            let name = shoot.file_name()?.to_string_lossy().into_owned();
            Some(shoot.with_file_name(format!("{name}-project")))
        };
        typed.or_else(beside)
    }
}

/// A typed path, with `~` for the person's own folder; none where nothing was typed.
pub fn typed(text: &str) -> Option<PathBuf> {
    let text = text.trim();
    let home = || dirs::home_dir().unwrap_or_default();
    match text.strip_prefix("~/") {
        Some(inside) => Some(home().join(inside)),
        None if text == "~" => Some(home()),
        None => (!text.is_empty()).then(|| PathBuf::from(text)),
    }
}

/// The plan, and the thread that looks at folders.
#[derive(Default)]
pub struct Wizard {
    /// What was chosen so far; none while no project is made.
    plan: Option<Plan>,
    /// What the folder holds that was looked at last.
    scan: Option<Scan>,
    /// The folder that was asked for last.
    asked: Option<PathBuf>,
    clerk: Option<Lookup<PathBuf, Scan>>,
}

impl Wizard {
    /// What was chosen so far; none while no project is made.
    pub fn plan(&self) -> Option<&Plan> {
        self.plan.as_ref()
    }

    /// What the chosen shoot's folder holds; none while it is looked at.
    pub fn scan(&self) -> Option<&Scan> {
        let shoot = typed(&self.plan.as_ref()?.shoot)?;
        self.scan.as_ref().filter(|scan| scan.folder == shoot)
    }

    /// Goes on with another plan, or ends.
    pub fn set(&mut self, plan: Option<Plan>) {
        self.plan = plan;
        if self.plan.is_none() {
            self.asked = None;
        }
    }

    /// Looks at the shoot's folder, where that is another than before, and takes in what was found.
    pub fn look(&mut self, wake: impl Fn() + Send + 'static) {
        let shoot = self.plan.as_ref().and_then(|plan| typed(&plan.shoot));
        if let Some(shoot) = shoot
            && self.asked.as_ref() != Some(&shoot)
        {
            let clerk = self
                .clerk
                .get_or_insert_with(|| Lookup::start(wake, |folder: PathBuf| scan(&folder)));
            clerk.ask(shoot.clone());
            self.asked = Some(shoot);
        }
        let found = self.clerk.iter().flat_map(Lookup::answers).last();
        self.scan = found.or(self.scan.take());
    }

    /// The job that makes the project, and the project's folder.
    ///
    /// # Errors
    /// A sentence that says what is missing.
    pub fn job(&self) -> Result<(Job, PathBuf), &'static str> {
        let plan = self.plan.as_ref().ok_or("No project is being made")?;
        let shoot = typed(&plan.shoot).ok_or("Choose the shoot's folder first")?;
        let scan = self.scan().ok_or("The shoot's folder is being looked at")?;
        if !scan.is_complete() {
            return Err("The shoot lacks what is marked above");
        }
        let root = plan.root().ok_or("Choose a folder for the project")?;
        let name = plan.name.trim();
        let job = Job::Import {
            project: root.clone(),
            shoot,
            settings: ImportSettings {
                size: plan.size,
                seed: 1,
            },
            lamps: plan.lamps.filter(|&count| count < scan.lamps),
            name: (!name.is_empty()).then(|| name.to_owned()),
        };
        Ok((job, root))
    }
}

/// What it costs to work at `size` pixels.
pub fn cost(scan: &Scan, plan: &Plan) -> String {
    let lamps = plan.lamps.unwrap_or(scan.lamps).min(scan.lamps);
    // A look is the linear and the encoded picture and its matte; a pose has its OLATs besides.
    let look = 7;
    let values = scan.poses * (look + 3 * lamps) + scan.frames * look;
    let bytes = 4 * values * plan.size * plan.size;
    let memory = match bytes as f64 / 1e6 {
        mb if mb < 1000.0 => format!("{} MB", mb.round().max(1.0)),
        mb => format!("{:.1} GB", mb / 1e3),
    };
    let times = (plan.size as f64 / 128.0).powi(2);
    let time = match times {
        1.0 => String::new(),
        times if times > 1.0 => {
            format!("; a step takes about {times} times as long as at 128 pixels")
        }
        times => format!(
            "; a step takes about 1/{} of the time at 128 pixels",
            1.0 / times
        ),
    };
    format!("Training holds its pictures in {memory} of memory{time}")
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
        };
        let said = |size, lamps| {
            let plan = Plan {
                size,
                lamps,
                ..Plan::default()
            };
            cost(&scan, &plan)
        };
        // 4 · 128² · (10 · (7 + 3 · 41) + 100 · 7) bytes.
        assert!(said(128, None).contains("131 MB"), "{}", said(128, None));
        assert!(said(512, None).contains("2.1 GB"), "{}", said(512, None));
        assert!(said(512, None).contains("16 times"));
        assert!(said(64, None).contains("1/4 of the time"));
        assert!(
            said(128, Some(10)).contains("70 MB"),
            "{}",
            said(128, Some(10))
        );
    }
}
