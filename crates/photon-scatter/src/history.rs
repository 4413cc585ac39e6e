//! One photon history: emission, forced interactions, and its detection in every view after each of them.

use crate::angles::Angles;
use crate::camera::{Grid, Place};
use crate::error::{ScatterError, valid, within};
use crate::medium::Path;
use crate::spectrum::{ATTENUATION, HIGHEST, IMPORTANCE, SCATTERED, WINDOWS};
use crate::{Compton, Medium, Random, ScatterOptions, ScatterReport, Source, Spectrum};

/// Threshold of the detection probability, in units of that of isotropic scattering into the photopeak window without attenuation. Paths above it are
/// always followed, others with proportional probability (systematic sampling over the views), so that most have one weight.
pub(crate) const FULL_DETECTION: f64 = 0.25;
/// Cells of [`Transmission`] along each axis.
pub(crate) const CELLS: usize = 12;
/// Smallest transmission for the choice of paths: bounds the weights where the transmission exceeds that of the middle of the cell.
const LEAST_TRANSMISSION: f64 = 0.02;

/// Number of detections after which these are distributed to the nodes: 4 MB.
pub(crate) const DETECTIONS: u64 = 65_536;
/// Numbers of emissions of which [`Problem::unit`] is the mean weight, the second if the first weights are 0; its range; the largest weight in it.
const TRIAL_EMISSIONS: [usize; 2] = [1024, 65_536];
const MEAN_WEIGHTS: [f64; 2] = [1e-100, 1e100];
const LARGEST_WEIGHT: f64 = 1e20;

/// The arguments of all histories.
pub(crate) struct Problem<'a> {
    pub(crate) source: &'a dyn Source,
    pub(crate) medium: &'a dyn Medium,
    pub(crate) spectrum: &'a Spectrum,
    /// For the views in which photons are detected: the weight of each in the sum over all views.
    pub(crate) grid: Grid,
    pub(crate) totals: Vec<f64>,
    pub(crate) directions: Vec<[f64; 3]>,
    pub(crate) transmission: Transmission,
    pub(crate) orders: usize,
    pub(crate) seed: u64,
    /// Unit of the deposits, which are in single precision: the mean weight of an emission, rounded to a power of 2; 1 for an empty source.
    pub(crate) unit: f64,
    /// Largest weight of these emissions in this unit.
    pub(crate) heaviest: f64,
}

/// Sums over the histories of a block, and work arrays.
#[derive(Debug, Default)]
pub(crate) struct Tally {
    pub(crate) deposits: Vec<f32>,
    /// Detections of each view that are not yet in the deposits.
    detections: Vec<Vec<Detection>>,
    pub(crate) report: ScatterReport,
    /// Smallest distance of an emission from a face.
    pub(crate) nearest: f64,
    /// Largest weight of a history at its first interaction.
    pub(crate) heaviest: f64,
    /// Sums of [`Sums::depth`](crate::sums::Sums::depth).
    pub(crate) depth: [f64; 2],
    path: Path,
}

/// Transmission from the middles of cells to each view, for the choice of the paths to follow.
pub(crate) struct Transmission {
    half_widths: [f64; 3],
    /// `[z][y][x][view]`.
    values: Vec<f64>,
}

impl Transmission {
    /// Cells between half-widths, and the attenuation of water in cm^2/g.
    pub(crate) fn new(
        half_widths: [f64; 3],
        directions: &[[f64; 3]],
        medium: &dyn Medium,
        attenuation: f64,
    ) -> Result<Self, ScatterError> {
        let mut path = Path::default();
        let mut values = Vec::with_capacity(CELLS.pow(3) * directions.len());
        for cell in 0..CELLS.pow(3) {
            let index = [cell % CELLS, cell / CELLS % CELLS, cell / CELLS.pow(2)];
            let middle = |k: usize| (2 * index[k] + 1) as f64 / CELLS as f64 - 1.0;
            let position = std::array::from_fn(|k| middle(k) * half_widths[k]);
            for direction in directions {
                let column = path.follow(medium, position, *direction)?;
                values.push((-attenuation * column).exp().max(LEAST_TRANSMISSION));
            }
        }
        Ok(Self {
            half_widths,
            values,
        })
    }

    /// Transmission to each view from the cell of a position, or from the nearest one.
    fn at(&self, position: [f64; 3], n_views: usize) -> &[f64] {
        let index = |k: usize| {
            let place = 0.5 * CELLS as f64 * (position[k] / self.half_widths[k] + 1.0);
            (place as usize).min(CELLS - 1)
        };
        let cell = (index(2) * CELLS + index(1)) * CELLS + index(0);
        &self.values[cell * n_views..(cell + 1) * n_views]
    }
}

/// Photons that a view receives from a point: its place, their energy and number.
#[derive(Debug)]
pub(crate) struct Detection(Place, f64, f64);

/// A photon, with its weight relative to that of its first interaction.
struct Photon {
    position: [f64; 3],
    direction: [f64; 3],
    energy: f64,
    weight: f64,
    order: usize,
}

impl<'a> Problem<'a> {
    /// Histories of a source in a medium, for all nodes and the views among them in which photons are detected.
    pub(crate) fn new(
        (source, medium): (&'a dyn Source, &'a dyn Medium),
        spectrum: &'a Spectrum,
        all: &Grid,
        angles: &Angles,
        options: &ScatterOptions,
    ) -> Result<Self, ScatterError> {
        let [unit, heaviest] = unit(source, options.seed)?;
        let grid = all.of_views(&angles.nodes);
        let directions: Vec<_> = grid.directions().collect();
        let water = spectrum.at(spectrum.energy());
        let water = water.map_or(0.0, |at| at.get(ATTENUATION));
        Ok(Self {
            source,
            medium,
            spectrum,
            transmission: Transmission::new(grid.half_widths(), &directions, medium, water)?,
            totals: angles.totals(),
            directions,
            grid,
            orders: options.orders,
            seed: options.seed,
            unit,
            heaviest,
        })
    }

    /// Follows the histories of a block.
    pub(crate) fn block(
        &self,
        block: u64,
        histories: usize,
        tally: &mut Tally,
    ) -> Result<(), ScatterError> {
        tally.deposits.clear();
        tally.deposits.resize(self.grid.n_deposits(), 0.0);
        let n_views = self.directions.len();
        tally.detections.resize_with(n_views, Vec::new);
        tally.report = ScatterReport::default();
        tally.nearest = f64::INFINITY;
        tally.heaviest = 0.0;
        tally.depth = [0.0; 2];
        let mut random = Random::new(self.seed, block);
        let mut distributed = 0;
        for _ in 0..histories {
            simd_set::checkpoint();
            self.history(&mut random, tally)?;
            if tally.report.paths - distributed >= DETECTIONS {
                distributed = tally.report.paths;
                self.distribute(tally);
            }
        }
        self.distribute(tally);
        tally.report.histories = histories as u64;
        Ok(())
    }

    /// Distributes the detections to the nodes, view by view: the nodes of one view stay in the cache.
    fn distribute(&self, tally: &mut Tally) {
        let detections = tally.detections.iter_mut();
        for Detection(place, energy, value) in detections.flat_map(|own| own.drain(..)) {
            if let Some(at) = self.spectrum.at(energy) {
                let values = |window| value * at.get(WINDOWS + window);
                self.grid.add(&place, values, &mut tally.deposits);
            }
        }
    }

    fn history(&self, random: &mut Random, tally: &mut Tally) -> Result<(), ScatterError> {
        let emission = self.source.emit(random);
        let most = LARGEST_WEIGHT * self.unit;
        let weight = within("weight of an emission", emission.weight, [0.0, most])?;
        let mut scale = weight / self.unit;
        valid(
            "distance of an emission",
            emission.position.iter().map(|x| x.abs()).sum(),
        )?;
        if scale == 0.0 {
            return Ok(());
        }
        tally.nearest = tally.nearest.min(self.grid.nearest(emission.position));
        let mut photon = Photon {
            position: emission.position,
            direction: random.direction(),
            energy: self.spectrum.energy(),
            weight: 1.0,
            order: 0,
        };
        let Some(first) = self.spectrum.at(photon.energy) else {
            return Ok(());
        };
        while photon.order < self.orders && self.interact(&mut photon, random, tally)? {
            if photon.order == 1 {
                // Weights are relative to the first interaction.
                scale *= std::mem::replace(&mut photon.weight, 1.0);
                tally.heaviest = tally.heaviest.max(scale);
            }
            self.detect(&photon, scale, random, tally)?;
            let compton = Compton::of(photon.energy);
            let cosine = compton.sample(random);
            photon.energy = compton.towards(cosine).0;
            photon.direction = turned(photon.direction, cosine, random);
            // Russian roulette: the number of followed photons is proportional to the expected number of recorded ones.
            let Some(at) = self.spectrum.at(photon.energy) else {
                break;
            };
            let survival = photon.weight * at.get(IMPORTANCE) / first.get(IMPORTANCE);
            if survival < 1.0 {
                if random.uniform() >= survival {
                    break;
                }
                photon.weight /= survival;
            }
        }
        Ok(())
    }

    /// Moves a photon to its next interaction, weighted with the probability that there is one and that it scatters; false without one.
    fn interact(
        &self,
        photon: &mut Photon,
        random: &mut Random,
        tally: &mut Tally,
    ) -> Result<bool, ScatterError> {
        let Some(at) = self.spectrum.at(photon.energy) else {
            return Ok(false);
        };
        let path = &mut tally.path;
        let column = path.follow(self.medium, photon.position, photon.direction)?;
        let mu = at.get(ATTENUATION);
        let interacts = -(-mu * column).exp_m1();
        if interacts <= 0.0 {
            return Ok(false);
        }
        let [distance, density, depth] = path.reach(-(-interacts * random.uniform()).ln_1p() / mu);
        tally.depth[0] += density * depth;
        tally.depth[1] += density * density;
        for axis in 0..3 {
            photon.position[axis] += distance * photon.direction[axis];
        }
        photon.weight *= interacts * at.get(SCATTERED);
        photon.order += 1;
        tally.report.interactions += 1;
        Ok(true)
    }

    /// Adds the probability of scattering into each view and reaching it to the detections.
    fn detect(
        &self,
        photon: &Photon,
        scale: f64,
        random: &mut Random,
        tally: &mut Tally,
    ) -> Result<(), ScatterError> {
        if !self.grid.has_row(photon.position[2]) {
            return Ok(());
        }
        let compton = Compton::of(photon.energy);
        let [x, y, _] = photon.direction;
        let transmission = self.transmission.at(photon.position, self.directions.len());
        let (mut kept, mut next) = (0.0, random.uniform());
        for (view, direction) in self.directions.iter().enumerate() {
            let (energy, density) = compton.towards(x * direction[0] + y * direction[1]);
            let Some(at) = self.spectrum.at(energy) else {
                continue;
            };
            let density = photon.weight * density;
            let keep = density * at.get(HIGHEST) * transmission[view] / FULL_DETECTION;
            let keep = keep.min(1.0);
            kept += keep;
            if kept <= next {
                continue;
            }
            next += 1.0;
            let Some(place) = self.grid.place(view, photon.position) else {
                continue;
            };
            let path = &mut tally.path;
            let column = path.follow(self.medium, photon.position, *direction)?;
            let value = scale * density / keep * (-at.get(ATTENUATION) * column).exp();
            tally.detections[view].push(Detection(place, energy, value));
            tally.report.paths += 1;
            let order = photon.order.min(ScatterReport::ORDERS) - 1;
            tally.report.by_order[order] += self.totals[view] * value * at.get(WINDOWS);
        }
        Ok(())
    }
}

/// Estimates the mean weight of the emissions of a source, rounds it to a power of 2, and returns the largest weight in this unit.
fn unit(source: &dyn Source, seed: u64) -> Result<[f64; 2], ScatterError> {
    if source.is_empty() {
        return Ok([1.0; 2]);
    }
    let (mut random, mut sum, mut most, mut n) = (Random::new(seed, u64::MAX), 0.0, 0.0f64, 0);
    while n < TRIAL_EMISSIONS[0] || (sum == 0.0 && n < TRIAL_EMISSIONS[1]) {
        let weight = valid("weight of an emission", source.emit(&mut random).weight)?;
        (sum, most, n) = (sum + weight, most.max(weight), n + 1);
    }
    let what = "mean weight of the first emissions";
    let mean = within(what, sum / n as f64, MEAN_WEIGHTS)?;
    let unit = mean.log2().round().exp2();
    Ok([unit, most / unit])
}

/// A unit vector at the angle of this cosine from another one, its azimuth uniform.
fn turned([x, y, z]: [f64; 3], cosine: f64, random: &mut Random) -> [f64; 3] {
    let sine = ((1.0 - cosine) * (1.0 + cosine)).max(0.0).sqrt();
    let (b, a) = (std::f64::consts::TAU * random.uniform()).sin_cos();
    // Two unit vectors across (Duff et al., J. Comput. Graph. Tech. 6 (2017) 1).
    let sign = 1.0f64.copysign(z);
    let p = -1.0 / (sign + z);
    let q = x * y * p;
    let first = [1.0 + sign * x * x * p, sign * q, -sign * x];
    let second = [q, sign + y * y * p, -y];
    let new: [f64; 3] =
        std::array::from_fn(|k| cosine * [x, y, z][k] + sine * (a * first[k] + b * second[k]));
    let norm = new.iter().map(|v| v * v).sum::<f64>().sqrt();
    new.map(|v| v / norm)
}
