//! One photon history: emission, forced interactions, and its detection in every view after each of them.

use crate::camera::Grid;
use crate::error::{ScatterError, valid};
use crate::medium::Path;
use crate::spectrum::{ATTENUATION, HIGHEST, IMPORTANCE, SCATTERED, WINDOWS};
use crate::{Compton, Medium, Random, ScatterReport, Source, Spectrum};

/// A detection with less than this part of the probability of isotropic scattering into the photopeak window is computed with a probability
/// of its own: most of the time goes into paths to the detector.
const FULL_DETECTION: f64 = 0.5;

/// Everything that histories are functions of.
pub(crate) struct Problem<'a> {
    pub(crate) source: &'a dyn Source,
    pub(crate) medium: &'a dyn Medium,
    pub(crate) spectrum: &'a Spectrum,
    pub(crate) grid: Grid,
    pub(crate) directions: Vec<[f64; 3]>,
    pub(crate) orders: usize,
    pub(crate) seed: u64,
}

/// Sums over the histories of a block, and work arrays.
#[derive(Debug, Default)]
pub(crate) struct Tally {
    pub(crate) deposits: Vec<f32>,
    pub(crate) report: ScatterReport,
    path: Path,
}

/// A photon, with its weight relative to that of its first interaction.
struct Photon {
    position: [f64; 3],
    direction: [f64; 3],
    energy: f64,
    weight: f64,
    order: usize,
}

impl Problem<'_> {
    /// Follows the histories of a block.
    pub(crate) fn block(
        &self,
        block: u64,
        histories: usize,
        tally: &mut Tally,
    ) -> Result<(), ScatterError> {
        tally.deposits.clear();
        tally.deposits.resize(self.grid.n_deposits(), 0.0);
        tally.report = ScatterReport::default();
        let mut random = Random::new(self.seed, block);
        for _ in 0..histories {
            self.history(&mut random, tally)?;
        }
        tally.report.histories = histories as u64;
        Ok(())
    }

    fn history(&self, random: &mut Random, tally: &mut Tally) -> Result<(), ScatterError> {
        let emission = self.source.emit(random);
        let mut scale = valid("weight of an emission", emission.weight)?;
        valid(
            "distance of an emission",
            emission.position.iter().map(|x| x.abs()).sum(),
        )?;
        if scale == 0.0 {
            return Ok(());
        }
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
            }
            self.detect(&photon, scale, random, tally)?;
            let cosine = Compton::of(photon.energy).sample(random);
            photon.energy = Compton::of(photon.energy).energy_at(cosine);
            photon.direction = turned(photon.direction, cosine, random);
            // As many photons are followed as can be expected to be recorded.
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
        let distance = path.distance(-(-interacts * random.uniform()).ln_1p() / mu);
        for axis in 0..3 {
            photon.position[axis] += distance * photon.direction[axis];
        }
        photon.weight *= interacts * at.get(SCATTERED);
        photon.order += 1;
        tally.report.interactions += 1;
        Ok(true)
    }

    /// Adds the probability of scattering into each view and reaching it to the image.
    fn detect(
        &self,
        photon: &Photon,
        scale: f64,
        random: &mut Random,
        tally: &mut Tally,
    ) -> Result<(), ScatterError> {
        let compton = Compton::of(photon.energy);
        let [x, y, _] = photon.direction;
        for (view, direction) in self.directions.iter().enumerate() {
            let cosine = x * direction[0] + y * direction[1];
            let Some(at) = self.spectrum.at(compton.energy_at(cosine)) else {
                continue;
            };
            let mut density = photon.weight * compton.relative_density(cosine);
            let keep = density * at.get(HIGHEST) / FULL_DETECTION;
            if keep < 1.0 {
                if random.uniform() >= keep {
                    continue;
                }
                density /= keep;
            }
            let Some(place) = self.grid.place(view, photon.position) else {
                continue;
            };
            let column = tally
                .path
                .follow(self.medium, photon.position, *direction)?;
            let value = scale * density * (-at.get(ATTENUATION) * column).exp();
            let values = |window| value * at.get(WINDOWS + window);
            self.grid.add(&place, values, &mut tally.deposits);
            tally.report.paths += 1;
            let order = photon.order.min(ScatterReport::ORDERS) - 1;
            tally.report.by_order[order] += values(0);
        }
        Ok(())
    }
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
