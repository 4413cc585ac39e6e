//! Clinical quantities of the heart.

use crate::error::PhantomError;
use crate::{HeartShape, Phantom};
use revolve_voxel::nalgebra::Point3;
use std::f64::consts::PI;

/// Volumes, ejection fraction and wall thickness, as measured clinically.
#[doc(alias("EDV", "ESV", "LVEF"))]
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct Numbers {
    /// End-diastolic volume of the cavity in mL.
    pub edv: f64,
    /// End-systolic volume in mL.
    pub esv: f64,
    /// `EDV - ESV` in mL.
    pub stroke_volume: f64,
    /// `(EDV - ESV) / EDV`.
    pub ejection_fraction: f64,
    /// The paper's `(EDV - V_ref) / V_ref`.
    pub gain: f64,
    /// Stroke volume times heart rate, L/min.
    pub cardiac_output: f64,
    /// Atrioventricular-plane displacement, cm.
    pub av_plane_displacement: f64,
    /// Contribution of this displacement to the stroke volume, as a fraction: displacement times the largest cross-section of the outer membrane
    /// at end-diastole, over the stroke volume.
    pub av_plane_fraction: f64,
    /// Relative shortening of the cavity from base to inner apex, from end-diastole to end-systole.
    pub longitudinal_shortening: f64,
    /// Volume of the wall in mL, the same at all phases.
    pub wall_volume: f64,
    /// Thickness of the wall at end-diastole.
    pub diastolic_thickness: Thickness,
    /// Thickness of the wall at end-systole.
    pub systolic_thickness: Thickness,
}

/// Thickness of the wall in cm: shortest distance from the inner membrane to the outer one.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct Thickness {
    /// At the side of the wall: the material midpoint of the inner cylinder; s = 0.2 if the heart was built from other membranes.
    pub side: f64,
    /// At the inner apex.
    pub apex: f64,
}

impl Phantom {
    /// Returns volumes, ejection fraction and wall thickness.
    ///
    /// # Errors
    /// Errors of the solver for the two shapes.
    pub fn numbers(&self) -> Result<Numbers, PhantomError> {
        let gains @ [systole, diastole] = self.cycle().gains();
        let shapes = self.heart().shapes(&gains)?;
        let (small, large) = (&shapes[0], &shapes[1]);
        let (esv, edv) = (small.volumes()[0], large.volumes()[0]);
        let descent = self.heart().av_plane_displacement(systole);
        let swept = PI * large.radius().powi(2) * descent;
        Ok(Numbers {
            edv,
            esv,
            stroke_volume: edv - esv,
            ejection_fraction: (edv - esv) / edv,
            gain: diastole,
            cardiac_output: (edv - esv) * self.cycle().beats_per_minute() / 1000.0,
            av_plane_displacement: descent,
            av_plane_fraction: match edv > esv {
                true => swept / (edv - esv),
                false => 0.0,
            },
            longitudinal_shortening: 1.0 - small.cavity_length() / large.cavity_length(),
            wall_volume: self.heart().pair().wall_volume(),
            diastolic_thickness: self.thickness_of(large),
            systolic_thickness: self.thickness_of(small),
        })
    }

    /// Returns the thickness of the wall at a phase.
    ///
    /// # Errors
    /// As [`Phantom::shape`].
    pub fn thickness(&self, phase: f64) -> Result<Thickness, PhantomError> {
        Ok(self.thickness_of(&*self.shape(phase)?))
    }

    pub(crate) fn thickness_of(&self, shape: &HeartShape) -> Thickness {
        let distance = |s: f64| {
            let [x, r] = shape.solution().inner.at(s).position;
            let place = self.heart().pose().to_lab(&Point3::new(x, r.max(0.0), 0.0));
            -shape.body().layers()[1].signed_distance(&shape.body().pose().to_body(&place))
        };
        Thickness {
            side: distance(self.parts.side),
            apex: distance(0.5),
        }
    }
}
