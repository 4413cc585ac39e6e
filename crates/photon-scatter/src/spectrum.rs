//! Energies: attenuation by water, and the energy windows of a detector.

use crate::Compton;
use crate::error::{ScatterError, within};

/// Electrons per gram of water: 10 per molecule of 18.0153 g/mol.
const ELECTRONS: f64 = 10.0 * 6.022_140_76e23 / 18.0153;
/// Energies in keV and the photoelectric attenuation of water in cm^2/g: NIST XCOM, H and O (Berger et al., NBSIR 87-3597).
const PHOTOELECTRIC: [[f64; 2]; 13] = [
    [20.0, 0.5439],
    [30.0, 0.145_8],
    [40.0, 0.056_80],
    [50.0, 0.027_25],
    [60.0, 0.014_93],
    [80.0, 5.770e-3],
    [100.0, 2.763e-3],
    [150.0, 7.308e-4],
    [200.0, 2.887e-4],
    [300.0, 8.160e-5],
    [400.0, 3.493e-5],
    [500.0, 1.883e-5],
    [600.0, 1.173e-5],
];
/// Energies in keV that the table covers.
const ENERGIES: [f64; 2] = [PHOTOELECTRIC[0][0], PHOTOELECTRIC[12][0]];
/// Intervals of the tables in energy: linear interpolation is accurate to 1e-6 at a resolution of 5 %.
const INTERVALS: usize = 2048;
/// Photons whose recording probability is at most this in every window are not followed.
const LEAST_EFFICIENCY: f64 = 1e-6;
/// Smallest fraction of the unscattered photons that the first window records.
const LEAST_PHOTOPEAK: f64 = 1e-3;
/// Full width at half maximum of a Gaussian in standard deviations.
const FWHM: f64 = 2.354_820_045_030_949_3;

/// Attenuation of water in cm^2/g without coherent scattering: free electrons (Klein and Nishina) and photoelectric absorption (NIST XCOM,
/// log-log interpolation). 0.15195 at 140.5 keV; XCOM, with bound electrons, has 0.7 % less, and 1.1 % more with coherent scattering.
///
/// ```
/// let water = photon_scatter::water_attenuation(140.5)?;
/// assert!((water - 0.15195).abs() < 5e-6);
/// assert!((0.15091 / water - 1.0 + 0.007).abs() < 5e-4); // XCOM without coherent scattering
/// assert!((0.15368 / water - 1.0 - 0.011).abs() < 5e-4); // and with it
/// # Ok::<(), photon_scatter::ScatterError>(())
/// ```
///
/// # Errors
/// [`ScatterError::OutOfRange`] for an energy outside 20 to 600 keV.
pub fn water_attenuation(energy: f64) -> Result<f64, ScatterError> {
    within("energy in keV", energy, ENERGIES)?;
    Ok(compton_attenuation(energy) + photoelectric(energy))
}

fn compton_attenuation(energy: f64) -> f64 {
    ELECTRONS * Compton::of(energy).cross_section()
}

fn photoelectric(energy: f64) -> f64 {
    let above = PHOTOELECTRIC.partition_point(|[at, _]| *at < energy);
    let above = above.clamp(1, PHOTOELECTRIC.len() - 1);
    let [[low, from], [high, to]] = [PHOTOELECTRIC[above - 1], PHOTOELECTRIC[above]];
    from * (to / from).powf((energy / low).ln() / (high / low).ln())
}

/// Columns of the table: attenuation of water in cm^2/g.
pub(crate) const ATTENUATION: usize = 0;
/// Fraction of the interactions that are scatterings.
pub(crate) const SCATTERED: usize = 1;
/// Largest efficiency of the next scattering in any direction.
pub(crate) const IMPORTANCE: usize = 2;
/// Largest efficiency of any window.
pub(crate) const HIGHEST: usize = 3;
/// Efficiency of the first window; the others follow.
pub(crate) const WINDOWS: usize = 4;

/// The energy of the photons emitted, and the energy resolution and windows of the detector.
///
/// Recorded energies are Gaussian about the energy of the photon, with a full width at half maximum proportional to the square root of
/// that energy. The efficiency of a window is the probability that a photon is recorded in it, over the probability that an unscattered photon is recorded
/// in the first window, the photopeak window: sensitivities of cameras refer to that window.
///
/// ```
/// use photon_scatter::Spectrum;
/// let spectrum = Spectrum::new(140.5, 0.1, &[[126.45, 154.55], [108.0, 126.45]])?;
/// assert_eq!(spectrum.efficiency(0, 140.5), 1.0);
/// assert!((spectrum.efficiency(0, 126.45) - 0.51).abs() < 0.01);
/// assert!(spectrum.efficiency(1, 140.5) < 0.01); // of the primary in the lower window
/// # Ok::<(), photon_scatter::ScatterError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Spectrum {
    energy: f64,
    resolution: f64,
    windows: Vec<[f64; 2]>,
    photopeak: f64,
    /// Lowest energy followed, and intervals per keV.
    least: f64,
    per_kev: f64,
    /// Rows by energy; their columns are below.
    table: Vec<f64>,
}

impl Spectrum {
    /// Photons of `energy` keV, a detector of `resolution` (full width at half maximum at that energy, as a fraction of it), and windows from
    /// and to an energy in keV, the photopeak window first.
    ///
    /// # Errors
    /// [`ScatterError::OutOfRange`] for an energy outside 21 to 600 keV, a resolution outside 0.005 to 1, no window or more than 64, one that
    /// is empty or ends outside 1 keV to 10 MeV, and a first window that does not contain `energy` or records less than 0.1 % of the unscattered
    /// photons.
    pub fn new(energy: f64, resolution: f64, windows: &[[f64; 2]]) -> Result<Self, ScatterError> {
        within("energy in keV", energy, [21.0, ENERGIES[1]])?;
        within("energy resolution", resolution, [0.005, 1.0])?;
        let count = windows.len() as f64;
        within("number of energy windows", count, [1.0, 64.0])?;
        for [low, high] in windows {
            within("lower edge of a window in keV", *low, [1.0, 1e4])?;
            within("upper edge of a window in keV", *high, [*low, 1e4])?;
            within("width of a window in keV", high - low, [1e-3, 1e4])?;
        }
        let [low, high] = windows[0];
        let what = "lower edge of the photopeak window in keV";
        within(what, low, [1.0, energy])?;
        let what = "upper edge of the photopeak window in keV";
        within(what, high, [energy, 1e4])?;
        let mut spectrum = Self {
            energy,
            resolution,
            windows: windows.to_vec(),
            photopeak: 1.0,
            least: ENERGIES[0],
            per_kev: 0.0,
            table: Vec::new(),
        };
        let photopeak = spectrum.efficiency(0, energy);
        let range = [LEAST_PHOTOPEAK, 1.0];
        spectrum.photopeak = within("efficiency of the first window", photopeak, range)?;
        spectrum.tabulate();
        Ok(spectrum)
    }

    fn tabulate(&mut self) {
        let n = self.windows.len();
        let highest = |energy: f64| {
            let windows = (0..n).map(|w| self.efficiency(w, energy));
            windows.fold(0.0, f64::max)
        };
        let step = (self.energy - ENERGIES[0]) / INTERVALS as f64;
        let all = (0..INTERVALS).map(|k| ENERGIES[0] + k as f64 * step);
        let mut followed = all.skip_while(|energy| highest(*energy) < LEAST_EFFICIENCY);
        let least = followed.next().unwrap_or(ENERGIES[0]);
        let step = (self.energy - least) / INTERVALS as f64;
        let mut table = Vec::new();
        for k in 0..=INTERVALS {
            let energy = least + k as f64 * step;
            let scattering = compton_attenuation(energy);
            let total = scattering + photoelectric(energy);
            table.extend([total, scattering / total]);
            table.extend([importance(energy, &highest), highest(energy)]);
            table.extend((0..n).map(|w| self.efficiency(w, energy)));
        }
        (self.least, self.per_kev, self.table) = (least, 1.0 / step, table);
    }

    /// Energy of the photons emitted (keV).
    pub(crate) fn energy(&self) -> f64 {
        self.energy
    }

    pub(crate) fn n_windows(&self) -> usize {
        self.windows.len()
    }

    /// Probability that a photon is recorded in a window, relative to that of unscattered photons in the first window.
    ///
    /// # Panics
    /// If there is no such window.
    #[must_use]
    pub fn efficiency(&self, window: usize, energy: f64) -> f64 {
        let [low, high] = self.windows[window];
        let sigma = self.resolution * (self.energy * energy).sqrt() / FWHM;
        let below = |edge: f64| libm::erf((edge - energy) / (sigma * std::f64::consts::SQRT_2));
        0.5 * (below(high) - below(low)) / self.photopeak
    }

    /// Largest ratio of the efficiency of a window to the highest of all windows, at the energies that are followed.
    pub(crate) fn fraction(&self, window: usize) -> f64 {
        let rows = self.table.chunks(WINDOWS + self.windows.len());
        let ratios = rows.map(|row| row[WINDOWS + window] / row[HIGHEST]);
        ratios.fold(0.0, f64::max)
    }

    /// The table at an energy; `None` below the energies that are followed.
    #[inline]
    pub(crate) fn at(&self, energy: f64) -> Option<At<'_>> {
        let place = (energy - self.least) * self.per_kev;
        if place < 0.0 {
            return None;
        }
        let k = (place as usize).min(INTERVALS - 1);
        let width = WINDOWS + self.windows.len();
        let (from, rest) = self.table[k * width..].split_at(width);
        let share = place - k as f64;
        Some(At {
            from,
            to: &rest[..width],
            share,
        })
    }
}

/// Largest efficiency of the next scattering in any direction.
fn importance(energy: f64, efficiency: &impl Fn(f64) -> f64) -> f64 {
    let compton = Compton::of(energy);
    let n = 64;
    let cosine = |k: usize| 1.0 - 2.0 * k as f64 / n as f64;
    let at = (0..=n).map(|k| compton.towards(cosine(k)));
    at.map(|(energy, density)| density * efficiency(energy))
        .fold(0.0, f64::max)
}

/// Two neighbouring rows of the table, and the place between them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct At<'a> {
    from: &'a [f64],
    to: &'a [f64],
    share: f64,
}

impl At<'_> {
    /// One column.
    #[inline]
    pub(crate) fn get(&self, column: usize) -> f64 {
        let from = self.from[column];
        from + self.share * (self.to[column] - from)
    }
}
