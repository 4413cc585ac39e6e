//! Results do not depend on the number of threads.

use crate::support::{BallSource, CHEST, camera};
use photon_scatter::{Scatter, ScatterOptions, Spectrum};

#[test]
fn results_are_bitwise_independent_of_threads() {
    let spectrum = Spectrum::new(140.5, 0.1, &[[126.45, 154.55], [108.0, 126.45]]).unwrap();
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let source = BallSource([5.0, 5.0, 0.0], 3.0, 1.0);
            let options = ScatterOptions::new(0.1).with_block(64);
            let camera = camera(12, 3.0, &[0.0, 90.0]);
            let scatter = Scatter::new(&source, &CHEST, &camera, &spectrum, &options).unwrap();
            let views = [(0, 0), (1, 1)].map(|(window, view)| scatter.view(window, view));
            (views, scatter.standard_error(0, 1), *scatter.report())
        })
    };
    let one = run(1);
    for threads in [2, 3] {
        assert!(run(threads) == one, "{threads} threads");
    }
}
