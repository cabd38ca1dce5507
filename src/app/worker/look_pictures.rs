//! Looks side by side: the same frame, each with its own light and effects.

use super::behind::Behind;
use super::comparison::LookView;
use super::prediction::PredictedFrame;
use super::preview::{LookPicture, PreviewRequest};
use super::relit_frame::extra;
use super::srgb_picture::SrgbPicture;
use super::view_table::{ViewTable, changed};
use base::error::Result;
use compositor::{EnvironmentLight, Field, Ingredients, compose};
use imaging::Mask;
use light::Rig;
use scene::{Output, Scene};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::SystemTime;

/// A table's file and its modification time.
type TableFile = Option<(PathBuf, Option<SystemTime>)>;

/// Pictures of the last request. An unchanged look is not made again.
#[derive(Default)]
pub(super) struct LookPictures([Made; 4]);

#[derive(Default)]
struct Made {
    light: Option<EnvironmentLight>,
    inputs: Option<Inputs>,
    picture: Option<Arc<SrgbPicture>>,
}

/// Inputs of a look's picture.
struct Inputs {
    view: LookView,
    predicted: Arc<PredictedFrame>,
    table: TableFile,
    /// Number of the picture behind the subject.
    behind: Option<u64>,
}

impl LookPictures {
    /// Makes the pictures of a request's looks. `reference` is the frame that sets the level of every light;
    /// `table` is the display table for the codes.
    ///
    /// # Errors
    /// As [`compose`], and when the table cannot be read.
    pub fn make(
        &mut self,
        (request, predicted): (&PreviewRequest, &Arc<PredictedFrame>),
        (rig, reference): (&Rig, (&Field, &Mask)),
        table: &mut ViewTable,
        behind: &Behind,
    ) -> Result<[Option<LookPicture>; 4]> {
        let mut pictures = [const { None }; 4];
        let through: TableFile = (request.table.clone()).map(|path| {
            let changed = changed(&path);
            (path, changed)
        });
        let places = self.0.iter_mut().zip(&request.looks).zip(&mut pictures);
        for ((made, look), picture) in places {
            let Some(view) = look else {
                *made = Made::default();
                continue;
            };
            let scene = Scene { frame: request.scene.frame, output: Output::Display, ..view.scene.clone() };
            let behind = behind.picture(&scene.background);
            let number = behind.map(|(number, _)| number);
            let is_made = made.inputs.as_ref().is_some_and(|inputs| {
                inputs.view == *view
                    && Arc::ptr_eq(&inputs.predicted, predicted)
                    && inputs.table == through
                    && inputs.behind == number
            });
            if !is_made {
                made.inputs = None;
                let (light, _) = EnvironmentLight::update(&mut made.light, &view.environment, rig, &scene, reference)?;
                let extra = extra(predicted, behind);
                let all = light.on(&predicted.field, &predicted.frame.mask);
                let mut codes = compose(&scene, &Ingredients { extra, ..all })?.display;
                let table = table.read(&scene, request.table.as_ref())?;
                if let (Some(codes), Some(table)) = (&mut codes, table) {
                    table.apply_to(codes);
                }
                made.picture = codes.as_ref().map(|codes| Arc::new(SrgbPicture::from_picture(codes)));
                made.inputs = Some(Inputs {
                    view: view.clone(),
                    predicted: predicted.clone(),
                    table: through.clone(),
                    behind: number,
                });
            }
            *picture = made.picture.clone().map(|made| (view.clone(), made));
        }
        Ok(pictures)
    }
}
