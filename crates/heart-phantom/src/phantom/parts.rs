//! What a phantom is made of: the domain's own types, put together by hand or from a scene.

use super::method::{Compensation, Method};
use super::output::{Output, Product};
use crate::error::{PhantomError, check, check_count};
use crate::model::{Attenuation, Background, without_overlap};
use crate::ranges;
use crate::scan::{Accuracy, BinSample, Collimation, Counting, Counts, Mode, Noise, Orbit, STEPS};
use crate::{Activity, Camera, Cycle, Defect, Heart, MaterialPoint, Rotation, Twist, ViewTime};
use radon::FbpOptions;
use revolve_voxel::Organs;
use std::f64::consts::TAU;

/// Bytes for the work arrays of a reconstruction: what [`Method::Auto`](radon::Method::Auto) needs at most, and as many again as
/// 40 threads use.
pub(crate) const WORK_BYTES: usize = 320 << 20;
/// Where the wall's side is, if nothing else is said: two fifths of the way from base to apex.
const SIDE: f64 = 0.2;

/// Everything that a [`Phantom`](crate::Phantom) is made of. Any heart will do: any two membranes one within the other
/// ([`Heart::of_membranes`]), any [`Cycle`].
///
/// Lengths in cm, times in seconds, angles in radians. [`PhantomParts::new`] is a plain scan of the heart alone, with the defaults of
/// a scene; every field may be set. The parts of a scene are `Scene::parts` (feature `scene`).
///
/// ```
/// use heart_phantom::membrane_newton::{Discretisation, Membrane, RestShape};
/// use heart_phantom::revolve_voxel::Pose;
/// use heart_phantom::{Camera, Cycle, Defect, Heart, Mode, Phantom, PhantomParts, VolumeCurve, WallRegion};
/// # fn main() -> Result<(), heart_phantom::PhantomError> {
/// // Two half ellipses, `[x, y]` from (0, b) over the apex (a, 0) to (0, -b), and a beat of five samples.
/// let ellipse = |a: f64, b: f64| -> Result<Membrane, heart_phantom::PhantomError> {
///     let half = |k: i32| std::f64::consts::PI * (0.5 - f64::from(k) / 100.0);
///     let points: Vec<_> = (0..=100).map(half).map(|t| [a * t.cos(), b * t.sin()]).collect();
///     Ok(Membrane::new(RestShape::polyline(&points)?))
/// };
/// let nodes = Discretisation::FiniteDifferences { nodes: 101 };
/// let membranes = [ellipse(8.0, 2.5)?, ellipse(9.0, 3.5)?];
/// let heart = Heart::of_membranes([&membranes[0], &membranes[1]], nodes, 0.0, Pose::axis_along_z(4.5)?)?;
/// let curve = VolumeCurve::Sampled(vec![120.0, 80.0, 60.0, 90.0, 110.0]);
/// let cycle = Cycle::with_curve(70.0, &curve, [0.0, 0.5])?;
/// let mut parts = PhantomParts::new(heart, cycle, Camera::new(12, 32, 16.0)?);
/// parts.mode = Mode::Gated { gates: 4 };
/// let region = WallRegion { layers: [0.0, 1.0], s: [0.1, 0.3], azimuths: [0.0, 1.5] };
/// parts.defects.push(Defect { region, activity: 0.2 });
/// let phantom = Phantom::from_parts(parts)?;
/// assert!((phantom.numbers()?.gain - 0.5).abs() < 1e-12);
/// assert_eq!(phantom.view(2, 0)?.len(), 32 * 32);
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct PhantomParts {
    /// What beats.
    pub heart: Heart,
    /// How it beats.
    pub cycle: Cycle,
    /// What looks at it, and the voxels.
    pub camera: Camera,
    /// What cavity and wall hold.
    pub activity: Activity,
    /// What surrounds the heart.
    pub background: Option<Background>,
    /// Organs around the heart, each active and attenuating, in the place of a background; the heart replaces them all, and attenuates
    /// as [`PhantomParts::attenuation`] has it, which is of no torso then.
    pub organs: Option<Organs>,
    /// Pieces of the wall with another activity; where they overlap, the last one counts.
    pub defects: Vec<Defect>,
    /// How far the wall is twisted at end-systole; at any other phase so much less as the cavity is fuller. `None` for a wall that is
    /// not. It moves material and defects, whose sides it puts within 0.1 mm of where they are, and no outline.
    pub twist: Option<Twist>,
    /// Material points whose motion the report has.
    pub points: Vec<MaterialPoint>,
    /// What weakens the rays.
    pub attenuation: Option<Attenuation>,
    /// Full width at half maximum of the detector's Gaussian blur; `None` for lines.
    pub blur: Option<f64>,
    /// Resolution that depends on depth, in front of a collimator where [`PhantomParts::orbit`] has it; `None` for lines.
    pub collimator: Option<Collimation>,
    /// Counts; `None` for their means.
    pub noise: Option<Noise>,
    /// What a sample is in counts, of activities in MBq; `None` if that is not known.
    pub counting: Option<Counting>,
    /// The time that a view sees.
    pub mode: Mode,
    /// How finely that time is sampled.
    pub accuracy: Accuracy,
    /// How volumes are made from the views.
    pub method: Method,
    /// Whether the heart's motion from one set of views to the next is taken back for it.
    pub compensation: Compensation,
    /// Filtered back-projection of the views into the camera's pixels, if that is the method.
    pub reconstruction: FbpOptions,
    /// Largest error of a voxel's covered fraction in exact volumes.
    pub truth_tolerance: f64,
    /// Material coordinate, above 0 (the base) and below 1/2 (the apex), of the wall's side, where thickness and blur are told.
    pub side: f64,
    /// Distance of the collimator's face from the axis in each view, for [`PhantomParts::collimator`]; file formats tell it, too.
    pub orbit: Orbit,
    /// What a sample of a view is: the line through the middle of its bin, or a mean.
    pub bin_sample: BinSample,
    /// What a run writes, and so what [`Phantom::prepare`](crate::Phantom::prepare) and [`Phantom::memory`](crate::Phantom::memory) count on;
    /// it is checked always, and written by `run` only, which comes with the feature `scene`.
    pub output: Output,
}

impl PhantomParts {
    /// The heart alone, its wall of activity 1 and its cavity empty, in means over whole beats of 32 steps: no blur, no noise, Ram-Lak.
    pub fn new(heart: Heart, cycle: Cycle, camera: Camera) -> Self {
        Self {
            heart,
            cycle,
            camera,
            activity: Activity::default(),
            background: None,
            organs: None,
            defects: Vec::new(),
            twist: None,
            points: Vec::new(),
            attenuation: None,
            blur: None,
            collimator: None,
            noise: None,
            counting: None,
            mode: Mode::WholeCycle,
            accuracy: Accuracy::Steps(32),
            method: Method::default(),
            compensation: Compensation::default(),
            reconstruction: FbpOptions::default().with_memory(WORK_BYTES),
            truth_tolerance: 1e-3,
            side: SIDE,
            orbit: Orbit::Circle(20.0),
            bin_sample: BinSample::Centres,
            output: Output::default(),
        }
    }

    /// Each number in its range, and the parts with each other; no shape is solved for it.
    pub(crate) fn check(&self) -> Result<(), PhantomError> {
        self.activity.validate()?;
        if let Some(background) = &self.background {
            let what = "activity of the background";
            check(what, background.concentration, ranges::ACTIVITY)?;
        }
        if self.organs.is_some() {
            let what = "attenuation of the heart, which organs around it need";
            let own = self.attenuation.ok_or(PhantomError::Absent { what })?;
            if own.torso.is_some() || self.background.is_some() {
                return Err(PhantomError::Unsupported {
                    format: "a heart with organs around it",
                    what: "a background, or a torso that attenuates, besides",
                });
            }
        }
        self.check_defects()?;
        check_count("points", self.points.len(), ranges::POINTS)?;
        for point in &self.points {
            check("layer of a point", point.layer, ranges::LAYER)?;
            check("s of a point", point.s, ranges::S)?;
            check("azimuth of a point", point.azimuth, [-2.0 * TAU, 2.0 * TAU])?;
        }
        if let Some(attenuation) = &self.attenuation {
            check("attenuation", attenuation.coefficient, ranges::ATTENUATION)?;
        }
        self.check_times()?;
        self.check_counts()?;
        check(
            "truth tolerance",
            self.truth_tolerance,
            ranges::TRUTH_TOLERANCE,
        )?;
        check("side", self.side, [0f64.next_up(), 0.5f64.next_down()])?;
        self.orbit.check(self.camera.n_views())?;
        self.bin_sample.check()?;
        if let Some(collimator) = &self.collimator {
            let what = "tolerance of the collimator's blur";
            check(what, collimator.tolerance, ranges::BLUR_TOLERANCE)?;
            let what = "FWHM of a blur beside a collimator, which has its own";
            check(what, self.blur.unwrap_or(0.0), [0.0, 0.0])?;
        }
        check(
            "mesh tolerance",
            self.output.mesh_tolerance,
            ranges::MESH_TOLERANCE,
        )?;
        self.check_method()?;
        self.check_output()
    }

    fn check_defects(&self) -> Result<(), PhantomError> {
        check_count("defects", self.defects.len(), ranges::DEFECTS)?;
        for Defect { region, activity } in &self.defects {
            let ascending = |what, [from, to]: [f64; 2], range: [f64; 2]| {
                check(what, from, range)?;
                check(what, to, [from.next_up(), range[1]])
            };
            ascending("layers of a defect", region.layers, ranges::LAYER)?;
            ascending("s of a defect", region.s, ranges::S)?;
            let [from, to] = region.azimuths;
            check("azimuths of a defect", from, [-2.0 * TAU, 2.0 * TAU])?;
            // A turn, and the rounding of a turn in degrees.
            let most = from + TAU * (1.0 + 1e-12);
            check("azimuths of a defect", to, [from.next_up(), most])?;
            check("activity of a defect", *activity, ranges::DEFECT_ACTIVITY)?;
        }
        without_overlap(self.defects.iter().map(|defect| defect.region)).map(drop)
    }

    fn check_times(&self) -> Result<(), PhantomError> {
        let points = match self.accuracy {
            Accuracy::Steps(steps) => check_count("steps", steps, ranges::STEPS)?,
            Accuracy::Tolerance(tolerance) => {
                check("tolerance of the views", tolerance, ranges::VIEW_TOLERANCE)?;
                2
            }
        };
        let gates = check_count("gates", self.mode.n_gates(), ranges::GATES)?;
        for (k, cycle) in self.cycles().iter().enumerate() {
            for gate in 0..gates {
                let acquisition = self.mode.acquisition(gate, points);
                (acquisition.validate(cycle, &self.camera)).map_err(|error| match error {
                    PhantomError::Unseen { gate, view_idx } => PhantomError::Unseen {
                        gate: k * gates + gate,
                        view_idx,
                    },
                    error => error,
                })?;
            }
        }
        Ok(())
    }

    /// Sets of views.
    pub(crate) fn n_gates(&self) -> usize {
        self.mode.n_gates() * self.cycle.breath_gates()
    }

    /// The cycle, each of its respiratory gates by itself.
    pub(super) fn cycles(&self) -> Vec<Cycle> {
        (0..self.cycle.breath_gates())
            .map(|gate| self.cycle.clone().in_breath_gate(gate))
            .collect()
    }

    fn check_counts(&self) -> Result<(), PhantomError> {
        let [least, most] = ranges::COUNTS;
        match (self.noise.map(|noise| noise.counts), &self.counting) {
            (Some(Counts::PerUnit(_) | Counts::Total(_)), Some(_)) => {
                return Err(PhantomError::Unsupported {
                    format: "a camera of known sensitivity",
                    what: "noise of other counts than those expected",
                });
            }
            (Some(Counts::PerUnit(mean) | Counts::Total(mean)), None) => {
                check("counts", mean, [least, most])?;
            }
            (Some(Counts::Expected), None) => {
                let what = "sensitivity of the camera, which expected counts need";
                return Err(PhantomError::Absent { what });
            }
            (Some(Counts::Expected) | None, _) => {}
        }
        let Some(counting) = &self.counting else {
            return Ok(());
        };
        counting.validate()?;
        for gate in 0..self.n_gates() {
            for time in self.view_times(gate) {
                check("seconds that a view counts", time.window, [1e-9, 1e9])?;
            }
            for counts in self.expected_counts(gate).into_iter().flatten() {
                check("expected counts of a sample of 1", counts, [least, most])?;
            }
        }
        Ok(())
    }

    /// When and from where the views of a gate are taken.
    pub(super) fn view_times(&self, gate: usize) -> Vec<ViewTime> {
        let gates = self.mode.n_gates();
        let acquisition = self.mode.acquisition(gate % gates, STEPS[0]);
        let cycle = self.cycle.clone().in_breath_gate(gate / gates);
        (0..self.camera.n_views())
            .map(|view_idx| acquisition.view_time(&cycle, &self.camera, view_idx))
            .collect()
    }

    /// Distance of the collimator's face from the axis in each view, unless the body's contour says it.
    pub(super) fn nominal_radii(&self) -> Option<Vec<f64>> {
        let angles = self.camera.geometry().angles().iter().enumerate();
        (angles.map(|(k, theta)| self.orbit.radius(k, *theta))).collect()
    }

    /// Expected counts of a sample of 1 in each view of a gate, where the camera's sensitivity is known.
    pub(crate) fn expected_counts(&self, gate: usize) -> Option<Vec<f64>> {
        let counting = self.counting.as_ref()?;
        let [bin, row] = self.camera.detector().pitch();
        let lasts = match self.mode {
            Mode::Exposure { seconds } => seconds,
            _ => self.camera.interval(),
        };
        let of = |time: &ViewTime| counting.per_unit(bin * row, time, lasts);
        Some(self.view_times(gate).iter().map(of).collect())
    }

    fn check_output(&self) -> Result<(), PhantomError> {
        let Output {
            write,
            volumes,
            projections,
            ..
        } = &self.output;
        if write.contains(&Product::Pictures) && !cfg!(feature = "files") {
            return Err(PhantomError::NotBuilt {
                what: "pictures",
                feature: "files",
            });
        }
        volumes.info().check_built()?;
        projections.info().check_built()?;
        if self.attenuation.is_none() && write.contains(&Product::Attenuation) {
            let what = "attenuation";
            return Err(PhantomError::Absent { what });
        }
        if projections.info().even_steps && !self.camera.has_even_steps() {
            let what = "views of two heads that make no even steps together";
            return Err(projections.info().cannot_hold(what));
        }
        if write.contains(&Product::Motion) && !volumes.info().fields {
            return Err(volumes.info().cannot_hold("several components per voxel"));
        }
        if projections.info().projections.is_none() {
            return Err(projections.info().cannot_hold("the angles of projections"));
        }
        self.check_gates()
    }

    /// Gates in one file: of a format that has an axis for them, and seen from the same angles.
    fn check_gates(&self) -> Result<(), PhantomError> {
        let (output, what) = (&self.output, "gates in one file");
        if let Some((_, format)) = output.without_gates(self.mode) {
            return Err(format.info().cannot_hold(what));
        }
        let turns = self.camera.rotation() == Rotation::Continuous && self.mode.n_gates() > 1;
        if turns && output.one_file(self.mode) && output.has(Product::Projections) {
            return Err(PhantomError::Unsupported {
                format: "a camera that turns, which sees each gate from other angles,",
                what,
            });
        }
        Ok(())
    }
}

#[cfg(all(test, not(feature = "files")))]
mod tests {
    use super::*;
    use crate::Phantom;

    #[test]
    fn an_output_that_this_build_leaves_out_is_refused() {
        let refused = |change: &dyn Fn(&mut Output)| {
            let heart = Heart::study(51).unwrap();
            let camera = Camera::new(4, 8, 16.0).unwrap();
            let mut parts = PhantomParts::new(heart, Cycle::new(60.0, 0.6).unwrap(), camera);
            change(&mut parts.output);
            match Phantom::from_parts(parts) {
                Err(PhantomError::NotBuilt { what, .. }) => what,
                other => panic!("{other:?}"),
            }
        };
        let pictures = refused(&|output| output.write.push(Product::Pictures));
        assert_eq!(pictures, "pictures");
        let volumes = refused(&|output| output.volumes = Format::NiftiGz);
        assert_eq!(volumes, "compressed NIfTI");
        let projections = refused(&|output| output.projections = Format::Npz);
        assert_eq!(projections, "npz");
    }
}
