//! Shaded iso-surface of a volume, optionally cut open (Fig. 15 to 17, c, of the paper).

use heart_phantom::PhantomError;
use heart_phantom::revolve_voxel::nalgebra::{Point3, Vector3};

use super::Picture;
use super::canvas::{Area, Drawn, FINE, HPos, Rect, label, paint, paint_over};
use super::marks::arrow;
use super::render::{Camera, Seen, View, WHITE, light, mix};
use super::style::{BLACK, CUT, SURFACE};
use super::surface::Surface;
use super::volume::Volume;

/// Width of the image as a fraction of the longest side of the volume.
const FRAME: f64 = 0.85;

/// Options of the surface and the view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct IsoView {
    /// The level of the surface; half the activity of the wall shows its boundary.
    pub(crate) level: f32,
    /// Direction of view.
    pub(crate) view: View,
    /// Removes the points p with p·n > d, given as (n, d), cm; values shade the faces of the cut.
    pub(crate) cut: Option<([f64; 3], f64)>,
}

/// Draws the surface where the volume reaches a level, seen along parallel rays.
///
/// Voxels are cubes. The volume is trilinear between samples, normals are its gradients. The image spans 0.85 of the longest side of the volume.
/// A level above all samples gives an image of the axes only.
pub(crate) fn isosurface(volume: Volume<'_>, view: &IsoView) -> Result<Picture, PhantomError> {
    let cut = view.cut.map(|(n, d)| {
        let n = Vector3::from(n);
        (n.normalize(), d / n.norm())
    });
    let side = 640;
    let rect = Rect {
        left: 0,
        top: 0,
        width: side,
        height: side,
    };
    let longest = volume.grid.shape().into_iter().fold(0, usize::max);
    let [spacing, ..] = volume.grid.spacing();
    let camera = Camera::new(
        view.view,
        Point3::origin(),
        FRAME * longest as f64 * spacing,
        rect,
    );
    let surface = Surface::new(volume, view.level);
    let away = -camera.toward;
    // Beyond any corner of the volume from its centre, voxels.
    let reach = 2.0 * longest as f64;
    let level = f64::from(view.level);
    let (outside, inside) = (light(SURFACE), light(CUT));
    let behind = mix(outside, inside, 0.5);

    let mut picture = paint(side as u32, side as u32, |_| Ok(()))?;
    camera.render(&mut picture, WHITE, |point| {
        let origin = volume.index(&point);
        let (mut from, mut to) = (-reach, reach);
        if let Some((n, d)) = cut {
            // Along the ray p·n - d = height + t slope, in voxels.
            let height = (point.coords.dot(&n) - d) / spacing;
            let slope = away.dot(&n);
            if slope < 0.0 {
                from = from.max(-height / slope);
            } else if slope > 0.0 {
                to = to.min(-height / slope);
            } else if height > 0.0 {
                return None;
            }
        }
        let found = surface.first(&origin, &away, from, to)?;
        let p = origin + found.t * away;
        if found.inside_at_start {
            // A face of the cut: flat, brightness proportional to activity, full at twice the level.
            let normal = cut.map_or(camera.toward, |(n, _)| n);
            let amount = (volume.value(&p) / (2.0 * level)).clamp(0.0, 1.3);
            let tone = 0.75 + 0.25 * normal.dot(&camera.toward).abs();
            let colour = inside.map(|c| c * tone * amount);
            return Some(Seen {
                colour,
                part: 1,
                nearness: -found.t * spacing,
            });
        }
        let normal = surface.normal(&p).unwrap_or(camera.toward);
        // Seen from inside, through a cut, the normal points away.
        let facing = normal.dot(&camera.toward);
        let colour = if facing < 0.0 { behind } else { outside };
        let colour = camera.shade(&(normal * facing.signum()), colour);
        Some(Seen {
            colour,
            part: 0,
            nearness: -found.t * spacing,
        })
    });
    let corner = [70.0, f64::from(side) - 70.0];
    paint_over(picture, |area| lab_axes(area, &camera, corner))
}

/// The lab's axes about a place, pixels of the image.
fn lab_axes(area: &Area<'_>, camera: &Camera, corner: [f64; 2]) -> Drawn {
    for (name, axis) in [
        ("x", Vector3::x()),
        ("y", Vector3::y()),
        ("z", Vector3::z()),
    ] {
        let fine = f64::from(FINE);
        let d = [axis.dot(&camera.right), -axis.dot(&camera.up)];
        let tip = |length: f64| [corner[0] + length * d[0], corner[1] + length * d[1]];
        arrow(
            area,
            corner.map(|v| v * fine),
            tip(46.0).map(|v| v * fine),
            BLACK,
            2,
        )?;
        let at = tip(60.0);
        label(
            area,
            name,
            (at[0].round() as i32, at[1].round() as i32),
            HPos::Center,
        )?;
    }
    Ok(())
}
