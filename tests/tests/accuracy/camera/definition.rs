//! Samples by their definition: depth by depth, the line integrals of a dense lattice of rays, weighted by the exact average over the bin of the
//! Gaussian of that depth, or by its value at the centre, and averaged over phases.

use heart_phantom::revolve_voxel::{
    Assembly, Lines, Organ, OrganShape, Organs, ParallelDetector, Shown,
};
use heart_phantom::{BinSample, Chest, Defect, HeartShape, Mode, Phantom, Scene};
use radon::Collimator;
use rayon::prelude::*;
use std::f64::consts::LN_2;

/// Thickness of the slabs of depth in cm; each has the mean variance of both ends.
const SLAB: f64 = 0.1;
/// Standard deviations at which a Gaussian ends.
const REACH: f64 = 5.0;
/// Sets of rows, each shifted along the bins by another multiple of a part of the spacing of the rays: both are Fibonacci numbers.
const SHIFTS: [usize; 2] = [8, 13];
/// Phases of a whole cycle, equidistant; a Gauss-Legendre rule on [-1, 1] for a gate.
const PHASES: usize = 16;
const GAUSS: [[f64; 2]; 5] = [
    [-0.906179845938664, 0.2369268850561891],
    [-0.5384693101056831, 0.4786286704993665],
    [0.0, 0.5688888888888889],
    [0.5384693101056831, 0.4786286704993665],
    [0.906179845938664, 0.2369268850561891],
];

/// The response of a scene; `None` for line integrals averaged over bins.
fn response(scene: &Scene) -> Option<Collimator> {
    match (&scene.collimator, &scene.blur) {
        (Some(settings), _) => settings.response().ok(),
        (None, Some(blur)) => Collimator::new(0.0, 0.0, blur.fwhm / (8.0 * LN_2).sqrt()).ok(),
        (None, None) => None,
    }
}

/// Phases of the first gate with their weights.
fn phases(mode: &Mode) -> Vec<[f64; 2]> {
    match *mode {
        Mode::Static { phase } => vec![[phase, 1.0]],
        Mode::Gated { gates } => GAUSS
            .map(|[x, weight]| [0.5 * (1.0 + x) / gates as f64, 0.5 * weight])
            .to_vec(),
        Mode::WholeCycle => (0..PHASES)
            .map(|k| [(k as f64 + 0.5) / PHASES as f64, 1.0 / PHASES as f64])
            .collect(),
        _ => panic!("{mode:?} is not drawn"),
    }
}

/// All samples `[row][bin]` of a view of the first gate. The error of the reference is kept below a sixteenth of `tolerance`.
pub(super) fn view(phantom: &Phantom, view_idx: usize, tolerance: f64) -> Option<Vec<f64>> {
    let (scene, camera) = (phantom.scene(), phantom.camera());
    let around = Around::of(scene)?;
    let view = View {
        size: [camera.n_bins(), camera.n_rows()],
        pitch: camera.detector().pitch(),
        theta: camera.geometry().angles()[view_idx],
        radius: *phantom.radii().ok()?.get(view_idx)?,
        response: response(scene),
        at_centres: scene.camera.samples == Some(BinSample::Centres),
        is_deep: scene.collimator.is_some(),
        tolerance,
    };
    let mut samples = vec![0.0; view.size[0] * view.size[1]];
    let torso = scene.background.map(|background| background.semi_axes);
    if scene.chest.is_some() || torso.is_some() {
        let reach = torso.map_or(21.0, |[a, b]| 1.01 * a.max(b));
        let everywhere = [[-reach, reach], [-99.0, 99.0]];
        view.add(
            &mut samples,
            everywhere,
            [-reach, reach],
            99.0,
            |rays, slabs| {
                let alone = around.assembly();
                (alone.project_add(rays, Shown::Organs, 1.0, slabs)).expect("surroundings");
            },
        );
    }
    for [phase, weight] in phases(&scene.acquisition.mode) {
        let shape = phantom.shape(phase).ok()?;
        let activity = scene.activity.of(&shape);
        let additional = |own: &Defect| {
            let sector = phantom.wall(phase).ok()?.sector(own, 1e-5).ok()?;
            Some((sector, activity[1] * (own.activity - 1.0)))
        };
        let defects: Vec<_> = scene
            .defects
            .iter()
            .map(additional)
            .collect::<Option<_>>()?;
        let ([side, height, depth], least) =
            (view.reach(&shape)?, shape.body().layers()[0].r_max());
        // The change of the background behind the heart.
        let low = scene.chest.map_or(depth[0], |_| -21.0);
        view.add(
            &mut samples,
            [side, height],
            [low, depth[1]],
            least,
            |rays, slabs| {
                let assembly = around.assembly();
                let with_heart = assembly.with_body(shape.body(), &activity, around.heart);
                let with_heart = with_heart
                    .and_then(|with_heart| with_heart.with_sectors(defects.clone()))
                    .expect("a heart");
                (with_heart.project_add(rays, Shown::Change, weight, slabs)).expect("a heart");
            },
        );
    }
    Some(samples)
}

/// The input of the samples of a view.
struct View {
    size: [usize; 2],
    pitch: [f64; 2],
    theta: f64,
    /// Distance of the collimator's face from the axis.
    radius: f64,
    response: Option<Collimator>,
    at_centres: bool,
    /// Whether the response depends on depth.
    is_deep: bool,
    tolerance: f64,
}

impl View {
    /// Extent of a heart along the bins, along the rows and along the rays.
    fn reach(&self, shape: &HeartShape) -> Option<[[f64; 2]; 3]> {
        let [low, high] = shape.body().bounding_box(1).ok()?;
        let (sin, cos) = self.theta.sin_cos();
        let mut reach = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
        for k in 0..8 {
            let at = |axis: usize| [low[axis], high[axis]][(k >> axis) & 1];
            let (x, y, z) = (at(0), at(1), at(2));
            for (reach, at) in (reach.iter_mut()).zip([x * cos + y * sin, z, y * cos - x * sin]) {
                *reach = [reach[0].min(at - 1e-3), reach[1].max(at + 1e-3)];
            }
        }
        Some(reach)
    }

    /// Adds the result of `project` to the slabs of rays within some bounds, `[side, height]`, across and `depth` along them. `least` is
    /// the smallest radius of the objects.
    fn add(
        &self,
        samples: &mut [f64],
        bounds: [[f64; 2]; 2],
        depth: [f64; 2],
        least: f64,
        project: impl Fn(&Lines, &mut [f32]) + Sync,
    ) {
        let n = match self.is_deep {
            true => ((depth[1] - depth[0]) / SLAB).ceil(),
            false => 1.0,
        };
        let thickness = (depth[1] - depth[0]) / n;
        let sigma = |k: usize| {
            let distance = self.radius - depth[0] - (k as f64 + 0.5) * thickness;
            self.response
                .map_or(0.0, |response| response.sigma(distance))
        };
        let sigmas: Vec<f64> = (0..n as usize).map(sigma).collect();
        let narrowest = sigmas[sigmas.len() - 1];
        let spacing = match narrowest > 0.0 {
            true => 0.3 * narrowest * (6.25 * self.tolerance).powf(0.4).min(0.4),
            // At edges in line with the rows the error is a hundredth of the largest sample at 1 / 48 of the pitch.
            false => {
                let fraction = (100.0 * self.tolerance).sqrt().min(1.0) / 48.0;
                fraction * self.pitch[0].max(self.pitch[1])
            }
        };
        // A square contains one ray of each set.
        let (spacing, side) = (spacing.min(least / 25.0), (SHIFTS[1] as f64).sqrt());
        let bins = [0, 1].map(|axis| {
            let (half, pitch) = (0.5 * self.size[axis] as f64, self.pitch[axis]);
            let reach = REACH * sigmas[0] / pitch;
            let from = (bounds[axis][0] / pitch).max(-half - reach) + half;
            let to = (bounds[axis][1] / pitch).min(half + reach) + half;
            [from.floor(), to.ceil()]
        });
        if bins.iter().any(|[from, to]| to <= from) {
            return;
        }
        let raster = Raster {
            size: self.size,
            pitch: self.pitch,
            at_centres: self.at_centres,
            bins,
            fine: [
                (self.pitch[0] / (spacing * side)).ceil(),
                (self.pitch[1] / (spacing / side)).ceil(),
            ],
            theta: self.theta,
            sigmas,
            planes: (1..n as usize)
                .map(|k| depth[0] + k as f64 * thickness)
                .collect(),
        };
        let parts: Vec<Vec<f64>> = (0..SHIFTS[1])
            .into_par_iter()
            .map_init(Vec::new, |slabs, shift| {
                raster.samples(&raster.set(shift), &project, slabs)
            })
            .collect();
        for part in parts {
            for (sum, value) in samples.iter_mut().zip(part) {
                *sum += value;
            }
        }
    }
}

/// The objects around the heart, and its attenuation if it is not that of the media.
struct Around {
    organs: Organs,
    media: Option<Organs>,
    heart: Option<f64>,
}

impl Around {
    fn of(scene: &Scene) -> Option<Self> {
        if let Some(chest) = scene.chest {
            return Some(Self {
                organs: chest.organs().ok()?,
                media: None,
                heart: Some(Chest::SOFT_TISSUE),
            });
        }
        let cylinder = |centre, semi_axes, activity, attenuation| {
            let shape = OrganShape::cylinder(centre, semi_axes).ok()?;
            let organ = Organ {
                shape,
                activity,
                attenuation,
            };
            Organs::new(vec![organ]).ok()
        };
        Some(Self {
            organs: match scene.background {
                Some(own) => cylinder(own.centre, own.semi_axes, own.concentration, 0.0)?,
                None => Organs::default(),
            },
            media: match scene.attenuation {
                Some(heart_phantom::Attenuation {
                    coefficient,
                    medium: heart_phantom::Medium::Torso { centre, semi_axes },
                }) => Some(cylinder(centre, semi_axes, 0.0, coefficient)?),
                _ => None,
            },
            heart: None,
        })
    }

    fn assembly(&self) -> Assembly<'_> {
        let alone = Assembly::new(&self.organs);
        match &self.media {
            Some(media) => alone.with_media(media),
            None => alone,
        }
    }
}

/// Rays of a view, `fine` of them along each side of a bin.
struct Raster {
    size: [usize; 2],
    pitch: [f64; 2],
    at_centres: bool,
    /// The first bin, and row, with rays, and the one after the last; those of the view begin at 0.
    bins: [[f64; 2]; 2],
    fine: [f64; 2],
    theta: f64,
    sigmas: Vec<f64>,
    planes: Vec<f64>,
}

/// Every 13th row of the rays.
struct Set {
    rays: Lines,
    /// For each slab and ray the first bin that it reaches, and its fractions in the bins from there on.
    along: Vec<(usize, Vec<f64>)>,
    /// Heights of the rows.
    heights: Vec<f64>,
}

impl Raster {
    fn step(&self, axis: usize) -> f64 {
        self.pitch[axis] / self.fine[axis]
    }

    /// Fractions in each bin, or row, of the Gaussian about a position; at its centre, the density times the pitch.
    fn fractions(&self, axis: usize, sigma: f64, at: f64) -> (usize, Vec<f64>) {
        let (n, pitch) = (self.size[axis], self.pitch[axis]);
        let edge = |k: usize| (k as f64 - 0.5 * n as f64) * pitch - at;
        let bin = |x: f64| (x / pitch + 0.5 * n as f64).floor().clamp(0.0, n as f64) as usize;
        if sigma == 0.0 {
            let (first, next) = (bin(at), bin(at) + 1);
            return (first, vec![1.0; next.min(n).saturating_sub(first)]);
        }
        let first = bin(at - REACH * sigma);
        let end = (bin(at + REACH * sigma) + 1).min(n);
        if self.at_centres {
            let density = |z: f64| (-0.5 * z * z).exp() / (sigma * std::f64::consts::TAU.sqrt());
            let at = |k: usize| pitch * density((edge(k) + 0.5 * pitch) / sigma);
            return (first, (first..end).map(at).collect());
        }
        let up_to = |x: f64| 0.5 * libm::erf(x / (sigma * std::f64::consts::SQRT_2));
        let ends: Vec<f64> = (first..=end.max(first)).map(|k| up_to(edge(k))).collect();
        (
            first,
            ends.windows(2).map(|pair| pair[1] - pair[0]).collect(),
        )
    }

    fn set(&self, shift: usize) -> Set {
        let n = [0, 1].map(|axis| {
            let [from, to] = self.bins[axis];
            ((to - from) * self.fine[axis]) as usize
        });
        let first = |axis: usize| {
            let edge = self.bins[axis][0] - 0.5 * self.size[axis] as f64;
            edge * self.pitch[axis] + 0.5 * self.step(axis)
        };
        let rows: Vec<usize> = (shift..n[1]).step_by(SHIFTS[1]).collect();
        let [by, sets] = SHIFTS.map(|n| n as f64);
        let beside = ((by * shift as f64 + 0.5) / sets).fract() - 0.5;
        let height = |row: usize| first(1) + row as f64 * self.step(1);
        let heights: Vec<f64> = rows.into_iter().map(height).collect();
        let middle = 0.5 * (heights[0] + heights[heights.len() - 1]);
        let pitch = [self.step(0), sets * self.step(1)];
        let place = |k: f64| first(0) + (k + beside) * self.step(0);
        let rays = ParallelDetector::new(n[0], heights.len(), pitch)
            .and_then(|detector| detector.with_offset([place(0.5 * (n[0] as f64 - 1.0)), middle]))
            .and_then(|detector| detector.rays(self.theta))
            .and_then(|rays| rays.with_planes(&self.planes))
            .expect("a raster");
        let along = (self.sigmas.iter())
            .flat_map(|sigma| (0..n[0]).map(|k| self.fractions(0, *sigma, place(k as f64))))
            .collect();
        Set {
            rays,
            along,
            heights,
        }
    }

    /// The samples of the result of `project` for the slabs of some rays, written to `slabs`.
    fn samples(
        &self,
        set: &Set,
        project: impl Fn(&Lines, &mut [f32]),
        slabs: &mut Vec<f32>,
    ) -> Vec<f64> {
        let mut samples = vec![0.0; self.size[0] * self.size[1]];
        let (n_bins, n_slabs) = (set.rays.size()[0], self.sigmas.len());
        slabs.clear();
        slabs.resize(set.heights.len() * n_slabs * n_bins, 0.0);
        project(&set.rays, slabs);
        let area = 1.0 / (self.fine[0] * self.fine[1]);
        for (row, slabs) in slabs.chunks(n_slabs * n_bins).enumerate() {
            for (slab, line) in slabs.chunks(n_bins).enumerate() {
                if line.iter().all(|v| *v == 0.0) {
                    continue;
                }
                let mut own = vec![0.0; self.size[0]];
                for (v, (first, fractions)) in line.iter().zip(&set.along[slab * n_bins..]) {
                    let v = f64::from(*v);
                    if v != 0.0 {
                        for (sum, fraction) in own[*first..].iter_mut().zip(fractions) {
                            *sum += v * fraction;
                        }
                    }
                }
                let (first, fractions) = self.fractions(1, self.sigmas[slab], set.heights[row]);
                for (k, fraction) in fractions.iter().enumerate() {
                    let line = &mut samples[(first + k) * self.size[0]..][..self.size[0]];
                    for (sum, v) in line.iter_mut().zip(&own) {
                        *sum += area * fraction * v;
                    }
                }
            }
        }
        samples
    }
}
