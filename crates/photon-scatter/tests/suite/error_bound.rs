//! The stated standard error against the true error.

use crate::support::{BallSource, CHEST, camera, photopeak};
use photon_scatter::{Scatter, ScatterError, ScatterOptions};

fn chest(options: &ScatterOptions) -> Result<Scatter, ScatterError> {
    let source = BallSource([5.0, 5.0, 0.0], 3.0, 1.0);
    Scatter::new(
        &source,
        &CHEST,
        &camera(16, 2.0, &[-45.0, 60.0]),
        &photopeak(),
        options,
    )
}

#[test]
fn the_true_error_is_within_two_standard_errors() {
    // The largest primary sample is near 2.
    let reference = chest(&ScatterOptions::new(0.004).with_seed(1000)).unwrap();
    let (mut inside, mut all) = (0, 0);
    for seed in 0..8 {
        let scatter = chest(&ScatterOptions::new(0.04).with_block(64).with_seed(seed)).unwrap();
        assert!(scatter.largest_error() <= 0.04);
        let ratio = reference.report().histories / scatter.report().histories;
        assert!(ratio > 50, "{ratio}");
        for view in 0..2 {
            let (samples, errors) = (scatter.view(0, view), scatter.standard_error(0, view));
            for ((sample, error), exact) in samples.iter().zip(errors).zip(reference.view(0, view))
            {
                inside += usize::from((sample - exact).abs() <= 2.0 * error);
                all += 1;
            }
        }
    }
    assert!(inside * 100 >= all * 95, "{inside} of {all}");
}

#[test]
fn too_few_histories_are_an_error_with_the_work_done() {
    let options = ScatterOptions::new(1e-6)
        .with_block(16)
        .with_most_histories(2000);
    let Err(ScatterError::Tolerance {
        asked,
        reached,
        report,
    }) = chest(&options)
    else {
        panic!("no error");
    };
    assert!(asked == 1e-6 && reached > 1e-3 && report.histories >= 1024);
}
