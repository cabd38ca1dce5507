//! Displays and views of the project's OpenColorIO configuration or of the variable `OCIO`, and the viewing transform
//! in use. A background thread reads the configuration and bakes the view into a table.

use crate::state::State;
use base::error::Result;
use base::files::shown;
use color_config::{ColorChoice, ConfigNames};
use imaging::DisplayTable;
use project::Project;
use std::sync::Arc;
use worker::Query;

/// Names in a configuration, and the requested view as a table.
type Answer = (Arc<ConfigNames>, Option<Arc<DisplayTable>>);

/// State of the configuration, and the query for it.
#[derive(Default)]
pub struct ColorViews {
    query: Query<ColorChoice, Answer>,
    asked: Option<ColorChoice>,
    /// Names in it, or the reason it cannot be read. None until known, and without a configuration.
    names: Option<std::result::Result<Arc<ConfigNames>, String>>,
}

impl ColorViews {
    /// Names in the configuration, or the reason it cannot be read. None until known, and without a configuration.
    pub fn names(&self) -> Option<&std::result::Result<Arc<ConfigNames>, String>> {
        self.names.as_ref()
    }

    /// True if a configuration is set, whether or not it has been read.
    pub fn is_configured(&self) -> bool {
        let asked = self.asked.as_ref();
        asked.is_some_and(|asked| asked.named().is_some())
    }

    /// Requests the names in the project's configuration and the table of the current view, if either changed.
    pub fn ask(&mut self, project: &Project, state: &State, wake: impl Fn() + Send + 'static) {
        let chosen = state.display.color_view.clone().unwrap_or_default();
        let choice = chosen.or_config(project.color_config());
        if self.asked.as_ref() == Some(&choice) {
            return;
        }
        let known = self.asked.as_ref().and_then(ColorChoice::named);
        self.asked = Some(choice.clone());
        if choice.named() != known {
            self.names = None;
        } else if !choice.is_view() && matches!(self.names, Some(Ok(_))) {
            return;
        }
        if choice.named().is_some() {
            // A view that was left and is chosen again is read again.
            self.query.forget();
            self.query.ask(choice, wake, |_| answer);
        }
    }

    /// Takes in what was read. Applies the view once its table is there. Resets export colours that the new
    /// configuration lacks, and returns the reason once.
    pub fn receive(&mut self, state: &mut State) -> Option<String> {
        let newest = self.query.answers().last();
        // Answers to older requests no longer matter.
        let (_, answer) = newest.filter(|(choice, _)| self.asked.as_ref() == Some(choice))?;
        match answer {
            Ok((names, table)) => {
                if table.is_some() {
                    state.display.viewing.through = table;
                }
                let exported = &mut state.export_options.ocio;
                let lost = exported.is_asked() && !has(&names, exported);
                let lost = lost.then(|| std::mem::take(exported));
                let sentence = lost.map(|lost| {
                    let name = lost.space.or(lost.view).unwrap_or_default();
                    format!(
                        "{} has no {name}. Exports use the working colours again. Choose others in Export, Colours",
                        shown(&names.config)
                    )
                });
                self.names = Some(Ok(names));
                sentence
            }
            Err(sentence) => {
                // A different view may have failed while the configuration itself was read.
                if !matches!(self.names, Some(Ok(_))) {
                    self.names = Some(Err(sentence.clone()));
                }
                let wanted = state.display.color_view.take();
                state.display.viewing.through = None;
                wanted.map(|_| sentence)
            }
        }
    }
}

/// True if the configuration contains everything that was chosen from it.
fn has(names: &ConfigNames, choice: &ColorChoice) -> bool {
    if let Some(space) = &choice.space {
        return names.spaces.iter().any(|known| known.name == *space);
    }
    let has_look = (choice.look.as_ref()).is_none_or(|look| names.looks.contains(look));
    let mut displays = names.displays.iter();
    let display = displays.find(|known| choice.display.as_ref() == Some(&known.name));
    let has_view =
        display.is_some_and(|display| (choice.view.as_ref()).is_some_and(|view| display.views.contains(view)));
    has_look && has_view
}

/// Reads a configuration, and bakes the chosen view into a table.
fn answer(choice: &ColorChoice) -> Result<Answer> {
    let config = choice.open()?;
    let look = choice.look.as_deref();
    let table = if choice.is_view() {
        let (display, view) = (choice.display.as_deref(), choice.view.as_deref());
        Some(Arc::new(config.to_view(display, view, look)?.table(look)))
    } else {
        None
    };
    Ok((Arc::new(config.names()), table))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::ViewCommand;
    use scene::Viewing;
    use std::path::{Path, PathBuf};
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::time::{Duration, Instant};

    const SRGB: &str = "sRGB - Display";

    fn with(config: Option<&str>) -> Project {
        let mut project = Project::without_shoot(Path::new("/film"));
        project.settings.color_config = config.map(PathBuf::from);
        project
    }

    fn view(name: &str) -> ColorChoice {
        ColorChoice { display: Some(SRGB.to_owned()), view: Some(name.to_owned()), ..ColorChoice::default() }
    }

    /// Requests until the condition holds; returns the last message.
    fn until(
        views: &mut ColorViews,
        project: &Project,
        state: &mut State,
        seen: impl Fn(&ColorViews, &State) -> bool,
    ) -> Option<String> {
        let started = Instant::now();
        let mut said = None;
        while !seen(views, state) {
            assert!(started.elapsed() < Duration::from_secs(60));
            views.ask(project, state, || {});
            said = views.receive(state).or(said);
            std::thread::sleep(Duration::from_millis(1));
        }
        said
    }

    #[test]
    fn a_view_is_looked_through_once_its_table_is_there_and_no_longer_when_it_is_left() {
        let (mut views, mut state) = (ColorViews::default(), State::new(1, 24.0));
        let project = with(Some("ocio://default"));
        let answers = Arc::new(AtomicUsize::new(0));
        let counted = answers.clone();
        views.ask(&project, &state, move || {
            counted.fetch_add(1, Ordering::SeqCst);
        });
        until(&mut views, &project, &mut state, |views, _| views.names().is_some());
        let names = views.names().unwrap().clone().unwrap();
        assert_eq!(names.displays[0].name, SRGB);
        assert!(state.display.viewing.is_neutral());
        let wanted = names.displays[0].views[0].clone();
        state.show(ViewCommand::LookThrough(Some(view(&wanted))));
        until(&mut views, &project, &mut state, |_, state| state.display.viewing.through.is_some());
        assert_eq!(state.scene().viewing.through.unwrap().name, wanted);
        // An exposure change keeps the view, a reset does not.
        state.show(ViewCommand::StepViewing(1.0));
        assert!(state.display.viewing.through.is_some());
        state.show(ViewCommand::ResetView);
        assert_eq!((&state.display.viewing, &state.display.color_view), (&Viewing::default(), &None));
        views.ask(&project, &state, || {});
        // A view that arrives late is not applied.
        state.show(ViewCommand::LookThrough(Some(view(&wanted))));
        views.ask(&project, &state, || {});
        state.show(ViewCommand::LookThrough(None));
        views.ask(&project, &state, || {});
        // Three answers: the names, the view, and the view again.
        test_support::wait_for(|| (answers.load(Ordering::SeqCst) == 3).then_some(()));
        assert_eq!(views.receive(&mut state), None);
        assert_eq!(state.display.viewing.through, None);
    }

    #[test]
    fn what_cannot_be_read_is_said_and_the_picture_stays_as_exported() {
        let (mut views, mut state) = (ColorViews::default(), State::new(1, 24.0));
        let gone = with(Some("/gone/config.ocio"));
        let said = until(&mut views, &gone, &mut state, |views, _| views.names().is_some());
        // The list of views shows the reason, so no message is needed.
        assert_eq!(said, None);
        let why = views.names().unwrap().clone().unwrap_err();
        assert!(why.contains("/gone/config.ocio"), "{why}");
        let project = with(Some("ocio://default"));
        until(&mut views, &project, &mut state, |views, _| matches!(views.names(), Some(Ok(_))));
        state.show(ViewCommand::LookThrough(Some(view("Polaroid"))));
        let said = until(&mut views, &project, &mut state, |_, state| state.display.color_view.is_none());
        assert!(said.unwrap().contains("Polaroid"));
        assert!(state.display.viewing.is_neutral() && matches!(views.names(), Some(Ok(_))));
    }

    #[test]
    fn another_configuration_keeps_what_it_has_too_and_the_rest_is_left_and_said() {
        let (mut views, mut state) = (ColorViews::default(), State::new(1, 24.0));
        let read = |path: &'static str| {
            move |views: &ColorViews, _: &State| {
                let names = views.names().and_then(|names| names.as_ref().ok());
                names.is_some_and(|names| names.config == Path::new(path))
            }
        };
        const NEW: &str = "ocio://default";
        const OLD: &str = "ocio://cg-config-v1.0.0_aces-v1.3_ocio-v2.1";
        let (new, old) = (with(Some(NEW)), with(Some(OLD)));
        // Both configurations have this space and a view of this name.
        let space = ColorChoice { space: Some("ACEScg".to_owned()), ..ColorChoice::default() };
        for kept in [space, view("Raw")] {
            state.export_options.ocio = kept.clone();
            for (project, path) in [(&new, NEW), (&old, OLD)] {
                let said = until(&mut views, project, &mut state, read(path));
                assert_eq!((said, &state.export_options.ocio), (None, &kept));
            }
        }
        until(&mut views, &new, &mut state, read(NEW));
        let names = views.names().unwrap().clone().unwrap();
        let first = &names.displays[0].views[0];
        // Colours of exports.
        state.export_options.ocio = view(first);
        let said = until(&mut views, &old, &mut state, read(OLD));
        assert!(said.unwrap().contains(&**first));
        assert_eq!(state.export_options.ocio, ColorChoice::default());
        // The view of the picture.
        until(&mut views, &new, &mut state, read(NEW));
        state.show(ViewCommand::LookThrough(Some(view(first))));
        until(&mut views, &new, &mut state, |_, state| state.display.viewing.through.is_some());
        let said = until(&mut views, &old, &mut state, read(OLD));
        assert!(said.unwrap().contains(&**first));
        assert_eq!((&state.display.color_view, &state.display.viewing.through), (&None, &None));
    }
}
