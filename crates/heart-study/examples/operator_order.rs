//! How the voxel operator of a SPECT camera converges to the exact views as voxels become finer, as `docs/img/operator-order.svg`:
//! `cargo run --release -p heart-study --example operator_order -- docs/img/operator-order.svg`.

use heart_phantom::radon::{LinearOperator, SliceAxis, SpectGeometry, SpectOperator, SpectOptions};
use heart_phantom::scene::{
    Attenuation, BinSample, CollimatorSettings, HolesSettings, Medium, Mode, Orbit, Product, Scene,
};
use heart_phantom::{Phantom, PhantomError};
use heart_study::figures::{Curve, curves};

/// The heart at end-diastole, which attenuates, seen through a collimator along an ellipse; means over bins, as the operator has them.
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
    scene.collimator = Some(CollimatorSettings {
        holes: HolesSettings::GeLehr,
        intrinsic_fwhm: 0.38,
    });
    scene.truth.tolerance = 1e-4;
    scene.output.write = vec![Product::Attenuation];
    scene
}

/// Relative Euclidean distance of what the operator makes of exact voxels from the exact views.
fn error(n: usize) -> Result<f64, PhantomError> {
    let phantom = Phantom::new(scene(n))?;
    let exact = phantom.sinograms(0, &|_| ())?.samples;
    let camera = phantom.camera();
    let axis = SliceAxis::new(n, camera.pitch())?;
    let geometry = SpectGeometry::new(camera.geometry(), &axis, phantom.radii()?)?;
    let mut options = SpectOptions::default().with_attenuation(phantom.attenuation(0.5)?);
    if let Some(collimator) = phantom.scene().collimator {
        options = options.with_collimator(collimator.response()?);
    }
    let options = options.with_tolerance(1e-5);
    let operator = SpectOperator::<f32>::new(&geometry, camera.image(), &axis, &options)?;
    let mut made = vec![0.0f32; exact.len()];
    operator.forward_into(&phantom.truth(0)?, &mut made)?;
    let square = |values: &mut dyn Iterator<Item = f64>| values.map(|v| v * v).sum::<f64>();
    let off = square(&mut made.iter().zip(&exact).map(|(a, b)| f64::from(a - b)));
    Ok((off / square(&mut exact.iter().map(|v| f64::from(*v)))).sqrt())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let out = std::env::args()
        .nth(1)
        .ok_or("usage: operator_order FILE.svg")?;
    let mut points: Vec<[f64; 2]> = Vec::new();
    for n in [32, 64, 128, 256] {
        let point = [(n as f64).log2(), error(n)?.log10()];
        let order = points
            .last()
            .map(|last| (last[1] - point[1]) / 2f64.log10());
        println!("{n:4}^3: {:.2e}, order {order:.2?}", 10f64.powf(point[1]));
        points.push(point);
    }
    // Through the first point.
    let order_two = points
        .iter()
        .map(|&[x, _]| [x, points[0][1] - 2.0 * (x - points[0][0]) * 2f64.log10()]);
    let order_two: Vec<_> = order_two.collect();
    let drawn = [
        Curve {
            label: "operator on exact voxels",
            points: &points,
        },
        Curve {
            label: "order 2",
            points: &order_two,
        },
    ];
    let x = "log2 of the voxels along an edge";
    let svg = curves(x, "log10 of the relative error of the views", &drawn)?;
    // White behind it, where a page is dark.
    let (head, rest) = svg.split_once('\n').ok_or("an empty drawing")?;
    let white = r##"<rect x="0" y="0" width="640" height="400" opacity="1" fill="#FFFFFF" stroke="none"/>"##;
    std::fs::write(out, format!("{head}\n{white}\n{rest}"))?;
    Ok(())
}
