//! Detection of warnings, before a run and for its report.

use super::Phantom;
use super::output::Product;
use super::products::Needs;
use super::warning::{Warning, WarningKind};
use crate::error::PhantomError;
use crate::scan::LEAST_DIRECTIONS;
use crate::scene::ReconstructionSettings;
use crate::text::{brief, enough};
use crate::{Counts, GateFiles, HeartShape, Method, RayGeometry};
use radon::{ArcPolicy, RadonError};
use revolve_voxel::{Body, Organ, Organs, VoxelGrid};
use std::f64::consts::TAU;

/// Largest overlap of heart and bone, as a fraction of the volume of the heart, that the sampling does not resolve.
const MOST_OVERLAP: f64 = 2e-3;

impl Phantom {
    /// Returns the warnings of the scene ([`WarningKind`]): allowed values that are probably not intended. Solves one or two shapes. Casts the rays
    /// of one view only if line integrals may alias. Whether all views and products can be computed is checked by [`Phantom::prepare`] only.
    ///
    /// ```
    /// use heart_phantom::{Phantom, WarningKind, Mode, Scene};
    /// let mut scene = Scene::default().with_size(32).with_mode(Mode::Static { phase: 0.5 });
    /// assert!(Phantom::new(scene.clone())?.warnings()?.is_empty());
    /// scene.pose.shift = [3.0, 0.0, 0.0];
    /// let warnings = Phantom::new(scene)?.warnings()?;
    /// assert_eq!((warnings[0].what, warnings[0].key), (WarningKind::TruncatedHeart, "camera.bins"));
    /// assert!(warnings[0].numbers["needed_cm"] > warnings[0].numbers["available_cm"]);
    /// println!("{}", warnings[0]);
    /// # Ok::<(), heart_phantom::PhantomError>(())
    /// ```
    ///
    /// # Errors
    /// Errors of the solver.
    pub fn warnings(&self) -> Result<Vec<Warning>, PhantomError> {
        let bodies = self.outermost()?;
        let mut found = self.truncations(&bodies)?;
        // A heart outside all views has a warning of its own.
        let elsewhere = found.iter().any(|w| w.what == WarningKind::OutOfView);
        found.extend(self.detector_inside(elsewhere)?);
        found.extend(self.aliased()?);
        let output = &self.scene().output;
        if output.has(Product::Projections) {
            found.extend(self.uneven_angles()?);
        }
        if output.needs(Needs::Reconstruction) {
            found.extend(self.few_directions().or_else(|| self.short_arc()));
            found.extend(self.uncorrected());
        }
        found.extend(self.unused());
        found.extend(self.untimed_counts()?);
        let activity = &self.scene().activity;
        let heart = [activity.cavity, activity.wall].map(|uptake| uptake.concentration(1.0));
        let sources = self.parts.surroundings.sources();
        if heart == [0.0; 2] && !sources.iter().any(|organ| organ.activity > 0.0) {
            let message = "nothing in the scene is active: all samples are zero".to_owned();
            found.push(Warning::new(
                WarningKind::NoActivity,
                "activity",
                [],
                message,
            ));
        }
        found.extend(self.unusual());
        found.extend(self.unsuitable(&bodies)?);
        found.extend(self.bone_in_the_heart(&bodies)?);
        found.extend(self.steep_twist()?);
        Ok(found)
    }

    /// Returns a warning if the collimator face of line integrals is inside the body; with a collimator that is an error.
    fn detector_inside(&self, elsewhere: bool) -> Result<Option<Warning>, PhantomError> {
        let is_parallel = self.camera().ray_geometry().is_none();
        if self.parts.collimator.is_some() || elsewhere || !is_parallel {
            return Ok(None);
        }
        Ok(self.inside()?.map(|(view, facing)| {
            let (radius, needed) = (facing.radius, facing.body);
            let message = format!(
                "the collimator face is inside the body: in view {view} it is {} cm from the axis of rotation, and the body extends {} cm towards it",
                brief(radius),
                enough(needed)
            );
            let numbers = [
                ("view", view as f64),
                ("radius_cm", radius),
                ("needed_cm", needed),
            ];
            Warning::new(
                WarningKind::DetectorInside,
                "camera.radius",
                numbers,
                message,
            )
        }))
    }

    /// Returns a warning if values at bin centres differ from averages over bins, which exist unless the collimator face is inside the body.
    fn aliased(&self) -> Result<Option<Warning>, PhantomError> {
        let has_bins = (self.camera().ray_geometry()).is_none_or(RayGeometry::has_bins);
        if !has_bins || (self.parts.collimator.is_some() && self.inside()?.is_some()) {
            return Ok(None);
        }
        let found = self.aliasing()?.filter(|[.., error]| *error > 0.0);
        Ok(found.map(|[pitch, fwhm, error]| {
            let response = match fwhm > 0.0 {
                true => format!(", and the response has a FWHM of {} cm", brief(fwhm)),
                false => String::new(),
            };
            let message = format!(
                "samples are values at the centres of bins with a pitch of {} cm{response}: they differ from averages over bins by up to \
                 {} % of the largest sample in the first view; camera.samples = \"averages\" computes these",
                brief(pitch),
                brief(100.0 * error)
            );
            let numbers = [("pitch_cm", pitch), ("fwhm_cm", fwhm), ("error", error)];
            Warning::new(WarningKind::Aliased, "camera.samples", numbers, message)
        }))
    }

    /// Returns the settings without effect.
    fn unused(&self) -> impl Iterator<Item = Warning> {
        let (scene, own) = (self.scene(), &self.scene().reconstruction);
        let wants = |product| scene.output.has(product);
        let default = ReconstructionSettings::default();
        let (filters, fbp) = match (scene.output.needs(Needs::Reconstruction), &own.method) {
            (false, _) => (false, "nothing is reconstructed"),
            (true, Method::Osem(_)) => (false, "it belongs to method = \"fbp\""),
            (true, Method::Fbp) => (true, ""),
        };
        let window = !filters && own.window != default.window;
        let cutoff = !filters && own.cutoff != default.cutoff;
        let arc = !filters && own.arc != default.arc;
        let compensation = self.is_compensated() && self.n_gates() == 1;
        let noise = scene.noise.is_some() && !scene.output.needs(Needs::Views);
        let one_file = scene.output.gates == GateFiles::OneFile && self.n_gates() == 1;
        let shows = wants(Product::Motion) || self.is_compensated();
        let twist =
            scene.twist.is_some() && !shows && scene.defects.is_empty() && scene.points.is_empty();
        let breathing = scene.breathing.is_some() && self.cycle().breathing().is_none();
        [
            ("reconstruction.window", window, fbp),
            ("reconstruction.cutoff", cutoff, fbp),
            ("reconstruction.arc", arc, fbp),
            (
                "reconstruction.compensation",
                compensation,
                "there is one gate",
            ),
            ("noise", noise, "no views are acquired"),
            ("output.gates", one_file, "there is one gate"),
            ("twist", twist, "no defect, point or motion is requested"),
            ("breathing", breathing, "shift and rotation are zero"),
        ]
        .into_iter()
        .filter(|(_, unused, _)| *unused)
        .map(|(key, _, reason)| {
            let message = format!("{key} has no effect: {reason}");
            Warning::new(WarningKind::Unused, key, [], message)
        })
    }

    /// Whether counts do not depend on acquisition times that differ by more than 1 %.
    fn untimed_counts(&self) -> Result<Option<Warning>, PhantomError> {
        let counts = self.scene().noise.map(|noise| noise.counts);
        if !matches!(counts, Some(Counts::Total(_) | Counts::PerUnit(_))) {
            return Ok(None);
        }
        let (mut shortest, mut longest) = (f64::INFINITY, 0.0f64);
        for gate in 0..self.n_gates() {
            for time in self.view_times(gate)? {
                shortest = shortest.min(time.window);
                longest = longest.max(time.window);
            }
        }
        let message = format!(
            "views take {} to {} s, but their counts do not depend on it; noise.counts = \"expected\" with a section [counting] includes the times",
            brief(shortest),
            brief(longest)
        );
        let numbers = [("shortest_s", shortest), ("longest_s", longest)];
        let warning = Warning::new(WarningKind::UntimedCounts, "noise.counts", numbers, message);
        Ok((longest > 1.01 * shortest).then_some(warning))
    }

    /// Returns end-systole and end-diastole, or the phase of a static scene.
    pub(crate) fn outermost_phases(&self) -> Vec<f64> {
        match self.scene().acquisition.mode.static_phase() {
            Some(phase) => vec![phase],
            None => self.cycle().extreme_phases().to_vec(),
        }
    }

    /// Returns the solids within the outer membrane at these phases; all others lie between them.
    pub(crate) fn outermost(&self) -> Result<Vec<Body>, PhantomError> {
        let breaths: &[f64] = match self.cycle().breathing() {
            None => &[0.0],
            Some(_) => &[0.0, 0.5, 1.0],
        };
        let mut bodies = Vec::new();
        for phase in self.outermost_phases() {
            let body = outside_of(&*self.shape(phase)?)?;
            for breath in breaths {
                bodies.push(body.with_pose(self.pose(*breath)?));
            }
        }
        Ok(bodies)
    }

    /// Returns a warning if views share directions, for example over several turns in large steps. Opposite parallel projections have the same
    /// direction.
    fn few_directions(&self) -> Option<Warning> {
        let (directions, views) = (self.camera().n_directions(), self.camera().n_views());
        let are_few = directions < LEAST_DIRECTIONS || 2 * directions < views;
        let message = format!(
            "the {views} projections have only {directions} distinct directions; a reconstruction needs more"
        );
        let numbers = [("directions", directions as f64), ("views", views as f64)];
        are_few.then(|| Warning::new(WarningKind::FewDirections, "camera.views", numbers, message))
    }

    /// Returns a warning if OSEM reconstructs parallel projections with a gap; filtered back-projection asks for a policy then.
    fn short_arc(&self) -> Option<Warning> {
        let is_parallel = self.camera().ray_geometry().is_none();
        self.scene()
            .reconstruction
            .method
            .osem()
            .filter(|_| is_parallel)?;
        let weights = self.camera().geometry().view_weights(ArcPolicy::Complete);
        let Err(RadonError::ShortArc { gap, .. }) = weights else {
            return None;
        };
        let gap = gap.to_degrees();
        let message = format!(
            "the views leave a gap of {} degrees between neighbouring directions: osem distorts the volume along them; camera.arc is in degrees",
            brief(gap)
        );
        let numbers = [("gap_degrees", gap)];
        Some(Warning::new(
            WarningKind::ShortArc,
            "camera.arc",
            numbers,
            message,
        ))
    }

    /// Largest attenuation coefficient of medium and organs, 1/cm; 0 without any.
    fn largest_attenuation(&self) -> f64 {
        let medium = (self.scene().attenuates()).map_or(0.0, |own| own.coefficient);
        let organs = self.parts.surroundings.sources().iter();
        (organs.map(|organ| organ.attenuation)).fold(medium, f64::max)
    }

    fn uncorrected(&self) -> Option<Warning> {
        let osem = self.scene().reconstruction.method.osem();
        let models = osem.is_some_and(|osem| osem.attenuation);
        let coefficient = self.largest_attenuation();
        (!models && coefficient > 0.0).then(|| {
            let message = format!(
                "the scene attenuates (up to {} /cm), but the reconstruction does not model it: activities inside the body are too small; \
                 osem with attenuation = true models it",
                brief(coefficient)
            );
            let numbers = [("coefficient_per_cm", coefficient)];
            Warning::new(WarningKind::Uncorrected, "reconstruction.method", numbers, message)
        })
    }

    /// Values outside the range of patients. Water has 0.096 /cm at 511 keV and more below: 9.6 and more in 1/m.
    fn unusual(&self) -> Vec<Warning> {
        let rate = self.cycle().beats_per_minute();
        let values = [
            ("cycle.beats_per_minute", rate, [20.0, 300.0], "1/min"),
            (
                "attenuation.coefficient",
                self.largest_attenuation(),
                [0.0, 5.0],
                "1/cm",
            ),
        ];
        (values.into_iter())
            .filter(|(_, value, [low, high], _)| !(low..=high).contains(&value))
            .map(|(key, value, [low, high], unit)| {
                let message = format!(
                    "{key} is {}, usually it is between {low} and {high} {unit}",
                    brief(value)
                );
                let numbers = [("value", value), ("least", low), ("most", high)];
                Warning::new(WarningKind::Unusual, key, numbers, message)
            })
            .collect()
    }

    /// Returns the organ of stronger attenuation than the heart, such as the spine, with the largest overlap.
    fn bone_in_the_heart(&self, bodies: &[Body]) -> Result<Option<Warning>, PhantomError> {
        let (Some(organs), Some(own)) = (&self.parts.organs, self.scene().attenuates()) else {
            return Ok(None);
        };
        let mut worst: Option<(usize, f64)> = None;
        for (organ, bone) in organs.as_slice().iter().enumerate() {
            if bone.attenuation <= 1.1 * own.coefficient {
                continue;
            }
            for body in bodies {
                let volume = overlap(body, bone)?;
                let least = MOST_OVERLAP * body.layers()[0].mass_properties().volume;
                if volume > worst.map_or(least, |(_, most)| most) {
                    worst = Some((organ, volume));
                }
            }
        }
        Ok(worst.map(|(organ, volume)| {
            let message = format!(
                "the heart overlaps organ {}, which attenuates more, by {} mL and replaces it there (organ 5 of [chest] is the spine); change [pose]",
                organ + 1,
                brief(volume)
            );
            let numbers = [("organ", organ as f64), ("volume_ml", volume)];
            Warning::new(WarningKind::InBone, "pose", numbers, message)
        }))
    }

    /// Returns a warning if a twist, at its largest, is too steep for the boundaries of defects.
    fn steep_twist(&self) -> Result<Option<Warning>, PhantomError> {
        if self.scene().twist.is_none() || self.scene().defects.is_empty() {
            return Ok(None);
        }
        for phase in self.outermost_phases() {
            let twist = self.wall(phase)?.wall_twist()?;
            if twist.is_some_and(|twist| twist.is_steep()) {
                let message = "the twist changes by more than 2.9 degrees within 1/256 of the size of the heart: there the boundaries of \
                               defects are less accurate than the tolerances state";
                let message = message.to_owned();
                return Ok(Some(Warning::new(
                    WarningKind::SteepTwist,
                    "twist",
                    [],
                    message,
                )));
            }
        }
        Ok(None)
    }

    fn uneven_angles(&self) -> Result<Option<Warning>, PhantomError> {
        let mut off = 0.0f64;
        for gate in 0..self.n_gates() {
            let times = self.view_times(gate)?;
            for (time, written) in times.iter().zip(self.written_angles(gate)?) {
                off = off.max((time.angle - written).abs());
            }
        }
        // Below the precision of angles in headers.
        Ok((off > 1e-9).then(|| {
            let off = off.to_degrees();
            let message = format!(
                "the gates have uneven angles, up to {off:.3} degrees from the even steps that the projection format stores; \
                 report.json and other formats contain each angle"
            );
            let numbers = [("off_degrees", off)];
            Warning::new(WarningKind::UnevenAngles, "output.projections", numbers, message)
        }))
    }

    /// Returns the angles of the views of a gate as the projection format stores them: some store even steps only.
    pub(crate) fn written_angles(&self, gate: usize) -> Result<Vec<f64>, PhantomError> {
        let angles = self.view_times(gate)?.into_iter().map(|time| time.angle);
        if !self.scene().output.projections.info().even_steps {
            return Ok(angles.collect());
        }
        let nominal = self.camera().geometry().angles();
        let off: f64 = angles.zip(nominal).map(|(a, b)| a - b).sum();
        let off = off / nominal.len() as f64;
        Ok(nominal.iter().map(|angle| angle + off).collect())
    }
}

/// Returns the common volume of a body and an organ in mL, from samples at the centres of 40^3 cells of the body's bounding box.
fn overlap(body: &Body, organ: &Organ) -> Result<f64, PhantomError> {
    const SIDE: usize = 40;
    let [low, high] = body.bounding_box(0)?;
    let sides = [0, 1, 2].map(|a| (high[a] - low[a]) / SIDE as f64);
    let centre = [0, 1, 2].map(|a| 0.5 * (low[a] + high[a]));
    let grid = VoxelGrid::centred([SIDE; 3], sides, centre)?;
    let organ = Organs::new(vec![*organ])?;
    let fractions: Vec<f64> = organ.voxelize(&grid, 0..SIDE, |_| 1.0)?;
    let inside = |k: usize| {
        let place = grid.centre(k % SIDE, k / SIDE % SIDE, k / (SIDE * SIDE));
        body.layers()[0].contains(&body.pose().to_body(&place))
    };
    let covered: f64 = (fractions.iter().enumerate())
        .filter(|(k, fraction)| **fraction > 0.0 && inside(*k))
        .map(|(_, fraction)| fraction)
        .sum();
    Ok(covered * grid.voxel_volume())
}

/// Returns the solid within the outer membrane.
fn outside_of(shape: &HeartShape) -> Result<Body, PhantomError> {
    let layers = shape.body().layers();
    Ok(Body::new(
        vec![layers[layers.len() - 1].clone()],
        *shape.body().pose(),
    )?)
}

/// Rotates a body into the frame of a camera at an angle: x along the bins.
pub(super) fn turned(body: &Body, theta: f64) -> Result<Body, PhantomError> {
    Ok(body.with_pose(body.pose().rotated_z(-theta % TAU)?))
}

/// Returns the joint extent of bodies along an axis.
pub(super) fn span(bodies: &[Body], axis: usize) -> Result<[f64; 2], PhantomError> {
    let mut all = [f64::INFINITY, f64::NEG_INFINITY];
    for body in bodies {
        let [low, high] = body.bounding_box(0)?;
        all = [all[0].min(low[axis]), all[1].max(high[axis])];
    }
    Ok(all)
}

/// Returns the largest distance of a body from each coordinate plane.
pub(super) fn half_extents(body: &Body) -> [f64; 3] {
    let [low, high] = body.bounding_box(0).unwrap_or_default();
    [0, 1, 2].map(|a| high[a].max(-low[a]))
}
