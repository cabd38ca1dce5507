//! Reader of interview and exemplar pictures as filmed. It reads while the pane is visible.

use crate::layout::Pane;
use base::error::Result;
use egui::{ColorImage, Context, TextureHandle, TextureOptions};
use imaging::resample::resize_area;
use imaging::{Encoded, Image, Mask};
use project::{Matte, Picture, Project};
use std::collections::{BTreeMap, HashMap};
use std::path::Path;
use worker::{Query, SrgbPicture};

/// Longer sides of a picture and of a thumbnail in pixels: sharp on a screen with two pixels per point.
const PICTURE_PX: usize = 2560;
const THUMBNAIL_PX: usize = 128;
/// Number of a pane's thumbnails kept in memory.
const MOST_THUMBNAILS: usize = 128;
/// Colour of the matte over a picture.
const RED: [f32; 3] = [0.9, 0.1, 0.1];

/// Content of the footage pane.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FootageView {
    pub matte: MatteView,
    /// True for the exemplar, false for the interview.
    pub exemplars: bool,
}

/// Display of the matte.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MatteView {
    #[default]
    Off,
    /// Over the picture: what is removed in red.
    Over,
    /// Instead of the picture.
    Alone,
}

/// A thumbnail of a picture of the shoot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Thumbnail {
    /// A frame of the interview.
    Frame(usize),
    /// A pose under a lamp.
    Olat { pose: usize, lamp: usize },
}

impl Thumbnail {
    /// File of the picture; None if the shoot has none.
    fn picture(self, project: &Project) -> Option<Picture> {
        let shoot = &project.settings.shoot;
        match self {
            Self::Frame(frame) => (frame < shoot.frames.len()).then(|| project.frame_picture(frame)),
            Self::Olat { pose, lamp } => {
                let is_known = pose < shoot.poses.len() && lamp < shoot.lamps.len();
                (is_known && project.has_olat(pose, lamp)).then(|| project.olat_picture(pose, lamp))
            }
        }
    }
}

/// A picture to read, and how to show it.
#[derive(Clone, Debug, PartialEq)]
struct FootageRequest {
    picture: Picture,
    matte: Matte,
    view: MatteView,
}

/// A picture of the shoot.
pub struct FootagePicture {
    /// Columns and rows of the file.
    pub size: (usize, usize),
    pub texture: TextureHandle,
    request: FootageRequest,
}

/// A picture and its file's size.
type SizedPicture = (SrgbPicture, (usize, usize));

/// The pictures, and the queries for them.
#[derive(Default)]
pub struct FootageReader {
    picture: Option<std::result::Result<FootagePicture, String>>,
    pictures: Query<FootageRequest, SizedPicture>,
    thumbnails: BTreeMap<Thumbnail, Option<TextureHandle>>,
    /// The thumbnails that each pane has room for.
    wanted: HashMap<Pane, Vec<Thumbnail>>,
    small: Query<(Thumbnail, Picture), SrgbPicture>,
}

impl FootageReader {
    /// The current picture, or the reason for its absence; None until the first is read.
    pub fn picture(&self) -> Option<&std::result::Result<FootagePicture, String>> {
        self.picture.as_ref()
    }

    /// A thumbnail, once read.
    pub fn thumbnail(&self, of: Thumbnail) -> Option<&TextureHandle> {
        self.thumbnails.get(&of)?.as_ref()
    }

    /// The thumbnails requested by a pane.
    pub fn wanted(&self, pane: Pane) -> &[Thumbnail] {
        self.wanted.get(&pane).map(Vec::as_slice).unwrap_or_default()
    }

    /// Rereads the visible picture, since a job may have made its matte.
    pub fn invalidate(&mut self) {
        self.pictures.forget();
    }

    /// Replaces the thumbnails requested by a pane.
    pub fn want(&mut self, pane: Pane, mut all: Vec<Thumbnail>) {
        all.truncate(MOST_THUMBNAILS);
        self.wanted.insert(pane, all);
        let wanted = &self.wanted;
        self.thumbnails.retain(|one, _| wanted.values().any(|all| all.contains(one)));
    }

    /// Takes in what was read. Call once per frame of the window.
    pub fn receive(&mut self, ctx: &Context) {
        if let Some((request, read)) = self.pictures.answers().last() {
            self.picture = Some(match read {
                Ok((codes, size)) => Ok(FootagePicture { size, texture: texture(ctx, "footage", &codes), request }),
                Err(sentence) => Err(sentence),
            });
        }
        for ((one, _), read) in self.small.answers() {
            if self.wanted.values().any(|all| all.contains(&one)) {
                // An unreadable thumbnail stays dark; the large picture shows the reason.
                let small = read.ok().map(|codes| texture(ctx, "thumbnail", &codes));
                self.thumbnails.insert(one, small);
            }
        }
    }

    /// Reads the pane's picture if its request changed. Call while the pane is visible.
    pub fn ask(
        &mut self,
        project: &Project,
        frame: usize,
        pose: usize,
        view: FootageView,
        wake: impl Fn() + Send + 'static,
    ) {
        let shoot = &project.settings.shoot;
        if shoot.frames.is_empty() || shoot.poses.is_empty() || shoot.lamps.is_empty() {
            return;
        }
        let FootageView { matte: view, exemplars } = view;
        let request = if exemplars {
            let pose = pose.min(shoot.poses.len() - 1);
            FootageRequest { picture: project.first_olat(pose), matte: project.exemplar_matte(pose), view }
        } else {
            let frame = frame.min(shoot.frames.len() - 1);
            FootageRequest { picture: project.frame_picture(frame), matte: project.frame_matte(frame), view }
        };
        self.pictures.ask(request, wake, |_| FootageRequest::read);
    }

    /// Reads one thumbnail requested by one of the panes `shown`, unless one is being read.
    pub fn ask_thumbnails(&mut self, project: &Project, shown: &[Pane], wake: impl Fn() + Send + 'static) {
        let wanted = shown.iter().filter_map(|pane| self.wanted.get(pane));
        let unread = (wanted.flatten().copied()).filter(|one| !self.thumbnails.contains_key(one));
        let mut next = unread.filter_map(|one| Some((one, one.picture(project)?)));
        if !self.small.is_waiting()
            && let Some(next) = next.next()
        {
            let read = |(_, picture): &(Thumbnail, Picture)| thumbnail(picture, THUMBNAIL_PX);
            // It may be the last one again, dropped in the meantime.
            self.small.forget();
            self.small.ask(next, wake, |_| read);
        }
    }
}

impl FootagePicture {
    /// The file to show.
    pub fn file(&self) -> &Path {
        match self.request.view {
            MatteView::Alone => self.request.matte.file(),
            _ => self.request.picture.file(),
        }
    }
}

impl FootageRequest {
    fn read(&self) -> Result<SizedPicture> {
        let reduced = |size| reduced(size, PICTURE_PX);
        match self.view {
            MatteView::Off => {
                let picture = footage::read_picture(&self.picture)?.0;
                Ok((codes(&picture, reduced(picture.size())), picture.size()))
            }
            MatteView::Alone => {
                let matte = footage::read_matte(&self.matte)?;
                let grey = matte.map(|coverage| [coverage; 3]);
                Ok((codes(&grey, reduced(grey.size())), grey.size()))
            }
            MatteView::Over => {
                let picture = footage::read_picture(&self.picture)?.0;
                let (width, height) = reduced(picture.size());
                let matte: Mask = resize_area(&footage::read_matte(&self.matte)?, width, height);
                let mut over: Image = resize_area(&picture, width, height);
                for (pixel, coverage) in over.pixels.iter_mut().zip(&matte.pixels) {
                    for c in 0..3 {
                        pixel[c] += 0.5 * (1.0 - coverage) * (RED[c] - pixel[c]);
                    }
                }
                Ok((SrgbPicture::from_picture(&Encoded(over)), picture.size()))
            }
        }
    }
}

/// A picture whose longer side has at most `longer_px` pixels.
pub fn thumbnail(picture: &Picture, longer_px: usize) -> Result<SrgbPicture> {
    let picture = footage::read_picture(picture)?.0;
    Ok(codes(&picture, reduced(picture.size(), longer_px)))
}

/// Averages of encoded values are close enough for viewing.
fn codes(picture: &Image, (width, height): (usize, usize)) -> SrgbPicture {
    SrgbPicture::from_picture(&Encoded(resize_area(picture, width, height)))
}

/// The size scaled so that the longer side is at most `most` pixels.
pub fn reduced((width, height): (usize, usize), most: usize) -> (usize, usize) {
    let longer = width.max(height);
    let scaled = |length: usize| (length * most / longer).max(1);
    if longer <= most { (width, height) } else { (scaled(width), scaled(height)) }
}

/// A picture on the screen.
pub fn texture(ctx: &Context, name: &str, codes: &SrgbPicture) -> TextureHandle {
    let picture = ColorImage::from_rgb([codes.width, codes.height], &codes.rgb);
    ctx.load_texture(name, picture, TextureOptions::LINEAR)
}
