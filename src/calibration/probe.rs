//! The mirror balls of a shoot: one under each lamp, one under the interview's light. All were taken
//! by one camera at one exposure, so that pixel for pixel the interview's ball is a sum of the lamps'.

use super::PROVISIONAL;
use super::blind_cone::uncover;
use super::code::{Code, STEPS, Table, codes};
use super::footprint::Footprint;
use super::least_squares::NormalEquations;
use super::mirror_ball::MirrorBall;
use super::silhouette::LEAST_RADIUS_PX;
use crate::error::{Error, Result};
use crate::imaging::{Response, color::luminance, file};
use crate::light::{Lamp, Rig};
use crate::progress::Progress;
use crate::project::Project;
use glam::Vec3;
use rayon::prelude::*;

/// All ball photographs as codes, so that any response can be tried in milliseconds.
pub struct Probes {
    ball: MirrorBall,
    footprints: Vec<Footprint>,
    /// The interview's ball: one code per pixel of the ball.
    interview: Vec<Code>,
    /// For each pixel of the ball, the nearest of the directions spread evenly over the sphere at which
    /// the balls are compared.
    cell_of_pixel: Vec<u16>,
    /// The blur of that comparison: weights between all pairs of cells.
    blur: Vec<f32>,
    /// Pixels of the ball that are clipped in no photograph. Only these are compared: so a clipped lamp
    /// is missing the same part in both, and its weight stays right.
    comparable: Vec<bool>,
    /// Median code of the interview's ball where no lamp is, black where lamps are everywhere.
    interview_dark: Code,
    profile: Vec<ProfilePixel>,
}

/// A pixel of the interview's ball beside the same pixel under each lamp that reaches it.
struct ProfilePixel {
    interview: Code,
    lamps: Vec<(usize, Code)>,
    /// The brightest of these lamps here.
    strongest: usize,
    /// Its place in the photograph.
    index: usize,
}

/// The interview's ball compared with the lamps' pixel by pixel.
pub(super) struct Profile {
    /// For each lamp, the sum of squared encoded distances where it is the strongest.
    pub squares: Vec<f64>,
    /// Mean square of the part of these distances that changes from pixel to pixel: noise, where the
    /// rest is a misfit that neighbours share.
    pub noise: f64,
    /// The weights that explain the pixels best. They are not those of [`Probes::fit`], which sees the
    /// lamps' whole light, but under the right response both agree.
    pub weights: Vec<[f32; 3]>,
}

/// The interview's light in terms of the lamps.
pub struct InterviewFit {
    /// For each lamp and channel, its share.
    pub weights: Vec<[f32; 3]>,
    /// Relative root-mean-square residual of the blurred ball.
    pub residual: f32,
    /// Share of the ball's luminance energy that no lamp explains.
    pub uncovered: f32,
}

impl Probes {
    /// Reads the shoot's balls.
    ///
    /// # Errors
    /// When a photograph cannot be read, differs in size from the others, or does not show the ball; when
    /// the ball is too small to tell lamps apart, or its photographs show no lamp, or light alone.
    pub fn load(project: &Project, progress: &Progress) -> Result<Self> {
        let shoot = &project.settings.shoot;
        let interview = file::read_encoded(&project.interview_probe_path())?;
        let size = interview.0.size();
        let ball = MirrorBall::new(&shoot.ball, shoot.dome_radius_m, size)?;
        let provisional = Table::of(&PROVISIONAL);
        if f64::from(shoot.ball.radius_px) < LEAST_RADIUS_PX {
            return Err(Error::unexpected(
                project.interview_probe_path().display(),
                format!("a mirror ball of at least {LEAST_RADIUS_PX} pixels in radius"),
                format!("one of {:.1} pixels", shoot.ball.radius_px),
                "Give the ball's circle, or photograph it from nearer or through a longer lens",
            ));
        }
        let on_ball = |picture: &[Code]| -> Vec<Code> {
            ball.pixels.iter().map(|p| picture[p.index]).collect()
        };
        let total = shoot.all_lamps().len();
        let footprints = (0..total)
            .into_par_iter()
            .map(|lamp| {
                progress.check("nothing was changed")?;
                let path = project.lamp_probe_path(lamp);
                let picture = file::read_encoded(&path)?;
                if picture.0.size() != size {
                    return Err(Error::unexpected(
                        path.display(),
                        format!("{}×{} pixels as in the interview's probe", size.0, size.1),
                        format!("{}×{}", picture.0.width, picture.0.height),
                        "Give all mirror-ball photographs from the same camera, uncropped",
                    ));
                }
                progress.step(
                    "mirror balls",
                    lamp as u64 + 1,
                    total as u64,
                    shoot.lamp(lamp).clone(),
                );
                Ok(Footprint::find(&on_ball(&codes(&picture)), &provisional))
            })
            .collect::<Result<Vec<_>>>()?;
        let interview = on_ball(&codes(&interview));
        let is_clipped = |code: &&Code| Footprint::is_clipped(code);
        let clipped = interview.iter().filter(is_clipped).count();
        let found = if 10 * clipped > 9 * interview.len() {
            Some((
                project.interview_probe_path(),
                "a ball that is clipped to white",
            ))
        } else if interview.iter().all(|code| *code == [0; 3]) {
            Some((project.interview_probe_path(), "a ball that is black"))
        } else if footprints
            .iter()
            .all(|footprint| footprint.pixels.is_empty())
        {
            Some((
                project.lamp_probe_path(0),
                "none there, nor in any other lamp's photograph",
            ))
        } else {
            None
        };
        if let Some((path, found)) = found {
            return Err(Error::unexpected(
                path.display(),
                "images of lamps on a mirror ball",
                found,
                "Check that these are the mirror ball's photographs, and expose them so that lamps are bright and \
                 the rest is dark",
            ));
        }
        Ok(Self::compare(
            ball.clone(),
            footprints,
            interview,
            &provisional,
        ))
    }

    fn compare(
        ball: MirrorBall,
        footprints: Vec<Footprint>,
        interview: Vec<Code>,
        provisional: &Table,
    ) -> Self {
        let lamps = footprints.len().max(1);
        // Radius of a cap when the lamps share the sphere evenly, within what a rig can sensibly have.
        let spacing = (1.0 - 2.0 / lamps as f32)
            .acos()
            .to_degrees()
            .clamp(8.0, 60.0);
        let cells = lattice((12 * lamps).clamp(400, 2000));
        let cell_of_pixel = ball
            .pixels
            .par_iter()
            .map(|pixel| {
                let nearness = |i: usize| cells[i].dot(pixel.direction);
                (0..cells.len())
                    .max_by(|&i, &j| nearness(i).total_cmp(&nearness(j)))
                    .unwrap_or(0) as u16
            })
            .collect();
        // A Gaussian of half the spacing: the rig's lamps melt together just so far that gaps close.
        let sharpness = (0.5 * spacing).to_radians().powi(-2);
        let blur = (cells.par_iter())
            .flat_map_iter(|a| {
                cells
                    .iter()
                    .map(move |b| ((a.dot(*b) - 1.0) * sharpness).exp())
            })
            .collect();
        let mut comparable: Vec<bool> = interview
            .iter()
            .map(|code| !Footprint::is_clipped(code))
            .collect();
        for (pixel, code) in footprints.iter().flat_map(|f| &f.pixels) {
            comparable[*pixel as usize] &= !Footprint::is_clipped(code);
        }
        let mut probes = Self {
            ball,
            footprints,
            interview,
            cell_of_pixel,
            blur,
            comparable,
            interview_dark: [0; 3],
            profile: vec![],
        };
        probes.interview_dark = probes.find_interview_dark();
        probes.profile = probes.make_profile(provisional);
        probes
    }

    /// The ball's geometry.
    pub fn ball(&self) -> &MirrorBall {
        &self.ball
    }

    /// Pixels with a clipped channel, over all lamps' footprints.
    pub fn clipped_pixels(&self) -> usize {
        self.footprints.iter().map(Footprint::clipped_pixels).sum()
    }

    /// Pixels of the interview's ball with a clipped channel.
    pub fn clipped_interview_pixels(&self) -> usize {
        self.interview
            .iter()
            .filter(|code| Footprint::is_clipped(code))
            .count()
    }

    /// The lamps under a response; `names` are those of all.
    pub fn lamps<'a>(
        &self,
        names: impl Iterator<Item = &'a String>,
        response: &Response,
    ) -> Vec<Lamp> {
        self.rig(names, &Table::of(response)).0.lamps
    }

    /// The lamps under a response, and the share of their energy that the ball hides and was filled in.
    pub(super) fn rig<'a>(
        &self,
        names: impl Iterator<Item = &'a String>,
        table: &Table,
    ) -> (Rig, f32) {
        let mut lamps: Vec<Lamp> = self
            .footprints
            .iter()
            .zip(names)
            .map(|(f, name)| f.lamp(name, &self.ball, table))
            .collect();
        // A lamp of less than a thousandth of the median's energy counts as not seen: its weight would
        // amplify the OLAT's noise a thousandfold.
        let faintest = 1e-3 * median(lamps.iter().map(|lamp| luminance(lamp.energy)));
        for lamp in lamps
            .iter_mut()
            .filter(|lamp| luminance(lamp.energy) < faintest)
        {
            lamp.confidence = 0.0;
        }
        // What the cone behind the ball hides of a lamp is filled in as if its footprint were as wide as
        // those of the lamps in full view: an even disc reaches √2 times its root-mean-square radius.
        let cone = self.ball.blind_half_angle_deg;
        let from_axis = |lamp: &Lamp| lamp.direction.angle_between(Vec3::NEG_Z).to_degrees();
        let is_clear =
            |lamp: &Lamp| from_axis(lamp) > cone + std::f32::consts::SQRT_2 * lamp.spread_deg;
        let seen = |lamp: &&Lamp| lamp.confidence > 0.0;
        let spread = median(
            lamps
                .iter()
                .filter(seen)
                .filter(|l| is_clear(l))
                .map(|lamp| lamp.spread_deg),
        );
        let radius = std::f32::consts::SQRT_2 * spread;
        let (mut filled, mut all) = (0.0, 0.0);
        for lamp in &mut lamps {
            if lamp.confidence > 0.0 && radius > 0.0 && from_axis(lamp) < cone + radius {
                let [seen, radius, cone] =
                    [from_axis(lamp), radius, cone].map(|a| f64::from(a).to_radians());
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

    /// Light that is on every ball whatever the lamp: the room's own, and the sensor's floor.
    fn ambient(&self, table: &Table) -> [f32; 3] {
        let backgrounds: Vec<[f32; 3]> = self
            .footprints
            .iter()
            .map(|f| f.background(table))
            .collect();
        [0, 1, 2].map(|c| median(backgrounds.iter().map(|b| b[c])))
    }

    /// Light on the interview's ball that is no lamp's image. What is dark under single lamps is the
    /// room's own light, which stays as it is, or the lamps' stray light, which adds up; how dark the
    /// interview's ball is between the lamps tells which. More than the stray light of all is light of
    /// its own, from where no lamp is.
    fn interview_ambient(&self, table: &Table) -> [f32; 3] {
        let ambient = self.ambient(table);
        let dark = table.rgb(self.interview_dark);
        let mut energy = [0.0f64; 3];
        for footprint in &self.footprints {
            let background = footprint.background(table);
            for (pixel, code) in &footprint.pixels {
                let light = table.rgb(*code);
                let solid_angle = self.ball.pixels[*pixel as usize].solid_angle;
                for c in 0..3 {
                    energy[c] += f64::from((light[c] - background[c]).max(0.0) * solid_angle);
                }
            }
        }
        let mut interview = [0.0f64; 3];
        for (pixel, code) in self.ball.pixels.iter().zip(&self.interview) {
            let light = table.rgb(*code);
            for c in 0..3 {
                interview[c] += f64::from((light[c] - ambient[c]).max(0.0) * pixel.solid_angle);
            }
        }
        [0, 1, 2].map(|c| {
            // The sum of the weights, as if all lamps were alike.
            let weights = if energy[c] > 0.0 {
                (interview[c] / energy[c]) as f32 * self.footprints.len() as f32
            } else {
                1.0
            };
            dark[c].clamp(ambient[c], ambient[c] * weights.max(1.0))
        })
    }

    fn find_interview_dark(&self) -> Code {
        let mut is_lit = vec![false; self.interview.len()];
        for (pixel, _) in self.footprints.iter().flat_map(|f| &f.pixels) {
            is_lit[*pixel as usize] = true;
        }
        [0, 1, 2].map(|c| {
            let dark = self.interview.iter().zip(&is_lit).filter(|(_, lit)| !**lit);
            let mut codes: Vec<u16> = dark.map(|(code, _)| code[c]).collect();
            codes.sort_unstable();
            codes.get(codes.len() / 2).copied().unwrap_or(0)
        })
    }

    /// The interview's light as a sum of lamps under a response: non-negative least squares of the
    /// interview's ball by the lamps' balls, per channel, both blurred to half the lamps' spacing.
    pub(super) fn fit(&self, table: &Table) -> InterviewFit {
        let n = self.blur.len().isqrt();
        let blurred = |energy: &[[f32; 3]]| -> Vec<[f32; 3]> {
            let lit: Vec<usize> = (0..n).filter(|&i| energy[i] != [0.0; 3]).collect();
            let at = |cell: usize| {
                lit.iter().fold([0.0f32; 3], |sum, &from| {
                    let k = self.blur[cell * n + from];
                    [0, 1, 2].map(|c| sum[c] + k * energy[from][c])
                })
            };
            (0..n).map(at).collect()
        };
        let mut seen = vec![[0.0f32; 3]; n];
        let ambient = self.interview_ambient(table);
        for (pixel, code) in self
            .interview
            .iter()
            .enumerate()
            .filter(|(pixel, _)| self.comparable[*pixel])
        {
            let (cell, light) = (
                &mut seen[usize::from(self.cell_of_pixel[pixel])],
                table.rgb(*code),
            );
            for c in 0..3 {
                cell[c] += (light[c] - ambient[c]) * self.ball.pixels[pixel].solid_angle;
            }
        }
        let seen: Vec<[f32; 3]> = blurred(&seen)
            .into_iter()
            .map(|e| e.map(|v| v.max(0.0)))
            .collect();
        let lamps: Vec<Vec<[f32; 3]>> = self
            .footprints
            .par_iter()
            .map(|footprint| {
                let background = footprint.background(table);
                let mut energy = vec![[0.0f32; 3]; n];
                for (pixel, code) in footprint
                    .pixels
                    .iter()
                    .filter(|(p, _)| self.comparable[*p as usize])
                {
                    let place = *pixel as usize;
                    let (cell, light) = (
                        &mut energy[usize::from(self.cell_of_pixel[place])],
                        table.rgb(*code),
                    );
                    for c in 0..3 {
                        cell[c] += (light[c] - background[c]).max(0.0)
                            * self.ball.pixels[place].solid_angle;
                    }
                }
                blurred(&energy)
            })
            .collect();
        let mut weights = vec![[0.0f32; 3]; lamps.len()];
        let (mut error, mut power) = (0.0f64, 0.0f64);
        let mut missing = [0.0f32; 3];
        let mut all = [0.0f32; 3];
        for c in 0..3 {
            let mut equations = NormalEquations::new(lamps.len());
            for cell in 0..n {
                let terms: Vec<(usize, f64)> = lamps
                    .iter()
                    .enumerate()
                    .filter(|(_, lamp)| lamp[cell][c] > 0.0)
                    .map(|(i, lamp)| (i, f64::from(lamp[cell][c])))
                    .collect();
                equations.add(&terms, f64::from(seen[cell][c]));
            }
            let solution = equations.solve();
            for (weight, x) in weights.iter_mut().zip(&solution) {
                weight[c] = *x as f32;
            }
            for cell in 0..n {
                let explained: f32 = lamps
                    .iter()
                    .zip(&weights)
                    .map(|(lamp, w)| w[c] * lamp[cell][c])
                    .sum();
                let left = seen[cell][c] - explained;
                error += f64::from(left).powi(2);
                power += f64::from(seen[cell][c]).powi(2);
                missing[c] += left.max(0.0);
                all[c] += seen[cell][c];
            }
        }
        let share = |part: f64, whole: f64| {
            if whole > 0.0 {
                (part / whole) as f32
            } else {
                0.0
            }
        };
        InterviewFit {
            weights,
            residual: share(error, power).sqrt(),
            uncovered: share(f64::from(luminance(missing)), f64::from(luminance(all))).min(1.0),
        }
    }

    /// Squared distance in encoded values between the interview's ball and the best sum of the lamps'
    /// balls, pixel for pixel, as the mean over channels: one sum for the pixels in which each lamp is
    /// the strongest, and the weights of that sum. A lamp's image has bright and dim pixels, and each lamp has
    /// another weight: only the right shape of the response makes all of them proportional. What it
    /// cannot tell is a power of the response, because that is a response too, with powers of the
    /// weights.
    pub(super) fn profile(&self, table: &Table) -> Profile {
        let backgrounds: Vec<[f32; 3]> = self
            .footprints
            .iter()
            .map(|f| f.background(table))
            .collect();
        let channels: Vec<(Vec<f64>, f64, Vec<f64>)> = (0..3usize)
            .into_par_iter()
            .map(|c| {
                let light = |&(lamp, code): &(usize, Code)| {
                    (
                        lamp,
                        f64::from((table.light(code[c]) - backgrounds[lamp][c]).max(0.0)),
                    )
                };
                // The last unknown is the room's own light during the interview.
                let constant = self.footprints.len();
                let mut equations = NormalEquations::new(constant + 1);
                let mut terms = Vec::new();
                for pixel in &self.profile {
                    // Errors are alike in the code, so light is divided by the slope there.
                    let certainty = 1.0 / f64::from(table.slope(pixel.interview[c]));
                    terms.clear();
                    terms.extend(
                        pixel
                            .lamps
                            .iter()
                            .map(light)
                            .map(|(lamp, l)| (lamp, l * certainty)),
                    );
                    terms.push((constant, certainty));
                    equations.add(
                        &terms,
                        f64::from(table.light(pixel.interview[c])) * certainty,
                    );
                }
                let x = equations.solve();
                let mut squares = vec![0.0; constant];
                let mut differences = NeighbourDifferences::default();
                for pixel in &self.profile {
                    let sum: f64 = pixel
                        .lamps
                        .iter()
                        .map(light)
                        .map(|(lamp, l)| x[lamp] * l)
                        .sum();
                    let code = f32::from(pixel.interview[c]) / f32::from(STEPS);
                    let off = f64::from(table.encode((sum + x[constant]) as f32) - code);
                    squares[pixel.strongest] += off.powi(2) / 3.0;
                    differences.add(pixel.index, off);
                }
                (squares, differences.noise(), x)
            })
            .collect();
        let lamps = 0..self.footprints.len();
        Profile {
            squares: lamps
                .clone()
                .map(|lamp| channels.iter().map(|(squares, ..)| squares[lamp]).sum())
                .collect(),
            noise: channels.iter().map(|(_, noise, _)| noise).sum::<f64>() / 3.0,
            weights: lamps
                .map(|lamp| [0, 1, 2].map(|c| channels[c].2[lamp] as f32))
                .collect(),
        }
    }

    /// How many pixels [`Self::profile`] compares.
    pub(super) fn profile_pixels(&self) -> usize {
        self.profile.len()
    }

    /// The codes that [`Self::profile`] compares, of the lamps' balls and of the interview's.
    pub(super) fn profile_codes(&self) -> impl Iterator<Item = &Code> {
        self.profile.iter().flat_map(|pixel| {
            let lamps = pixel.lamps.iter().map(|(_, code)| code);
            lamps.chain(std::iter::once(&pixel.interview))
        })
    }

    fn make_profile(&self, provisional: &Table) -> Vec<ProfilePixel> {
        /// Enough pixels to tell a response; more only take time.
        const ENOUGH: usize = 16_384;
        /// A pixel counts from this many times the room's own light: nearer to it, the sensor's noise
        /// and what every lamp's footprint leaves out bend the curve.
        const LIT: f32 = 10.0;
        let mut lamps: Vec<Vec<(usize, Code)>> = vec![vec![]; self.interview.len()];
        for (lamp, footprint) in self.footprints.iter().enumerate() {
            for (pixel, code) in &footprint.pixels {
                lamps[*pixel as usize].push((lamp, *code));
            }
        }
        let ambient = self.ambient(provisional);
        let lit = |code: &Code| (0..3).all(|c| provisional.light(code[c]) > LIT * ambient[c]);
        let profile: Vec<ProfilePixel> = self
            .interview
            .iter()
            .zip(lamps)
            .zip(&self.comparable)
            .zip(&self.ball.pixels)
            .filter(|(((code, lamps), comparable), _)| {
                !lamps.is_empty() && lit(code) && **comparable
            })
            .map(|(((code, lamps), _), place)| {
                let level = |codes: &Code| provisional.rgb(*codes).into_iter().sum::<f32>();
                let brighter =
                    |a: &&(usize, Code), b: &&(usize, Code)| level(&a.1).total_cmp(&level(&b.1));
                ProfilePixel {
                    interview: *code,
                    index: place.index,
                    strongest: lamps.iter().max_by(brighter).map_or(0, |(lamp, _)| *lamp),
                    lamps,
                }
            })
            .collect();
        let stride = profile.len().div_ceil(ENOUGH).max(1);
        // Two neighbours at a time, for the noise.
        profile
            .into_iter()
            .enumerate()
            .filter(|(i, _)| (i / 2) % stride == 0)
            .map(|(_, pixel)| pixel)
            .collect()
    }
}

/// The noise in a series of errors, from neighbours in one row: half the mean square of their
/// differences (von Neumann 1941).
#[derive(Default)]
pub(super) struct NeighbourDifferences {
    last: Option<(usize, f64)>,
    square: f64,
    count: f64,
}

impl NeighbourDifferences {
    /// The next error, at a place counted along the rows.
    pub fn add(&mut self, place: usize, error: f64) {
        if let Some((_, last)) = self.last.filter(|(last, _)| last + 1 == place) {
            self.square += 0.5 * (error - last).powi(2);
            self.count += 1.0;
        }
        self.last = Some((place, error));
    }

    /// Mean square of the noise; 0 where no two places were neighbours.
    pub fn noise(&self) -> f64 {
        self.square / self.count.max(1.0)
    }
}

/// The middle one of some values; 0 of none.
fn median(values: impl Iterator<Item = f32>) -> f32 {
    let mut values: Vec<f32> = values.collect();
    values.sort_by(f32::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// `n` directions spread evenly over the sphere: a Fibonacci lattice.
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
