//! Mirror balls of a shoot: one under each lamp, one under the interview's light. All were taken by one camera at
//! one exposure, so that pixel for pixel the interview's ball is a sum of the lamps'.

mod interview;
mod profile;

use super::arc_cosine;
use super::blind_cone::uncover;
use super::code_values::{self, CodeValues, PROVISIONAL, ResponseTable, codes, encoded, is_clipped};
use super::footprint::{Footprint, aim};
use super::highlight::Grid;
use super::mirror_ball::MirrorBall;
use super::silhouette::{self, Circle, Photographs};
use base::error::{Error, Result};
use base::median::median;
use base::progress::Progress;
use glam::Vec3;
use imaging::{Encoded, Response, color::luminance};
use light::{Lamp, Rig};
pub(super) use profile::{NeighbourDifferences, Profile};
use project::{Picture, Project};
use rayon::prelude::*;

/// All ball photographs as code values, so that any response takes milliseconds to try.
pub struct Probes {
    ball: MirrorBall,
    footprints: Vec<Footprint>,
    /// Code values of each pixel of the interview's ball.
    interview: Vec<CodeValues>,
    /// Nearest cell of each pixel of the ball. Cells are directions spread evenly over the sphere at which the
    /// balls are compared.
    cell_of_pixel: Vec<u16>,
    /// Blur of that comparison: weights between all pairs of cells.
    blur: Vec<f32>,
    /// Correlation between the effects of light from two cells on a subject, see [`arc_cosine::kernel`].
    kernel: Vec<f32>,
    /// True for pixels of the ball that no photograph clips. Only these are compared: a clipped lamp then lacks the
    /// same part in both, and its weight stays right.
    comparable: Vec<bool>,
    /// Median code values of the interview's ball outside the lamps; black if lamps are everywhere.
    interview_dark: CodeValues,
    profile: Vec<ProfilePixel>,
    /// Mean square of the rounding errors of the profile's codes.
    pub(super) profile_rounding: f64,
    /// Warning about the ball's circle.
    wrong_circle: Option<String>,
    /// Factor on the light of the ball's photographs: see [`scale`].
    scale: f32,
}

/// A pixel of the interview's ball, with the same pixel under each lamp that reaches it.
struct ProfilePixel {
    interview: CodeValues,
    lamps: Vec<(usize, CodeValues)>,
    /// Index in the photograph.
    index: usize,
    /// Cell of the sphere; see [`Probes::cell_of_pixel`].
    cell: usize,
}

impl Probes {
    /// Reads the shoot's balls.
    ///
    /// # Errors
    /// When the shoot lacks poses, lamps or frames; when a photograph cannot be read, differs in size from the
    /// others, or does not show the ball; when the ball is too small to resolve lamps, or its photographs are
    /// black, clipped or show no lamp.
    pub fn load(project: &Project, progress: &Progress) -> Result<Self> {
        project.check_parts()?;
        let shoot = &project.settings.shoot;
        let size = footage::dimensions(&project.interview_probe_picture())?;
        let ball = MirrorBall::new(&shoot.ball, shoot.ball_dome_radius_m(), size)?;
        let provisional = ResponseTable::from_response(&PROVISIONAL);
        let all = project.probe_pictures();
        let scale = scale(&all, &ball)?;
        let interview = read(&project.interview_probe_picture(), scale)?;
        let paths = &all[1..];
        let (footprints, wrong_circle) = footprints(
            paths,
            (&project.interview_probe_picture(), size),
            (&ball, Circle::from_ball(&shoot.ball)),
            scale,
            progress,
        )?;
        let interview = on_ball(&ball, &codes(&interview));
        let clipped = interview.iter().filter(|code| is_clipped(code)).count();
        let problem = if 10 * clipped > 9 * interview.len() {
            Some((project.interview_probe_picture(), "shows a mirror ball that is clipped everywhere"))
        } else if interview.iter().all(|code| *code == [0; 3]) {
            Some((project.interview_probe_picture(), "shows a mirror ball that is black"))
        } else if footprints.iter().all(|footprint| footprint.pixels.is_empty()) {
            Some((project.lamp_probe_picture(0), "and all other lamps' photographs show no lamp on the mirror ball"))
        } else {
            None
        };
        if let Some((path, problem)) = problem {
            return Err(Error::invalid(
                format!("{} {problem}", path.display()),
                "Check that these are the mirror ball's photographs, and expose them so that the lamps are bright \
                 and everything else is dark",
            ));
        }
        Ok(Self { wrong_circle, scale, ..Self::compare(ball.clone(), footprints, interview, &provisional) })
    }

    fn compare(
        ball: MirrorBall,
        footprints: Vec<Footprint>,
        interview: Vec<CodeValues>,
        provisional: &ResponseTable,
    ) -> Self {
        let lamps = footprints.len().max(1);
        // Cap radius of lamps that share the sphere evenly, limited to the range of sensible rigs.
        let spacing = (1.0 - 2.0 / lamps as f32).acos().to_degrees().clamp(8.0, 60.0);
        let cells = lattice((12 * lamps).clamp(400, 2000));
        let cell_of_pixel = ball
            .pixels
            .par_iter()
            .map(|pixel| {
                let nearness = |i: usize| cells[i].dot(pixel.direction);
                (0..cells.len()).max_by(|&i, &j| nearness(i).total_cmp(&nearness(j))).unwrap_or(0) as u16
            })
            .collect();
        // A Gaussian of half the spacing: the lamps merge just enough to close the gaps.
        let sharpness = (0.5 * spacing).to_radians().powi(-2);
        let blur = (cells.par_iter())
            .flat_map_iter(|a| cells.iter().map(move |b| ((a.dot(*b) - 1.0) * sharpness).exp()))
            .collect();
        let kernel =
            (cells.par_iter()).flat_map_iter(|a| cells.iter().map(move |b| arc_cosine::kernel(a.dot(*b)))).collect();
        let mut comparable: Vec<bool> = interview.iter().map(|code| !is_clipped(code)).collect();
        for (pixel, code) in footprints.iter().flat_map(|f| &f.pixels) {
            comparable[*pixel as usize] &= !is_clipped(code);
        }
        let mut probes = Self {
            ball,
            footprints,
            interview,
            cell_of_pixel,
            blur,
            kernel,
            comparable,
            interview_dark: [0; 3],
            profile: vec![],
            profile_rounding: 0.0,
            wrong_circle: None,
            scale: 1.0,
        };
        probes.interview_dark = probes.find_interview_dark();
        probes.profile = probes.make_profile(provisional);
        probes.profile_rounding = code_values::rounding(probes.profile_codes());
        probes
    }

    /// Warning about the ball's circle.
    pub fn wrong_circle(&self) -> Option<&str> {
        self.wrong_circle.as_deref()
    }

    /// The ball's geometry.
    pub fn ball(&self) -> &MirrorBall {
        &self.ball
    }

    /// Number of pixels with a clipped channel, over all lamps' footprints.
    pub fn clipped_pixels(&self) -> usize {
        self.footprints.iter().map(Footprint::clipped_pixels).sum()
    }

    /// Number of pixels of the interview's ball with a clipped channel.
    pub fn clipped_interview_pixels(&self) -> usize {
        self.interview.iter().filter(|code| is_clipped(code)).count()
    }

    /// Lamps under a response; `names` lists all of them.
    pub fn lamps<'a>(&self, names: impl Iterator<Item = &'a String>, response: &Response) -> Vec<Lamp> {
        self.rig(names, &ResponseTable::from_response(response)).0.lamps
    }

    /// Lamps under a response, and the share of their energy hidden by the ball and filled in.
    pub(super) fn rig<'a>(&self, names: impl Iterator<Item = &'a String>, table: &ResponseTable) -> (Rig, f32) {
        measure(&self.footprints, (&self.ball, self.scale), names, table)
    }
}

/// Number of photographs that together show the ball's rim well enough.
const ENOUGH: usize = 8;

/// Footprints in the lamps' photographs, which must have the reference's size, and the warning about the circle.
///
/// # Errors
/// When the ball is too small to resolve lamps, a photograph cannot be read or differs in size, or the job was
/// stopped.
pub(super) fn footprints(
    pictures: &[Picture],
    (reference, size): (&Picture, (usize, usize)),
    (ball, circle): (&MirrorBall, Circle),
    scale: f32,
    progress: &Progress,
) -> Result<(Vec<Footprint>, Option<String>)> {
    silhouette::large_enough(&circle, &reference.display().to_string())?;
    let provisional = ResponseTable::from_response(&PROVISIONAL);
    let mut grid = Grid::new(ball, size.0, pictures.len());
    let some: Vec<Picture> = (pictures.iter().step_by(pictures.len().div_ceil(ENOUGH).max(1))).cloned().collect();
    // Faults of the photographs are reported below.
    let wrong_circle =
        (Photographs::read(&some, progress).ok()).and_then(|photographs| grid.check_circle(&photographs, &circle));
    let (mut footprints, series): (Vec<_>, Vec<_>) = (pictures.par_iter().enumerate())
        .map(|(lamp, address)| {
            progress.check("nothing was changed")?;
            let picture = read(address, scale)?;
            silhouette::same_size((address.display(), picture.0.size()), (reference.display(), size))?;
            let name = address.file().file_stem().unwrap_or_default().to_string_lossy();
            progress.step("mirror balls", lamp as u64 + 1, pictures.len() as u64, name);
            let photograph = on_ball(ball, &codes(&picture));
            Ok((Footprint::find(&photograph, &provisional), grid.reduce(&photograph, &provisional)))
        })
        .collect::<Result<Vec<_>>>()?
        .into_iter()
        .unzip();
    aim(&mut footprints, &series, &grid, &provisional);
    Ok((footprints, wrong_circle))
}

/// Factor on the light of a ball's photographs: see [`code_values::scale`].
///
/// # Errors
/// When a photograph cannot be read.
pub(super) fn scale(pictures: &[Picture], ball: &MirrorBall) -> Result<f32> {
    code_values::scale(pictures, |picture| {
        let light = footage::read_light(picture, &Response::Srgb)?;
        let pixels = ball.pixels.iter().filter_map(|p| light.pixels.get(p.index));
        Ok(pixels.flatten().copied().fold(0.0, f32::max))
    })
}

/// A photograph of a ball as codes: of `scale` times its light if that is scene-linear.
fn read(picture: &Picture, scale: f32) -> Result<Encoded> {
    if scale == 1.0 {
        return footage::read_picture(picture);
    }
    Ok(encoded(&footage::read_light(picture, &Response::Srgb)?, scale))
}

/// Code values of the ball's pixels.
fn on_ball(ball: &MirrorBall, picture: &[CodeValues]) -> Vec<CodeValues> {
    ball.pixels.iter().map(|p| picture[p.index]).collect()
}

/// Lamps of the footprints under a response, and the share of their energy hidden by the ball and filled in.
pub(super) fn measure<'a>(
    footprints: &[Footprint],
    (ball, scale): (&MirrorBall, f32),
    names: impl Iterator<Item = &'a String>,
    table: &ResponseTable,
) -> (Rig, f32) {
    let mut lamps: Vec<Lamp> = footprints.iter().zip(names).map(|(f, name)| f.lamp(name, ball, table)).collect();
    for lamp in &mut lamps {
        lamp.energy = lamp.energy.map(|energy| energy / scale);
    }
    // A lamp below a thousandth of the median energy counts as not seen, because its weight would amplify the
    // OLAT's noise a thousandfold.
    let faintest = 1e-3 * median(lamps.iter().map(|lamp| luminance(lamp.energy)));
    for lamp in lamps.iter_mut().filter(|lamp| luminance(lamp.energy) < faintest) {
        lamp.confidence = 0.0;
    }
    // The part of a lamp hidden by the cone behind the ball is filled in with the footprint width of lamps in full
    // view: a uniform disc reaches √2 times its root-mean-square radius.
    let cone = ball.blind_half_angle_deg;
    let from_axis = |lamp: &Lamp| lamp.direction.angle_between(Vec3::NEG_Z).to_degrees();
    let is_clear = |lamp: &Lamp| from_axis(lamp) > cone + std::f32::consts::SQRT_2 * lamp.spread_deg;
    let seen = |lamp: &&Lamp| lamp.confidence > 0.0;
    let spread = median(lamps.iter().filter(seen).filter(|l| is_clear(l)).map(|lamp| lamp.spread_deg));
    let radius = std::f32::consts::SQRT_2 * spread;
    let (mut filled, mut all) = (0.0, 0.0);
    for lamp in &mut lamps {
        if lamp.confidence > 0.0 && radius > 0.0 && from_axis(lamp) < cone + radius {
            let [seen, radius, cone] = [from_axis(lamp), radius, cone].map(|a| f64::from(a).to_radians());
            let (angle, visible) = uncover(seen, radius, cone);
            let sideways = lamp.direction.with_z(0.0).normalize_or_zero() * angle.sin() as f32;
            lamp.direction = sideways.with_z(-(angle.cos() as f32)).normalize();
            filled += luminance(lamp.energy) * (1.0 / visible as f32 - 1.0);
            lamp.energy = lamp.energy.map(|e| e / visible as f32);
            lamp.confidence *= visible as f32;
        }
        all += luminance(lamp.energy);
    }
    (Rig { lamps }, if all > 0.0 { filled / all } else { 0.0 })
}

/// `n` directions spread evenly over the sphere (a Fibonacci lattice).
fn lattice(n: usize) -> Vec<Vec3> {
    let golden_angle = std::f32::consts::PI * (3.0 - 5.0f32.sqrt());
    (0..n)
        .map(|i| {
            let y = 1.0 - (2 * i + 1) as f32 / n as f32;
            let (sin, cos) = (i as f32 * golden_angle).sin_cos();
            let radius = (1.0 - y * y).sqrt();
            Vec3::new(radius * cos, y, radius * sin)
        })
        .collect()
}
