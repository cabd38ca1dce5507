//! One pose of the OLAT session.

use super::frame::load_mask;
use super::framed::{dimensions, read_framed_light, read_mask};
use super::missing_olats::{self, MissingOlat, add};
use super::motion::Correction;
use base::error::Result;
use imaging::resample::resize_area;
use imaging::{Image, Mask, Response};
use project::{Picture, Project};
use rayon::prelude::*;

/// An exemplar of the reflectance field: a pose under each single lamp, linear, at the working size.
#[derive(Clone, Debug)]
pub struct Exemplar {
    /// Index in the project, from 0.
    pub pose: usize,
    /// One linear picture per learnt lamp, in the OLAT session's units.
    pub olats: Vec<Image>,
    /// Lamps whose OLATs the pose lacks: theirs are sums of others.
    pub missing: Vec<usize>,
    /// Coverage of the subject.
    pub mask: Mask,
}

impl Exemplar {
    /// Reads pose `pose` of the project, linearised by `response` and corrected for the motion measured by the
    /// project's calibration.
    pub fn load(project: &Project, response: &Response, pose: usize) -> Result<Self> {
        let reader = OlatReader::new(project, response, pose)?;
        let lamps = project.settings.shoot.lamps.len();
        let olats = (0..lamps).into_par_iter().map(|lamp| reader.read(lamp)).collect::<Result<_>>()?;
        let missing = (0..lamps).filter(|&lamp| !project.has_olat(pose, lamp)).collect();
        Ok(Self { pose, olats, missing, mask: load_mask(project, &project.exemplar_matte(pose))? })
    }

    /// Reads every pose of the project.
    pub fn load_all(project: &Project, response: &Response) -> Result<Vec<Self>> {
        (0..project.settings.shoot.poses.len()).map(|p| Self::load(project, response, p)).collect()
    }

    /// The pose as a sum of its learnt lamps: Σ weights_i · OLAT_i.
    pub fn relit(&self, weights: &[[f32; 3]]) -> Image {
        let mut sum = Image::filled(self.mask.width, self.mask.height, [0.0; 3]);
        for (olat, &weight) in self.olats.iter().zip(weights) {
            add(&mut sum, olat, weight);
        }
        sum
    }

    /// The pose as a sum of all lamps of the shoot, with a weight for each. Reads the OLATs of lamps that the
    /// network does not learn, linearised by `response`, a few at a time.
    ///
    /// # Errors
    /// When one of these OLATs cannot be read.
    pub fn relit_by_all(&self, project: &Project, response: &Response, weights: &[[f32; 3]]) -> Result<Image> {
        const AT_A_TIME: usize = 16;
        let mut sum = self.relit(weights);
        let reader = OlatReader::new(project, response, self.pose)?;
        let others: Vec<usize> = (self.olats.len()..weights.len()).collect();
        for some in others.chunks(AT_A_TIME) {
            let olats = some.par_iter().map(|&lamp| reader.read(lamp)).collect::<Result<Vec<_>>>()?;
            for (olat, &lamp) in olats.iter().zip(some) {
                add(&mut sum, olat, weights[lamp]);
            }
        }
        Ok(sum)
    }
}

/// All source pictures of the project's exemplars: mattes, and OLATs of all lamps of the shoot.
pub fn exemplar_sources(project: &Project) -> Vec<Picture> {
    let shoot = &project.settings.shoot;
    let pose = |pose: usize| {
        let olats = project.pose_lamps(pose).into_iter();
        let matte = project.exemplar_matte(pose).picture().clone();
        std::iter::once(matte).chain(olats.map(move |lamp| project.olat_picture(pose, lamp)))
    };
    (0..shoot.poses.len()).flat_map(pose).collect()
}

/// Reader of the OLATs of one pose.
pub struct OlatReader<'a> {
    project: &'a Project,
    response: &'a Response,
    pose: usize,
    correction: Option<Correction>,
    missing: Vec<MissingOlat>,
}

impl<'a> OlatReader<'a> {
    /// A reader of pose `pose`. OLATs are linearised by `response` and corrected for the motion measured by the
    /// project's calibration.
    ///
    /// # Errors
    /// When the calibration or the pose's matte cannot be read, or a picture that stands in for a missing one.
    pub fn new(project: &'a Project, response: &'a Response, pose: usize) -> Result<Self> {
        let correction = Correction::new(project, pose)?;
        let missing = missing_olats::find(project, response, pose)?;
        Ok(Self { project, response, pose, correction, missing })
    }

    /// OLAT of lamp `lamp` among all lamps of the shoot, linear, at the working size: a sum of others if the pose lacks it.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn read(&self, lamp: usize) -> Result<Image> {
        self.read_at(lamp, self.project.settings.size)
    }

    /// The OLAT at `side` × `side` pixels.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn read_at(&self, lamp: usize, side: usize) -> Result<Image> {
        if let Some(missing) = self.missing.iter().find(|missing| missing.lamp == lamp) {
            let mut sum = Image::filled(side, side, [0.0; 3]);
            for &(other, weight) in &missing.weights {
                add(&mut sum, &self.read_at(other, side)?, weight);
            }
            return Ok(sum);
        }
        let settings = &self.project.settings;
        let picture = self.project.olat_picture(self.pose, lamp);
        let mut linear = read_framed_light(&picture, &settings.framing, self.response)?;
        if let Some(correction) = &self.correction {
            linear = correction.still(&linear, settings.shoot.lamp(lamp));
        }
        Ok(resize_area(&linear, side, side))
    }

    /// Side of the pose's square at full size in pixels.
    ///
    /// # Errors
    /// When the first OLAT cannot be read.
    pub fn side(&self) -> Result<usize> {
        let size = dimensions(&self.project.first_olat(self.pose))?;
        Ok(self.project.settings.framing.for_size(size).side)
    }

    /// Coverage of the subject at `side` × `side` pixels.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn mask_at(&self, side: usize) -> Result<Mask> {
        let matte = self.project.exemplar_matte(self.pose);
        Ok(resize_area(&read_mask(&matte, &self.project.settings.framing)?, side, side))
    }
}
