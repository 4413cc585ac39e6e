//! Images behind a response against their definition: a dense lattice of rays, cut into thin slabs, each blurred by its own Gaussian.

mod bins;
mod corners;
mod divergent;
mod sectors;

use nalgebra::{Point3, Vector3};
use revolve_voxel::{
    Assembly, BinValue, Body, DepthResponse, Image, Lines, Meridian, Organ, OrganShape, Organs,
    ParallelDetector, PointRaster, Pose, Ray, RevolveError, Sector, Shown, View, nalgebra,
};

/// A bulged solid with a flat base, of 300 segments.
fn bulge(length: f64, radius: f64) -> Meridian {
    let point = |k: i32| {
        let angle = -0.6 + (0.6 + std::f64::consts::FRAC_PI_2) * f64::from(k) / 300.0;
        [length * angle.sin(), radius * angle.cos().max(0.0)]
    };
    Meridian::new(&(0..=300).map(point).collect::<Vec<_>>()).unwrap()
}

fn heart() -> Body {
    let pose = Pose::axis_along_z(1.0).unwrap();
    let pose = pose.rotated_x(0.7).unwrap().rotated_y(2.2).unwrap();
    let pose = pose.shifted(Vector3::new(0.6, -0.9, 0.4)).unwrap();
    Body::new(vec![bulge(2.2, 0.8), bulge(2.7, 1.4)], pose).unwrap()
}

fn chest() -> Organs {
    let organ = |shape, activity, attenuation| Organ {
        shape,
        activity,
        attenuation,
    };
    let cylinder = OrganShape::cylinder([0.0, 0.2], [4.5, 3.6]).unwrap();
    let lung = OrganShape::ellipsoid([1.8, 0.5, 0.3], [2.0, 2.4, 3.0]).unwrap();
    let liver = OrganShape::ellipsoid([-1.5, 0.3, -1.8], [2.0, 1.6, 1.5]).unwrap();
    Organs::new(vec![
        organ(cylinder, 0.1, 0.16),
        organ(lung, 0.03, 0.05),
        organ(liver, 0.3, 0.16),
    ])
    .unwrap()
}

fn none() -> Organs {
    Organs::new(Vec::new()).unwrap()
}

/// Activity and attenuation on a ray: the ends of all stretches, and the content of a point between two ends.
struct OnRay<'a> {
    ends: Vec<f64>,
    content: Box<dyn Fn(f64) -> [f64; 2] + 'a>,
}

/// The definition of an image: rays, content of a ray, standard deviation at a depth.
struct Definition<'a> {
    ray: &'a dyn Fn(f64, f64) -> Ray,
    on_ray: &'a dyn Fn(&Ray) -> OnRay<'a>,
    sigma: &'a dyn Fn(f64) -> f64,
    value: BinValue,
}

impl Definition<'_> {
    /// All samples, from rays `step` apart within `bounds` of u and v, in slabs of at most `slab` cm.
    fn samples(
        &self,
        detector: &ParallelDetector,
        bounds: [[f64; 2]; 2],
        [step, slab]: [f64; 2],
    ) -> Vec<f64> {
        let n = [detector.n_bins(), detector.n_rows()];
        let mut samples = vec![0.0; n[0] * n[1]];
        let count = bounds.map(|[low, high]| ((high - low) / step).round() as usize);
        // Rows are shifted by multiples of the golden ratio, so that an edge along the rows or the bins intersects no ray twice.
        let shift = |row: usize| (row as f64 * 0.618_033_988_749_895).fract();
        for row in 0..count[1] {
            for bin in 0..count[0] {
                let place = [bin as f64 + shift(row), row as f64 + 0.5];
                let place = [0, 1].map(|axis| bounds[axis][0] + place[axis] * step);
                let ray = (self.ray)(place[0], place[1]);
                for (depth, amount) in slabs(&(self.on_ray)(&ray), slab) {
                    let sigma = (self.sigma)(depth);
                    let weights =
                        [0, 1].map(|axis| self.weights(detector, axis, place[axis], sigma));
                    let amount = amount * step * step;
                    for (j, across) in weights[1].iter().enumerate().filter(|(_, w)| **w > 0.0) {
                        for (k, along) in weights[0].iter().enumerate() {
                            samples[j * n[0] + k] += amount * across * along;
                        }
                    }
                }
            }
        }
        samples
    }

    /// Weights of all bins, or rows, for content at a place.
    fn weights(&self, detector: &ParallelDetector, axis: usize, at: f64, sigma: f64) -> Vec<f64> {
        let n = [detector.n_bins(), detector.n_rows()][axis];
        let pitch = detector.pitch()[axis];
        let edge = |k: usize| (k as f64 - 0.5 * n as f64) * pitch - at;
        let weight = |k: usize| {
            let [low, high] = [edge(k), edge(k + 1)];
            match self.value {
                _ if sigma == 0.0 => f64::from(u8::from(low <= 0.0 && 0.0 < high)) / pitch,
                BinValue::Centre => {
                    let z = 0.5 * (low + high) / sigma;
                    (-0.5 * z * z).exp() / (sigma * std::f64::consts::TAU.sqrt())
                }
                // Simpson's rule with 16 parts of a bin.
                _ => {
                    let density = |k: i32| {
                        let z = (low + (high - low) * f64::from(k) / 16.0) / sigma;
                        (-0.5 * z * z).exp() * [2.0, 4.0][(k % 2) as usize]
                    };
                    let sum: f64 =
                        (0..=16).map(density).sum::<f64>() - 0.5 * (density(0) + density(16));
                    sum / (48.0 * sigma * std::f64::consts::TAU.sqrt())
                }
            }
        };
        (0..n).map(weight).collect()
    }
}

/// The attenuated activity of slabs of a ray, with their depths.
fn slabs(on_ray: &OnRay<'_>, thickness: f64) -> Vec<(f64, f64)> {
    let mut ends = on_ray.ends.clone();
    ends.sort_by(f64::total_cmp);
    let mut found = Vec::new();
    let mut through = 1.0;
    for pair in ends.windows(2).rev() {
        let length = pair[1] - pair[0];
        if length <= 0.0 {
            continue;
        }
        let [activity, mu] = (on_ray.content)(0.5 * (pair[0] + pair[1]));
        let parts = (length / thickness).ceil();
        let part = length / parts;
        for k in 0..parts as usize {
            let middle = pair[1] - (k as f64 + 0.5) * part;
            let mean = if mu > 0.0 {
                -(-mu * part).exp_m1() / (mu * part)
            } else {
                1.0
            };
            found.push((middle, activity * through * part * mean));
            through *= (-mu * part).exp();
        }
    }
    found
}

/// A body and its sector on a ray, without anything around it.
fn body_on_ray<'a>(
    body: &Body,
    activity: [f64; 2],
    mu: f64,
    sector: Option<&'a (Sector, f64)>,
    ray: &Ray,
) -> OnRay<'a> {
    let spans = [0, 1].map(|layer| body.spans(layer, ray).unwrap());
    let ray = *ray;
    let mut ends: Vec<f64> = spans
        .iter()
        .flatten()
        .flat_map(|s| [s.enter, s.exit])
        .collect();
    if let (Some(_), [first, .., last]) = (sector, &ends.clone()[..]) {
        // Fine enough to find the sides of the sector.
        ends.extend((1..400).map(|k| first + (last - first) * f64::from(k) / 400.0));
    }
    OnRay {
        ends,
        content: Box::new(move |t| {
            let inside = |layer: usize| spans[layer].iter().any(|s| s.enter < t && t < s.exit);
            let more = sector.map_or(0.0, |(sector, more)| match sector.contains(&ray.at(t)) {
                true => *more,
                false => 0.0,
            });
            match (inside(0), inside(1)) {
                (true, _) => [activity[0], mu],
                (_, true) => [activity[1] + more, mu],
                _ => [0.0; 2],
            }
        }),
    }
}

/// All bins and rows of an image.
fn whole(image: &Image, detector: &ParallelDetector) -> Vec<f64> {
    let mut samples = vec![0.0; detector.n_bins() * detector.n_rows()];
    for (row, own) in image
        .rows
        .clone()
        .zip(image.samples.chunks(image.bins.len().max(1)))
    {
        samples[row * detector.n_bins()..][image.bins.clone()].copy_from_slice(own);
    }
    samples
}

fn largest(samples: &[f64]) -> f64 {
    samples.iter().fold(0.0, |most: f64, v| most.max(v.abs()))
}

fn apart(a: &[f64], b: &[f64]) -> f64 {
    let most = a
        .iter()
        .zip(b)
        .fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
    most / largest(b)
}

/// A view of a detector at an angle.
fn view_of<'a>(
    detector: &ParallelDetector,
    theta: f64,
    value: BinValue,
    response: &'a DepthResponse,
    density: f64,
) -> View<'a> {
    let lines = detector.rays(theta).unwrap();
    View::new(&lines, detector.pitch(), value, response, density).unwrap()
}

/// The ray of a view at a position.
fn parallel_ray(theta: f64, [u, v]: [f64; 2]) -> Ray {
    let (sin, cos) = theta.sin_cos();
    let origin = Point3::new(u * cos, u * sin, v);
    Ray::new(origin, Vector3::new(-sin, cos, 0.0)).unwrap()
}

/// A collimator's face at 6 cm.
fn sigma(t: f64) -> f64 {
    (0.1 + 0.03 * (6.0 - t)).hypot(0.12)
}

#[test]
fn a_body_behind_a_collimator_agrees_with_the_definition() {
    let (body, organs, theta) = (heart(), none(), 0.8);
    let detector = ParallelDetector::new(13, 12, [0.6, 0.5]).unwrap();
    let rays = |u: f64, v: f64| parallel_ray(theta, [u, v]);
    let response = DepthResponse::new(sigma, [-5.0, 5.0], 1e-6).unwrap();
    for value in [BinValue::Average, BinValue::Centre] {
        let view = view_of(&detector, theta, value, &response, 2.0);
        let assembly = Assembly::new(&organs)
            .with_body(&body, &[0.2, 1.0], Some(0.15))
            .unwrap();
        let image = whole(
            &view.image(&assembly, Shown::Change, 0..12).unwrap(),
            &detector,
        );
        let exact = Definition {
            ray: &rays,
            on_ray: &|ray| body_on_ray(&body, [0.2, 1.0], 0.15, None, ray),
            sigma: &sigma,
            value,
        }
        .samples(&detector, [[-3.6, 3.6], [-3.2, 3.2]], [0.03, 0.1]);
        // The lattice of the reference, whose error falls from 8e-4 at a step of 0.05 to 2e-4 at 0.025.
        assert!(apart(&image, &exact) < 4e-4, "{}", apart(&image, &exact));
    }
}

#[test]
fn the_error_falls_exponentially_with_the_density() {
    let (body, organs) = (heart(), chest());
    let detector = ParallelDetector::new(16, 16, [0.5, 0.5]).unwrap();
    let response = DepthResponse::new(sigma, [-5.0, 5.0], 1e-8).unwrap();
    for theta in [0.1, 1.3, 2.9, 4.0] {
        let assembly = Assembly::new(&organs)
            .with_body(&body, &[0.2, 1.0], Some(0.16))
            .unwrap();
        for shown in [Shown::Change, Shown::Organs] {
            let image = |density: f64| {
                let view = view_of(&detector, theta, BinValue::Average, &response, density);
                whole(&view.image(&assembly, shown, 0..16).unwrap(), &detector)
            };
            let exact = image(4.0);
            let errors = [0.7, 1.0, 1.4, 2.0].map(|density| apart(&image(density), &exact));
            println!("{theta} {shown:?} {errors:.1?}");
            assert!(
                errors[0] < 1.2e-2 && errors[1] < 1e-3 && errors[2] < 2e-4,
                "{errors:?}"
            );
            assert!(errors[3] < 5e-5, "{errors:?}");
        }
    }
}

#[test]
fn organs_are_replaced_and_attenuate() {
    let (body, organs, theta) = (heart(), chest(), 2.4);
    let detector = ParallelDetector::new(12, 11, [0.9, 0.9]).unwrap();
    let rays = |u: f64, v: f64| parallel_ray(theta, [u, v]);
    let response = DepthResponse::new(sigma, [-5.0, 5.0], 1e-6).unwrap();
    let view = view_of(&detector, theta, BinValue::Average, &response, 2.0);
    let assembly = Assembly::new(&organs)
        .with_body(&body, &[0.2, 1.0], Some(0.16))
        .unwrap();
    let [around, change] = [Shown::Organs, Shown::Change]
        .map(|shown| whole(&view.image(&assembly, shown, 0..11).unwrap(), &detector));
    let both: Vec<f64> = around.iter().zip(&change).map(|(a, b)| a + b).collect();
    for (with_body, image) in [(false, &around), (true, &both)] {
        let on_ray = |ray: &Ray| {
            let own = body_on_ray(&body, [0.2, 1.0], 0.16, None, ray);
            let organs = organs.clone();
            let ray = *ray;
            let spans = organs
                .as_slice()
                .iter()
                .filter_map(|organ| organ.shape.span(&ray));
            let mut ends: Vec<f64> = spans.flat_map(|s| [s.enter, s.exit]).collect();
            ends.extend(&own.ends);
            OnRay {
                ends,
                content: Box::new(move |t| {
                    let inside = (own.content)(t);
                    let last = organs
                        .as_slice()
                        .iter()
                        .rev()
                        .find(|o| o.shape.contains(&ray.at(t)));
                    match (with_body && inside != [0.0; 2], last) {
                        (true, _) => inside,
                        (_, Some(organ)) => [organ.activity, organ.attenuation],
                        _ => [0.0; 2],
                    }
                }),
            }
        };
        let exact = Definition {
            ray: &rays,
            on_ray: &on_ray,
            sigma: &sigma,
            value: BinValue::Average,
        }
        .samples(&detector, [[-6.0, 6.0], [-6.4, 6.4]], [0.08, 0.1]);
        // The lattice of the reference, which changes by as much when its step is halved.
        assert!(
            apart(image, &exact) < 2e-3,
            "{with_body} {}",
            apart(image, &exact)
        );
    }
}

#[test]
fn sectors_add_their_activity() {
    let body = heart();
    let ring = Meridian::ring(&[[0.2, 0.85], [0.2, 1.3], [1.2, 1.15], [1.2, 0.75]]).unwrap();
    let sector = (Sector::new(ring, [0.5, 2.0], *body.pose()).unwrap(), -0.8);
    let organs = none();
    let detector = ParallelDetector::new(9, 8, [0.8, 0.7]).unwrap();
    let rays = |u: f64, v: f64| Ray::new(Point3::new(u, 0.0, v), Vector3::y()).unwrap();
    let response = DepthResponse::constant(0.3).unwrap();
    let view = view_of(&detector, 0.0, BinValue::Average, &response, 4.0);
    let assembly = Assembly::new(&organs)
        .with_body(&body, &[0.2, 1.0], None)
        .unwrap();
    let assembly = assembly.with_sectors(vec![sector.clone()]).unwrap();
    let image = whole(
        &view.image(&assembly, Shown::Change, 0..8).unwrap(),
        &detector,
    );
    let exact = Definition {
        ray: &rays,
        on_ray: &|ray| body_on_ray(&body, [0.2, 1.0], 0.0, Some(&sector), ray),
        sigma: &|_| 0.3,
        value: BinValue::Average,
    }
    .samples(&detector, [[-3.6, 3.6], [-3.2, 3.2]], [0.05, 0.5]);
    // Sides of the sector are no breaks of the quadrature; the reference finds them to 1/400 of a chord.
    assert!(apart(&image, &exact) < 1e-3, "{}", apart(&image, &exact));
}

#[test]
fn parts_are_bitwise_those_of_the_whole_for_any_number_of_threads() {
    let (body, organs) = (heart(), chest());
    let detector = ParallelDetector::new(16, 16, [0.5, 0.5]).unwrap();
    let response = DepthResponse::new(sigma, [-5.0, 5.0], 1e-3).unwrap();
    let view = view_of(&detector, 1.0, BinValue::Average, &response, 1.0);
    let assembly = Assembly::new(&organs)
        .with_body(&body, &[0.2, 1.0], Some(0.16))
        .unwrap();
    let on = |threads: usize, rows: std::ops::Range<usize>| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| view.image(&assembly, Shown::Change, rows).unwrap())
    };
    let all = whole(&on(1, 0..16), &detector);
    assert_eq!(whole(&on(3, 0..16), &detector), all);
    let some = whole(&on(2, 5..8), &detector);
    assert_eq!(some[5 * 16..8 * 16], all[5 * 16..8 * 16]);
    assert!(on(1, 5..8).rays.cast < on(1, 0..16).rays.cast);
}

#[test]
fn invalid_values_are_rejected() {
    let detector = ParallelDetector::new(4, 4, [0.5, 0.5]).unwrap();
    let lines = detector.rays(0.0).unwrap();
    assert!(DepthResponse::constant(-1.0).is_err() && DepthResponse::constant(f64::NAN).is_err());
    assert!(DepthResponse::new(|_| 0.0, [0.0, 1.0], 1e-3).is_err());
    assert!(DepthResponse::new(|_| 1.0, [1.0, 1.0], 1e-3).is_err());
    assert!(DepthResponse::new(|_| 1.0, [0.0, 1.0], 0.0).is_err());
    let sharp = DepthResponse::constant(0.0).unwrap();
    assert!(View::new(&lines, detector.pitch(), BinValue::Centre, &sharp, 1.0).is_err());
    for density in [0.0, -1.0, 0.09, 1001.0, 1e300, f64::NAN] {
        let view = View::new(&lines, detector.pitch(), BinValue::Average, &sharp, density);
        assert!(view.is_err(), "{density}");
    }
    let view = View::new(&lines, detector.pitch(), BinValue::Average, &sharp, 1.0).unwrap();
    for rows in [3..5, 5..5, 0..usize::MAX, 0..1_000_000_000] {
        let image = view.image(&Assembly::new(&none()), Shown::Change, rows.clone());
        assert!(
            matches!(image, Err(RevolveError::BadRange { .. })),
            "{rows:?}"
        );
    }
    let raster = |y: f64, bin_step: Vector3<f64>, row_step: Vector3<f64>| PointRaster {
        first: Point3::new(-1.0, y, -1.0),
        bin_step,
        row_step,
    };
    let new = |lines: &Lines, pitch| View::new(lines, pitch, BinValue::Average, &sharp, 1.0);
    let error = |lines: &Lines| new(lines, [1.0; 2]).unwrap_err();
    let between = |from, to| Lines::between([4, 4], from, to).unwrap();
    let far = raster(5.0, Vector3::x(), Vector3::z());
    // The source moves along the bins, slower than the detector.
    let moving = between(raster(0.0, 0.5 * Vector3::x(), Vector3::z()), far);
    // No rows, or bins along the rays.
    let line = between(
        Point3::origin().into(),
        raster(5.0, Vector3::x(), Vector3::zeros()),
    );
    let edge = between(
        raster(-5.0, Vector3::zeros(), Vector3::z()),
        raster(5.0, Vector3::y(), Vector3::z()),
    );
    for lines in [moving, line, edge] {
        assert_eq!(error(&lines), RevolveError::NoDirection);
    }
    let list = Lines::each([1, 1], vec![parallel_ray(0.0, [0.0; 2])]).unwrap();
    assert_eq!(error(&list), RevolveError::NotRaster);
    for bad in [0.0, -1.0, f64::NAN] {
        assert!(new(&lines, [0.5, bad]).is_err() && new(&lines, [bad, 0.5]).is_err());
    }
    let (body, organs) = (heart(), none());
    let assembly = || Assembly::new(&organs);
    assert!(assembly().with_body(&body, &[1.0], None).is_err());
    assert!(
        assembly()
            .with_body(&body, &[1.0, 1.0], Some(-1.0))
            .is_err()
    );
}

#[test]
fn views_of_equal_parts_are_equal() {
    let response = DepthResponse::new(sigma, [-5.0, 5.0], 1e-6).unwrap();
    let wider = DepthResponse::new(|t| 2.0 * sigma(t), [-5.0, 5.0], 1e-6).unwrap();
    let view = |response, theta, density| {
        let detector = ParallelDetector::new(13, 12, [0.6, 0.5]).unwrap();
        view_of(&detector, theta, BinValue::Average, response, density)
    };
    let one = view(&response, 0.8, 2.0);
    let same = response.clone();
    assert_eq!(one, view(&same, 0.8, 2.0));
    for other in [
        view(&wider, 0.8, 2.0),
        view(&response, 0.9, 2.0),
        view(&response, 0.8, 3.0),
    ] {
        assert_ne!(one, other);
    }
}
