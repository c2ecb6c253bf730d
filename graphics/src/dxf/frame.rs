//! Coordinates of the objects of a DXF file in space, and their projection to the plane of the drawing.

use kurbo::{Affine, Point, Vec2};

/// A place or a direction in space.
pub(super) type Space = [f64; 3];

/// Coordinates within others: its axes and its origin there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Frame {
    x: Space,
    y: Space,
    z: Space,
    origin: Space,
}

impl Frame {
    /// The same coordinates, all lengths times a factor.
    pub(super) fn scale(by: f64) -> Self {
        Self { x: [by, 0.0, 0.0], y: [0.0, by, 0.0], z: [0.0, 0.0, by], origin: [0.0; 3] }
    }

    /// Scaled, turned about z, and moved.
    pub(super) fn placed(scale: Space, sine: f64, cosine: f64, origin: Space) -> Self {
        Self {
            x: [cosine * scale[0], sine * scale[0], 0.0],
            y: [-sine * scale[1], cosine * scale[1], 0.0],
            z: [0.0, 0.0, scale[2]],
            origin,
        }
    }

    /// Moved.
    pub(super) fn moved(by: Space) -> Self {
        Self { origin: by, ..Self::scale(1.0) }
    }

    /// The coordinates of an object with this extrusion (the arbitrary axis algorithm of the DXF reference).
    pub(super) fn of_extrusion(normal: Space) -> Self {
        let length = dot(normal, normal).sqrt();
        if !(length.is_finite() && length > 0.0) {
            return Self::scale(1.0);
        }
        let normal = normal.map(|part| part / length);
        let is_near_z = normal[0].abs() < 1.0 / 64.0 && normal[1].abs() < 1.0 / 64.0;
        let from = if is_near_z { [0.0, 1.0, 0.0] } else { [0.0, 0.0, 1.0] };
        let x = cross(from, normal);
        let length = dot(x, x).sqrt();
        let x = x.map(|part| part / length);
        Self { x, y: cross(normal, x), z: normal, origin: [0.0; 3] }
    }

    /// These coordinates in those that `self` is in, where they are given in `self`.
    pub(super) fn then(&self, inner: &Self) -> Self {
        Self {
            x: self.direction(inner.x),
            y: self.direction(inner.y),
            z: self.direction(inner.z),
            origin: self.place(inner.origin),
        }
    }

    fn direction(&self, of: Space) -> Space {
        core::array::from_fn(|axis| {
            self.x[axis] * of[0] + self.y[axis] * of[1] + self.z[axis] * of[2]
        })
    }

    fn place(&self, of: Space) -> Space {
        let from = self.direction(of);
        core::array::from_fn(|axis| from[axis] + self.origin[axis])
    }

    /// A place, seen from above.
    pub(super) fn point(&self, of: Space) -> Point {
        let place = self.place(of);
        Point::new(place[0], place[1])
    }

    /// A direction, seen from above.
    pub(super) fn vector(&self, of: Space) -> Vec2 {
        let direction = self.direction(of);
        Vec2::new(direction[0], direction[1])
    }

    /// From the plane at a height to the plane of the drawing, seen from above.
    pub(super) fn plane(&self, height: f64) -> Affine {
        let origin = self.place([0.0, 0.0, height]);
        Affine::new([self.x[0], self.x[1], self.y[0], self.y[1], origin[0], origin[1]])
    }

    /// Whether its plane stands at an angle to that of the drawing.
    pub(super) fn is_tilted(&self) -> bool {
        let flat = self.x[0].abs().max(self.x[1].abs()).max(self.y[0].abs()).max(self.y[1].abs());
        self.x[2].abs().max(self.y[2].abs()) > 1e-9 * flat
    }
}

pub(super) fn cross(one: Space, other: Space) -> Space {
    [
        one[1] * other[2] - one[2] * other[1],
        one[2] * other[0] - one[0] * other[2],
        one[0] * other[1] - one[1] * other[0],
    ]
}

fn dot(one: Space, other: Space) -> f64 {
    one[0] * other[0] + one[1] * other[1] + one[2] * other[2]
}

#[cfg(test)]
mod tests {
    use kurbo::Point;

    use super::Frame;

    #[test]
    fn an_extrusion_downwards_mirrors_x() {
        let frame = Frame::of_extrusion([0.0, 0.0, -1.0]);
        assert_eq!(frame.point([3.0, 4.0, 5.0]), Point::new(-3.0, 4.0));
        assert!(!frame.is_tilted());
        assert_eq!(Frame::of_extrusion([0.0, 0.0, 2.0]), Frame::scale(1.0));
        assert_eq!(Frame::of_extrusion([0.0; 3]), Frame::scale(1.0));
    }

    #[test]
    fn an_extrusion_along_x_shows_the_plane_from_its_edge() {
        // Ax = z × N = y, Ay = N × Ax = z.
        let frame = Frame::of_extrusion([1.0, 0.0, 0.0]);
        assert_eq!(frame.point([2.0, 3.0, 4.0]), Point::new(4.0, 2.0));
        assert!(frame.is_tilted());
    }
}
