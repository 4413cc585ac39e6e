//! Scatter of gated projection sets, from photon histories with the media, the sources and the response of the projections.

use super::Phantom;
use super::resolution::largest_of;
use super::scatter_model::{Emitters, State, Tissue};
use crate::error::{PhantomError, check_count};
use crate::once::once;
use crate::scan::RowsOfViews;
use crate::scene::ScatterSettings;
use crate::{Sinograms, no_observer};
use photon_scatter::{
    Camera, Response, Scatter, ScatterError, ScatterOptions, Spectrum, View, water_attenuation,
};
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// Cells of volume and of respiratory phase in each of which the heart is averaged: 2 mm of motion, less than scatter resolves.
const CELLS: f64 = 8.0;
/// Distance of the nodes in cm, and at most this fraction of a row of bins, as for small animals: the heart is wider.
const PITCH: f64 = 0.75;
const PART_OF_ROW: f64 = 1.0 / 30.0;
/// Largest angle in degrees between views that are not interpolated, and the tolerance from which it applies; smaller ones have proportionally
/// smaller angles.
const SPACING: f64 = 12.0;
const WIDE: f64 = 0.01;
/// Largest number of histories of a gate.
const MOST_HISTORIES: u64 = 1_000_000_000;

impl ScatterSettings {
    /// Options for an absolute tolerance and the rows of a camera.
    fn options(&self, tolerance: f64, camera: &crate::Camera) -> ScatterOptions {
        let options = ScatterOptions::new(tolerance).with_relative(self.tolerance);
        let spacing = SPACING.to_radians() * (self.tolerance / WIDE).min(1.0);
        let row = camera.n_bins() as f64 * camera.pitch();
        let pitch = PITCH.min(PART_OF_ROW * row);
        let options = options.with_pitch(pitch).with_spacing(spacing);
        options
            .with_seed(self.seed)
            .with_most_histories(MOST_HISTORIES)
    }

    /// Energies and windows.
    pub(crate) fn spectrum(&self) -> Result<Spectrum, ScatterError> {
        Spectrum::new(self.energy, self.resolution, &self.windows)
    }
}

impl Phantom {
    /// The scattered photons in the projections of a gate: expected samples and their standard errors in each energy window. `None` without
    /// a section `[scatter]` or without activity. The first call for a gate computes its projections and follows the photon histories.
    ///
    /// The heart is averaged over the acquisition time of the gate. The medium is that of its average state, and scatters as water with the
    /// same attenuation.
    ///
    /// ```
    /// use heart_phantom::scene::ScatterSettings;
    /// use heart_phantom::Mode;
    /// use heart_phantom::{Chest, Phantom, Scene};
    /// let mut scene = Scene::default().with_size(8).with_mode(Mode::Static { phase: 0.0 });
    /// scene.camera.views = 4;
    /// scene.chest = Some(Chest::default());
    /// scene.scatter = Some(ScatterSettings { tolerance: 0.1, ..ScatterSettings::default() });
    /// let phantom = Phantom::new(scene)?;
    /// let (view, window) = (1, 0);
    /// let scatter = phantom.scatter(0)?.unwrap();
    /// assert_eq!(scatter.view(window, view).len(), 8 * 8);
    /// assert!(scatter.standard_error(window, view).iter().all(|error| *error <= scatter.report().largest_standard_error));
    /// # Ok::<(), heart_phantom::PhantomError>(())
    /// ```
    ///
    /// # Errors
    /// [`PhantomError::Count`] if there is no such gate; as [`Phantom::view`]; [`PhantomError::Scatter`].
    pub fn scatter(&self, gate: usize) -> Result<Option<&Scatter>, PhantomError> {
        check_count("gate", gate, [0, self.n_gates() - 1])?;
        self.scattered(gate, None)
    }

    /// All scattered photons of a gate in an energy window, `[view][row][bin]`.
    pub(crate) fn scatter_samples(
        &self,
        gate: usize,
        window: usize,
    ) -> Result<Vec<f32>, PhantomError> {
        let n_views = self.camera().n_views();
        let Some(scatter) = self.scatter(gate)? else {
            return Ok(vec![0.0; n_views * self.camera().view_len()]);
        };
        let samples = (0..n_views).flat_map(|view| scatter.view(window, view));
        Ok(samples.map(|sample| sample as f32).collect())
    }

    /// Number of energy windows.
    pub(crate) fn n_windows(&self) -> usize {
        (self.scene().scatter.as_ref()).map_or(1, |settings| settings.windows.len())
    }

    /// Turns unscattered photons in some rows of some projections into all photons in an energy window, and states their error.
    pub(super) fn add_scatter(
        &self,
        (gate, window): (usize, usize),
        part: &RowsOfViews,
        taken: &mut Sinograms,
    ) -> Result<(), PhantomError> {
        let Some(settings) = &self.scene().scatter else {
            return Ok(());
        };
        let (camera, n_bins) = (self.camera(), self.camera().n_bins());
        let (views, rows) = part;
        let known = (*part == camera.all_rows()).then(|| largest_of(&taken.samples));
        let Some(scatter) = self.scattered(gate, known)? else {
            return Ok(());
        };
        let primary = settings.spectrum()?.efficiency(window, settings.energy) as f32;
        let own = taken.samples.chunks_mut((rows.len() * n_bins).max(1));
        for (view, own) in views.clone().zip(own) {
            let more = scatter.view(window, view);
            for (sample, more) in own.iter_mut().zip(&more[rows.start * n_bins..]) {
                *sample = primary * *sample + *more as f32;
            }
        }
        let largest = largest_of(&taken.samples);
        if largest > 0.0 {
            taken.view_error.scatter = scatter.largest_error() / largest;
        }
        Ok(())
    }

    /// Scatter of a gate, computed once; `known` is the largest unscattered sample of the gate, if it is known.
    fn scattered(&self, gate: usize, known: Option<f64>) -> Result<Option<&Scatter>, PhantomError> {
        let Some(settings) = &self.scene().scatter else {
            return Ok(None);
        };
        let scatter = once(&self.scattered[gate], || {
            let largest = match known {
                Some(known) => known,
                None => {
                    let _views = simd_set::part(0..1, 2);
                    let all = self.camera().all_rows();
                    largest_of(&self.primary(gate, all, &no_observer)?.samples)
                }
            };
            let _photons = simd_set::part(1..2, 2);
            match largest > 0.0 {
                true => self.follow(gate, settings, settings.tolerance * largest),
                false => Ok(None),
            }
        })?;
        Ok(scatter.as_ref())
    }

    /// Follows photons to an absolute tolerance.
    fn follow(
        &self,
        gate: usize,
        settings: &ScatterSettings,
        tolerance: f64,
    ) -> Result<Option<Scatter>, PhantomError> {
        let Some(attenuation) = self.scene().attenuates() else {
            return Ok(None);
        };
        let around = self.parts.surroundings.sources().to_vec();
        let height = self.camera().n_rows() as f64 * self.camera().detector().pitch()[1];
        let source = Emitters::new(self.hearts(gate)?, around, height);
        let body = &source.states[source.states.len() / 2].body;
        let water = water_attenuation(settings.energy)?;
        let medium = Tissue::new(&attenuation, body, self.parts.organs.as_ref(), water)?;
        let options = settings.options(tolerance, self.camera());
        let (camera, spectrum) = (
            self.scatter_camera(gate, &self.radii()?)?,
            settings.spectrum()?,
        );
        let scatter = Scatter::new(&source, &medium, &camera, &spectrum, &options)?;
        Ok(Some(scatter))
    }

    /// The camera of a gate.
    fn scatter_camera(&self, gate: usize, radii: &[f64]) -> Result<Camera, PhantomError> {
        let (detector, response) = (self.camera().detector(), self.response()?);
        let views: Vec<View> = (self.view_times(gate)?.iter().zip(radii))
            .map(|(time, &radius)| View {
                // Exact, and the angle itself within a turn.
                angle: time.angle % TAU,
                radius,
            })
            .collect();
        let response = Response {
            slope: response.slope(),
            at_face: response.at_face(),
            intrinsic: response.intrinsic(),
        };
        let size = [self.camera().n_bins(), self.camera().n_rows()];
        Ok(Camera::new(size, detector.pitch(), &views, response)?)
    }

    /// Memory in bytes: of all gates, and in addition per thread; nothing without scatter.
    ///
    /// # Errors
    /// [`PhantomError::Scatter`] for more nodes than the limit.
    pub(super) fn bytes_of_scatter(&self, radii: &[f64]) -> Result<[u64; 2], PhantomError> {
        let Some(settings) = &self.scene().scatter else {
            return Ok([0; 2]);
        };
        let [all, each] = Scatter::bytes(
            &self.scatter_camera(0, radii)?,
            &settings.spectrum()?,
            &settings.options(settings.tolerance, self.camera()),
        )?;
        Ok([all * self.n_gates() as u64, each])
    }

    /// Returns the states of the heart whose average the projections of a gate are: averages over cells of volume and respiratory phase.
    fn hearts(&self, gate: usize) -> Result<Vec<State>, PhantomError> {
        let (scan, times) = (self.heart_scan(gate)?, self.states(gate)?);
        let mut low = [f64::INFINITY; 2];
        let mut high = [f64::NEG_INFINITY; 2];
        for time in &times {
            for (k, x) in [time.gain, time.breath].into_iter().enumerate() {
                (low[k], high[k]) = (low[k].min(x), high[k].max(x));
            }
        }
        let mut sums = BTreeMap::<[usize; 2], [f64; 3]>::new();
        for time in &times {
            let at = [time.gain, time.breath];
            // 0 / 0 is cell 0.
            let cell = |k: usize| (CELLS * (at[k] - low[k]) / (high[k] - low[k])) as usize;
            let sum = sums.entry([cell(0), cell(1)]).or_default();
            for (sum, x) in sum.iter_mut().zip([1.0, time.gain, time.breath]) {
                *sum += time.share * x;
            }
        }
        let sums: Vec<_> = sums.into_values().filter(|sum| sum[0] > 0.0).collect();
        let gains: Vec<f64> = sums.iter().map(|[share, gain, _]| gain / share).collect();
        let shapes = self.parts.heart.shapes(&gains)?;
        let placed = scan.placed(&shapes)?;
        (sums.iter().zip(&shapes))
            .map(|([share, _, breath], shape)| {
                let body = shape
                    .body()
                    .with_pose(self.pose((breath / share).clamp(0.0, 1.0))?);
                let activity = self.scene().activity.of(shape);
                let defects = (placed.of(shape).iter())
                    .map(|(_, sector, factor)| {
                        (sector.with_pose(*body.pose()), activity[1] * factor)
                    })
                    .collect();
                Ok(State::new(*share, body, activity, defects))
            })
            .collect()
    }
}
