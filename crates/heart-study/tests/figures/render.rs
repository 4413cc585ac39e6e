//! The camera, its colours and its antialiasing.

use crate::figures::canvas::{Rect, paint};
use crate::figures::render::{Camera, Seen, View, WHITE, decode, encode};
use heart_phantom::revolve_voxel::nalgebra::Point3;
fn camera(view: View) -> Camera {
    let rect = Rect {
        left: 10,
        top: 20,
        width: 200,
        height: 100,
    };
    Camera::new(view, Point3::new(1.0, 2.0, 3.0), 20.0, rect)
}

#[test]
fn x_points_to_the_viewer_y_right_z_up() {
    let camera = camera(View {
        azimuth: 0.0,
        elevation: 0.0,
    });
    let at = |x: f64, y: f64, z: f64| camera.pixel(&Point3::new(x, y, z));
    assert_eq!(at(1.0, 2.0, 3.0), [110.0, 70.0]);
    assert_eq!(at(9.0, 2.0, 3.0), [110.0, 70.0]);
    // 20 cm over 200 pixels: one centimetre is ten pixels.
    assert_eq!(at(1.0, 3.0, 3.0), [120.0, 70.0]);
    assert_eq!(at(1.0, 2.0, 4.0), [110.0, 60.0]);
    assert_eq!(camera.nearness(&Point3::new(4.0, 0.0, 0.0)), 3.0);
}

#[test]
fn pixels_and_points_are_inverse_and_the_frame_is_right_handed() {
    let camera = camera(View {
        azimuth: 0.7,
        elevation: -0.4,
    });
    for (x, y) in [(10.0, 20.0), (33.5, 81.25), (210.0, 120.0)] {
        let [a, b] = camera.pixel(&camera.point(x, y));
        // Rounding of numbers near 100.
        assert!((a - x).abs() < 1e-12 && (b - y).abs() < 1e-12, "{a} {b}");
    }
    assert!((camera.right.cross(&camera.up) - camera.toward).norm() < 1e-15);
}

#[test]
fn encode_and_decode_are_inverse_for_all_bytes() {
    for v in 0..=255u8 {
        let light = decode(f64::from(v) / 255.0);
        assert_eq!((encode(light) * 255.0).round() as u8, v);
    }
}

#[test]
fn edges_are_averaged_and_flats_are_not() {
    let rect = Rect {
        left: 0,
        top: 0,
        width: 30,
        height: 10,
    };
    let view = View {
        azimuth: 0.0,
        elevation: 0.0,
    };
    let camera = Camera::new(view, Point3::origin(), 30.0, rect);
    let mut picture = paint(30, 10, |_| Ok(())).unwrap();
    // Black right of y = 0.35 cm, which is pixel 15.35 from the left.
    camera.render(&mut picture, WHITE, |p| {
        (p.y > 0.35).then_some(Seen {
            colour: [0.0; 3],
            part: 0,
            nearness: 0.0,
        })
    });
    assert_eq!(picture.pixel(14, 5).unwrap(), [255; 3]);
    assert_eq!(picture.pixel(16, 5).unwrap(), [0; 3]);
    // Of the three columns of samples at 1/6, 1/2 and 5/6 of the pixel, two are black.
    assert_eq!(picture.pixel(15, 5).unwrap(), [85; 3]);
}
