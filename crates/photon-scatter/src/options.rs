//! What a computation is asked for, and the work that it took.

/// How accurately scatter is computed, for [`Scatter::new`](crate::Scatter::new).
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct ScatterOptions {
    /// Largest standard error of any bin in any view and window, in the unit of the samples (activity times cm).
    pub tolerance: f64,
    /// Pitch of the nodes on which scatter is collected and from which cubics interpolate, in cm: details smaller than twice the pitch are
    /// smoothed. The number of histories for a tolerance is about proportional to its power -2.
    pub pitch: f64,
    /// Angle in radians by which the views are at most apart from which cubics interpolate the views between them; 0 for none.
    /// Views of an orbit with more than one larger gap, or whose radius changes abruptly, are not interpolated.
    pub spacing: f64,
    /// Orders of scattering that are followed.
    pub orders: usize,
    /// Histories in each of the first 128 blocks; more where the tolerance needs more.
    pub block: usize,
    /// Histories at most.
    pub most_histories: u64,
    /// Seed of the random numbers; block k has stream k.
    pub seed: u64,
}

impl ScatterOptions {
    /// A tolerance in the unit of the samples; nodes 0.75 cm and 12 degrees apart, 32 orders, blocks of 512 histories, at most 10^9 histories, seed 0.
    pub fn new(tolerance: f64) -> Self {
        Self {
            tolerance,
            pitch: 0.75,
            spacing: 12f64.to_radians(),
            orders: 32,
            block: 512,
            most_histories: 1_000_000_000,
            seed: 0,
        }
    }

    /// The same with another pitch of the nodes.
    pub fn with_pitch(mut self, pitch: f64) -> Self {
        self.pitch = pitch;
        self
    }

    /// The same with views interpolated from those this angle in radians apart, at most; 0 for none.
    pub fn with_spacing(mut self, spacing: f64) -> Self {
        self.spacing = spacing;
        self
    }

    /// The same with so many orders of scattering.
    pub fn with_orders(mut self, orders: usize) -> Self {
        self.orders = orders;
        self
    }

    /// The same with first blocks of another number of histories.
    pub fn with_block(mut self, histories: usize) -> Self {
        self.block = histories;
        self
    }

    /// The same with another bound on the number of histories.
    pub fn with_most_histories(mut self, histories: u64) -> Self {
        self.most_histories = histories;
        self
    }

    /// The same with another seed.
    pub fn with_seed(mut self, seed: u64) -> Self {
        self.seed = seed;
        self
    }
}

/// The work done.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct ScatterReport {
    /// Photons emitted.
    pub histories: u64,
    /// Interactions of all photons.
    pub interactions: u64,
    /// Paths from interactions to detectors.
    pub paths: u64,
    /// Sum over all views of the scatter in the first window, per emission, by order: once scattered, twice, and so on; the last also
    /// contains all higher orders.
    pub by_order: [f64; Self::ORDERS],
}

impl ScatterReport {
    /// Orders that are counted by themselves.
    pub const ORDERS: usize = 8;

    pub(crate) fn add(&mut self, other: &Self) {
        self.histories += other.histories;
        self.interactions += other.interactions;
        self.paths += other.paths;
        for (sum, more) in self.by_order.iter_mut().zip(other.by_order) {
            *sum += more;
        }
    }
}
