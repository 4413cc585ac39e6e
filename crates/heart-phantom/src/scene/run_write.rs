//! Writing the arrays of a run.

use super::run::Run;
use crate::error::PhantomError;
use crate::files::{self, AcquisitionInfo, Corrections, Projections, Volume};
use crate::phantom::{Content, Index, to_counts};
use crate::{PhaseOf, Product, ProjectionValues, ScenePhase};
use std::path::PathBuf;

impl Run<'_> {
    /// Writes an array of a product. Cardiac gates that share a file are written when all are present; those of a respiratory gate follow each other.
    pub(super) fn write(
        &mut self,
        array: (Product, usize),
        index: Index,
        samples: &[f32],
    ) -> Result<(), PhantomError> {
        let gate = match index {
            Index::Gate(gate) | Index::Phase(PhaseOf::Gate { gate, .. }) => gate,
            Index::Phase(_) | Index::Volume(_) | Index::Cardiac(_) | Index::All => {
                return self.put(array, index, samples);
            }
        };
        if !self.phantom.joins(array.0) {
            return self.put(array, index, samples);
        }
        let gates = self.phantom.n_cardiac_gates();
        let joined = self.joined.entry(array).or_default();
        joined.extend_from_slice(samples);
        if joined.len() < gates * samples.len() {
            return Ok(());
        }
        let all = self.joined.remove(&array).unwrap_or_default();
        self.put(array, Index::Cardiac(gate / gates), &all)
    }

    fn put(
        &mut self,
        array: (Product, usize),
        index: Index,
        samples: &[f32],
    ) -> Result<(), PhantomError> {
        match array.0 {
            Product::Projections | Product::Scatter => self.put_projections(array, index, samples),
            _ => self.put_volume(array.0, index, samples),
        }
    }

    /// The projections of a gate, or of all cardiac gates, in an energy window, or their scatter.
    fn put_projections(
        &mut self,
        (product, window): (Product, usize),
        index: Index,
        samples: &[f32],
    ) -> Result<(), PhantomError> {
        let cardiac = self.phantom.n_cardiac_gates();
        let gates = match index {
            Index::Gate(gate) => gate..gate + 1,
            Index::Cardiac(of) => of * cardiac..(of + 1) * cardiac,
            Index::Phase(_) | Index::Volume(_) | Index::All => 0..1,
        };
        let gate = gates.start;
        let (camera, scene) = (self.phantom.camera(), self.phantom.scene());
        let detector = *camera.detector();
        let angles = self.phantom.written_angles(gate)?;
        let radii = self.phantom.radii()?;
        let seconds = self.seconds_per_gate(index);
        let (mut counts, mut seen) = (Vec::new(), 0.0);
        for gate in gates {
            counts.extend(self.phantom.counts_per_unit(gate)?.into_iter().flatten());
            let times = self.phantom.view_times(gate)?;
            seen += times.iter().map(|time| time.window).sum::<f64>() / times.len() as f64;
        }
        // Without respiratory gates the time per angular position, also that of rejected beats.
        if seconds.is_some() && self.phantom.n_respiratory_gates() == 1 {
            seen = camera.interval();
        }
        let raw = product == Product::Projections
            && self.phantom.scene().output.values == ProjectionValues::Counts;
        let counted;
        let samples = match raw {
            false => samples,
            true => {
                counted = to_counts(samples, &counts, camera.view_len());
                &counted
            }
        };
        let mut projections = match seconds {
            None => Projections::new(detector, &angles, &radii, samples)?,
            Some(seconds) => Projections::of_gates(detector, &angles, &radii, samples, seconds)?,
        };
        if !counts.is_empty() {
            projections = projections.with_counts_per_unit(&counts)?;
        }
        projections = projections.with_acquisition(AcquisitionInfo {
            heads: camera.n_heads(),
            seconds_per_view: seen,
            decay_corrected: !raw && self.decays(),
            counts: raw,
            beats: seconds.map(|_| self.phantom.beat_counts()),
        })?;
        projections.study = self.study.as_deref();
        let names = self.phantom.names_of(product, window, index);
        let format = scene.output.projections;
        files::write(&self.out.join(&names[0]), &projections, format)?;
        self.files.extend(names);
        Ok(())
    }

    /// Writes displacements, velocities and strains at a phase.
    pub(super) fn write_motion(&mut self, to: &ScenePhase) -> Result<(), PhantomError> {
        let motion = self.phantom.motion(to.at)?;
        let grid = *self.phantom.camera().grid();
        let fields = [&motion.displacement, &motion.velocity, &motion.strain];
        let arrays = Product::Motion.info().arrays;
        for (array, ((_, content), samples)) in arrays.iter().zip(fields).enumerate() {
            if let Content::Field(of) = *content {
                let field = Volume::of_field(grid, samples, of)?;
                let names = (self.phantom).names_of(Product::Motion, array, Index::Phase(to.of));
                self.write_volume(names, field)?;
            }
        }
        Ok(())
    }

    /// Writes one volume or those of all gates.
    pub(super) fn put_volume<'s>(
        &mut self,
        product: Product,
        index: Index,
        samples: impl Into<files::Samples<'s>>,
    ) -> Result<(), PhantomError> {
        let grid = *self.phantom.camera().grid();
        let seconds = self.seconds_per_gate(index);
        let mut volume = match seconds {
            None => Volume::new(grid, samples)?,
            Some(seconds) => Volume::of_gates(grid, samples, seconds)?,
        };
        volume.beats = seconds.map(|_| self.phantom.beat_counts());
        if product == Product::Reconstruction {
            volume.corrections = self.corrections();
        }
        volume.transmission = product == Product::Attenuation;
        let names = self.phantom.names_of(product, 0, index);
        self.write_volume(names, volume)
    }

    fn write_volume(
        &mut self,
        names: Vec<PathBuf>,
        volume: Volume<'_>,
    ) -> Result<(), PhantomError> {
        let mut volume = volume;
        volume.study = self.study.as_deref();
        let format = self.phantom.scene().output.volumes;
        files::write(&self.out.join(&names[0]), &volume, format)?;
        self.files.extend(names);
        Ok(())
    }

    /// Returns whether the activity decays; normalised samples are corrected for it.
    fn decays(&self) -> bool {
        (self.phantom.scene().counting).is_some_and(|own| own.decay.half_life().is_some())
    }

    /// Returns the corrections of the reconstructions, which are of normalised samples.
    fn corrections(&self) -> Corrections {
        let osem = self.phantom.scene().reconstruction.method.osem();
        Corrections {
            decay: self.decays(),
            attenuation: osem.is_some_and(|osem| osem.attenuation),
            scatter: osem.is_some_and(|osem| osem.scatter),
            motion: self.phantom.is_compensated(),
        }
    }

    /// Returns the time between cardiac gates if they share a file.
    fn seconds_per_gate(&self, index: Index) -> Option<f64> {
        let gates = self.phantom.n_cardiac_gates() as f64;
        matches!(index, Index::Cardiac(_)).then(|| self.phantom.cycle().period() / gates)
    }
}
