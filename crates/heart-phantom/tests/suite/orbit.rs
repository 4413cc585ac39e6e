//! Orbits and heads: positions of the collimator faces, times of the views, and reports.

use heart_phantom::scene::{
    CollimatorSettings, DiscretisationSettings, HeadsSettings, HolesSettings,
};
use heart_phantom::{
    Attenuation, BinSample, Medium, Mode, Orbit, Product, Scene, radon::ArcPolicy,
};
use heart_phantom::{Phantom, PhantomError, Rotation, Warning, WarningKind, no_observer, run};
use std::f64::consts::PI;

const N: usize = 32;
const TORSO: [f64; 2] = [11.0, 8.0];
const CENTRE: [f64; 2] = [0.5, -0.3];

/// The heart in the reference configuration, through a collimator over a full turn.
fn scene(views: usize, radius: Orbit) -> Scene {
    let mut scene = Scene::default()
        .with_size(N)
        .with_mode(Mode::Static { phase: 0.3 });
    scene.camera.views = views;
    scene.camera.arc = 360.0;
    scene.reconstruction.arc = ArcPolicy::Extend;
    scene.camera.radius = radius;
    scene.camera.samples = Some(BinSample::Centres);
    scene.heart.discretisation = DiscretisationSettings::Differences { nodes: 101 };
    scene.collimator = Some(CollimatorSettings {
        holes: HolesSettings::GeLehr,
        intrinsic_fwhm: 0.38,
    });
    scene
}

/// A torso that attenuates without activity.
fn in_torso(mut scene: Scene) -> Scene {
    scene.attenuation = Some(Attenuation {
        coefficient: 0.15,
        medium: Medium::Torso {
            centre: CENTRE,
            semi_axes: TORSO,
        },
    });
    scene
}

/// The samples, and their stated error relative to the largest.
fn views_and_error(scene: Scene) -> (Vec<f32>, f64) {
    let phantom = Phantom::new(scene).unwrap();
    let made = phantom.sinograms(0, &no_observer).unwrap();
    (made.samples, made.view_error.total())
}

fn views(scene: Scene) -> Vec<f32> {
    views_and_error(scene).0
}

fn close(a: &[f32], b: &[f32]) {
    within(1e-5, a, b);
}

/// Compares samples relative to the largest.
fn within(tolerance: f32, a: &[f32], b: &[f32]) {
    let most = b.iter().fold(0.0f32, |most, v| most.max(*v));
    assert!(most > 0.1 && a.len() == b.len());
    for (a, b) in a.iter().zip(b) {
        assert!((a - b).abs() < tolerance * most, "{a} {b}");
    }
}

#[test]
fn each_view_equals_that_of_a_circular_orbit_of_its_radius() {
    let radii = [11.0, 14.0, 12.5];
    let (seen, error) = views_and_error(scene(3, Orbit::PerView(radii.to_vec())));
    for (k, radius) in radii.into_iter().enumerate() {
        let (circle, own) = views_and_error(scene(3, Orbit::Circle(radius)));
        let view = k * N * N..(k + 1) * N * N;
        // The narrowest response of all views sets the resolution of each.
        within((error + own) as f32, &seen[view.clone()], &circle[view]);
        assert!(error + own < 2e-3);
    }
    let far = views(scene(3, Orbit::Circle(14.0)));
    let peak = |view: &[f32]| view.iter().fold(0.0f32, |most, v| most.max(*v));
    assert!(peak(&seen[..N * N]) > 1.02 * peak(&far[..N * N]));
}

#[test]
fn the_centre_of_the_face_follows_the_ellipse() {
    let axes = [18.0, 13.0];
    let orbit = Orbit::Ellipse { semi_axes: axes };
    let phantom = Phantom::new(scene(7, orbit)).unwrap();
    let angles = phantom.camera().geometry().angles();
    for (radius, theta) in phantom.radii().unwrap().into_iter().zip(angles) {
        let [x, y] = [-radius * theta.sin(), radius * theta.cos()];
        let on = (x / axes[0]).powi(2) + (y / axes[1]).powi(2);
        assert!((on - 1.0).abs() < 1e-14, "{on}");
    }
}

/// The plane of the face touches the ellipse of the torso; without a torso, the surfaces of the heart.
#[test]
fn a_contour_orbit_has_the_given_gap() {
    let gap = 1.5;
    let orbit = Orbit::Contour { gap };
    let phantom = Phantom::new(in_torso(scene(12, orbit.clone()))).unwrap();
    let angles = phantom.camera().geometry().angles().to_vec();
    for (radius, theta) in phantom.radii().unwrap().into_iter().zip(&angles) {
        // The vertex of a fine polygon of the ellipse that is farthest towards the face.
        let (sin, cos) = theta.sin_cos();
        let points = (0..4000).map(|k| f64::from(k) * PI / 2000.0);
        let farthest = points
            .map(|t| {
                [
                    CENTRE[0] + TORSO[0] * t.cos(),
                    CENTRE[1] + TORSO[1] * t.sin(),
                ]
            })
            .map(|[x, y]| y * cos - x * sin)
            .fold(0.0, f64::max);
        assert!(
            (radius - gap - farthest).abs() < 1e-5,
            "{radius} {farthest}"
        );
    }
    let phantom = Phantom::new(scene(12, orbit)).unwrap();
    let [_, outer] = phantom.meshes(0.3).unwrap();
    for (radius, theta) in phantom.radii().unwrap().into_iter().zip(&angles) {
        let (sin, cos) = theta.sin_cos();
        let towards = outer.vertices.iter().map(|p| p.y * cos - p.x * sin);
        let farthest = towards.fold(0.0, f64::max);
        // Triangles are within the curved surface, by their tolerance of 1e-3.
        assert!(
            (radius - gap - farthest).abs() < 2e-2,
            "{radius} {farthest}"
        );
    }
}

#[test]
fn clockwise_rotation_reverses_the_order_of_views() {
    let orbit = Orbit::Ellipse {
        semi_axes: [16.0, 12.0],
    };
    let forth = views(scene(4, orbit.clone()));
    let mut back = scene(4, orbit);
    back.camera.arc = -360.0;
    let back = views(back);
    for k in 0..4 {
        let other = (4 - k) % 4;
        close(
            &forth[k * N * N..(k + 1) * N * N],
            &back[other * N * N..(other + 1) * N * N],
        );
    }
}

#[test]
fn two_heads_acquire_at_the_same_times() {
    for rotation in [Rotation::StepAndShoot, Rotation::Continuous] {
        let mut one = scene(5, Orbit::Circle(14.0)).with_mode(Mode::Exposure { seconds: 0.4 });
        one.camera.arc = 90.0;
        one.camera.start = 10.0;
        one.camera.rotation = rotation;
        one.acquisition.accuracy = heart_phantom::Accuracy::Steps(8);
        // Projections only: 90 degrees do not suffice for FBP.
        one.output.write = vec![Product::Projections];
        one.reconstruction.arc = heart_phantom::radon::ArcPolicy::Extend;
        let mut two = one.clone();
        two.camera.heads = HeadsSettings::Two { angle: 90.0 };
        let mut second = one.clone();
        second.camera.start += 90.0;
        let both = Phantom::new(two).unwrap();
        let times = both.view_times(0).unwrap();
        assert_eq!(times.len(), 10);
        for k in 0..5 {
            let [a, b] = [times[k], times[5 + k]];
            assert_eq!((a.start, a.window, a.phase), (b.start, b.window, b.phase));
            assert!((b.angle - a.angle - PI / 2.0).abs() < 1e-14);
        }
        assert_ne!(times[0].phase, times[1].phase);
        let seen = both.sinograms(0, &no_observer).unwrap();
        let [first, second] = [one, second].map(views_and_error);
        let error = seen.view_error.total() + first.1.max(second.1);
        // Each head has the resolution of its own views.
        within(error as f32, &seen.samples, &[first.0, second.0].concat());
        // Together they are ten even steps over half a turn.
        let plan = both.geometry(0).unwrap();
        assert!(
            plan.view_weights(heart_phantom::radon::ArcPolicy::Complete)
                .is_ok()
        );
    }
}

#[test]
fn a_detector_inside_the_body_is_rejected_with_values() {
    // In front of the heart, but not of the torso, which only attenuates.
    let inside = in_torso(scene(4, Orbit::Circle(10.0)));
    let error = Phantom::new(inside.clone()).unwrap().prepare().unwrap_err();
    let PhantomError::Rejected { field, source, .. } = error else {
        panic!("{error:?}");
    };
    assert_eq!(field, "camera.radius");
    // At 90 degrees the face is at -x: half-width 11 about 0.5; at 270 degrees at +x.
    assert!(
        matches!(*source, PhantomError::DetectorInside { view_idx: 3, radius: 10.0, needed } if (needed - 11.5).abs() < 1e-9),
        "{source:?}"
    );
    assert!(source.to_string().contains("in view 3"));
    let near = in_torso(scene(4, Orbit::Circle(11.6)));
    Phantom::new(near).unwrap().prepare().unwrap();
    // Line integrals do not end at the face: a warning, in the report too.
    let mut lines = inside;
    lines.collimator = None;
    lines.output.write = vec![Product::Projections];
    let phantom = Phantom::new(lines).unwrap();
    let inside = WarningKind::DetectorInside;
    let is_it = |warning: &Warning| warning.what == inside && warning.numbers["view"] == 3.0;
    assert!(phantom.warnings().unwrap().iter().any(is_it));
    let folder = tempfile::tempdir().unwrap();
    assert!(
        run(&phantom, folder.path(), &no_observer)
            .unwrap()
            .warnings
            .iter()
            .any(is_it)
    );
    let report = std::fs::read_to_string(folder.path().join("report.json")).unwrap();
    assert!(report.contains("\"detector-inside\"") && report.contains("\"radius_cm\""));
}

#[test]
fn orbits_are_read_and_written() {
    for orbit in [
        Orbit::Circle(18.0),
        Orbit::PerView(vec![18.0, 17.5, 17.0]),
        Orbit::Ellipse {
            semi_axes: [18.0, 14.0],
        },
        Orbit::Contour { gap: 0.5 },
    ] {
        let mut given = scene(3, orbit);
        given.camera.heads = HeadsSettings::Two { angle: 180.0 };
        if let Orbit::PerView(radii) = &mut given.camera.radius {
            radii.extend_from_within(..);
        }
        assert_eq!(Scene::from_toml(&given.to_toml()).unwrap(), given);
    }
    let short = "[reconstruction]\narc = 'extend'\n[camera]\nviews = 2\narc = 180\nradius = ";
    let read = |radius: &str| Scene::from_toml(&format!("{short}{radius}\n"));
    assert_eq!(read("21").unwrap().camera.radius, Orbit::Circle(21.0));
    for (radius, field, says) in [
        ("-1.0", "camera.radius", "between"),
        ("\"near\"", "camera.radius", "contour"),
        ("true", "camera.radius", "contour"),
        ("{ per_view = [20.0] }", "camera.radius.per_view", "2"),
        (
            "{ per_view = [20.0, nan] }",
            "camera.radius.per_view",
            "between",
        ),
        (
            "{ ellipse = { semi_axes = [20.0, 0.0] } }",
            "camera.radius.ellipse.semi_axes",
            "between",
        ),
        ("{ ellipse = { semi_axes = [20.0] } }", "camera.radius", ""),
        (
            "{ contour = { gap = -0.1 } }",
            "camera.radius.contour.gap",
            "between",
        ),
        ("{ contour = { gap = 0.1, more = 1 } }", "camera.radius", ""),
        ("{ square = 3.0 }", "camera.radius", ""),
    ] {
        let Err(PhantomError::Scene(error)) = read(radius) else {
            panic!("{radius}");
        };
        assert!(error.first().field.starts_with(field), "{radius}: {error}");
        assert!(error.to_string().contains(says), "{radius}: {error}");
    }
    let heads = |angle: &str| {
        Scene::from_toml(&format!(
            "[camera]\nheads = {{ two = {{ angle = {angle} }} }}\n"
        ))
    };
    let Err(PhantomError::Scene(error)) = heads("400.0") else {
        panic!();
    };
    assert_eq!(error.first().field, "camera.heads.two.angle");
    // Twice the same quarter of a turn: the other quarter is missing.
    let quarter = "[camera]\narc = 90.0\nheads = { two = { angle = 180.0 } }\n";
    let Err(PhantomError::Scene(error)) = Scene::from_toml(quarter) else {
        panic!();
    };
    assert_eq!(error.first().field, "camera.arc");
    assert!(Scene::from_toml(&quarter.replace("180.0", "90.0")).is_ok());
}

#[test]
fn headers_contain_the_radius_of_each_view() {
    let radii = vec![12.0, 13.5, 12.25, 14.0];
    let text = |format: &str, name: &str| {
        let mut given = scene(4, Orbit::PerView(radii.clone()));
        given.output.write = vec![Product::Projections];
        given.output.projections = serde_json::from_str(&format!("\"{format}\"")).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let report = run(&Phantom::new(given).unwrap(), folder.path(), &no_observer).unwrap();
        assert_eq!(report.gates[0].views.radius_cm, radii);
        assert!(
            report
                .files
                .iter()
                .all(|file| folder.path().join(file).is_file())
        );
        assert!(report.files.iter().any(|file| file.to_str() == Some(name)));
        String::from_utf8_lossy(&std::fs::read(folder.path().join(name)).unwrap()).into_owned()
    };
    let stir = text("interfile-stir", "projections.hs");
    assert!(
        stir.contains("orbit := non-circular\nRadii := {120, 135, 122.5, 140}\n"),
        "{stir}"
    );
    let simind = text("interfile-simind", "projections.h00");
    assert!(simind.contains("orbit := noncircular\n"), "{simind}");
    assert!(
        simind.contains("Orbit File := projections.cor\n"),
        "{simind}"
    );
    assert_eq!(
        text("interfile-simind", "projections.cor"),
        "12\n13.5\n12.25\n14\n"
    );
    assert!(text("nrrd", "projections.nrrd").contains("radius_mm:=120 135 122.5 140\n"));
    let json: serde_json::Value =
        serde_json::from_str(&text("raw-json", "projections.json")).unwrap();
    assert_eq!(json["radius_cm"], serde_json::json!(radii));
    // Equal radii are a circle, also those of an ellipse.
    for orbit in [
        Orbit::PerView(vec![14.0; 4]),
        Orbit::Ellipse {
            semi_axes: [14.0; 2],
        },
    ] {
        let mut given = scene(4, orbit);
        given.output.write = vec![Product::Projections];
        given.output.projections = heart_phantom::files::Format::InterfileSimind;
        let folder = tempfile::tempdir().unwrap();
        let phantom = Phantom::new(given).unwrap();
        let report = run(&phantom, folder.path(), &no_observer).unwrap();
        let planned = phantom.files().unwrap().into_iter().map(|file| file.name);
        assert!(planned.eq(report.files.iter().cloned()));
        let names = ["projections.h00", "projections.a00", "report.json"];
        assert_eq!(report.files, names.map(std::path::PathBuf::from));
        let header = std::fs::read(folder.path().join(names[0])).unwrap();
        let header = String::from_utf8_lossy(&header).into_owned();
        assert!(
            header.contains("orbit := circular\nRadius := 140\n"),
            "{header}"
        );
    }
    // Interfile cannot store two heads without even steps.
    let mut uneven = scene(4, Orbit::Circle(14.0));
    uneven.camera.heads = HeadsSettings::Two { angle: 90.0 };
    uneven.output.projections = heart_phantom::files::Format::InterfileStir;
    let Err(PhantomError::Scene(error)) = Phantom::new(uneven) else {
        panic!();
    };
    assert_eq!(error.first().field, "output.projections");
}
