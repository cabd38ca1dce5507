//! Maps of light directions: a panorama around the subject, or a mirror ball as the camera sees it.

use crate::panels::widgets::sphere::{place, share};
use egui::{Pos2, Rect, Vec2, vec2};
use glam::Vec3;
use light::latlong::direction_from_uv;
use worker::{mirrored, on_mirror_ball};

/// A map of all directions in a rectangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightMap {
    Panorama(Rect),
    /// A ball in the middle of the rectangle.
    Sphere(Rect),
}

impl LightMap {
    /// Name of the map in the names of its handles.
    pub fn name(self) -> &'static str {
        match self {
            Self::Panorama(_) => "panorama",
            Self::Sphere(_) => "sphere",
        }
    }

    /// The square of the ball, or the panorama.
    pub fn rect(self) -> Rect {
        match self {
            Self::Panorama(rect) => rect,
            Self::Sphere(rect) => Rect::from_center_size(rect.center(), Vec2::splat(rect.size().min_elem())),
        }
    }

    /// The point of a direction.
    pub fn place(self, direction: Vec3) -> Pos2 {
        let rect = self.rect();
        match self {
            Self::Panorama(_) => place(rect, direction),
            Self::Sphere(_) => {
                let [x, y] = on_mirror_ball(direction);
                rect.center() + 0.5 * rect.width() * vec2(x, -y)
            }
        }
    }

    /// The direction at a point; outside the map, the direction at the nearest point on it.
    pub fn direction(self, at: Pos2) -> Vec3 {
        let rect = self.rect();
        match self {
            Self::Panorama(_) => {
                let (u, v) = share(rect, at);
                direction_from_uv(u, v)
            }
            Self::Sphere(_) => {
                let seen = (at - rect.center()) / (0.5 * rect.width()).max(f32::MIN_POSITIVE);
                // The rim itself shows only the direction straight behind the ball.
                let seen = seen / (seen.length() / 0.995).max(1.0);
                mirrored([seen.x, -seen.y]).unwrap_or(Vec3::NEG_Z)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::pos2;

    #[test]
    fn a_direction_is_found_again_where_it_was_drawn() {
        let rect = Rect::from_min_size(pos2(20.0, 30.0), vec2(300.0, 240.0));
        for map in [LightMap::Panorama(rect), LightMap::Sphere(rect)] {
            for direction in [Vec3::X, Vec3::new(-0.6, 0.4, 0.6), Vec3::new(0.2, -0.3, -0.9)] {
                let direction = direction.normalize();
                let found = map.direction(map.place(direction));
                assert!(found.angle_between(direction) < 0.02, "{map:?} {direction}");
            }
            let beside = map.direction(pos2(5000.0, 150.0));
            assert!(beside.is_normalized(), "{map:?}");
        }
    }
}
