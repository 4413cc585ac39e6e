//! Projections of bodies along rays with individual directions.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::PointRaster;
use crate::rays::chord::Hint;
use crate::rays::cone::{Batch, LANES};
use crate::rays::direction::Direction;
use crate::rays::lines::Lines;
use crate::solid::segment::ROUNDING;
use crate::{Meridian, Pose, RayCounters, Sample};

/// Lines that one task projects.
const CHUNK: usize = 256;

impl Lines {
    /// Adds the integrals along lines that are not parallel; `ends` are their rasters in the body frame.
    pub(super) fn project_each<T: Sample>(
        &self,
        ends: Option<[PointRaster; 2]>,
        pose: &Pose,
        layers: &[(&Meridian, f64)],
        out: &mut [T],
    ) -> RayCounters {
        let farthest = pose.farthest(self.farthest);
        let bound = Bound::around(layers, farthest);
        let turn = [Vector3::x(), Vector3::y(), Vector3::z()].map(|e| pose.vector_to_body(&e));
        let set = simd_set::Set::detect();
        out.par_chunks_mut(CHUNK)
            .enumerate()
            .map_init(Scratch::default, |scratch, (chunk, image)| {
                set.run(Chunk {
                    lines: self,
                    turn,
                    shift: pose.isometry().translation.vector,
                    layers,
                    ends,
                    bound,
                    farthest,
                    first: chunk * CHUNK,
                    image,
                    scratch,
                })
            })
            .reduce(RayCounters::default, |a, b| a + b)
    }
}

/// A ball and a cylinder around all layers, in the body frame: lines that miss one of them need no further test.
#[derive(Clone, Copy)]
struct Bound {
    middle: f64,
    ball2: f64,
    radius2: f64,
}

impl Bound {
    fn around(layers: &[(&Meridian, f64)], farthest: f64) -> Self {
        let (mut ends, mut radius, mut near) = ([f64::MAX, f64::MIN], 0.0f64, 0.0f64);
        for (layer, _) in layers {
            let [from, to] = layer.x_range();
            ends = [ends[0].min(from), ends[1].max(to)];
            radius = radius.max(layer.r_max());
            near = near.max(ROUNDING * (layer.size() + farthest));
        }
        let half = 0.5 * (ends[1] - ends[0]);
        Self {
            middle: 0.5 * (ends[0] + ends[1]),
            ball2: (half.hypot(radius) + near).powi(2),
            radius2: (radius + near).powi(2),
        }
    }

    /// The direction as [c, s] and e1, if the line may intersect a layer.
    #[inline(always)]
    fn parts(&self, o: &Point3<f64>, d: &Vector3<f64>) -> Option<[[f64; 2]; 2]> {
        let x = o.x - self.middle;
        let across2 = d.y * d.y + d.z * d.z;
        let norm2 = d.x * d.x + across2;
        let moment = [
            o.y * d.z - o.z * d.y,
            o.z * d.x - x * d.z,
            x * d.y - o.y * d.x,
        ];
        let q2 = moment[0] * moment[0];
        let distance2 = q2 + moment[1] * moment[1] + moment[2] * moment[2];
        if distance2 > self.ball2 * norm2 || q2 > self.radius2 * across2 {
            return None;
        }
        let (norm, across) = (norm2.sqrt(), across2.sqrt());
        Some([[d.x / norm, across / norm], [d.y / across, d.z / across]])
    }
}

/// Scratch memory of a task.
#[derive(Default)]
struct Scratch {
    /// Number in the chunk, origin in the body frame, [c, s] and e1.
    lines: Vec<(usize, Point3<f64>, [[f64; 2]; 2])>,
    sums: Vec<f64>,
    chords: Vec<f64>,
    hints: Vec<Hint>,
    batch: Batch<(usize, f64)>,
    slopes: Slopes,
}

/// Directions in lanes, in the form that intersections with cones use.
#[derive(Default)]
struct Slopes {
    c: [f64; LANES],
    s: [f64; LANES],
    inv_c: [f64; LANES],
    inv_sc: [f64; LANES],
}

/// Some lines, compiled for each instruction set.
struct Chunk<'a, T> {
    lines: &'a Lines,
    /// The axes of the lab in the body frame, and the origin of the body frame in the lab.
    turn: [Vector3<f64>; 3],
    shift: Vector3<f64>,
    layers: &'a [(&'a Meridian, f64)],
    bound: Bound,
    /// The rasters in the body frame.
    ends: Option<[PointRaster; 2]>,
    farthest: f64,
    /// Number of the first line.
    first: usize,
    image: &'a mut [T],
    scratch: &'a mut Scratch,
}

impl Slopes {
    #[inline(always)]
    fn set(&mut self, lane: usize, direction: &Direction) {
        self.c[lane] = direction.c;
        self.s[lane] = direction.s;
        self.inv_c[lane] = direction.inv_c;
        self.inv_sc[lane] = direction.inv_sc;
    }

    #[inline(always)]
    fn direction(&self, lane: usize) -> Direction {
        let (c, s) = (self.c[lane], self.s[lane]);
        Direction {
            c,
            s,
            inv_c: self.inv_c[lane],
            inv_sc: self.inv_sc[lane],
            steep: s >= c.abs(),
            // Unused by the crossing of a cone.
            e1: [1.0, 0.0],
            mid: 0.0,
            along: 1.0,
            near: 0.0,
            beyond: 0.0,
            slack: 0.0,
        }
    }
}

/// Sizes of directions whose squares neither overflow nor underflow.
const PLAIN: std::ops::Range<f64> = 1e-100..1e100;

impl<T> Chunk<'_, T> {
    /// Finds the lines that may intersect a layer.
    #[inline(always)]
    fn prepare(&mut self) {
        let lines = self.lines;
        let [n_bins, _] = lines.size;
        let (mut bin, mut row) = (self.first % n_bins, self.first / n_bins);
        let [x, y, z] = self.turn;
        let turned = |v: Vector3<f64>| x * v.x + y * v.y + z * v.z;
        let found = &mut self.scratch.lines;
        found.clear();
        for k in 0..self.image.len() {
            let (o, d) = match &self.ends {
                Some([from, to]) => {
                    let row = lines.first_row + row;
                    let from = from.at(bin, row);
                    (from, to.at(bin, row) - from)
                }
                None => {
                    let ray = lines.line(bin, row);
                    let from = turned(ray.origin().coords - self.shift);
                    (Point3::from(from), turned(ray.direction()))
                }
            };
            let d = match PLAIN.contains(&d.amax()) {
                true => d,
                false => turned(lines.line(bin, row).direction()),
            };
            found.extend(self.bound.parts(&o, &d).map(|parts| (k, o, parts)));
            bin += 1;
            if bin == n_bins {
                (bin, row) = (0, row + 1);
            }
        }
    }
}

/// Adds the lengths of the signed intervals of some lines to their chords.
#[inline(always)]
fn add(chords: &mut [f64], slopes: &Slopes, batch: &mut Batch<(usize, f64)>) {
    for ((at, sign), [entry, exit]) in batch.drain(|lane| slopes.direction(lane)) {
        chords[at] += sign * (exit - entry);
    }
}

impl<T: Sample> simd_set::Work for Chunk<'_, T> {
    type Out = RayCounters;

    #[inline(always)]
    fn run(mut self) -> RayCounters {
        self.prepare();
        let Scratch {
            lines,
            sums,
            chords,
            hints,
            batch,
            slopes,
        } = self.scratch;
        let mut counters = RayCounters::default();
        (counters.cast, counters.skipped) =
            (lines.len() as u64, (self.image.len() - lines.len()) as u64);
        sums.clear();
        sums.resize(lines.len(), 0.0);
        for &(meridian, weight) in self.layers {
            hints.clear();
            hints.resize(meridian.chains().len(), Hint::default());
            chords.clear();
            chords.resize(lines.len(), 0.0);
            for (at, (_, origin, [parts, e1])) in lines.iter().enumerate() {
                let direction = Direction::of_parts(meridian, self.farthest, *parts, *e1);
                let [w, q, _] = direction.coordinates(origin);
                for (sign, faces) in direction.intervals(meridian, [w, q], hints) {
                    let lane = batch.push([w, q], &faces, (at, sign));
                    slopes.set(lane, &direction);
                    if batch.is_full() {
                        add(chords, slopes, batch);
                    }
                }
            }
            add(chords, slopes, batch);
            for (sum, chord) in sums.iter_mut().zip(&*chords) {
                if *chord > 0.0 {
                    *sum += weight * chord;
                    counters.hit += 1;
                }
            }
        }
        for ((k, ..), sum) in lines.iter().zip(sums) {
            if *sum != 0.0 {
                self.image[*k] += T::from_f64(*sum);
            }
        }
        counters
    }
}
