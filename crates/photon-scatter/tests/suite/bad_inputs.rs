//! Every invalid input is a typed error.

use crate::support::{Ball, LEHR, Point, camera, photopeak};
use photon_scatter::{
    Camera, Compton, Emission, Medium, Piece, PointSource, Random, Response, Scatter, ScatterError,
    ScatterOptions, Source, Spectrum, View, VoxelMedium, water_attenuation,
};

const BALL: Ball = Ball {
    centre: [0.0; 3],
    radius: 2.0,
    density: 1.0,
};

#[test]
fn spectra_are_checked() {
    let window = [126.45, 154.55];
    for energy in [f64::NAN, 0.0, 20.0, 601.0, f64::INFINITY] {
        assert!(Spectrum::new(energy, 0.1, &[window]).is_err(), "{energy}");
    }
    for energy in [f64::NAN, 0.0, -1.0, f64::INFINITY] {
        assert!(water_attenuation(energy).is_err() && Compton::new(energy).is_err());
    }
    // MeV; an angle where a cosine belongs; a cosine with a rounding error.
    assert!(Compton::new(0.1405).is_err() && Compton::new(1.0).is_ok());
    let compton = Compton::new(140.5).unwrap();
    for bad in [40.0, -1.1, f64::NAN] {
        assert!(compton.energy_at(bad).is_err() && compton.relative_density(bad).is_err());
    }
    let rounded = [1.0, 1.0 + f64::EPSILON].map(|cosine| compton.energy_at(cosine).unwrap());
    assert_eq!(rounded, [140.5; 2]);
    for resolution in [f64::NAN, 0.0, 1.5] {
        assert!(Spectrum::new(140.5, resolution, &[window]).is_err());
    }
    for bad in [
        [154.0, 126.0],
        [f64::NAN, 150.0],
        [0.0, 150.0],
        [140.0, 140.0],
        [130.0, f64::INFINITY],
    ] {
        assert!(Spectrum::new(140.5, 0.1, &[bad]).is_err(), "{bad:?}");
    }
    let none = Spectrum::new(140.5, 0.1, &[]);
    assert!(matches!(none, Err(ScatterError::OutOfRange { .. })));
    let far = Spectrum::new(140.5, 0.1, &[[60.0, 80.0]]);
    assert!(matches!(far, Err(ScatterError::OutOfRange { .. })));
    // The lower window first.
    let error = Spectrum::new(140.5, 0.1, &[[108.0, 126.45], window]).unwrap_err();
    assert_eq!(
        error.to_string(),
        "upper edge of the photopeak window in keV is 126.45; it must be from 140.5 to 10000"
    );
    // The ends of all ranges work.
    for (energy, resolution) in [(21.0, 0.005), (600.0, 1.0)] {
        let window = [[0.9 * energy, 1.1 * energy]];
        assert!(Spectrum::new(energy, resolution, &window).is_ok());
    }
}

#[test]
fn cameras_are_checked() {
    let view = View {
        angle: 0.0,
        radius: 20.0,
    };
    let make = |size, pitch, view, response| Camera::new(size, [pitch; 2], &[view], response);
    assert!(
        make([0, 8], 1.0, view, LEHR).is_err() && make([8, usize::MAX], 1.0, view, LEHR).is_err()
    );
    assert!(Camera::new([8; 2], [1.0; 2], &[], LEHR).is_err());
    for bad in [f64::NAN, f64::INFINITY, -1.0, 0.0] {
        assert!(make([8; 2], bad, view, LEHR).is_err());
        assert!(
            make(
                [8; 2],
                1.0,
                View {
                    radius: bad,
                    ..view
                },
                LEHR
            )
            .is_err()
        );
        let slope = Response { slope: bad, ..LEHR };
        assert!(bad == 0.0 || make([8; 2], 1.0, view, slope).is_err());
    }
    for (angle, valid) in [
        (f64::NAN, false),
        (90.0, false),
        (10.0, false),
        (3.0, true),
        (-12.5, true),
        (12.5, true),
    ] {
        let made = make([8; 2], 1.0, View { angle, ..view }, LEHR);
        assert_eq!(made.is_ok(), valid, "{angle}");
    }
}

fn run(
    source: &dyn Source,
    medium: &dyn Medium,
    options: &ScatterOptions,
) -> Result<Scatter, ScatterError> {
    Scatter::new(
        source,
        medium,
        &camera(4, 1.0, &[0.0]),
        &photopeak(),
        options,
    )
}

#[test]
fn options_are_checked() {
    let point = Point([0.0; 3], 1.0);
    let least = ScatterOptions::new(1e3).with_block(16);
    assert!(run(&point, &BALL, &least).is_ok());
    for tolerance in [f64::NAN, 0.0, -1.0, f64::INFINITY] {
        assert!(run(&point, &BALL, &ScatterOptions::new(tolerance)).is_err());
    }
    assert!(run(&point, &BALL, &ScatterOptions::new(0.0).with_relative(0.5)).is_ok());
    for (empty, allowed) in [
        (least.with_orders(0), "at least 1"),
        (least.with_most_histories(0), "at least 2048"),
    ] {
        let error = run(&point, &BALL, &empty).unwrap_err().to_string();
        let expected = format!("is 0; it must be {allowed}");
        assert!(error.ends_with(&expected), "{error}");
    }
    let error = run(&point, &BALL, &ScatterOptions::new(0.0)).unwrap_err();
    assert_eq!(
        error.to_string(),
        "tolerance is 0; it must be greater than 0"
    );
    let error = run(&point, &BALL, &least.with_block(15)).unwrap_err();
    assert_eq!(
        error.to_string(),
        "histories of a block is 15; it must be from 16 to 10000000"
    );
    for pitch in [f64::NAN, 0.0, 1e9] {
        assert!(run(&point, &BALL, &least.with_pitch(pitch)).is_err());
    }
    for block in [0, 15, usize::MAX] {
        assert!(run(&point, &BALL, &least.with_block(block)).is_err());
    }
    let wide = Camera::new(
        [16_384; 2],
        [1.0; 2],
        &[View {
            angle: 0.0,
            radius: 9.0,
        }],
        LEHR,
    )
    .unwrap();
    let huge = Scatter::new(&point, &BALL, &wide, &photopeak(), &least);
    let error = huge.unwrap_err().to_string();
    assert!(error.contains("of each at a pitch of 0.75 cm"), "{error}");
}

struct Bad(f64);

impl Source for Bad {
    fn emit(&self, _: &mut Random) -> Emission {
        Emission {
            position: [self.0, 0.0, 0.0],
            weight: 1.0,
        }
    }
}

impl Medium for Bad {
    fn pieces(&self, _: [f64; 3], _: [f64; 3], pieces: &mut Vec<Piece>) {
        pieces.push(Piece {
            enter: 0.0,
            exit: 1.0,
            density: self.0,
        });
    }
}

#[test]
fn sources_and_media_are_checked() {
    let options = ScatterOptions::new(1e3).with_block(16);
    let point = |weight| Point([0.0; 3], weight);
    for bad in [f64::NAN, f64::INFINITY] {
        for result in [
            run(&Bad(bad), &BALL, &options),
            run(&point(bad), &BALL, &options),
            run(&point(-1.0), &BALL, &options),
            run(&point(1.0), &Bad(bad), &options),
            run(&point(1.0), &Bad(-1.0), &options),
        ] {
            assert!(matches!(result, Err(ScatterError::OutOfRange { .. })));
        }
    }
    // Nothing emitted, or nothing to scatter: no scatter, exactly, where source or medium state it.
    let (none, air) = (
        PointSource {
            position: [0.0; 3],
            activity: 0.0,
        },
        VoxelMedium::new([2; 3], [1.0; 3], &[0.0; 8]).unwrap(),
    );
    for result in [
        run(&none, &BALL, &options),
        run(&point(1.0), &air, &options),
    ] {
        let scatter = result.unwrap();
        assert!(scatter.view(0, 0).iter().all(|value| *value == 0.0));
        assert_eq!(scatter.report().largest_standard_error, 0.0);
        assert_eq!(scatter.sum(0, 0), [0.0; 2]);
    }
    // Otherwise it is not known.
    let scatter = run(&point(1.0), &Bad(0.0), &options).unwrap();
    assert!(scatter.report().largest_standard_error > 0.0 && scatter.sum(0, 0)[1] > 0.0);
    let error = run(&point(0.0), &BALL, &options).unwrap_err().to_string();
    assert!(
        error.starts_with("mean weight of the first emissions is 0;"),
        "{error}"
    );
}

/// A window in which no photon is recorded has the error of one that the others record; a window above the energy of the photons has none.
#[test]
fn windows_without_a_photon_have_an_error() {
    let windows = [[126.45, 154.55], [85.0, 86.0], [400.0, 500.0]];
    let spectrum = Spectrum::new(140.5, 0.02, &windows).unwrap();
    let options = ScatterOptions::new(1e3).with_block(16).with_orders(1);
    let point = Point([0.0; 3], 1.0);
    let camera = camera(4, 1.0, &[0.0]);
    let scatter = Scatter::new(&point, &BALL, &camera, &spectrum, &options).unwrap();
    let sums = [0, 1, 2].map(|window| scatter.sum(window, 0));
    println!("{sums:?}");
    assert!(sums[1][0] < 1e-9 * sums[0][0] && sums[1][1] > 0.0 && sums[2] == [0.0; 2]);
    let errors = scatter.standard_error(1, 0);
    assert!(errors.iter().all(|error| *error > 0.0), "{errors:?}");
}

/// Pieces of fixed ends and densities for every ray.
struct Fixed(&'static [[f64; 3]]);

impl Medium for Fixed {
    fn pieces(&self, _: [f64; 3], _: [f64; 3], pieces: &mut Vec<Piece>) {
        let piece = |&[enter, exit, density]: &[f64; 3]| Piece {
            enter,
            exit,
            density,
        };
        pieces.extend(self.0.iter().map(piece));
    }
}

#[test]
fn pieces_are_checked() {
    let options = ScatterOptions::new(1e3).with_block(16);
    let point = Point([0.0; 3], 1.0);
    let good: [&[[f64; 3]]; 4] = [
        &[],
        &[[-1.0, 1.0, 1.0]],
        &[[-3.0, -2.0, 30.0], [0.0, 1.0, 0.5], [1.0, 2.0, 1.0]],
        // Rounding.
        &[[0.0, 1.0, 1.0], [1.0 - 1e-9, 2.0, 1.0]],
    ];
    for pieces in good {
        assert!(run(&point, &Fixed(pieces), &options).is_ok(), "{pieces:?}");
    }
    let bad: [(&[[f64; 3]], &str); 7] = [
        (&[[1.0, -1.0, 1.0]], "end of a piece in cm"),
        (
            &[[0.0, 1.0, 1.0], [0.0, 1.0, 1.0]],
            "start of a piece in cm",
        ),
        (
            &[[1.0, 2.0, 1.0], [0.0, 1.0, 1.0]],
            "start of a piece in cm",
        ),
        (&[[0.0, 1.0, 1000.0]], "density of a piece in g/cm^3"),
        (&[[0.0, 1.0, f64::NAN]], "density of a piece in g/cm^3"),
        (&[[f64::NEG_INFINITY, 1.0, 1.0]], "start of a piece in cm"),
        (&[[0.0, f64::INFINITY, 0.0]], "end of a piece in cm"),
    ];
    for (pieces, expected) in bad {
        let error = run(&point, &Fixed(pieces), &options).unwrap_err();
        assert!(
            matches!(error, ScatterError::OutOfRange { what, .. } if what == expected),
            "{pieces:?}: {error}"
        );
    }
}

#[test]
fn faces_are_outside_the_medium() {
    let run = |radius, y| {
        let view = View { angle: 0.5, radius };
        let camera = Camera::new([4; 2], [1.0; 2], &[view], LEHR).unwrap();
        let point = Point([0.0, y, 0.0], 1.0);
        let options = ScatterOptions::new(1e3).with_block(16);
        Scatter::new(&point, &BALL, &camera, &photopeak(), &options)
    };
    assert!(run(2.0, 0.0).is_ok());
    let inside = run(1.9, 0.0).unwrap_err().to_string();
    assert!(inside.starts_with("radius of a view"), "{inside}");
}
