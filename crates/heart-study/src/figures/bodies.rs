//! Shaded views of the exact body: reference configuration and dilated (Fig. 12), before and after the pose (Fig. 13 of the paper).

use std::f64::consts::{PI, TAU};

use heart_phantom::PhantomError;
use heart_phantom::revolve_voxel::Pose;
use heart_phantom::revolve_voxel::nalgebra::{Point3, Vector3, center};
use plotters::prelude::RGBColor;

use super::canvas::{Area, Drawn, FINE, HPos, Rect, label, paint, paint_over, text, title};
use super::marks::{Entry, Sign, arrow, legend, segment};
use super::render::{Camera, Colour, Seen, View, WHITE, light, mix};
use super::style::{BLACK, BLUE, CAVITY, CUT, GREEN, GREY, SURFACE, TEXT, VERMILION};
use super::wall::{Met, Part, Wall};
use super::{Picture, WallState};

/// Meridians and parallels of the mesh drawn on the outer wall.
const MESH: [f64; 2] = [48.0, 40.0];
/// Thickness of its lines, cm.
const LINE: f64 = 0.035;
/// Height of the legend in pixels, and its entries.
const KEY: i32 = 60;
const ENTRIES: [Entry<'_>; 4] = [
    (Sign::Line(16), SURFACE, "outside"),
    (Sign::Line(16), CAVITY, "cavity"),
    (Sign::Line(16), CUT, "cut, base"),
    (Sign::Line(2), BLUE, "equal steps along the wall and around"),
];

/// Draws each state twice at one scale: above the wall cut open, below the mesh on its outer surface.
///
/// The mesh has equal steps of the material coordinate and of azimuth, so it shows the stretch.
pub(crate) fn bodies(states: &[WallState<'_>]) -> Result<Picture, PhantomError> {
    let cast = |azimuths: [f64; 2]| -> Result<Vec<Wall>, PhantomError> {
        let wall = |state| Wall::new(state, Pose::identity(), azimuths);
        states.iter().map(wall).collect()
    };
    // The quarter of negative y and positive z is removed.
    let (walls, opened) = (cast([0.0, TAU])?, cast([PI, 2.5 * PI])?);
    let long = walls.iter().fold(0.0f64, |m, w| m.max(w.extent[0]));
    let thick = walls.iter().fold(0.0f64, |m, w| m.max(w.extent[1]));
    // The x axis of the body points to the right and away from the viewer, so that the base with the cavity is visible.
    let view = View {
        azimuth: -118f64.to_radians(),
        elevation: 24f64.to_radians(),
    };
    let span = 1.04 * (long * 0.89 + thick * 0.47);
    let width = 620;
    let high = 1.06 * (thick + 0.2 * long);
    let height = (f64::from(width) * (high / span).clamp(0.3, 1.2)) as i32;
    let gap = 24;
    let (left, top) = (gap, 64);
    let panel = |column: usize, row: i32| Rect {
        left: left + column as i32 * (width + gap),
        top: top + row * (height + gap),
        width,
        height,
    };
    let size = (
        left + states.len() as i32 * (width + gap),
        top + 2 * (height + gap) + KEY,
    );
    let mut picture = paint(size.0 as u32, size.1 as u32, |area| {
        for (i, state) in states.iter().enumerate() {
            let rect = panel(i, 0);
            title(area, state.title, (rect.left + width / 2, 32))?;
        }
        Ok(())
    })?;
    let (paper, lines) = (mix(light(SURFACE), WHITE, 0.72), light(BLUE));
    let mut bars = Vec::new();
    for (i, (wall, opened)) in walls.iter().zip(&opened).enumerate() {
        // One base plane in all panels, at the same position.
        let centre = Point3::new(
            0.5 * long + walls[0].centre.x - 0.5 * walls[0].extent[0],
            0.0,
            0.0,
        );
        let open = Camera::new(view, centre, span, panel(i, 0));
        open.render(&mut picture, WHITE, |p| {
            let met = opened.met(p, -open.toward)?;
            Some(seen(&open, &met, paint_of(met.part)))
        });
        let mesh = Camera::new(view, centre, span, panel(i, 1));
        mesh.render(&mut picture, WHITE, |p| {
            let met = wall.met(p, -mesh.toward)?;
            let colour = match met.part {
                Part::Outer { material, stretch } => {
                    // Width of a pixel on the inclined surface, for antialiasing of lines.
                    let soft = mesh.per_pixel / met.normal.dot(&mesh.toward).max(0.2);
                    let ink = mesh_line([material, stretch], &met.point, soft);
                    mix(paper, lines, ink)
                }
                part => paint_of(part),
            };
            Some(seen(&mesh, &met, colour))
        });
        let rect = panel(i, 1);
        bars.push((rect.left + 20, rect.top + rect.height - 14));
    }
    let two_cm = (2.0 * f64::from(width) / span).round() as i32;
    paint_over(picture, |area| {
        for (x, y) in bars {
            let ends = [x, x + two_cm].map(|x| [f64::from(x * FINE), f64::from(y * FINE)]);
            segment(area, ends[0], ends[1], BLACK, 3)?;
            label(area, "2 cm", (x + two_cm + 14, y), HPos::Left)?;
        }
        legend(area, &ENTRIES, (left + 20, size.1 - KEY / 2)).map(drop)
    })
}

fn seen(camera: &Camera, met: &Met, colour: Colour) -> Seen {
    let part = match met.part {
        Part::Outer { .. } => 0,
        Part::Inner => 1,
        Part::Flat(axis) => 2 + axis as u8,
    };
    Seen {
        colour: camera.shade(&met.normal, colour),
        part,
        nearness: camera.nearness(&met.point),
    }
}

/// The light of a part of the wall.
fn paint_of(part: Part) -> Colour {
    light(match part {
        Part::Outer { .. } => SURFACE,
        Part::Inner => CAVITY,
        Part::Flat(_) => CUT,
    })
}

/// Returns the opacity of mesh lines at a point of the outer wall in the body frame, 0 to 1, from its material coordinate and the
/// centimetres of meridian per unit of it; lines fade over `soft` cm.
fn mesh_line([material, stretch]: [f64; 2], point: &Point3<f64>, soft: f64) -> f64 {
    let off = |t: f64| (t - t.round()).abs();
    let parallel = off(material * MESH[1]) / MESH[1] * stretch;
    let r = point.y.hypot(point.z);
    // Towards the apex every second meridian ends where lines would merge.
    let mut n = MESH[0];
    while n > 6.0 && r * TAU / n < 6.0 * LINE {
        n *= 0.5;
    }
    let meridian = off(point.z.atan2(point.y) / TAU * n) / n * TAU * r;
    let ink = |distance: f64| ((0.5 * LINE - distance) / soft + 0.5).clamp(0.0, 1.0);
    ink(parallel).max(ink(meridian))
}

/// Draws the body in each pose with the axes of the lab, its own axis, and the orbit of the camera about z.
///
/// Lines behind the body are pale.
pub(crate) fn poses(
    state: &WallState<'_>,
    poses: &[(&str, Pose)],
    view: View,
) -> Result<Picture, PhantomError> {
    let side = 640;
    let top = 60;
    let walls: Vec<Wall> = poses
        .iter()
        .map(|(_, pose)| Wall::new(state, *pose, [0.0, TAU]))
        .collect::<Result<_, _>>()?;
    // The circle and the axes extend beyond the body in any pose.
    let reach = walls
        .iter()
        .fold(0.0f64, |m, w| m.max(w.centre.coords.norm() + w.radius));
    let size = (side * poses.len() as i32, top + side);
    let mut picture = paint(size.0 as u32, size.1 as u32, |area| {
        for (i, (name, _)) in poses.iter().enumerate() {
            title(area, name, (side * i as i32 + side / 2, 34))?;
        }
        Ok(())
    })?;
    let mut cameras = Vec::with_capacity(poses.len());
    for (i, wall) in walls.iter().enumerate() {
        let rect = Rect {
            left: side * i as i32,
            top,
            width: side,
            height: side,
        };
        let camera = Camera::new(view, Point3::origin(), 2.9 * reach, rect);
        camera.render(&mut picture, WHITE, |p| {
            let met = wall.met(p, -camera.toward)?;
            Some(seen(&camera, &met, paint_of(met.part)))
        });
        cameras.push(camera);
    }
    paint_over(picture, |area| {
        for ((camera, wall), (_, pose)) in cameras.iter().zip(&walls).zip(poses) {
            let scene = Scene { area, camera, wall };
            let circle: Vec<Point3<f64>> = (0..=180)
                .map(|k| TAU * f64::from(k) / 180.0)
                .map(|a| Point3::new(1.2 * reach * a.cos(), 1.2 * reach * a.sin(), 0.0))
                .collect();
            scene.line(&circle, GREEN, 3)?;
            // The camera rotates from x towards y.
            for k in [8, 52, 98, 142] {
                if !scene.hidden(&circle[k]) {
                    let (a, b) = (scene.at(&circle[k - 1]), scene.at(&circle[k]));
                    let ahead = [b[0] - a[0], b[1] - a[1]];
                    let scale = 20.0 * f64::from(FINE) / ahead[0].hypot(ahead[1]).max(1.0);
                    let tail = [b[0] - scale * ahead[0], b[1] - scale * ahead[1]];
                    arrow(area, tail, b, GREEN, 4)?;
                }
            }
            for (name, axis) in [
                ("x", Vector3::x()),
                ("y", Vector3::y()),
                ("z", Vector3::z()),
            ] {
                scene.axis(Point3::origin(), axis, 1.32 * reach, GREY)?;
                scene.label(name, axis * 1.42 * reach)?;
            }
            scene.axis(wall.centre, pose.axis(), 1.18 * wall.radius, VERMILION)?;
            // Above the circle's leftmost point, clear of the body.
            let left = circle
                .iter()
                .map(|p| camera.pixel(p))
                .fold([f64::INFINITY; 2], |m, p| if p[0] < m[0] { p } else { m });
            let at = [left[0] - 14.0, left[1] - 86.0].map(|v| v.round() as i32);
            text(area, "camera", TEXT, GREEN, (at[0], at[1]), HPos::Left)?;
        }
        Ok(())
    })
}

/// Lines over a rendered body, pale behind it.
struct Scene<'s, 'b> {
    area: &'s Area<'b>,
    camera: &'s Camera,
    wall: &'s Wall,
}

impl Scene<'_, '_> {
    /// Canvas pixel of a point.
    fn at(&self, p: &Point3<f64>) -> [f64; 2] {
        self.camera.pixel(p).map(|v| v * f64::from(FINE))
    }

    fn hidden(&self, p: &Point3<f64>) -> bool {
        self.wall
            .met(*p, -self.camera.toward)
            .is_some_and(|met| self.camera.nearness(&met.point) > self.camera.nearness(p) + 1e-6)
    }

    fn line(&self, points: &[Point3<f64>], colour: RGBColor, width: i32) -> Drawn {
        for pair in points.windows(2) {
            let middle = center(&pair[0], &pair[1]);
            if self.hidden(&middle) {
                // A faint line through the body shows its continuation.
                let trace = center(&pair[0], &middle);
                segment(self.area, self.at(&pair[0]), self.at(&trace), colour, 1)?;
            } else {
                segment(
                    self.area,
                    self.at(&pair[0]),
                    self.at(&pair[1]),
                    colour,
                    width,
                )?;
            }
        }
        Ok(())
    }

    fn axis(&self, from: Point3<f64>, along: Vector3<f64>, length: f64, colour: RGBColor) -> Drawn {
        let points: Vec<Point3<f64>> = (0..=80)
            .map(|k| from + along * (length * f64::from(k) / 80.0))
            .collect();
        self.line(&points[..=76], colour, 3)?;
        arrow(
            self.area,
            self.at(&points[74]),
            self.at(&points[80]),
            colour,
            3,
        )
    }

    fn label(&self, words: &str, at: Vector3<f64>) -> Drawn {
        let [x, y] = (self.camera.pixel(&Point3::from(at))).map(|v| v.round() as i32);
        title(self.area, words, (x, y))
    }
}
