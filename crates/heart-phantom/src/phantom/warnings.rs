//! Looks for what is allowed and yet may surprise: before any work, and for the report.

use super::Phantom;
use super::output::Product;
use super::products::Needs;
use super::warning::{Edge, Seen, Warning};
use crate::error::PhantomError;
use crate::{HeartShape, Mode, Rotation};
use revolve_voxel::{Body, EllipticCylinder, Organ, Organs, VoxelGrid};
use std::f64::consts::PI;

/// Directions of half a turn in which it is looked for a gap: the widest one is found to 1 - cos(pi / 128), 3e-4 of itself.
const DIRECTIONS: usize = 64;
/// Overlap of heart and bone in mL that is below what the sampling of it resolves.
const MOST_OVERLAP: f64 = 0.5;

impl Phantom {
    /// What is allowed and yet may surprise; nothing if all is as one expects. It solves the shapes that are looked
    /// at most, one or two. It casts rays of one view only where line integrals are wide apart.
    ///
    /// Views that end before the heart or the background does are truncated: filtered back-projection takes what they do not
    /// see for nothing, which streaks. A torso that attenuates does so however wide it is, but volumes hold no more of it than
    /// the bins see; and however narrow it is, though the heart reach out of it.
    ///
    /// ```
    /// use heart_phantom::{Edge, Phantom, Seen, Warning, scene::{Mode, Scene}};
    /// let mut scene = Scene::default().with_size(32).with_mode(Mode::Static { phase: 0.5 });
    /// assert!(Phantom::new(scene.clone())?.warnings()?.is_empty());
    /// scene.pose.shift = [3.0, 0.0, 0.0];
    /// let warnings = Phantom::new(scene)?.warnings()?;
    /// assert!(matches!(warnings[..], [Warning::Truncated { what: Seen::Heart, edge: Edge::Bins, .. }]));
    /// println!("{}", warnings[0]);
    /// # Ok::<(), heart_phantom::PhantomError>(())
    /// ```
    ///
    /// # Errors
    /// What solving the shapes can return.
    pub fn warnings(&self) -> Result<Vec<Warning>, PhantomError> {
        let parts = self.parts();
        let mut found = Vec::new();
        let bodies = self.outermost()?;
        match self.out_of_view(&bodies)? {
            Some(warning) => found.push(warning),
            None => found.extend(self.truncated_heart(&bodies)?),
        }
        let background = parts
            .scene
            .background
            .filter(|around| around.concentration > 0.0);
        if let Some(around) = background {
            let widest = self.widest_ellipse(&around.torso()?);
            found.extend(self.beyond_bins(Seen::Background, widest));
        }
        found.extend(self.truncated_organs()?);
        let medium = parts.attenuation.filter(|medium| medium.coefficient > 0.0);
        if let Some(torso) = medium.and_then(|medium| medium.torso()) {
            let widest = self.widest_ellipse(&torso);
            found.extend(self.beyond_bins(Seen::Torso, widest));
            let times = (bodies.iter()).map(|body| torso.growth_to_hold(body));
            let times = times.fold(0.0, f64::max);
            // It is too large by less than that.
            found.extend((times > 1.0 + 1e-4).then_some(Warning::OutOfTorso { times }));
        }
        // Through a collimator there would be no view at all, and of a heart that is elsewhere enough was said.
        let elsewhere = found.iter().any(|w| matches!(w, Warning::OutOfView { .. }));
        if parts.collimator.is_none() && !elsewhere {
            found.extend(
                self.inside()?
                    .map(|(view, facing)| Warning::DetectorInside {
                        view,
                        radius: facing.radius,
                        needed: facing.body,
                    }),
            );
        }
        // Behind a face within the body there is no view to look at.
        if parts.collimator.is_none() || self.inside()?.is_none() {
            let aliasing = self.aliasing()?.filter(|[.., error]| *error > 0.0);
            found.extend(aliasing.map(|[pitch, fwhm, error]| Warning::Aliased {
                pitch,
                fwhm,
                error,
            }));
        }
        if parts.scene.output.has(Product::Projections) {
            found.extend(self.uneven_angles()?);
        }
        if parts.scene.output.needs(Needs::Reconstruction) {
            found.extend(self.few_directions());
        }
        found.extend(self.bone_in_the_heart(&bodies)?);
        Ok(found)
    }

    /// End-systole and end-diastole, or the one phase of a static scan.
    pub(crate) fn outermost_phases(&self) -> Vec<f64> {
        match self.scene().acquisition.mode {
            Mode::Static { phase } => vec![phase],
            Mode::Instants | Mode::Exposure { .. } | Mode::WholeCycle | Mode::Gated { .. } => {
                self.extreme_phases().to_vec()
            }
        }
    }

    /// The solids within the outer membrane between which all others lie: at end-systole and end-diastole, or at the one phase that is
    /// looked at.
    pub(crate) fn outermost(&self) -> Result<Vec<Body>, PhantomError> {
        let breaths: &[f64] = match self.cycle().breathing() {
            None => &[0.0],
            Some(_) => &[0.0, 0.5, 1.0],
        };
        let mut bodies = Vec::new();
        for phase in self.outermost_phases() {
            let body = outside_of(&*self.shape(phase)?)?;
            for breath in breaths {
                bodies.push(body.standing(self.pose(*breath)?));
            }
        }
        Ok(bodies)
    }

    /// Organs that reach beyond the bins, or beyond the rows: of those that are active, and of those that only attenuate, the farthest.
    fn truncated_organs(&self) -> Result<Vec<Warning>, PhantomError> {
        let organs = self.parts().organs.iter().flat_map(Organs::as_slice);
        let (active, others): (Vec<&Organ>, Vec<&Organ>) =
            organs.partition(|organ| organ.activity > 0.0);
        let weakens = |organ: &&Organ| organ.attenuation > 0.0;
        let passive: Vec<&Organ> = others.into_iter().filter(weakens).collect();
        let mut found = Vec::new();
        for (what, organs) in [(Seen::Background, active), (Seen::Torso, passive)] {
            let (mut widest, mut highest) = (None, 0.0f64);
            for organ in organs {
                let ([x, y, z], [a, b, c]) = organ.shape.bounds();
                let section = EllipticCylinder::new([x, y], [a, b])?;
                if let Some((half, theta)) = self.widest_ellipse(&section) {
                    wider(&mut widest, half, theta);
                }
                // What has no ends goes on beyond any rows, as a background does.
                if c.is_finite() {
                    highest = highest.max(z.abs() + c);
                }
            }
            found.extend(self.beyond_bins(what, widest));
            let rows = truncated(what, Edge::Rows, 2.0 * highest, self.height(), None);
            found.extend(rows);
        }
        Ok(found)
    }

    fn truncated_heart(&self, bodies: &[Body]) -> Result<Vec<Warning>, PhantomError> {
        let mut widest: Option<(f64, f64)> = None;
        let mut highest = 0.0f64;
        for body in bodies {
            let [x, y, z] = half_extents(body);
            highest = highest.max(z);
            // No view can miss what is nearer to the axis than that.
            let views = match 2.0 * x.hypot(y) > self.width() {
                true => self.seen_from(),
                false => Vec::new(),
            };
            for theta in views {
                wider(&mut widest, half_extents(&turned(body, theta)?)[0], theta);
            }
        }
        let rows = truncated(Seen::Heart, Edge::Rows, 2.0 * highest, self.height(), None);
        let bins = self.beyond_bins(Seen::Heart, widest);
        Ok(bins.into_iter().chain(rows).collect())
    }

    /// Whether the field of view misses the heart at every phase, and by how much. Its phases lie between the outermost ones.
    fn out_of_view(&self, bodies: &[Body]) -> Result<Option<Warning>, PhantomError> {
        let [low, high] = span(bodies, 2)?;
        let mut found = vec![(Edge::Rows, low.max(-high), 0.5 * self.height())];
        // How far a convex body is from the axis: the widest gap between the two that any direction shows.
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
        Ok(outside.map(|(edge, nearest, reach)| Warning::OutOfView {
            edge,
            nearest,
            reach,
        }))
    }

    /// Projections from fewer directions than their number promises, such as several turns in large steps. A parallel projection from
    /// the opposite side is the same direction.
    fn few_directions(&self) -> Option<Warning> {
        let angles = self.camera().geometry().angles();
        let mut directions: Vec<f64> = angles.iter().map(|angle| angle.rem_euclid(PI)).collect();
        directions.sort_by(f64::total_cmp);
        // Angles in degrees are rounded; the smallest step of a camera is far larger.
        directions.dedup_by(|a, b| (*a - *b).abs() < 1e-6);
        let (first, last) = (directions.first()?, directions.last()?);
        let again = directions.len() > 1 && first + PI - last < 1e-6;
        let n = directions.len() - usize::from(again);
        (n < 3 || 2 * n < angles.len()).then_some(Warning::FewDirections {
            directions: n,
            views: angles.len(),
        })
    }

    /// The organ that attenuates more than the heart, such as the spine, of which the heart takes the place most.
    fn bone_in_the_heart(&self, bodies: &[Body]) -> Result<Option<Warning>, PhantomError> {
        let parts = self.parts();
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
                if volume > worst.map_or(MOST_OVERLAP, |(_, most)| most) {
                    worst = Some((organ, volume));
                }
            }
        }
        Ok(worst.map(|(organ, volume)| Warning::InBone { organ, volume }))
    }

    fn uneven_angles(&self) -> Result<Option<Warning>, PhantomError> {
        let mut off = 0.0f64;
        for gate in 0..self.n_gates() {
            let times = self.view_times(gate)?;
            for (time, written) in times.iter().zip(self.written_angles(gate)?) {
                off = off.max((time.angle - written).abs());
            }
        }
        // Below what a header in degrees tells.
        Ok((off > 1e-9).then_some(Warning::UnevenAngles { off }))
    }

    /// The angles of the views of a gate as the format of the projections has them: some know of even steps only.
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

    /// The angles of the views; of a camera that turns, those at which each begins and ends besides.
    fn seen_from(&self) -> Vec<f64> {
        let shares: &[f64] = match self.camera().rotation() {
            Rotation::StepAndShoot => &[0.5],
            Rotation::Continuous => &[0.0, 0.5, 1.0],
        };
        (0..self.camera().n_views())
            .flat_map(|view_idx| shares.iter().map(move |share| (view_idx, *share)))
            .map(|(view_idx, share)| self.camera().angle(view_idx, share))
            .collect()
    }

    /// How far to either side an elliptic cylinder reaches, and from where that is seen.
    fn widest_ellipse(&self, torso: &EllipticCylinder) -> Option<(f64, f64)> {
        let ([x, y], [a, b]) = (torso.centre(), torso.semi_axes());
        let mut widest = None;
        for theta in self.seen_from() {
            let (sin, cos) = theta.sin_cos();
            let middle = x * cos + y * sin;
            wider(&mut widest, middle.abs() + (a * cos).hypot(b * sin), theta);
        }
        widest
    }

    fn beyond_bins(&self, what: Seen, widest: Option<(f64, f64)>) -> Option<Warning> {
        let edge = Edge::Bins;
        widest
            .and_then(|(half, theta)| truncated(what, edge, 2.0 * half, self.width(), Some(theta)))
    }

    /// Length of the rows of a view in cm.
    fn width(&self) -> f64 {
        self.camera().n_bins() as f64 * self.camera().pitch()
    }

    /// Height of a view in cm.
    fn height(&self) -> f64 {
        self.camera().n_rows() as f64 * self.camera().detector().pitch()[1]
    }
}

/// Volume that a body and an organ have in common, in mL: samples in the middle of 40 cells along each side of the body's box.
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

fn truncated(
    what: Seen,
    edge: Edge,
    needed: f64,
    seen: f64,
    angle: Option<f64>,
) -> Option<Warning> {
    // What only rounding puts outside is inside.
    (needed > seen * (1.0 + 1e-9)).then_some(Warning::Truncated {
        what,
        edge,
        needed,
        seen,
        angle,
    })
}

fn wider(widest: &mut Option<(f64, f64)>, half: f64, theta: f64) {
    if widest.is_none_or(|(most, _)| half > most) {
        *widest = Some((half, theta));
    }
}

/// The solid within the outer membrane.
fn outside_of(shape: &HeartShape) -> Result<Body, PhantomError> {
    let layers = shape.body().layers();
    Ok(Body::new(
        vec![layers[layers.len() - 1].clone()],
        *shape.body().pose(),
    )?)
}

/// A body as a camera at an angle has it: along x what is along its bins.
pub(super) fn turned(body: &Body, theta: f64) -> Result<Body, PhantomError> {
    let pose = body.pose().turned_z(-theta)?;
    Ok(Body::new(body.layers().to_vec(), pose)?)
}

/// From where to where bodies reach along an axis, all together.
pub(super) fn span(bodies: &[Body], axis: usize) -> Result<[f64; 2], PhantomError> {
    let mut all = [f64::INFINITY, f64::NEG_INFINITY];
    for body in bodies {
        let [low, high] = body.bounding_box(0)?;
        all = [all[0].min(low[axis]), all[1].max(high[axis])];
    }
    Ok(all)
}

/// How far a body reaches from the planes through the origin, to the farther side.
pub(super) fn half_extents(body: &Body) -> [f64; 3] {
    let [low, high] = body.bounding_box(0).unwrap_or_default();
    [0, 1, 2].map(|a| high[a].max(-low[a]))
}
