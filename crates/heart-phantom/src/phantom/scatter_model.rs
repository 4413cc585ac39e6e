//! Heart, organs and background as the source and the medium of scattered photons.

use crate::Attenuation;
use crate::error::PhantomError;
use photon_scatter::{Emission, Medium, Piece, Random, Source};
use revolve_voxel::nalgebra::{Point3, Vector3};
use revolve_voxel::{Body, Organ, Organs, Ray, Sector, Span};
use std::f64::consts::{PI, TAU};

/// The heart at a volume and a respiratory phase.
pub(super) struct State {
    /// Fraction of the time.
    share: f64,
    pub(super) body: Body,
    /// Where the outermost layer begins on the axis, its length and its radius.
    size: [f64; 3],
    /// Activity of cavity and wall.
    activity: [f64; 2],
    /// Defects and the activity that each adds to that of the wall.
    defects: Vec<(Sector, f64)>,
    /// Largest activity.
    most: f64,
}

impl State {
    /// Creates a state from a body, the activity of cavity and wall, and the activity that each defect adds to the wall.
    pub(super) fn new(
        share: f64,
        body: Body,
        activity: [f64; 2],
        defects: Vec<(Sector, f64)>,
    ) -> Self {
        let outermost = &body.layers()[body.layers().len() - 1];
        let [from, to] = outermost.x_range();
        let raised = defects.iter().map(|(_, more)| activity[1] + more);
        Self {
            share,
            size: [from, to - from, outermost.r_max()],
            most: raised.fold(activity[0].max(activity[1]), f64::max),
            activity,
            defects,
            body,
        }
    }

    /// Whether a ray has its origin in a layer.
    fn holds(&self, layer: usize, ray: &Ray) -> bool {
        let spans = self.body.spans(layer, ray).unwrap_or_default();
        spans
            .iter()
            .any(|span| span.enter <= 0.0 && span.exit > 0.0)
    }

    /// Activity at the origin of a ray; `None` outside the heart.
    fn activity(&self, ray: &Ray) -> Option<f64> {
        if !self.holds(self.body.layers().len() - 1, ray) {
            return None;
        }
        let [cavity, wall] = self.activity;
        if self.holds(0, ray) {
            return Some(cavity);
        }
        let defects = self.defects.iter();
        let within = defects.filter(|(sector, _)| sector.contains(&ray.origin()));
        Some(wall + within.map(|(_, more)| more).sum::<f64>())
    }

    /// Volume of the cylinder around the heart.
    fn volume(&self) -> f64 {
        PI * self.size[2].powi(2) * self.size[1]
    }
}

/// Heart, organs and background.
pub(super) struct Emitters {
    pub(super) states: Vec<State>,
    organs: Vec<Organ>,
    /// Total activity of each organ, parts that others replace included.
    amounts: Vec<f64>,
    half_height: f64,
}

/// Points in cylinders are drawn uniformly at the height of the detector and beyond with a density that decreases with this length in cm, about
/// that of attenuation; not farther than `BEYOND`, from where scatter is attenuated to less than 1 %.
const TAIL: f64 = 20.0;
const BEYOND: f64 = 30.0;

impl Emitters {
    /// Heart, organs and background, with the height of the detector.
    pub(super) fn new(states: Vec<State>, organs: Vec<Organ>, height: f64) -> Self {
        let half_height = 0.5 * height;
        let amount = |organ: &Organ| {
            let (_, [a, b, c]) = organ.shape.bounds();
            let volume = match c.is_finite() {
                true => 4.0 / 3.0 * PI * a * b * c,
                false => PI * a * b * 2.0 * (half_height - TAIL * (-BEYOND / TAIL).exp_m1()),
            };
            organ.activity * volume
        };
        Self {
            amounts: organs.iter().map(amount).collect(),
            organs,
            half_height,
            states,
        }
    }

    /// Draws a point in an organ, with its weight: 0 where another organ replaces this one.
    fn in_organ(&self, which: usize, random: &mut Random) -> (Point3<f64>, f64) {
        let (centre, half) = self.organs[which].shape.bounds();
        let mut weight = 1.0;
        let ([x, y], z) = match half[2].is_finite() {
            true => {
                let r = random.uniform().cbrt();
                let [x, y, z] = random.direction().map(|x| r * x);
                ([x, y], centre[2] + half[2] * z)
            }
            false => {
                let (r, turn) = (random.uniform().sqrt(), TAU * random.uniform());
                let tail = -(-BEYOND / TAIL).exp_m1();
                let place = random.uniform() * (self.half_height + TAIL * tail);
                let mut z = place;
                if place > self.half_height {
                    let beyond = -TAIL * (-random.uniform() * tail).ln_1p();
                    z = self.half_height + beyond;
                    weight = (beyond / TAIL).exp();
                }
                let below = random.uniform() < 0.5;
                let across = [r * turn.cos(), r * turn.sin()];
                (across, if below { -z } else { z })
            }
        };
        let at = Point3::new(centre[0] + half[0] * x, centre[1] + half[1] * y, z);
        let later = &self.organs[which + 1..];
        if later.iter().any(|organ| organ.shape.contains(&at)) {
            weight = 0.0;
        }
        (at, weight)
    }
}

impl Source for Emitters {
    fn emit(&self, random: &mut Random) -> Emission {
        let mut place = random.uniform();
        let state = (self.states.iter()).find(|state| {
            place -= state.share;
            place < 0.0
        });
        let state = state.unwrap_or(&self.states[self.states.len() - 1]);
        let own = state.most * state.volume();
        let all = own + self.amounts.iter().sum::<f64>();
        let mut place = all * random.uniform() - own;
        let organ = self.amounts.iter().position(|amount| {
            let before = place;
            place -= amount;
            before >= 0.0 && place < 0.0
        });
        let emission = |at: Point3<f64>, weight: f64| Emission {
            position: at.coords.into(),
            weight: all * weight,
        };
        let axis = state.body.pose().axis();
        match organ {
            Some(which) => {
                let (at, weight) = self.in_organ(which, random);
                let ray = Ray::new(at, axis);
                let free = ray.is_ok_and(|ray| state.activity(&ray).is_none());
                emission(at, if free { weight } else { 0.0 })
            }
            None => {
                let [from, length, radius] = state.size;
                let (r, turn) = (radius * random.uniform().sqrt(), TAU * random.uniform());
                let x = from + length * random.uniform();
                let at = Point3::new(x, r * turn.cos(), r * turn.sin());
                let at = state.body.pose().to_lab(&at);
                let ray = Ray::new(at, axis).ok();
                let activity = ray.and_then(|ray| state.activity(&ray)).unwrap_or(0.0);
                let emits = state.most * random.uniform() < activity;
                emission(at, f64::from(u8::from(emits)))
            }
        }
    }
}

/// The medium of the projections as water of the same attenuation.
pub(super) struct Tissue<'a> {
    /// The heart, which replaces organs, and whether it attenuates.
    body: Option<&'a Body>,
    /// Centre and squared radius of a ball around it: most rays miss it.
    ball: (Point3<f64>, f64),
    /// The organs, the first of which replaces the others.
    organs: Vec<Quadric>,
    /// Density of the heart.
    density: f64,
}

/// The unit ball or the unit cylinder after a shift and a scaling, for sizes whose squares neither overflow nor underflow: with
/// [`OrganShape::span`](revolve_voxel::OrganShape::span), which is safe for any size, scatter takes 1.3 times as long (5.6 for 4.3 CPU s in `chest.toml`).
struct Quadric {
    centre: Vector3<f64>,
    /// Reciprocals of the semi-axes.
    scale: Vector3<f64>,
    density: f64,
}

impl Quadric {
    fn span(&self, position: Vector3<f64>, direction: Vector3<f64>) -> Option<Span> {
        let p = (position - self.centre).component_mul(&self.scale);
        let v = direction.component_mul(&self.scale);
        let (square, product) = (v.norm_squared(), p.dot(&v));
        let root = product * product - square * (p.norm_squared() - 1.0);
        (root > 0.0 && square > 0.0).then(|| Span {
            enter: (-product - root.sqrt()) / square,
            exit: (-product + root.sqrt()) / square,
        })
    }
}

impl<'a> Tissue<'a> {
    /// The medium around a heart, and the attenuation of water.
    pub(super) fn new(
        attenuation: &Attenuation,
        body: &'a Body,
        organs: Option<&Organs>,
        water: f64,
    ) -> Result<Self, PhantomError> {
        let [low, high] = body.bounding_box(body.layers().len() - 1)?;
        let torso = attenuation.torso();
        let organs = match &torso {
            Some(torso) => std::slice::from_ref(torso),
            None => organs.map_or(&[][..], Organs::as_slice),
        };
        let quadric = |organ: &Organ| {
            let (centre, half) = organ.shape.bounds();
            Quadric {
                centre: centre.into(),
                scale: half.map(f64::recip).into(),
                density: organ.attenuation / water,
            }
        };
        Ok(Self {
            body: torso.is_none().then_some(body),
            // Larger than any rounding error.
            ball: (
                Point3::from((low.coords + high.coords) * 0.5),
                0.2501 * (high - low).norm_squared(),
            ),
            organs: organs.iter().rev().map(quadric).collect(),
            density: attenuation.coefficient / water,
        })
    }
}

impl Medium for Tissue<'_> {
    fn is_empty(&self) -> bool {
        (self.body.is_none() || self.density == 0.0)
            && self.organs.iter().all(|organ| organ.density == 0.0)
    }

    fn pieces(&self, position: [f64; 3], direction: [f64; 3], pieces: &mut Vec<Piece>) {
        let (position, direction) = (Vector3::from(position), Vector3::from(direction));
        let beside = (position - self.ball.0.coords).cross(&direction);
        if let Some(body) = self.body
            && beside.norm_squared() <= self.ball.1
            && let Ok(ray) = Ray::new(position.into(), direction)
        {
            let spans = body.spans(body.layers().len() - 1, &ray);
            for span in spans.unwrap_or_default() {
                fill(pieces, span, self.density);
            }
        }
        for organ in &self.organs {
            if let Some(span) = organ.span(position, direction) {
                fill(pieces, span, organ.density);
            }
        }
    }
}

/// Adds the parts of a span that no ordered piece covers.
fn fill(pieces: &mut Vec<Piece>, span: Span, density: f64) {
    let (mut enter, mut k) = (span.enter.max(0.0), 0);
    while enter < span.exit {
        let next = pieces.get(k).copied();
        let exit = next.map_or(span.exit, |next| next.enter.min(span.exit));
        if exit > enter {
            let piece = Piece {
                enter,
                exit,
                density,
            };
            pieces.insert(k, piece);
            k += 1;
        }
        k += 1;
        enter = next.map_or(span.exit, |next| enter.max(next.exit));
    }
}
