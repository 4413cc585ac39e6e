//! Figures of invalid data.

use super::{ODD, SIZES, back, pairs};
use heart_phantom::PhantomError;
use heart_phantom::files::Section;
use heart_study::StudyError;
use heart_study::figures::{
    CircleStudy, ForceFrame, IsoView, Projection, Shape, View, Volume, circle, force_frames,
    histories, isosurface, projections, shapes, slices,
};

#[test]
fn figures_accept_any_input() {
    let values = [0.5_f32; 8];
    let volume = |spacing: f64| Volume {
        values: &values,
        size: [2; 3],
        spacing,
    };
    for n in SIZES {
        let odd = Volume {
            values: &values,
            size: [n, n, 2],
            spacing: 1.0,
        };
        let refused = slices(&odd, &[Section::Axial(0)], [0.0, 1.0], "");
        assert!(match refused {
            Err(StudyError::TooFew { given, .. }) => given == n,
            Err(StudyError::Phantom(PhantomError::WrongLength { given, .. })) =>
                n >= 2 && given == 8,
            _ => false,
        });
        for plane in [Section::Sagittal(n), Section::Coronal(n), Section::Axial(n)] {
            assert_eq!(
                slices(&volume(1.0), &[plane], [0.0, 1.0], "").is_ok(),
                n < 2
            );
        }
        back(projections(
            &[Projection {
                angle: 0.0,
                values: &values,
            }],
            n,
            1.0,
        ));
    }
    for nothing in [
        slices(&volume(1.0), &[], [0.0, 1.0], ""),
        projections(&[], 2, 1.0),
        shapes(&[]),
        force_frames(&[]),
        histories("", None, &[]),
    ] {
        assert!(matches!(nothing, Err(StudyError::TooFew { given: 0, .. })));
    }
    for a in ODD {
        back(slices(&volume(a), &[Section::Axial(0)], [0.0, 1.0], "a"));
        back(slices(&volume(1.0), &[Section::Axial(0)], [0.0, a], "a"));
        back(slices(&volume(1.0), &[Section::Axial(0)], [a, 1.0], "a"));
        let seen = Projection {
            angle: a,
            values: &values,
        };
        back(projections(&[seen], 2, 1.0));
        let straight = Projection {
            angle: 0.0,
            values: &values,
        };
        back(projections(&[straight], 2, a));
        let view = IsoView {
            level: a as f32,
            view: View {
                azimuth: a,
                elevation: 0.1,
            },
            cut: Some(([a, 0.0, 1.0], a)),
        };
        back(isosurface(&volume(1.0), &view));
        let level = IsoView { level: 0.4, ..view };
        back(isosurface(&volume(a), &level));
        back(histories("b", Some(a), &[("a", &[1.0, a])]));
    }
    // An image takes a hundredth of a second: every third pair.
    for [a, b] in pairs().step_by(3) {
        let nodes = [[0.0, a], [b, 0.0], [0.0, -1.0]];
        back(shapes(&[Shape {
            nodes: &nodes,
            load: a,
            area: b,
            volume: a,
        }]));
        back(force_frames(&[ForceFrame {
            iteration: usize::MAX,
            nodes: &nodes,
            elastic: &nodes,
            pressure: &nodes[..2],
        }]));
        back(force_frames(&[ForceFrame {
            iteration: 0,
            nodes: &nodes,
            elastic: &nodes,
            pressure: &nodes,
        }]));
        back(circle(&CircleStudy {
            initial: &nodes,
            solution: &nodes,
            centre: [a, 0.0],
            radius: b,
            n_nodes: &[3, usize::MAX],
            errors: &[a, b],
            order: a,
        }));
    }
}
