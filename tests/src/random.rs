//! A seeded generator of test problems.
//!
//! Uniform random numbers never coincide: no ray lies in the plane of a vertex, no angle is a right angle, no two lengths are
//! equal. One problem in three therefore draws seven of eight numbers from grids: small integers divided by powers of two for
//! lengths, multiples of 45 degrees for angles, powers of two for units.

use std::f64::consts::FRAC_PI_4;

/// A SplitMix64 generator (Steele, Lea and Flood 2014, doi:10.1145/2660193.2660195).
#[derive(Debug)]
pub struct Random {
    state: u64,
    on_grids: bool,
}

impl Random {
    /// A generator that depends on the seed alone.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        let mut random = Self {
            state: seed,
            on_grids: false,
        };
        // Seeds with a difference of the increment would give one sequence, displaced by one number.
        random.state = random.bits();
        random.on_grids = random.one_in(3);
        random
    }

    /// Whether the next number is drawn from a grid.
    fn snaps(&mut self) -> bool {
        self.on_grids && !self.one_in(8)
    }

    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in [low, high), never from a grid: for data, and where coincidences would bias a statistic.
    pub fn any(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Uniform in [low, high), or one of a few multiples of a power of two in it.
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        if self.snaps() && high > low {
            let fine = self.integer(1, 4) as f64;
            let step = ((high - low).log2().floor() - fine).exp2();
            if let Some(value) = self.multiple(step, low, high) {
                return value;
            }
        }
        self.any(low, high)
    }

    /// Uniform on a logarithmic scale between powers of ten, or a power of two.
    pub fn decades(&mut self, low: f64, high: f64) -> f64 {
        let value = 10f64.powf(self.any(low, high));
        if self.snaps() {
            value.log2().round().exp2()
        } else {
            value
        }
    }

    /// An angle in [low, high), in radians.
    pub fn angle(&mut self, low: f64, high: f64) -> f64 {
        let eighth = self.snaps().then(|| self.multiple(FRAC_PI_4, low, high));
        eighth.flatten().unwrap_or_else(|| self.any(low, high))
    }

    /// An angle in [low, high), in degrees.
    pub fn degrees(&mut self, low: f64, high: f64) -> f64 {
        let eighth = self.snaps().then(|| self.multiple(45.0, low, high));
        eighth.flatten().unwrap_or_else(|| self.any(low, high))
    }

    /// Rounds a number up to three binary digits in part of the problems.
    pub fn rounded(&mut self, value: f64) -> f64 {
        if self.snaps() && value > 0.0 {
            let digit = (value.log2().floor() - 2.0).exp2();
            (value / digit).ceil() * digit
        } else {
            value
        }
    }

    /// A multiple of a step in [low, high), if there is one.
    fn multiple(&mut self, step: f64, low: f64, high: f64) -> Option<f64> {
        let (first, end) = ((low / step).ceil(), (high / step).ceil());
        (end > first).then(|| (first + self.integer(0, (end - first) as usize - 1) as f64) * step)
    }

    /// Uniform in low..=high.
    pub fn integer(&mut self, low: usize, high: usize) -> usize {
        low + (self.bits() % (high - low + 1) as u64) as usize
    }

    /// True with probability 1 / `n`.
    pub fn one_in(&mut self, n: usize) -> bool {
        self.integer(1, n) == 1
    }

    /// One of the elements, with equal probability.
    pub fn pick<T: Clone>(&mut self, from: &[T]) -> T {
        from[self.integer(0, from.len() - 1)].clone()
    }

    /// The value, or with probability 1 / 30 an implausible one.
    pub fn spoiled(&mut self, value: f64) -> f64 {
        if !self.one_in(30) {
            return value;
        }
        let tiny = f64::MIN_POSITIVE;
        self.pick(&[
            f64::NAN,
            f64::INFINITY,
            f64::NEG_INFINITY,
            0.0,
            -0.0,
            -value,
            tiny,
            tiny / 8.0,
            1e308,
            1e-200,
            1e200,
        ])
    }
}
