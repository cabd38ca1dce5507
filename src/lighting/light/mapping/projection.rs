//! Projection of one picture of the sphere: pixel places to directions and back.

use super::disc::Disc;
use crate::latlong::texel_solid_angle;
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// A picture of the sphere of `width × height` pixels. Places count from its top left corner.
#[derive(Clone, Debug)]
pub struct Projection {
    pub width: usize,
    pub height: usize,
    pub kind: Kind,
}

#[derive(Clone, Copy, Debug)]
pub enum Kind {
    LatLong,
    /// The faces of a cube, of `edge × edge` pixels.
    Cube(&'static [Face; 6], usize),
    Disc(Disc),
}

/// One face of an unfolded cube.
#[derive(Debug)]
pub struct Face {
    /// Column and row of its cell.
    cell: (u8, u8),
    /// Direction at its middle.
    ahead: DVec3,
    /// Direction of the picture's right.
    right: DVec3,
    /// Direction of the picture's top.
    up: DVec3,
}

const fn face(column: u8, row: u8, [ahead, right, up]: [DVec3; 3]) -> Face {
    Face { cell: (column, row), ahead, right, up }
}

/// Six views from within, around the one ahead.
pub(super) const CROSS: [Face; 6] = [
    face(1, 0, [DVec3::Y, DVec3::X, DVec3::Z]),
    face(0, 1, [DVec3::NEG_X, DVec3::NEG_Z, DVec3::Y]),
    face(1, 1, [DVec3::NEG_Z, DVec3::X, DVec3::Y]),
    face(2, 1, [DVec3::X, DVec3::Z, DVec3::Y]),
    face(3, 1, [DVec3::Z, DVec3::NEG_X, DVec3::Y]),
    face(1, 2, [DVec3::NEG_Y, DVec3::X, DVec3::NEG_Z]),
];

/// The OpenGL 4.6 specification's table 8.19, with s_c to the right and t_c down.
pub(super) const STRIP: [Face; 6] = [
    face(0, 0, [DVec3::X, DVec3::NEG_Z, DVec3::Y]),
    face(1, 0, [DVec3::NEG_X, DVec3::Z, DVec3::Y]),
    face(2, 0, [DVec3::Y, DVec3::X, DVec3::NEG_Z]),
    face(3, 0, [DVec3::NEG_Y, DVec3::X, DVec3::Z]),
    face(4, 0, [DVec3::Z, DVec3::X, DVec3::Y]),
    face(5, 0, [DVec3::NEG_Z, DVec3::NEG_X, DVec3::Y]),
];

impl Face {
    /// Direction, not of unit length, at the place (x, y) in pixels on the plane of this face of `edge` pixels.
    fn look(&self, x: f64, y: f64, edge: f64) -> DVec3 {
        let right = 2.0 * (x / edge - f64::from(self.cell.0)) - 1.0;
        let up = 1.0 - 2.0 * (y / edge - f64::from(self.cell.1));
        self.ahead + right * self.right + up * self.up
    }
}

impl Projection {
    /// Unit direction at the place (x, y) in pixels, and steradians per square pixel there; `None` if the picture
    /// shows nothing there.
    pub fn look(&self, x: f64, y: f64) -> Option<(DVec3, f64)> {
        match &self.kind {
            Kind::LatLong => {
                let (width, height) = (self.width as f64, self.height as f64);
                let (sin, cos) = (PI * y / height).sin_cos();
                let (across, ahead) = (TAU * (x / width - 0.5)).sin_cos();
                let density = TAU * PI * sin.abs() / (width * height);
                Some((DVec3::new(sin * across, cos, -sin * ahead), density))
            }
            Kind::Cube(faces, edge) => {
                let face = self.face_at(faces, *edge, x, y)?;
                let edge = *edge as f64;
                let direction = face.look(x, y, edge);
                let length = direction.length();
                Some((direction / length, (2.0 / edge).powi(2) / (length * length * length)))
            }
            Kind::Disc(disc) => disc.look(x, y, false),
        }
    }

    /// Face whose cell contains the place (x, y) in pixels.
    fn face_at(&self, faces: &'static [Face; 6], edge: usize, x: f64, y: f64) -> Option<&'static Face> {
        let cell = |p: f64, end: usize| (p.min(end as f64 - 1e-9) / edge as f64).floor();
        let (column, row) = (cell(x, self.width), cell(y, self.height));
        faces.iter().find(|f| (f64::from(f.cell.0), f64::from(f.cell.1)) == (column, row))
    }

    /// Place (x, y) in pixels of a unit direction; `None` if the picture does not show it.
    pub fn place(&self, direction: DVec3) -> Option<(f64, f64)> {
        match &self.kind {
            Kind::LatLong => {
                let theta = direction.x.hypot(direction.z).atan2(direction.y);
                let u = 0.5 + direction.x.atan2(-direction.z) / TAU;
                let u = if u >= 1.0 { u - 1.0 } else { u };
                Some((u * self.width as f64, theta / PI * self.height as f64))
            }
            Kind::Cube(faces, edge) => {
                let edge = *edge as f64;
                let face = faces.iter().max_by(|a, b| a.ahead.dot(direction).total_cmp(&b.ahead.dot(direction)))?;
                let along = |axis: DVec3| axis.dot(direction) / face.ahead.dot(direction);
                // A place on a face's far edge would fall into the next cell.
                let inside = |p: f64| (0.5 + 0.5 * p).clamp(0.0, 1.0 - 1e-9);
                Some((
                    edge * (f64::from(face.cell.0) + inside(along(face.right))),
                    edge * (f64::from(face.cell.1) + inside(-along(face.up))),
                ))
            }
            Kind::Disc(disc) => disc.place(direction),
        }
    }

    /// Index of the pixel that contains a place.
    pub fn pixel(&self, (x, y): (f64, f64)) -> usize {
        let column = (x as usize).min(self.width - 1);
        (y as usize).min(self.height - 1) * self.width + column
    }

    /// The four pixels around a place and their bilinear weights. Across a border these are the pixels that
    /// continue the picture: beyond the seam, a pole, a cube's edge, an angular map's rim.
    pub fn neighbours(&self, x: f64, y: f64) -> [(Option<usize>, f32); 4] {
        let (left, top) = ((x - 0.5).floor(), (y - 0.5).floor());
        let (fx, fy) = ((x - 0.5 - left) as f32, (y - 0.5 - top) as f32);
        let (left, top) = (left as i64, top as i64);
        if self.is_interior(left, top) {
            let first = top as usize * self.width + left as usize;
            return [
                (Some(first), (1.0 - fx) * (1.0 - fy)),
                (Some(first + 1), fx * (1.0 - fy)),
                (Some(first + self.width), (1.0 - fx) * fy),
                (Some(first + self.width + 1), fx * fy),
            ];
        }
        let at = |dx: i64, dy: i64| self.continued(left + dx, top + dy, x, y);
        [
            (at(0, 0), (1.0 - fx) * (1.0 - fy)),
            (at(1, 0), fx * (1.0 - fy)),
            (at(0, 1), (1.0 - fx) * fy),
            (at(1, 1), fx * fy),
        ]
    }

    /// True if this pixel, which shows something, and those right of and below it lie within the picture and its
    /// borders.
    fn is_interior(&self, column: i64, row: i64) -> bool {
        if column < 0 || row < 0 || column + 1 >= self.width as i64 || row + 1 >= self.height as i64 {
            return false;
        }
        match &self.kind {
            Kind::LatLong => true,
            Kind::Cube(_, edge) => {
                let edge = *edge as i64;
                (column + 1) % edge != 0 && (row + 1) % edge != 0
            }
            Kind::Disc(disc) => {
                let off = |p: i64, centre: f64| (p as f64 + 1.0 - centre).abs() + 0.5;
                let (dx, dy) = (off(column, disc.centre[0]), off(row, disc.centre[1]));
                dx * dx + dy * dy <= disc.radius * disc.radius
            }
        }
    }

    /// Index of the pixel (column, row) seen from the place (x, y), possibly across a border.
    fn continued(&self, column: i64, row: i64, x: f64, y: f64) -> Option<usize> {
        let (width, height) = (self.width as i64, self.height as i64);
        let inside = (0..width).contains(&column) && (0..height).contains(&row);
        let centre = (column as f64 + 0.5, row as f64 + 0.5);
        let plain = (row * width + column) as usize;
        match &self.kind {
            Kind::LatLong => {
                // A step across a pole lands half a turn away.
                let beyond = !(0..height).contains(&row);
                let column = column + if beyond { width / 2 } else { 0 };
                let row = row.clamp(0, height - 1);
                Some((row * width + column.rem_euclid(width)) as usize)
            }
            Kind::Cube(faces, edge) => {
                let face = self.face_at(faces, *edge, x, y)?;
                let there = self.face_at(faces, *edge, centre.0, centre.1);
                if inside && there.is_some_and(|f| std::ptr::eq(f, face)) {
                    return Some(plain);
                }
                let direction = face.look(centre.0, centre.1, *edge as f64).normalize();
                self.place(direction).map(|place| self.pixel(place))
            }
            Kind::Disc(disc) => {
                // Pixels cut by the rim show the sphere in part.
                if inside && disc.nearest(column as usize, row as usize) < disc.radius {
                    return Some(plain);
                }
                let (direction, _) = disc.look(centre.0, centre.1, true)?;
                let (x, y) = self.place(direction)?;
                // A photograph's frame may cut the ball.
                let (wide, high) = (self.width as f64, self.height as f64);
                ((0.0..=wide).contains(&x) && (0.0..=high).contains(&y)).then(|| self.pixel((x, y)))
            }
        }
    }

    /// Solid angle of each pixel in steradians.
    pub fn solid_angles(&self) -> Vec<f64> {
        let (width, height) = (self.width, self.height);
        match &self.kind {
            Kind::LatLong => {
                (0..height).flat_map(|y| std::iter::repeat_n(texel_solid_angle(y, width, height), width)).collect()
            }
            &Kind::Cube(faces, edge) => {
                // Solid angle of the rectangle from a face's middle to (a, b), both signed.
                let corner = |a: f64, b: f64| (a * b).atan2((a * a + b * b + 1.0).sqrt());
                let at = |i: usize| 2.0 * i as f64 / edge as f64 - 1.0;
                (0..width * height)
                    .map(|i| {
                        let (x, y) = (i % width, i / width);
                        let place = (x as f64 + 0.5, y as f64 + 0.5);
                        if self.face_at(faces, edge, place.0, place.1).is_none() {
                            return 0.0;
                        }
                        let (a, b) = (at(x % edge), at(x % edge + 1));
                        let (c, d) = (at(y % edge), at(y % edge + 1));
                        corner(b, d) - corner(a, d) - corner(b, c) + corner(a, c)
                    })
                    .collect()
            }
            Kind::Disc(disc) => disc.solid_angles(width, height),
        }
    }

    /// Share of each pixel's area that shows something.
    pub fn coverage(&self) -> Vec<f32> {
        const ACROSS: usize = 8;
        let (width, height) = (self.width, self.height);
        (0..width * height)
            .map(|i| {
                let (x, y) = (i % width, i / width);
                match &self.kind {
                    Kind::LatLong => 1.0,
                    Kind::Cube(faces, edge) => {
                        let face = self.face_at(faces, *edge, x as f64 + 0.5, y as f64 + 0.5);
                        f32::from(u8::from(face.is_some()))
                    }
                    Kind::Disc(disc) if disc.farthest(x, y) <= disc.radius => 1.0,
                    Kind::Disc(disc) if disc.nearest(x, y) >= disc.radius => 0.0,
                    Kind::Disc(disc) => {
                        let inside = (0..ACROSS * ACROSS).filter(|sub| {
                            let at = |i: usize| (i as f64 + 0.5) / ACROSS as f64;
                            let dx = x as f64 + at(sub % ACROSS) - disc.centre[0];
                            let dy = y as f64 + at(sub / ACROSS) - disc.centre[1];
                            dx.hypot(dy) <= disc.radius
                        });
                        // A sliver counts as a little, not as nothing.
                        (inside.count().max(1) as f32) / (ACROSS * ACROSS) as f32
                    }
                }
            })
            .collect()
    }

    /// A place within the visible part of pixel `index`: its centre, or the point nearest to a disc's middle.
    pub fn centre(&self, index: usize) -> (f64, f64) {
        let (x, y) = ((index % self.width) as f64, (index / self.width) as f64);
        match &self.kind {
            Kind::Disc(disc) => {
                // Inside the pixel, because its border may belong to a neighbour.
                let inside = |p: f64, centre: f64| centre.clamp(p + 1e-6, p + 1.0 - 1e-6);
                (inside(x, disc.centre[0]), inside(y, disc.centre[1]))
            }
            _ => (x + 0.5, y + 0.5),
        }
    }
}
