//! Stored looks: saved, applied, shared between projects, and compared side by side.

use crate::app::StudioApp;
use crate::command::{Command, Dialog, LookCommand, LooksCommand};
use crate::four_looks::FourSlot;
use crate::look_name::LookName;
use crate::look_shelf::write_to;
use crate::stored_look::{ENDING, StoredLook};
use crate::stored_looks::{LookId, LookNews, Shelf};
use base::files::shown;
use scene::Inspection;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use worker::SrgbPicture;

impl StudioApp {
    pub(crate) fn apply_to_looks(&mut self, command: LooksCommand) {
        let done = self.change_looks(command);
        self.refuse_unless(done);
    }

    fn change_looks(&mut self, command: LooksCommand) -> Result<(), String> {
        match command {
            LooksCommand::Store(name) => {
                let name = LookName::new(&name).map_err(|e| e.to_string())?;
                self.store_look(Shelf::Project, name)?;
            }
            LooksCommand::Update(id) => self.store_look(id.shelf, id.name)?,
            LooksCommand::Apply(id, number) => {
                let version = self.looks.version(&id, number);
                let version = version.ok_or("This look is no longer stored")?;
                let (look, number) = (version.look.clone(), version.number);
                self.looks.current = Some((id, number));
                self.show_look(look);
            }
            LooksCommand::Rename(id, name) => {
                self.writable(id.shelf)?;
                let name = LookName::new(&name).map_err(|e| e.to_string())?;
                let names = self.names(id.shelf);
                let taken = |one: &&LookName| one.is_like(&name) && **one != id.name;
                if let Some(taken) = names.iter().find(taken) {
                    return Err(format!("A look named {taken} already exists. Choose another name"));
                }
                let to = LookId { shelf: id.shelf, name: name.clone() };
                self.state.four.rename(&id, &to);
                self.state.compare.rename(&id, &to);
                if let Some((current, _)) = &mut self.looks.current
                    && *current == id
                {
                    *current = to;
                }
                self.looks.act(id.shelf, move |shelf| shelf.rename(&id.name, &name).map(|()| None));
            }
            LooksCommand::Duplicate(id) => {
                self.writable(id.shelf)?;
                let taken: Vec<LookName> = self.names(id.shelf);
                let copy = id.name.free(&taken);
                self.looks.act(id.shelf, move |shelf| shelf.copy(shelf, &id.name, &copy).map(|()| None));
            }
            LooksCommand::Remove(id) => {
                self.writable(id.shelf)?;
                let said = format!("{} was removed. Restore it under Removed in Looks", id.name);
                self.looks.act_and_say(id.shelf, said, move |shelf| shelf.remove(&id.name).map(|()| None));
            }
            LooksCommand::BringBack(id) => {
                self.writable(id.shelf)?;
                self.looks.act(id.shelf, move |shelf| shelf.bring_back(&id.name).map(|_| None));
            }
            LooksCommand::Copy(id) => self.copy_look(id)?,
            LooksCommand::SaveAs(id) => {
                self.saved_as = Some(id);
                self.open_dialog(Dialog::SaveLook);
            }
            LooksCommand::Write(path) => self.write_look(path)?,
            LooksCommand::Load(path) => self.load_look_file(path),
            LooksCommand::ToggleFour => {
                self.state.four.on = !self.state.four.on;
                self.state.four.fill(self.looks.ids());
            }
            LooksCommand::Place(place, slot) => {
                self.state.four.place(place, slot);
            }
            LooksCommand::Pick(place) => self.pick_look(place)?,
        }
        Ok(())
    }

    /// Checks that a shelf can be changed.
    fn writable(&self, shelf: Shelf) -> Result<(), String> {
        match (shelf, &self.session.read_only) {
            (Shelf::Project, Some(why)) => Err(format!("Looks cannot be stored here: {why}")),
            (Shelf::Person, _) if self.looks.shelf(shelf).is_none() => {
                Err("No settings folder on this system: looks for all projects cannot be stored".to_owned())
            }
            _ => Ok(()),
        }
    }

    fn names(&self, shelf: Shelf) -> Vec<LookName> {
        let looks = self.looks.looks(shelf).iter();
        looks.map(|look| look.name.clone()).collect()
    }

    fn store_look(&mut self, shelf: Shelf, name: LookName) -> Result<(), String> {
        self.writable(shelf)?;
        let look = StoredLook::from_look(&self.state.look);
        (self.looks).act(shelf, move |shelf| shelf.store(&name, &look).map(Some));
        Ok(())
    }

    /// Moves a look to the other shelf.
    fn copy_look(&mut self, id: LookId) -> Result<(), String> {
        let to = match id.shelf {
            Shelf::Project => Shelf::Person,
            Shelf::Person => Shelf::Project,
        };
        self.writable(to)?;
        let from = self.looks.shelf(id.shelf).cloned();
        let from = from.ok_or("This look is no longer stored")?;
        let said = match to {
            Shelf::Person => format!("{} is kept for all projects", id.name),
            Shelf::Project => format!("{} is stored in this project", id.name),
        };
        self.looks.act_and_say(to, said, move |shelf| shelf.copy(&from, &id.name, &id.name).map(|()| None));
        Ok(())
    }

    fn write_look(&mut self, path: PathBuf) -> Result<(), String> {
        let id = self.saved_as.take();
        let version = id.and_then(|id| Some(self.looks.version(&id, None)?.look.clone()));
        let look = version.ok_or("This look is no longer stored")?;
        self.errand(
            move || write_to(&path, &look).map(|()| path),
            |app, written| match written {
                Ok(path) => app.status.say(format!("Saved as {}", shown(&path))),
                Err(e) => app.status.refuse(e.to_string()),
            },
        );
        Ok(())
    }

    /// Applies the look in a file, and stores it in the project under the file's name.
    fn load_look_file(&mut self, path: PathBuf) {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let name = name.strip_suffix(ENDING).or(name.strip_suffix(".json"));
        let name = name.and_then(|name| LookName::new(name).ok());
        self.errand_here(
            move || StoredLook::read(&path),
            move |app, read| match read {
                Ok(look) => {
                    let look = Arc::new(look);
                    app.show_look(look.clone());
                    // Without a name that is valid for a folder, the look is only applied.
                    if let (Some(name), Ok(())) = (name, app.writable(Shelf::Project)) {
                        (app.looks).act(Shelf::Project, move |shelf| shelf.store(&name, &look).map(Some));
                    }
                }
                Err(e) => app.status.refuse(e.to_string()),
            },
        );
    }

    /// Applies a stored look. If the list lacks its environment, looks for the file first.
    fn show_look(&mut self, look: Arc<StoredLook>) {
        let listed = look.environment.place_in(&self.state.look.environments);
        let file = look.environment.file.clone().filter(|_| listed.is_none());
        let Some(file) = file else {
            if listed.is_none() {
                self.miss_environment(&look, None);
            }
            return self.show_listed(look, false);
        };
        self.errand_here(
            move || Ok((file.is_file(), file)),
            move |app, found| {
                // The lookup of a file cannot fail.
                let (is_there, file) = found.unwrap_or_default();
                if !is_there {
                    app.miss_environment(&look, Some(&file));
                }
                app.show_listed(look, is_there);
            },
        );
    }

    fn show_listed(&mut self, look: Arc<StoredLook>, exists: bool) {
        self.apply(Command::Look(LookCommand::Apply { look, exists }));
        // One separate undo step, whatever follows.
        self.state.release();
    }

    /// Shows a message that a look's environment is missing.
    fn miss_environment(&mut self, look: &StoredLook, file: Option<&Path>) {
        let name = &look.environment.name;
        let list = &self.state.look.environments;
        let file = file.map(shown);
        if look.environment.namesake_in(list).is_some() {
            let with = file.unwrap_or_else(|| "another environment".to_owned());
            return self
                .status
                .advise(format!("\u{201c}{name}\u{201d} is a different file here; the look was made with {with}"));
        }
        if !name.is_empty() {
            let place = file.map_or(String::new(), |file| format!(", {file}"));
            self.status.refuse(format!(
                "Environment \u{201c}{name}\u{201d}{place} is missing. Add it and click the look again"
            ));
        }
    }

    fn pick_look(&mut self, place: usize) -> Result<(), String> {
        match self.state.four.slots.get(place).cloned() {
            None | Some(FourSlot::Empty) => return Ok(()),
            Some(FourSlot::Present) => {}
            Some(FourSlot::Stored(id, number)) => {
                self.change_looks(LooksCommand::Apply(id, number))?;
            }
        }
        self.state.four.on = false;
        Ok(())
    }

    /// Takes in the contents of the shelves.
    pub(crate) fn receive_looks(&mut self) {
        for news in self.looks.receive() {
            match news {
                LookNews::Stored(id, number) => self.looks.current = Some((id, number)),
                LookNews::Done(sentence) => self.status.say(sentence),
                LookNews::Failed(sentence) => self.status.refuse(sentence),
                LookNews::Unreadable(sentence) => self.status.advise(sentence),
            }
        }
        self.state.four.fill(self.looks.ids());
        self.draw_look();
    }

    /// Writes a thumbnail of the picture on screen for the version that it shows, if that has none.
    fn draw_look(&mut self) {
        let (Some((id, number)), Some(relit)) = (&self.looks.current, &self.preview.relit) else { return };
        let version = self.looks.version(id, Some(*number));
        let state = &self.state;
        let is_missing = version.is_some_and(|version| version.picture.is_none());
        let is_tried = self.looks.drawn == self.looks.current;
        if !is_missing || is_tried || self.looks.is_busy() || self.writable(id.shelf).is_err() {
            return;
        }
        let whole = relit.coarse == 1 && !relit.rgb.is_empty() && relit.solo.is_empty();
        let scene = &relit.scene;
        let as_exported = scene.viewing.is_neutral() && scene.effects.inspection == Inspection::Picture;
        let is_its = version.is_some_and(|version| version.look.is(&state.look, state.frame));
        if !whole || !as_exported || !is_its || *scene != state.scene_of(&state.look) {
            return;
        }
        let listed = state.look.environments.get(state.look.environment);
        let light = listed.and_then(|listed| self.library.environment(&listed.origin));
        if light.is_none_or(|light| light.name != relit.environment) {
            return;
        }
        let picture = SrgbPicture { width: relit.rgb_size[0], height: relit.rgb_size[1], rgb: relit.rgb.clone() };
        let (name, number, shelf) = (id.name.clone(), *number, id.shelf);
        // One attempt only: if writing fails now, it would fail in every frame.
        self.looks.drawn = self.looks.current.clone();
        self.looks.act(shelf, move |shelf| shelf.draw(&name, number, &picture).map(|()| None));
    }
}
