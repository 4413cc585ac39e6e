//! Shaded views: an orthographic camera, two lights, and anti-aliasing where neighbouring pixels differ.

use heart_phantom::revolve_voxel::nalgebra::{Point3, Vector3};
use plotters::style::RGBColor;
use rayon::prelude::*;

use super::Picture;
use super::canvas::Rect;

/// Direction of view; z is up in the image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct View {
    /// Angle of the viewer about z from the x axis towards y, radians.
    pub(crate) azimuth: f64,
    /// Angle of the viewer above the x-y plane, radians.
    pub(crate) elevation: f64,
}

impl View {
    /// Returns the unit vector to the viewer; its component perpendicular to the axis of a body is the normal of a cut along that
    /// axis that faces the viewer.
    pub(crate) fn toward(&self) -> [f64; 3] {
        let (sa, ca) = self.azimuth.sin_cos();
        let (se, ce) = self.elevation.sin_cos();
        [ce * ca, ce * sa, se]
    }
}

/// An orthographic camera over a rectangle of an image.
#[derive(Clone, Copy, Debug)]
pub(super) struct Camera {
    pub(super) right: Vector3<f64>,
    pub(super) up: Vector3<f64>,
    pub(super) toward: Vector3<f64>,
    centre: Point3<f64>,
    /// Centimetres across a pixel.
    pub(super) per_pixel: f64,
    rect: Rect,
    /// Directions to the key light and the fill, and halfway between key and viewer.
    lights: [Vector3<f64>; 3],
}

impl Camera {
    /// A camera with `centre` in the middle of `rect` and a width of `width` cm.
    pub(super) fn new(view: View, centre: Point3<f64>, width: f64, rect: Rect) -> Self {
        let (sa, ca) = view.azimuth.sin_cos();
        let toward = Vector3::from(view.toward());
        let right = Vector3::new(-sa, ca, 0.0);
        let up = toward.cross(&right);
        let light = |x: f64, y: f64, z: f64| (x * right + y * up + z * toward).normalize();
        let key = light(-0.55, 0.75, 0.75);
        Self {
            right,
            up,
            toward,
            centre,
            per_pixel: width / f64::from(rect.width),
            rect,
            lights: [key, light(0.85, -0.15, 0.6), (key + toward).normalize()],
        }
    }

    /// Returns the point of the plane through the centre at `(x, y)`, pixels of the image.
    pub(super) fn point(&self, x: f64, y: f64) -> Point3<f64> {
        let across = x - f64::from(self.rect.left) - 0.5 * f64::from(self.rect.width);
        let down = y - f64::from(self.rect.top) - 0.5 * f64::from(self.rect.height);
        self.centre + self.per_pixel * (across * self.right - down * self.up)
    }

    /// Returns the projection of `p`, pixels of the image.
    pub(super) fn pixel(&self, p: &Point3<f64>) -> [f64; 2] {
        let d = (p - self.centre) / self.per_pixel;
        [
            f64::from(self.rect.left) + 0.5 * f64::from(self.rect.width) + d.dot(&self.right),
            f64::from(self.rect.top) + 0.5 * f64::from(self.rect.height) - d.dot(&self.up),
        ]
    }

    /// Returns the distance of `p` in front of the plane through the centre, cm.
    pub(super) fn nearness(&self, p: &Point3<f64>) -> f64 {
        (p - self.centre).dot(&self.toward)
    }

    /// Colour of a matt surface with a slight gloss: ambient light, a key light from the upper left, a fill from the
    /// right; `normal` is of unit length and faces the viewer.
    pub(super) fn shade(&self, normal: &Vector3<f64>, colour: Colour) -> Colour {
        let [key, fill, half] = &self.lights;
        // Light wraps around the edge of the lit side, so that no edge is visible.
        let lit = |from: &Vector3<f64>| ((normal.dot(from) + 0.35) / 1.35).max(0.0).powi(2);
        let diffuse = 0.32 + 0.74 * lit(key) + 0.26 * lit(fill);
        let gloss = 0.1 * normal.dot(half).max(0.0).powi(30);
        colour.map(|c| c * diffuse + gloss)
    }

    /// Fills the rectangle of the camera with the result of `seen` at each point of the plane through the centre.
    ///
    /// One sample per pixel, nine where a neighbour shows another part or a different depth. Results do not depend on the number of
    /// threads.
    pub(super) fn render(
        &self,
        picture: &mut Picture,
        background: Colour,
        seen: impl Fn(Point3<f64>) -> Option<Seen> + Sync,
    ) {
        let (width, height) = (self.rect.width as usize, self.rect.height as usize);
        let (left, top) = (f64::from(self.rect.left), f64::from(self.rect.top));
        let sample = |x: f64, y: f64| seen(self.point(left + x, top + y));
        let first: Vec<Option<Seen>> = (0..width * height)
            .into_par_iter()
            .with_min_len(width)
            .map(|i| sample((i % width) as f64 + 0.5, (i / width) as f64 + 0.5))
            .collect();
        let jump = 4.0 * self.per_pixel;
        let differs = |i: usize, k: usize| match (&first[i], &first[k]) {
            (None, None) => false,
            (Some(a), Some(b)) => a.part != b.part || (a.nearness - b.nearness).abs() > jump,
            _ => true,
        };
        let colour_of = |seen: Option<Seen>| seen.map_or(background, |s| s.colour).map(encode);
        let shown: Vec<Colour> = (0..width * height)
            .into_par_iter()
            .with_min_len(width)
            .map(|i| {
                let (x, y) = (i % width, i / width);
                let edge = (x > 0 && differs(i, i - 1))
                    || (x + 1 < width && differs(i, i + 1))
                    || (y > 0 && differs(i, i - width))
                    || (y + 1 < height && differs(i, i + width));
                if !edge {
                    return colour_of(first[i]);
                }
                // Averages in sRGB, not in linear light, so that edges are uniform on light and dark.
                let mut sum = [0.0; 3];
                for k in 0..9 {
                    let at = |n: usize, d: i32| n as f64 + (f64::from(d) + 0.5) / 3.0;
                    let colour = colour_of(sample(at(x, k % 3), at(y, k / 3)));
                    (0..3).for_each(|c| sum[c] += colour[c] / 9.0);
                }
                sum
            })
            .collect();
        for (i, colour) in shown.into_iter().enumerate() {
            let (x, y) = (
                self.rect.left as usize + i % width,
                self.rect.top as usize + i / width,
            );
            picture.set(
                x as u32,
                y as u32,
                colour.map(|c| (255.0 * c).round() as u8),
            );
        }
    }
}

/// The intersection of a ray.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    pub(super) colour: Colour,
    /// Edges between different parts are anti-aliased.
    pub(super) part: u8,
    /// Distance in front of the plane of the camera, cm.
    pub(super) nearness: f64,
}

/// Red, green and blue, proportional to light.
pub(super) type Colour = [f64; 3];

pub(super) const WHITE: Colour = [1.0; 3];

/// The light of a palette colour.
pub(super) fn light(colour: RGBColor) -> Colour {
    [colour.0, colour.1, colour.2].map(|v| decode(f64::from(v) / 255.0))
}

/// Mixes two lights, `t` = 0 for the first.
pub(super) fn mix(a: Colour, b: Colour, t: f64) -> Colour {
    std::array::from_fn(|c| a[c] * (1.0 - t) + b[c] * t)
}

/// Light to sRGB (IEC 61966-2-1), clipped to [0, 1].
pub(super) fn encode(light: f64) -> f64 {
    let light = light.clamp(0.0, 1.0);
    if light <= 0.003_130_8 {
        12.92 * light
    } else {
        1.055 * light.powf(1.0 / 2.4) - 0.055
    }
}

/// sRGB to light.
pub(super) fn decode(value: f64) -> f64 {
    if value <= 0.040_45 {
        value / 12.92
    } else {
        ((value + 0.055) / 1.055).powf(2.4)
    }
}
