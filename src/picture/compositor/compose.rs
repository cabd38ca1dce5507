//! Makes pictures from a reflectance field and a scene, with a report on every pass.

use super::composition::{Backend, Composition, InMemory, OnGpu, inputs};
use super::descriptor::PlannedPass;
use super::field::Field;
use super::picture::{Ingredients, Picture};
use super::plan::plan;
use super::reuse::Reuse;
use super::shown::ShownPicture;
use base::error::{Error, Result};
use scene::Scene;

/// Makes the picture of `scene`.
///
/// # Errors
/// When field, mask and weights do not match, the view is invalid, or a GPU fails.
pub fn compose(scene: &Scene, ingredients: &Ingredients) -> Result<Picture> {
    Ok(make(scene, ingredients, None, None, false)?.picture)
}

/// Makes the picture of `scene`. Pictures after some passes are cached in `reuse`, and reused
/// while none of their inputs has changed: `of.extra.identity` must state changes.
///
/// # Errors
/// As [`compose`].
pub fn compose_reusing(scene: &Scene, ingredients: &Ingredients, reuse: &mut Reuse) -> Result<Picture> {
    Ok(make(scene, ingredients, None, Some(reuse), false)?.picture)
}

/// Runs a given plan: a test may force a pass that [`plan`] would skip. Every pass must be in it.
///
/// # Errors
/// As [`compose`].
pub fn execute(scene: &Scene, ingredients: &Ingredients, passes: &[PlannedPass]) -> Result<Picture> {
    Ok(make(scene, ingredients, Some(passes), None, false)?.picture)
}

/// Makes a picture by a given plan or by its own. The result may stay on the GPU.
pub(super) fn make(
    scene: &Scene,
    ingredients: &Ingredients,
    given: Option<&[PlannedPass]>,
    mut reuse: Option<&mut Reuse>,
    may_stay: bool,
) -> Result<ShownPicture> {
    check(ingredients)?;
    let inputs = inputs(ingredients);
    match ingredients.field {
        Field::Gpu(field, passes) => passes.guarded(|| {
            let uploads = reuse.as_mut().map(|r| r.gpu.own.clone());
            let backend = OnGpu::new(ingredients, inputs, (field, passes), uploads.unwrap_or_default())?;
            let composition = Composition::new(scene, ingredients, inputs, backend, reuse);
            perform(composition, given, may_stay)
        }),
        _ => {
            let rim = reuse.as_mut().map(|r| r.memory.own.clone());
            let backend = InMemory::new(ingredients, inputs.frame, rim.unwrap_or_default());
            let composition = Composition::new(scene, ingredients, inputs, backend, reuse);
            perform(composition, given, may_stay)
        }
    }
}

/// Runs the plan, pass by pass.
fn perform<B: Backend>(
    mut composition: Composition<B>,
    given: Option<&[PlannedPass]>,
    may_stay: bool,
) -> Result<ShownPicture> {
    let mut planned = plan(composition.scene, composition.facts());
    let mut done = Vec::with_capacity(planned.len());
    for index in 0..planned.len() {
        composition.begin(planned[index].pass);
        let measured = composition.measure(&planned[..=index])?;
        if measured {
            planned = plan(composition.scene, composition.facts());
        }
        if let Some(forced) = given.and_then(|given| given.get(index)) {
            planned[index] = forced.clone();
        }
        done.push(composition.run(&planned, index, measured)?);
    }
    composition.finish(done, may_stay)
}

fn check(ingredients: &Ingredients) -> Result<()> {
    let remedy = "Predict this frame again with the network of this project";
    let field = ingredients.field;
    let (width, height) = field.size();
    if (width, height) != ingredients.mask.size() {
        return Err(Error::invalid(
            format!(
                "the reflectance field has {width} × {height} pixels, but the matte has {} × {}",
                ingredients.mask.width, ingredients.mask.height
            ),
            remedy,
        ));
    }
    if field.lamps() != ingredients.weights.per_lamp.len() {
        return Err(Error::invalid(
            format!(
                "the reflectance field has {} lamps, but there are weights for {}",
                field.lamps(),
                ingredients.weights.per_lamp.len()
            ),
            remedy,
        ));
    }
    if ingredients.environment.radiance.pixels.is_empty() {
        return Err(Error::invalid(
            format!("the environment {} has no texels", ingredients.environment.name),
            "Choose another environment",
        ));
    }
    let fov = ingredients.view.vertical_fov_deg;
    if !(fov > 0.0 && fov < 180.0) {
        return Err(Error::invalid(
            format!("the background's field of view is {fov}°, not between 0° and 180°"),
            "Leave it at 40°",
        ));
    }
    Ok(())
}

#[cfg(test)]
#[path = "compose_tests.rs"]
pub(super) mod tests;

#[cfg(test)]
#[path = "effects_tests.rs"]
mod effects_tests;
