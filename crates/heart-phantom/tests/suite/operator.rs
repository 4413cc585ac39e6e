//! The voxel operator of `radon` on exact voxels against exact projections: they share neither rays nor blurs of slabs.

use heart_phantom::radon::{LinearOperator, SliceAxis, SpectGeometry, SpectOperator, SpectOptions};
use heart_phantom::scene::{CollimatorSettings, DiscretisationSettings, HolesSettings};
use heart_phantom::{Attenuation, BinSample, Medium, Mode, Orbit, Product, Scene};
use heart_phantom::{Phantom, no_observer};

/// An attenuating heart, through a collimator on an elliptic orbit; bin averages, as in the operator.
fn scene(n: usize) -> Scene {
    let mut scene = Scene::default()
        .with_size(n)
        .with_mode(Mode::Static { phase: 0.5 });
    scene.attenuation = Some(Attenuation {
        coefficient: 0.15,
        medium: Medium::Heart,
    });
    (scene.camera.views, scene.camera.arc) = (3, 360.0);
    scene.camera.radius = Orbit::Ellipse {
        semi_axes: [14.0, 11.0],
    };
    scene.camera.samples = Some(BinSample::Averages);
    scene.heart.discretisation = DiscretisationSettings::Differences { nodes: 201 };
    scene.collimator = Some(CollimatorSettings {
        holes: HolesSettings::GeLehr,
        intrinsic_fwhm: 0.38,
    });
    scene.output.write = vec![Product::Attenuation];
    scene
}

/// Relative Euclidean distance of the operator's projections of coverage voxels from the exact projections.
fn error(n: usize) -> f64 {
    let phantom = Phantom::new(scene(n)).unwrap();
    let exact = phantom.sinograms(0, &no_observer).unwrap().samples;
    let camera = phantom.camera();
    let axis = SliceAxis::new(n, camera.pitch()).unwrap();
    let geometry = SpectGeometry::new(camera.geometry(), &axis, phantom.radii().unwrap()).unwrap();
    let options = SpectOptions::default()
        .with_collimator(phantom.scene().collimator.unwrap().response().unwrap())
        .with_attenuation(phantom.attenuation(0.5).unwrap())
        .with_tolerance(1e-4);
    let operator = SpectOperator::<f32>::new(&geometry, camera.image(), &axis, &options).unwrap();
    let mut made = vec![0.0f32; exact.len()];
    let truth = phantom.truth(0).unwrap();
    operator.forward_into(&truth, &mut made).unwrap();
    let square = |v: f64| v * v;
    let off: f64 = made
        .iter()
        .zip(&exact)
        .map(|(a, b)| square(f64::from(a - b)))
        .sum();
    let all: f64 = exact.iter().map(|v| square(f64::from(*v))).sum();
    (off / all).sqrt()
}

#[test]
fn the_operator_on_coverage_voxels_converges_to_the_exact_views() {
    let errors = [24, 48, 96].map(error);
    println!("24, 48, 96: {errors:?}");
    // Voxels add the variance of a box in each direction: order 2 if the blur is wider than they are, which the coarsest do not satisfy.
    for (pair, order) in errors.windows(2).zip([1.5, 1.7]) {
        assert!((pair[0] / pair[1]).log2() > order, "{errors:?}");
    }
    assert!(errors[2] < 5e-3, "{errors:?}");
}
