//! Figures reject invalid input with its values and accept unusual input.

use heart_phantom::files::Section;
use heart_phantom::revolve_voxel::Pose;
use heart_study::figures::*;

use super::{FRONT, ball, half_ellipse, iso};

#[test]
fn bad_input_is_rejected_with_its_values() {
    use heart_phantom::PhantomError::{Count, OutOfRange, Solid, WrongLength};
    use heart_study::StudyError::*;
    let good = half_ellipse(8.0, 2.0);
    let mut nan = good.clone();
    nan[7][1] = f64::NAN;
    let shape = |nodes| Shape {
        nodes,
        load: 1.0,
        area: 2.0,
        volume: 3.0,
    };
    assert!(matches!(
        shapes(&[]),
        Err(TooFew {
            given: 0,
            least: 1,
            ..
        })
    ));
    assert!(matches!(
        shapes(&[shape(&good[..2])]),
        Err(TooFew {
            given: 2,
            least: 3,
            ..
        })
    ));
    assert!(matches!(
        shapes(&[shape(&nan)]),
        Err(NotFinite { index: 7, .. })
    ));
    assert!(matches!(
        shapes(&[shape(&[[1.0, 1.0]; 5])]),
        Err(Interval { .. })
    ));
    assert!(matches!(
        shapes(&[shape(&[[-1e308, 0.0], [1e308, 1.0], [0.0, 0.0]])]),
        Err(Interval { .. })
    ));
    let infinite = Shape {
        load: f64::INFINITY,
        ..shape(&good)
    };
    assert!(matches!(
        shapes(&[infinite]),
        Err(NotFinite { index: 0, .. })
    ));

    let nan_segment: [f64; 17] = std::array::from_fn(|k| if k == 5 { f64::NAN } else { 1.0 });
    assert!(matches!(polar_maps(&[], 1.0, ""), Err(TooFew { .. })));
    assert!(matches!(
        polar_maps(&[("", nan_segment)], 1.0, ""),
        Err(NotFinite { index: 5, .. })
    ));
    assert!(matches!(
        polar_maps(&[("", [1.0; 17])], 0.0, ""),
        Err(Phantom(OutOfRange { .. }))
    ));

    let history = |norms: &'static [f64]| ("", norms);
    assert!(matches!(histories("", None, &[]), Err(TooFew { .. })));
    assert!(matches!(
        histories("", None, &[history(&[])]),
        Err(TooFew { .. })
    ));
    assert!(matches!(
        histories("", None, &[history(&[1.0, f64::NAN])]),
        Err(NotFinite { index: 1, .. })
    ));
    assert!(matches!(
        histories("", None, &[history(&[1.0, -2.0])]),
        Err(Phantom(OutOfRange { given: -2.0, .. }))
    ));
    assert!(matches!(
        histories("", Some(0.0), &[history(&[1.0])]),
        Err(Phantom(OutOfRange { .. }))
    ));
    // Zeros and a single value are drawn.
    assert!(histories("", None, &[history(&[0.0])]).is_ok());

    let frame = |elastic| ForceFrame {
        iteration: 0,
        nodes: &good,
        elastic,
        pressure: &good,
    };
    assert!(matches!(force_frames(&[]), Err(TooFew { .. })));
    assert!(matches!(
        force_frames(&[frame(&good[1..])]),
        Err(Phantom(WrongLength {
            given: 100,
            expected: 101,
            ..
        }))
    ));
    assert!(matches!(
        force_frames(&[frame(&nan)]),
        Err(NotFinite { index: 7, .. })
    ));
    let still = vec![[0.0; 2]; good.len()];
    let rest = ForceFrame {
        iteration: 0,
        nodes: &good,
        elastic: &still,
        pressure: &still,
    };
    assert!(force_frames(&[rest]).is_ok());

    let state = |outer| WallState {
        title: "",
        inner: &good,
        outer,
    };
    assert!(matches!(wall_meshes(&[], 5, 50), Err(TooFew { .. })));
    assert!(matches!(
        wall_meshes(&[state(&good[1..])], 5, 50),
        Err(Phantom(WrongLength { .. }))
    ));
    assert!(matches!(
        wall_meshes(&[state(&good)], 0, 50),
        Err(TooFew { .. })
    ));
    assert!(matches!(bodies(&[]), Err(TooFew { .. })));
    assert!(matches!(bodies(&[state(&nan)]), Err(NotFinite { .. })));
    let flat = vec![[1.0, 1.0]; good.len()];
    assert!(matches!(bodies(&[state(&flat)]), Err(Phantom(Solid(_)))));
    assert!(matches!(
        poses(&state(&good), &[], FRONT),
        Err(TooFew { .. })
    ));
    let nowhere = View {
        azimuth: f64::NAN,
        elevation: 0.0,
    };
    assert!(matches!(
        poses(&state(&good), &[("", Pose::identity())], nowhere),
        Err(NotFinite { .. })
    ));

    let image = |values| Projection { angle: 0.0, values };
    assert!(matches!(projections(&[], 4, 1.0), Err(TooFew { .. })));
    assert!(matches!(
        projections(&[image(&[0.0; 15])], 4, 1.0),
        Err(Phantom(WrongLength { .. }))
    ));
    assert!(matches!(
        projections(&[image(&[0.0; 16])], 0, 1.0),
        Err(TooFew { .. })
    ));
    assert!(matches!(
        projections(&[image(&[0.0; 16])], 4, 0.0),
        Err(Phantom(OutOfRange { .. }))
    ));
    assert!(matches!(
        projections(&[image(&[f32::NAN; 16])], 4, 1.0),
        Err(NotFinite { .. })
    ));
    assert!(projections(&[image(&[0.0; 16])], 4, 1.0).is_ok());

    let values = ball(8, 3.0);
    let volume = Volume {
        values: &values,
        size: [8; 3],
        spacing: 1.0,
    };
    let z = Section::Axial(3);
    let window = [0.0, 1.0];
    assert!(matches!(
        slices(&volume, &[Section::Axial(8)], window, ""),
        Err(Phantom(Count {
            given: 8,
            most: 7,
            ..
        }))
    ));
    assert!(matches!(
        slices(&volume, &[z], [1.0, 1.0], ""),
        Err(Interval { .. })
    ));
    assert!(matches!(
        slices(&volume, &[z], [0.0, f64::NAN], ""),
        Err(Interval { .. })
    ));
    assert!(matches!(
        slices(&volume, &[], window, ""),
        Err(TooFew { .. })
    ));
    let short = Volume {
        size: [8, 8, 9],
        ..volume
    };
    assert!(matches!(
        slices(&short, &[z], window, ""),
        Err(Phantom(WrongLength {
            given: 512,
            expected: 576,
            ..
        }))
    ));
    // An angle in degrees.
    let image = Projection {
        angle: 90.0,
        values: &values[..64],
    };
    assert!(matches!(
        projections(&[image], 8, 0.1),
        Err(Phantom(OutOfRange { .. }))
    ));
    let huge = Volume {
        size: [usize::MAX; 3],
        ..volume
    };
    assert!(matches!(
        isosurface(&huge, &iso(0.5)),
        Err(Phantom(WrongLength { .. }))
    ));
    let unscaled = Volume {
        spacing: -1.0,
        ..volume
    };
    assert!(matches!(
        isosurface(&unscaled, &iso(0.5)),
        Err(Phantom(OutOfRange { .. }))
    ));
    let mut broken = values.clone();
    broken[100] = f32::INFINITY;
    let broken = Volume {
        values: &broken,
        ..volume
    };
    assert!(matches!(
        isosurface(&broken, &iso(0.5)),
        Err(NotFinite { index: 100, .. })
    ));
    assert!(matches!(
        isosurface(&volume, &iso(0.0)),
        Err(Phantom(OutOfRange { .. }))
    ));
    let cut = IsoView {
        cut: Some(([0.0; 3], 1.0)),
        ..iso(0.5)
    };
    assert!(matches!(
        isosurface(&volume, &cut),
        Err(Phantom(OutOfRange { .. }))
    ));

    let study = CircleStudy {
        initial: &good,
        solution: &good,
        centre: [0.0; 2],
        radius: 1.0,
        n_nodes: &[10, 20],
        errors: &[1e-2, 2.5e-3],
        order: 2.0,
    };
    assert!(circle(&study).is_ok());
    assert!(matches!(
        circle(&CircleStudy {
            n_nodes: &[10],
            ..study
        }),
        Err(Phantom(WrongLength { .. }))
    ));
    assert!(matches!(
        circle(&CircleStudy {
            errors: &[1.0, 0.0],
            ..study
        }),
        Err(Phantom(OutOfRange { .. }))
    ));
    assert!(matches!(
        circle(&CircleStudy {
            radius: f64::NAN,
            ..study
        }),
        Err(Phantom(OutOfRange { .. }))
    ));
}
