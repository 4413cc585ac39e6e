//! The numbers of a heart, as a clinic would measure them.

use crate::error::PhantomError;
use crate::{HeartShape, Phantom};
use revolve_voxel::nalgebra::Point3;
use std::f64::consts::PI;

/// The numbers of a heart, as a clinic would measure them.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize))]
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
    /// The paper's `(EDV - V_rest) / V_rest`.
    pub gain: f64,
    /// Stroke volume times heart rate, L a minute.
    pub cardiac_output: f64,
    /// How far the plane of the base goes down, cm.
    pub base_descent: f64,
    /// What share of the stroke volume that is: the outer membrane's largest section at end-diastole times the descent, over the stroke
    /// volume.
    pub base_share: f64,
    /// Shortening of the cavity, base to inner apex, from end-diastole to end-systole, as a share of its length.
    pub longitudinal_shortening: f64,
    /// Volume of the wall in mL, the same at all phases.
    pub wall_volume: f64,
    /// Thickness of the wall at end-diastole.
    pub diastolic_thickness: Thickness,
    /// Thickness of the wall at end-systole.
    pub systolic_thickness: Thickness,
}

/// Thickness of the wall in cm: shortest distance from the inner membrane to the outer one.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Thickness {
    /// At the side of the wall: the material middle of the inner cylinder; s = 0.2 of a heart of one's own.
    pub side: f64,
    /// From the inner apex.
    pub apex: f64,
}

impl Phantom {
    /// Volumes, ejection fraction, wall.
    ///
    /// # Errors
    /// What solving the two shapes can return.
    pub fn numbers(&self) -> Result<Numbers, PhantomError> {
        let [systole, diastole] = self.cycle().gains();
        self.heart().shapes(&[systole, diastole])?;
        let (small, large) = (self.shape_at_gain(systole)?, self.shape_at_gain(diastole)?);
        let (esv, edv) = (small.volumes()[0], large.volumes()[0]);
        let descent = self.heart().base_descent(systole);
        let swept = PI * large.radius().powi(2) * descent;
        Ok(Numbers {
            edv,
            esv,
            stroke_volume: edv - esv,
            ejection_fraction: (edv - esv) / edv,
            gain: diastole,
            cardiac_output: (edv - esv) * self.cycle().beats_per_minute() / 1000.0,
            base_descent: descent,
            base_share: match edv > esv {
                true => swept / (edv - esv),
                false => 0.0,
            },
            longitudinal_shortening: 1.0 - small.cavity_length() / large.cavity_length(),
            wall_volume: self.heart().pair().wall_volume(),
            diastolic_thickness: self.thickness_of(&large),
            systolic_thickness: self.thickness_of(&small),
        })
    }

    /// Thickness of the wall at a phase.
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
            side: distance(self.parts().side),
            apex: distance(0.5),
        }
    }
}
