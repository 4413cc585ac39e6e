//! Options of a computation, and the work done.

/// Declares methods that return the options with another value of one field; an optional field becomes `Some`.
macro_rules! setters {
    ($($(#[$doc:meta])* $with:ident($field:ident: $type:ty);)*) => {$(
        $(#[$doc])*
        #[must_use]
        pub fn $with(mut self, $field: $type) -> Self {
            self.$field = $field.into();
            self
        }
    )*};
}

/// Accuracy options of [`Scatter::new`](crate::Scatter::new).
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct ScatterOptions {
    /// Largest standard error of any bin in any view and window, in the unit of the samples (activity times cm); 0 if only
    /// [`relative`](Self::relative) applies. It is also the largest error of interpolation between nodes and views whose distance is automatic.
    pub tolerance: f64,
    /// Tolerance relative to the largest scatter of any bin, which applies where it is larger than [`tolerance`](Self::tolerance). The largest
    /// scatter is reduced by three of its standard errors. It does not depend on the unit of the activity.
    pub relative: f64,
    /// Distance in cm of the nodes on which scatter is collected and from which cubics interpolate; `None` for 0.75 cm, reduced until the error of
    /// interpolation is within the tolerance. A prescribed one has the error [`ScatterReport::interpolation_error`]: details smaller than twice the
    /// distance are smoothed, such as the scatter around a point source. It is 0.01 to 10 cm and at most the larger of two lengths: the mean depth of
    /// the interactions in a scatterer, from its surface or the source, and the standard deviation of the response at the nearest emission. Above
    /// this limit, known after the first blocks, the bound on the error may not hold: for point sources near the surface of a ball of water it holds
    /// up to about 1.2 times the mean depth. A scatterer begins where the density rises from less than an eighth; means are weighted by squared
    /// densities. The number of histories for a tolerance is about proportional to its power -2, down to the width of the response.
    pub pitch: Option<f64>,
    /// Largest angle in radians between the views from which cubics interpolate the views between them; 0 for no interpolation, `None` for 12
    /// degrees, reduced as the pitch is. Views of an orbit with more than one larger gap, or whose radius changes abruptly, are not interpolated.
    pub spacing: Option<f64>,
    /// Number of orders of scattering, at least 1.
    pub orders: usize,
    /// Histories in each of the first 128 blocks, at most a 128th of [`most_histories`](Self::most_histories); later blocks are larger if the
    /// tolerance requires it.
    pub block: usize,
    /// Largest number of histories, including discarded ones; at least 2048. Whenever standard errors are computed, first after 128 blocks, the
    /// necessary number is estimated; if it is more than twice this one, the result is [`ScatterError::Tolerance`](crate::ScatterError::Tolerance) at
    /// once. Before a photon is recorded, there is no such estimate. A source far from the medium requires more histories: in inverse proportion to
    /// the solid angle of the medium.
    pub most_histories: u64,
    /// Seed of the random numbers; block k has stream k.
    pub seed: u64,
}

impl ScatterOptions {
    /// A tolerance in the unit of the samples, none relative to the scatter; automatic distances of nodes and views, 32 orders, blocks of 512
    /// histories, at most 10^8 histories, seed 0. `new(0.0).with_relative(0.02)` has only a tolerance relative to the largest scatter: prefer it
    /// unless the size of the samples, which is proportional to the activity, is known.
    #[must_use]
    pub fn new(tolerance: f64) -> Self {
        Self {
            tolerance,
            relative: 0.0,
            pitch: None,
            spacing: None,
            orders: 32,
            block: 512,
            most_histories: 100_000_000,
            seed: 0,
        }
    }

    setters! {
        /// Sets the tolerance relative to the largest scatter.
        with_relative(relative: f64);
        /// Prescribes the pitch of the nodes.
        with_pitch(pitch: f64);
        /// Prescribes the largest angle in radians between the views from which others are interpolated; 0 for no interpolation.
        with_spacing(spacing: f64);
        /// Sets the number of orders of scattering.
        with_orders(orders: usize);
        /// Sets the number of histories of the first blocks.
        with_block(block: usize);
        /// Sets the largest number of histories.
        with_most_histories(most_histories: u64);
        /// Sets the seed.
        with_seed(seed: u64);
    }
}

/// The errors and the work done.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct ScatterReport {
    /// The largest standard error of any bin in any view and window: of the photon histories, without interpolation.
    pub largest_standard_error: f64,
    /// Upper bound on the error in any sample of the interpolation between nodes and between views. Nodes are compared with the cubics through their
    /// neighbours: the error is at most 0.1 to 0.25 of the sum of these differences at four nodes where images are smooth. Where the differences
    /// over one pitch are not small relative to those over two, the images may contain point sources narrower than the nodes, whose error is larger
    /// by the ratio of the pitch to the width of the response. Differences within the standard error are omitted.
    pub interpolation_error: f64,
    /// Photons emitted.
    pub histories: u64,
    /// Interactions of all photons.
    pub interactions: u64,
    /// Paths from interactions to detectors.
    pub paths: u64,
    /// Projection sums (samples times the area of a bin) of the first window, added over all views, by order: once scattered, twice, and so
    /// on; the last also contains all higher orders. They include scatter beside the detector, up to four standard deviations of the response.
    /// Images are not separated: [`ScatterOptions::orders`] `= 1` gives an image of first-order scatter, two runs a difference.
    pub by_order: [f64; Self::ORDERS],
    /// Standard errors of [`by_order`](Self::by_order), at least the contribution of one photon.
    pub by_order_error: [f64; Self::ORDERS],
}

impl ScatterReport {
    /// Number of orders that are counted separately.
    pub const ORDERS: usize = 8;

    /// Adds the work of other histories, without errors; [`by_order`](Self::by_order) is a sum over the histories.
    pub(crate) fn add(&mut self, other: &Self) {
        self.histories += other.histories;
        self.interactions += other.interactions;
        self.paths += other.paths;
        for (sum, more) in self.by_order.iter_mut().zip(other.by_order) {
            *sum += more;
        }
    }
}
