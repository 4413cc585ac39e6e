//! Geometries and options in files: unchanged after writing and reading, invalid values rejected.

use radon::{
    ArcPolicy, CglsOptions, Collimator, EdgePolicy, EmOptions, FbpMethod, FbpOptions, HoleResponse,
    ImageGrid, InstructionSet, Interpolation, Kernel, ParallelGeometry, ParallelHoles, SirtOptions,
    SliceAxis, SpectGeometry, SpectOptions, StackOrder, Stopping, Window,
};
use serde::{Serialize, de::DeserializeOwned};
use std::fmt::Debug;

/// Also compares the text.
fn check<T: Serialize + DeserializeOwned + PartialEq + Debug>(value: T, text: &str) {
    let written = serde_json::to_string(&value).unwrap();
    assert_eq!(written, text);
    assert_eq!(serde_json::from_str::<T>(&written).unwrap(), value);
}

#[test]
fn geometries_and_options_are_read_as_they_were_written() {
    let geometry = ParallelGeometry::from_radians([0.5, 20.0], 7, 0.25).unwrap();
    let geometry = geometry.with_offset(-1.5).unwrap();
    let views = r#"{"angles":[0.5,20.0],"n_bins":7,"pitch":0.25,"offset":-1.5}"#;
    check(geometry.clone(), views);
    let grid = ImageGrid::anisotropic(3, 4, [0.5, 0.75]).unwrap();
    let grid = grid.with_centre([1.0, -2.0]).unwrap();
    check(
        grid,
        r#"{"nx":3,"ny":4,"spacing":[0.5,0.75],"centre":[1.0,-2.0]}"#,
    );
    let axis = SliceAxis::new(5, 0.5).unwrap().with_centre(0.25).unwrap();
    let rows = r#"{"n_slices":5,"spacing":0.5,"centre":0.25}"#;
    check(axis, rows);
    let orbit = SpectGeometry::new(&geometry, &axis, [9.0, 8.5]).unwrap();
    check(
        orbit,
        &format!(r#"{{"views":{views},"rows":{rows},"radii":[9.0,8.5]}}"#),
    );
    let collimator = Collimator::new(0.25, 0.125, 0.5).unwrap();
    let width = r#"{"slope":0.25,"at_face":0.125,"intrinsic":0.5}"#;
    check(collimator, width);
    let holes = ParallelHoles {
        diameter: 0.15,
        length: 3.5,
        attenuation: 22.0,
        response: HoleResponse::default(),
    };
    let text = serde_json::to_string(&holes).unwrap();
    assert_eq!(serde_json::from_str::<ParallelHoles>(&text).unwrap(), holes);
    let opaque = ParallelHoles {
        attenuation: f64::INFINITY,
        ..holes
    };
    let text = r#"{"diameter":0.15,"length":3.5,"attenuation":null,"response":"anger"}"#;
    check(opaque, text);

    check(StackOrder::SliceViewBin, r#""slice-view-bin""#);
    check(Kernel::Joseph, r#""joseph""#);
    check(
        FbpMethod::Fourier { tolerance: 0.001 },
        r#"{"fourier":{"tolerance":0.001}}"#,
    );
    let stopping = Stopping::default()
        .with_max_iterations(3)
        .with_residual(0.5);
    let rule = r#"{"max_iterations":3,"residual":0.5,"change":null}"#;
    check(stopping, rule);
    check(
        EmOptions::default()
            .with_stopping(stopping)
            .with_background(vec![0.5_f32]),
        &format!(r#"{{"stopping":{rule},"background":[0.5]}}"#),
    );
    let options = FbpOptions::default()
        .with_window(Window::Hann)
        .with_interpolation(Interpolation::BandLimited)
        .with_edge(EdgePolicy::Ellipse)
        .with_arc(ArcPolicy::Rescale)
        .with_region(1..3, 0..2);
    let text = serde_json::to_string(&options).unwrap();
    assert_eq!(serde_json::from_str::<FbpOptions>(&text).unwrap(), options);
    // The instruction set belongs to the machine.
    let text = serde_json::to_string(&options.clone().with_instructions(InstructionSet::Baseline));
    assert_eq!(
        serde_json::from_str::<FbpOptions>(&text.unwrap()).unwrap(),
        options
    );
}

#[test]
fn absent_options_are_those_of_the_default() {
    let some: FbpOptions = serde_json::from_str(r#"{"cutoff":0.5}"#).unwrap();
    assert_eq!(some, FbpOptions::default().with_cutoff(0.5));
    assert_eq!(
        serde_json::from_str::<CglsOptions>("{}").unwrap(),
        CglsOptions::default()
    );
    assert_eq!(
        serde_json::from_str::<SirtOptions>("{}").unwrap(),
        SirtOptions::default()
    );
    assert_eq!(
        serde_json::from_str::<EmOptions<f64>>("{}").unwrap(),
        EmOptions::default()
    );
    let some: SpectOptions<f32> = serde_json::from_str(r#"{"attenuation":[0.5]}"#).unwrap();
    assert_eq!(some, SpectOptions::default().with_attenuation(vec![0.5]));
}

/// The message is that of the constructor.
#[test]
fn invalid_values_are_rejected() {
    fn error<T: DeserializeOwned + Debug>(text: &str) -> String {
        serde_json::from_str::<T>(text).unwrap_err().to_string()
    }
    let views = |angles: &str, pitch: &str| {
        error::<ParallelGeometry>(&format!(
            r#"{{"angles":{angles},"n_bins":7,"pitch":{pitch},"offset":0.0}}"#
        ))
    };
    assert!(views("[]", "1.0").contains("n_views"));
    assert!(views("[0.0]", "-1.0").contains("pitch"));
    let grid = r#"{"nx":3,"ny":0,"spacing":[0.5,0.75],"centre":[1.0,-2.0]}"#;
    assert!(error::<ImageGrid>(grid).contains("ny"));
    let axis = r#"{"n_slices":5,"spacing":0.0,"centre":0.25}"#;
    assert!(error::<SliceAxis>(axis).contains("spacing"));
    let collimator = r#"{"slope":-0.25,"at_face":0.125,"intrinsic":0.5}"#;
    assert!(error::<Collimator>(collimator).contains("slope"));
    let holes = r#"{"diameter":0.15,"length":3.5}"#;
    assert!(error::<ParallelHoles>(holes).contains("attenuation"));
    assert!(error::<FbpOptions>(r#"{"cut":0.5}"#).contains("cut"));
    assert!(error::<ImageGrid>(r#"{"nx":3}"#).contains("ny"));
}
