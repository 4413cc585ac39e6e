//! Images along fans and cones, and of narrow responses.

use super::*;

#[test]
fn fans_and_cones_are_averaged_over_bins() {
    let (body, organs) = (heart(), chest());
    let detector = ParallelDetector::new(14, 12, [1.0, 0.9]).unwrap();
    for (fan, tilt) in [(1.0, 0.0), (0.0, 0.0), (0.0, 0.3)] {
        let first = Point3::new(-6.5, 12.0, -4.95);
        let ends = [
            PointRaster {
                first: Point3::new(0.3, -14.0, -4.95 * fan),
                bin_step: Vector3::zeros(),
                row_step: Vector3::new(0.0, 0.0, 0.9 * fan),
            },
            PointRaster {
                first,
                bin_step: Vector3::new(1.0, 0.1, tilt),
                row_step: Vector3::new(-tilt, 0.0, 0.9),
            },
        ];
        let lines = Lines::between([14, 12], ends[0], ends[1]).unwrap();
        let rays = |u: f64, v: f64| {
            let (bin, row) = (u / 1.0 + 6.5, v / 0.9 + 5.5);
            let [from, to] =
                [&ends[0], &ends[1]].map(|end| end.first + end.bin_step * bin + end.row_step * row);
            Ray::new(from, to - from).unwrap()
        };
        for (sigma, tolerance, density) in [(0.4, 3e-3, 2.0), (0.0, 3e-3, 4.0)] {
            let response = DepthResponse::constant(sigma).unwrap();
            let view = View::new(
                &lines,
                detector.pitch(),
                BinValue::Average,
                &response,
                density,
            )
            .unwrap();
            let assembly = Assembly::new(&organs)
                .with_body(&body, &[0.2, 1.0], None)
                .unwrap();
            let image = whole(
                &view.image(&assembly, Shown::Change, 0..12).unwrap(),
                &detector,
            );
            let on_ray = |ray: &Ray| {
                // Activity of the organs inside the body is removed; the attenuation is that of the organs.
                let own = body_on_ray(&body, [0.2, 1.0], 1.0, None, ray);
                let (organs, ray) = (organs.clone(), *ray);
                let spans = organs
                    .as_slice()
                    .iter()
                    .filter_map(|organ| organ.shape.span(&ray));
                let mut ends: Vec<f64> = spans.flat_map(|s| [s.enter, s.exit]).collect();
                ends.extend(&own.ends);
                OnRay {
                    ends,
                    content: Box::new(move |t| {
                        let [activity, inside] = (own.content)(t);
                        let last = organs
                            .as_slice()
                            .iter()
                            .rev()
                            .find(|o| o.shape.contains(&ray.at(t)));
                        let [around, mu] = last.map_or([0.0; 2], |o| [o.activity, o.attenuation]);
                        [if inside > 0.0 { activity - around } else { 0.0 }, mu]
                    }),
                }
            };
            let exact = Definition {
                ray: &rays,
                on_ray: &on_ray,
                sigma: &|_| sigma,
                value: BinValue::Average,
            }
            .samples(
                &detector,
                [[-7.0, 7.0], [-5.4, 5.4]],
                [0.1 / if sigma == 0.0 { 2.0 } else { 1.0 }, 9.0],
            );
            // Lattice of the reference: without a blur its bins contain 20 x 18 rays.
            assert!(
                apart(&image, &exact) < tolerance,
                "{fan} {tilt} {sigma}: {}",
                apart(&image, &exact)
            );
        }
    }
}

#[test]
fn narrow_responses_and_none_agree_in_the_limit() {
    let (body, organs) = (heart(), none());
    let detector = ParallelDetector::new(20, 20, [0.35, 0.35]).unwrap();
    let assembly = Assembly::new(&organs)
        .with_body(&body, &[0.2, 1.0], None)
        .unwrap();
    let image = |sigma: f64| {
        let response = DepthResponse::constant(sigma).unwrap();
        let view = view_of(&detector, 0.4, BinValue::Average, &response, 3.0);
        whole(
            &view.image(&assembly, Shown::Change, 0..20).unwrap(),
            &detector,
        )
    };
    let sharp = image(0.0);
    for sigma in [1e-6, 1e-4, 2e-3, 0.02, 0.04] {
        let off = apart(&image(sigma), &sharp);
        // Edges displaced by sigma in bins of 0.35 cm.
        assert!(off < 1e-3 + sigma, "{sigma}: {off}");
    }
    // Both sides of the width from which on bins divide panels.
    let [below, above] = [0.35 * 0.1249, 0.35 * 0.1251].map(image);
    assert!(apart(&below, &above) < 1e-3);
    // The sum over all bins is the activity.
    let volumes = [0, 1].map(|k| body.region_measures(k).unwrap().volume);
    let activity = 0.2 * volumes[0] + volumes[1];
    for samples in [sharp, image(0.1)] {
        let sum = samples.iter().sum::<f64>() * 0.35 * 0.35;
        assert!((sum / activity - 1.0).abs() < 1e-4, "{sum} {activity}");
    }
}
