//! Every invalid input is a typed error.

use crate::support::{Ball, LEHR, Point, camera, photopeak};
use photon_scatter::{
    Camera, Compton, Emission, Medium, Piece, Random, Response, Scatter, ScatterError,
    ScatterOptions, Source, Spectrum, View, water_attenuation,
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
    for bad in [f64::NAN, f64::INFINITY, -1.0] {
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
        assert!(make([8; 2], 1.0, view, slope).is_err());
    }
    assert!(
        make(
            [8; 2],
            1.0,
            View {
                angle: f64::NAN,
                ..view
            },
            LEHR
        )
        .is_err()
    );
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
    assert!(matches!(huge, Err(ScatterError::OutOfRange { .. })));
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
    // Nothing emitted, or nothing to scatter: no scatter, exactly.
    for result in [
        run(&point(0.0), &BALL, &options),
        run(&point(1.0), &Bad(0.0), &options),
    ] {
        let scatter = result.unwrap();
        assert!(scatter.view(0, 0).iter().all(|value| *value == 0.0));
        assert_eq!(scatter.largest_error(), 0.0);
    }
}
