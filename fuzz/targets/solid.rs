//! A ray (six numbers) and the points of a meridian (two numbers each): the chord is the sum of its spans and fits into the body.
#![no_main]

use fuzz::numbers;
use libfuzzer_sys::fuzz_target;
use revolve_voxel::nalgebra::{Point3, Vector3};
use revolve_voxel::{Body, Meridian, Pose, Ray};

fuzz_target!(|text: &str| {
    let Some(numbers) = numbers(text) else { return };
    let Some((ray, points)) = numbers.split_first_chunk::<6>() else {
        return;
    };
    let (origin, direction) = (
        Point3::from_slice(&ray[..3]),
        Vector3::from_column_slice(&ray[3..]),
    );
    let Ok(meridian) = Meridian::new(points.as_chunks::<2>().0) else {
        return;
    };
    let Ok(ray) = Ray::new(origin, direction) else {
        return;
    };
    let [low, high] = meridian.x_range();
    let longest = (high - low).hypot(2.0 * meridian.r_max());
    let measures = meridian.mass_properties();
    assert!(measures.volume > 0.0 && measures.surface > 0.0);
    let body = Body::new(vec![meridian], Pose::identity()).expect("one layer");
    let chord = body.chord(0, &ray).expect("the layer exists");
    assert!(
        chord >= 0.0 && chord <= longest * (1.0 + 1e-9),
        "{chord} of {longest}"
    );
    let spans = body.spans(0, &ray).expect("the layer exists");
    let sum: f64 = spans.iter().map(|span| span.length()).sum();
    assert!((sum - chord).abs() <= 1e-6 * longest, "{sum} {chord}");
});
