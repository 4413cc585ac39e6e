//! Detection of warnings, before a run and for its report.

use super::Phantom;
use super::output::Product;
use super::products::Needs;
use super::warning::{Edge, TruncatedObject, Warning};
use crate::error::PhantomError;
use crate::scan::LEAST_DIRECTIONS;
use crate::scene::ReconstructionSettings;
use crate::{Counts, HeartShape, Method, Mode, RayGeometry, Rotation};
use radon::{ArcPolicy, RadonError};
use revolve_voxel::{Body, Organ, OrganShape, Organs, VoxelGrid};
use std::f64::consts::{PI, TAU};

/// Number of directions over half a turn in which a gap is searched; the widest one is found with a relative error of 1 - cos(pi / 128) = 3e-4.
const DIRECTIONS: usize = 64;
/// Largest overlap of heart and bone, as a fraction of the volume of the heart, that the sampling does not resolve.
const MOST_OVERLAP: f64 = 2e-3;

/// The distance of no object, at no view angle.
const NOTHING: (f64, Option<f64>) = (0.0, None);

impl Phantom {
    /// Returns the warnings of the scene: allowed values that are probably not intended. Solves one or two shapes. Casts the rays of one view only
    /// if line integrals may alias. Whether all views and products can be computed is checked by [`Phantom::prepare`] only.
    ///
    /// Views that do not cover the heart or the background are truncated: filtered back-projection takes missing samples as zero, which causes
    /// streaks. Projections and the model of OSEM include all of an attenuating torso, but attenuation maps end at the field of view; the part of a
    /// heart outside the torso does not attenuate.
    ///
    /// ```
    /// use heart_phantom::{Edge, Phantom, TruncatedObject, Warning, scene::{Mode, Scene}};
    /// let mut scene = Scene::default().with_size(32).with_mode(Mode::Static { phase: 0.5 });
    /// assert!(Phantom::new(scene.clone())?.warnings()?.is_empty());
    /// scene.pose.shift = [3.0, 0.0, 0.0];
    /// let warnings = Phantom::new(scene)?.warnings()?;
    /// assert!(matches!(warnings[..], [Warning::Truncated { object: TruncatedObject::Heart, edge: Edge::Bins, .. }]));
    /// println!("{}", warnings[0]);
    /// # Ok::<(), heart_phantom::PhantomError>(())
    /// ```
    ///
    /// # Errors
    /// Errors of the solver.
    pub fn warnings(&self) -> Result<Vec<Warning>, PhantomError> {
        let parts = &self.parts;
        let mut found = Vec::new();
        let bodies = self.outermost()?;
        match self.out_of_view(&bodies)? {
            Some(warning) => found.push(warning),
            None => found.extend(self.truncated_heart(&bodies)?),
        }
        found.extend(self.truncated_organs());
        let medium = parts.attenuation.filter(|medium| medium.coefficient > 0.0);
        if let Some(Organ { shape: torso, .. }) = medium.and_then(|medium| medium.torso()) {
            let widest = self.widest_ellipse(&torso);
            found.extend(self.truncated(TruncatedObject::Torso, Edge::Bins, widest));
            let times = (bodies.iter()).map(|body| torso.scale_to_contain(body));
            let times = times.fold(0.0, f64::max);
            // The factor is too large by less than 1e-4.
            found.extend((times > 1.0 + 1e-4).then_some(Warning::OutOfTorso { times }));
        }
        // A collimator inside the body is an error, and a heart outside all views has a warning of its own.
        let elsewhere = found.iter().any(|w| matches!(w, Warning::OutOfView { .. }));
        let rays = self.camera().ray_geometry();
        if parts.collimator.is_none() && !elsewhere && rays.is_none() {
            found.extend(
                self.inside()?
                    .map(|(view, facing)| Warning::DetectorInside {
                        view,
                        radius_cm: facing.radius,
                        needed_cm: facing.body,
                    }),
            );
        }
        // No projection exists if the collimator face is inside the body.
        if rays.is_none_or(RayGeometry::has_bins)
            && (parts.collimator.is_none() || self.inside()?.is_none())
        {
            let aliasing = self.aliasing()?.filter(|[.., error]| *error > 0.0);
            found.extend(aliasing.map(|[pitch_cm, fwhm_cm, error]| Warning::Aliased {
                pitch_cm,
                fwhm_cm,
                error,
            }));
        }
        if parts.scene.output.has(Product::Projections) {
            found.extend(self.uneven_angles()?);
        }
        if parts.scene.output.needs(Needs::Reconstruction) {
            found.extend(self.few_directions().or_else(|| self.short_arc()));
            found.extend(self.uncorrected());
        }
        found.extend(self.unused());
        found.extend(self.untimed_counts()?);
        let activity = &parts.scene.activity;
        let heart = [activity.cavity, activity.wall].map(|uptake| uptake.concentration(1.0));
        if heart == [0.0; 2] && !(parts.surroundings.sources().iter()).any(|o| o.activity > 0.0) {
            found.push(Warning::NoActivity);
        }
        found.extend(self.unusual());
        found.extend(self.unsuitable(&bodies)?);
        found.extend(self.bone_in_the_heart(&bodies)?);
        found.extend(self.steep_twist()?);
        Ok(found)
    }

    /// Returns the settings without effect.
    fn unused(&self) -> impl Iterator<Item = Warning> {
        let own = &self.scene().reconstruction;
        let default = ReconstructionSettings::default();
        let fbp = "it belongs to method = \"fbp\"";
        let osem = matches!(own.method, Method::Osem(_));
        [
            (
                "reconstruction.window",
                osem && own.window != default.window,
                fbp,
            ),
            (
                "reconstruction.cutoff",
                osem && own.cutoff != default.cutoff,
                fbp,
            ),
            ("reconstruction.arc", osem && own.arc != default.arc, fbp),
            (
                "reconstruction.compensation",
                self.is_compensated() && self.n_gates() == 1,
                "there is one gate",
            ),
        ]
        .into_iter()
        .filter(|(_, unused, _)| *unused)
        .map(|(key, _, reason)| Warning::Unused { key, reason })
    }

    /// Whether counts do not depend on acquisition times that differ by more than 1 %.
    fn untimed_counts(&self) -> Result<Option<Warning>, PhantomError> {
        let counts = self.scene().noise.map(|noise| noise.counts);
        if !matches!(counts, Some(Counts::Total(_) | Counts::PerUnit(_))) {
            return Ok(None);
        }
        let (mut shortest_s, mut longest_s) = (f64::INFINITY, 0.0f64);
        for gate in 0..self.n_gates() {
            for time in self.view_times(gate)? {
                shortest_s = shortest_s.min(time.window);
                longest_s = longest_s.max(time.window);
            }
        }
        let differ = longest_s > 1.01 * shortest_s;
        Ok(differ.then_some(Warning::UntimedCounts {
            shortest_s,
            longest_s,
        }))
    }

    /// Returns end-systole and end-diastole, or the phase of a static scene.
    pub(crate) fn outermost_phases(&self) -> Vec<f64> {
        match self.scene().acquisition.mode {
            Mode::Static { phase } => vec![phase],
            Mode::Instants | Mode::Exposure { .. } | Mode::WholeCycle | Mode::Gated { .. } => {
                self.cycle().extreme_phases().to_vec()
            }
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

    /// Returns warnings for background and active organs, and for organs that only attenuate, that extend farthest beyond the bins or the rows.
    fn truncated_organs(&self) -> Vec<Warning> {
        let organs = self.parts.surroundings.sources().iter();
        let (active, others): (Vec<&Organ>, Vec<&Organ>) =
            organs.partition(|organ| organ.activity > 0.0);
        let weakens = |organ: &&Organ| organ.attenuation > 0.0;
        let passive: Vec<&Organ> = others.into_iter().filter(weakens).collect();
        let mut found = Vec::new();
        for (what, organs) in [
            (TruncatedObject::Background, active),
            (TruncatedObject::Torso, passive),
        ] {
            let (mut widest, mut highest) = (NOTHING, 0.0f64);
            for organ in organs {
                let ([.., z], [.., c]) = organ.shape.bounds();
                widest = wider(widest, self.widest_ellipse(&organ.shape));
                // An infinite cylinder extends beyond any rows, as a background does.
                if c.is_finite() {
                    highest = highest.max(z.abs() + c);
                }
            }
            found.extend(self.truncated(what, Edge::Bins, widest));
            found.extend(self.truncated(what, Edge::Rows, (highest, None)));
        }
        found
    }

    fn truncated_heart(&self, bodies: &[Body]) -> Result<Vec<Warning>, PhantomError> {
        let (mut widest, mut highest) = (NOTHING, 0.0f64);
        for body in bodies {
            let [x, y, z] = half_extents(body);
            highest = highest.max(z);
            // No view truncates a body that is nearer to the axis.
            let views = match 2.0 * x.hypot(y) > self.width() {
                true => self.view_angles(),
                false => Vec::new(),
            };
            for theta in views {
                let [half, ..] = half_extents(&turned(body, theta)?);
                widest = wider(widest, (half, Some(theta)));
            }
        }
        let bins = self.truncated(TruncatedObject::Heart, Edge::Bins, widest);
        let rows = self.truncated(TruncatedObject::Heart, Edge::Rows, (highest, None));
        Ok(bins.into_iter().chain(rows).collect())
    }

    /// Returns a warning if the field of view misses the heart at every phase. All phases lie between the outermost ones.
    fn out_of_view(&self, bodies: &[Body]) -> Result<Option<Warning>, PhantomError> {
        let [low, high] = span(bodies, 2)?;
        let mut found = vec![(Edge::Rows, low.max(-high), 0.5 * self.height())];
        // Distance of a convex body from the axis: the widest gap in any direction.
        let mut gap = f64::NEG_INFINITY;
        for k in 0..DIRECTIONS {
            let theta = PI * k as f64 / DIRECTIONS as f64;
            let turned = (bodies.iter())
                .map(|body| turned(body, theta))
                .collect::<Result<Vec<_>, _>>()?;
            let [low, high] = span(&turned, 0)?;
            gap = gap.max(low.max(-high));
        }
        found.push((Edge::Bins, gap, 0.5 * self.width()));
        let outside = (found.into_iter()).find(|(_, nearest, reach)| nearest >= reach);
        Ok(
            outside.map(|(edge, nearest_cm, reach_cm)| Warning::OutOfView {
                edge,
                nearest_cm,
                reach_cm,
            }),
        )
    }

    /// Returns a warning if views share directions, for example over several turns in large steps. Opposite parallel projections have the same
    /// direction.
    fn few_directions(&self) -> Option<Warning> {
        let (directions, views) = (self.camera().n_directions(), self.camera().n_views());
        let are_few = directions < LEAST_DIRECTIONS || 2 * directions < views;
        are_few.then_some(Warning::FewDirections { directions, views })
    }

    /// Returns a warning if OSEM reconstructs parallel projections with a gap; filtered back-projection asks for a policy then.
    fn short_arc(&self) -> Option<Warning> {
        let weights = || self.camera().geometry().view_weights(ArcPolicy::Complete);
        match self.scene().reconstruction.method {
            Method::Osem(_) if self.camera().ray_geometry().is_none() => match weights() {
                Err(RadonError::ShortArc { gap, .. }) => Some(Warning::ShortArc {
                    gap_degrees: gap.to_degrees(),
                }),
                Ok(_) | Err(_) => None,
            },
            Method::Osem(_) | Method::Fbp => None,
        }
    }

    /// Largest attenuation coefficient of medium and organs, 1/cm; 0 without any.
    fn largest_attenuation(&self) -> f64 {
        let medium = self.parts.attenuation.iter().map(|own| own.coefficient);
        let organs = self.parts.surroundings.sources().iter();
        medium
            .chain(organs.map(|organ| organ.attenuation))
            .fold(0.0, f64::max)
    }

    fn uncorrected(&self) -> Option<Warning> {
        let models = match self.scene().reconstruction.method {
            Method::Osem(osem) => osem.attenuation,
            Method::Fbp => false,
        };
        let coefficient_per_cm = self.largest_attenuation();
        (!models && coefficient_per_cm > 0.0).then_some(Warning::Uncorrected { coefficient_per_cm })
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
            .map(|(key, value, usual, unit)| Warning::Unusual {
                key,
                value,
                usual,
                unit,
            })
            .collect()
    }

    /// Returns the organ of stronger attenuation than the heart, such as the spine, with the largest overlap.
    fn bone_in_the_heart(&self, bodies: &[Body]) -> Result<Option<Warning>, PhantomError> {
        let parts = &self.parts;
        let (Some(organs), Some(own)) = (&parts.organs, &parts.attenuation) else {
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
        Ok(worst.map(|(organ, volume_ml)| Warning::InBone { organ, volume_ml }))
    }

    /// Returns a warning if a twist, at its largest, is too steep for the boundaries of defects.
    fn steep_twist(&self) -> Result<Option<Warning>, PhantomError> {
        if self.parts.twist.is_none() || self.scene().defects.is_empty() {
            return Ok(None);
        }
        for phase in self.outermost_phases() {
            let twist = self.wall(phase)?.wall_twist()?;
            if twist.is_some_and(|twist| twist.is_steep()) {
                return Ok(Some(Warning::SteepTwist));
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
        Ok((off > 1e-9).then_some(Warning::UnevenAngles {
            off_degrees: off.to_degrees(),
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

    /// Returns the angles of the views; with continuous rotation also those at start and end of each view.
    fn view_angles(&self) -> Vec<f64> {
        let shares: &[f64] = match self.camera().rotation() {
            Rotation::StepAndShoot => &[0.5],
            Rotation::Continuous => &[0.0, 0.5, 1.0],
        };
        (0..self.camera().n_views())
            .flat_map(|view_idx| shares.iter().map(move |share| (view_idx, *share)))
            .map(|(view_idx, share)| self.camera().angle(view_idx, share))
            .collect()
    }

    /// Returns the largest distance of an organ from the axis across the rays, and the angle of that view.
    fn widest_ellipse(&self, torso: &OrganShape) -> (f64, Option<f64>) {
        let ([x, y, _], [a, b, _]) = torso.bounds();
        let half = |theta: f64| {
            let (sin, cos) = theta.sin_cos();
            let middle = x * cos + y * sin;
            (middle.abs() + (a * cos).hypot(b * sin), Some(theta))
        };
        (self.view_angles().into_iter().map(half)).fold(NOTHING, wider)
    }

    /// Returns a warning if an object extends beyond an edge of the views, at a view angle if there is one.
    fn truncated(
        &self,
        object: TruncatedObject,
        edge: Edge,
        (half, angle): (f64, Option<f64>),
    ) -> Option<Warning> {
        let needed_cm = 2.0 * half;
        let available_cm = match edge {
            Edge::Bins => self.width(),
            Edge::Rows => self.height(),
        };
        // Differences within rounding do not count.
        (needed_cm > available_cm * (1.0 + 1e-9)).then_some(Warning::Truncated {
            object,
            edge,
            needed_cm,
            available_cm,
            angle_degrees: angle.map(f64::to_degrees),
        })
    }

    fn unless_parallel(&self) -> f64 {
        (self.camera().ray_geometry()).map_or(1.0, |_| f64::INFINITY)
    }

    /// Returns the length of the rows of a view, cm; infinite unless rays are parallel, so that truncation is not examined.
    pub(super) fn width(&self) -> f64 {
        self.unless_parallel() * self.camera().n_bins() as f64 * self.camera().pitch()
    }

    /// Returns the height of a view, cm.
    fn height(&self) -> f64 {
        self.unless_parallel() * self.camera().n_rows() as f64 * self.camera().detector().pitch()[1]
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

/// Returns the larger of two distances, each with its view angle; the first of equal ones.
fn wider(a: (f64, Option<f64>), b: (f64, Option<f64>)) -> (f64, Option<f64>) {
    if b.0 > a.0 { b } else { a }
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
