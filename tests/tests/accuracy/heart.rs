//! A heart: volume of its wall, surface of its body, coverage of voxels, iterative reconstruction.

use std::f64::consts::PI;

use crate::Row;
use crate::equilibria::volume;
use crate::voxel::covered;
use heart_phantom::membrane_newton::{
    Discretisation, Equilibrium, Membrane, ReferenceShape, Rubber, Solver, Stiffness, StrainEnergy,
    Thickness,
};
use heart_phantom::revolve_voxel::Pose;
use heart_phantom::scene::DiscretisationSettings;
use heart_phantom::{Heart, Method, Osem, Phantom, no_observer};
use heart_phantom::{Mode, Scene, radon::ArcPolicy};
use nalgebra::Point3;
use tests::Random;

pub(crate) const ROWS: &[Row] = &[
    Row {
        name: "heart_phantom::HeartShape::wall_volume_error",
        what: "volume of the wall; 1e-12 of the volumes is added to the stated error",
        reference: "Gauss quadrature of the polynomials; frusta between nodes",
        norm: "relative to the wall",
        quick: 6,
        problem: wall,
    },
    Row {
        name: "heart_phantom::scene::DiscretisationSettings::Spectral::tolerance",
        what: "distance between membrane and surface of the body",
        reference: "2000 points on each polynomial",
        norm: "maximum, in cm",
        quick: 6,
        problem: surface,
    },
    Row {
        name: "heart_phantom::scene::TruthSettings::tolerance",
        what: "volume fraction of a voxel inside the wall",
        reference: "1.1e5 points of a Kronecker sequence per voxel, tested against the polygons through the nodes",
        norm: "maximum over 12 voxels",
        quick: 4,
        problem: coverage,
    },
    Row {
        name: "heart_phantom::Osem::tolerance",
        what: "relative change of the image in the last iteration",
        reference: "difference between runs with prescribed numbers of iterations",
        norm: "L2, relative",
        quick: 4,
        problem: change,
    },
];

/// Two random balloons of springs or rubber, the outer one around the inner one.
fn balloons(random: &mut Random) -> Option<[Membrane; 2]> {
    let (length, radius) = (random.uniform(5.0, 10.0), random.uniform(1.2, 2.5));
    let around = random.uniform(0.5, 1.5);
    let is_rubber = random.one_in(3);
    let mut membrane = |length: f64, radius: f64| {
        let rest = Membrane::new(ReferenceShape::balloon(length, radius).ok()?);
        let modulus = random.decades(-1.0, 1.0);
        if is_rubber {
            let thickness = Thickness::constant(0.05).ok()?;
            let energy = StrainEnergy::NeoHookean { mu: modulus };
            Some(rest.with_rubber(Rubber::new(energy, thickness).ok()?))
        } else {
            Some(rest.with_stiffness(Stiffness::constant(modulus).ok()?))
        }
    };
    Some([
        membrane(length, radius)?,
        membrane(length + 0.5 * around, radius + around)?,
    ])
}

/// pi times the integral of y^2 x' over the upper half of a curve.
fn enclosed(of: &Equilibrium) -> f64 {
    let pieces = of.pieces();
    if !pieces.is_empty() {
        return volume(&pieces);
    }
    let points = of.points();
    let upper = points[..=points.len() / 2].windows(2);
    let frusta = upper.map(|ends| {
        let [[x0, y0], [x1, y1]] = [ends[0], ends[1]];
        PI / 3.0 * (x1 - x0) * (y0 * y0 + y0 * y1 + y1 * y1)
    });
    frusta.sum()
}

fn wall(random: &mut Random) -> Option<f64> {
    let membranes = balloons(random)?;
    let discretisation = if random.one_in(2) {
        let nodes = 2 * random.integer(15, 150) + 1;
        Discretisation::FiniteDifferences { nodes }
    } else {
        let degree = random.integer(8, 20);
        Discretisation::Spectral {
            degree,
            per_piece: 1,
        }
    };
    let [inner, outer] = membranes.each_ref().map(|membrane| {
        let solver = Solver::new(membrane, discretisation).ok()?;
        Some(enclosed(&solver.start()))
    });
    let rest = outer? - inner?;
    let pose = Pose::axis_along_z(4.0).ok()?;
    let [inner, outer] = &membranes;
    let gain = random.uniform(-0.2, 1.0);
    let mut heart = Heart::of_membranes([inner, outer], discretisation, 1e-3, pose).ok()?;
    if random.one_in(3) {
        let descent = random.uniform(0.2, 1.6);
        heart = heart.with_av_plane_displacement(descent, [0.0, 1.0]).ok()?;
    }
    let shape = heart.shapes(&[gain]).ok()?.remove(0);
    let solved = shape.solution();
    let outside = enclosed(&solved.outer);
    let error = (outside - enclosed(&solved.inner)) / rest - 1.0;
    Some(error.abs() / (shape.solution().wall_volume_error.abs() + 1e-12 * outside / rest))
}

fn surface(random: &mut Random) -> Option<f64> {
    let phase = random.uniform(0.0, 1.0);
    let tolerance = random.decades(-6.0, -1.0);
    let mut scene = Scene::default().with_mode(Mode::Static { phase });
    scene.heart.discretisation = DiscretisationSettings::Spectral {
        degree: random.integer(8, 24),
        per_piece: random.integer(1, 2),
        tolerance,
    };
    scene.heart.inner.length = random.uniform(6.0, 10.0);
    scene.heart.outer.length = scene.heart.inner.length + random.uniform(0.0, 1.0);
    let shape = Phantom::new(scene).ok()?.shape(phase).ok()?;
    let (body, solved) = (shape.body(), shape.solution());
    let azimuth = random.any(0.0, 2.0 * PI);
    let mut worst = 0.0_f64;
    for (layer, membrane) in [&solved.inner, &solved.outer].into_iter().enumerate() {
        for k in 0..=2000 {
            let [x, r] = membrane.at(0.5 * f64::from(k) / 2000.0).position;
            let point = Point3::new(x, r * azimuth.cos(), r * azimuth.sin());
            let point = body.pose().to_lab(&point);
            worst = worst.max(body.signed_distance(layer, &point).ok()?.abs());
        }
    }
    // Positions in the lab are rounded.
    Some(worst / (tolerance + 1e-13))
}

/// A heart at one phase in a random pose, and few large voxels.
fn static_scene(random: &mut Random) -> Scene {
    let phase = random.uniform(0.0, 1.0);
    let mut scene = Scene::default().with_mode(Mode::Static { phase });
    scene.heart.discretisation = DiscretisationSettings::Differences { nodes: 61 };
    // Not from a grid: planes of reference points parallel to the base would displace it by up to half their distance.
    scene.pose.rotate_x = random.any(-180.0, 180.0);
    scene.pose.rotate_y = random.any(-180.0, 180.0);
    scene.pose.shift = [0; 3].map(|_| random.uniform(-1.0, 1.0));
    let camera = &mut scene.camera;
    (camera.views, camera.bins, camera.rows) = (16, 24, 20);
    camera.pitch = [0; 2].map(|_| random.uniform(0.4, 0.8));
    scene.reconstruction.arc = ArcPolicy::Extend;
    scene
}

fn coverage(random: &mut Random) -> Option<f64> {
    let mut scene = static_scene(random);
    let tolerance = random.decades(-2.5, -1.0);
    scene.truth.tolerance = tolerance;
    let Mode::Static { phase } = scene.acquisition.mode else {
        return None;
    };
    let phantom = Phantom::new(scene).ok()?;
    let (truth, shape) = (phantom.truth(0).ok()?, phantom.shape(phase).ok()?);
    let (grid, pose) = (phantom.camera().grid(), *shape.body().pose());
    // Whether a half plane's point is within the polygon: an odd number of edges is farther from the axis.
    let within = |curve: &[[f64; 2]], x: f64, r: f64| {
        let upper = curve[..=curve.len() / 2].windows(2);
        let above = upper.filter(|ends| {
            let [[x0, y0], [x1, y1]] = [ends[0], ends[1]];
            (x0 <= x) != (x1 <= x) && y0 + (y1 - y0) * (x - x0) / (x1 - x0) > r
        });
        above.count() % 2 == 1
    };
    let [inner, outer] = shape.curves();
    let [nx, ny, _] = grid.shape();
    let is_cut = |k: &usize| truth[*k] > 0.0 && truth[*k] < 1.0;
    let cut: Vec<usize> = (0..truth.len()).filter(is_cut).collect();
    let mut worst = 0.0_f64;
    for number in 0..12 {
        // One in four may be adjacent to the surface, covered or not.
        let mut voxel = random.pick(&cut);
        if number % 4 == 0 && voxel + 1 < truth.len() {
            voxel += 1;
        }
        let centre = grid.centre(voxel % nx, voxel / nx % ny, voxel / (nx * ny));
        let exact = covered(grid.spacing(), |by| {
            let at = pose.to_body(&(centre + by));
            let r = at.y.hypot(at.z);
            within(outer, at.x, r) && !within(inner, at.x, r)
        });
        worst = worst.max((f64::from(truth[voxel]) - exact).abs());
    }
    Some(worst / tolerance)
}

fn change(random: &mut Random) -> Option<f64> {
    let scene = static_scene(random);
    let tolerance = random.decades(-3.0, -0.5);
    let subsets = random.integer(1, 8);
    let phantom = Phantom::new(scene.clone()).ok()?;
    let views = phantom.sinograms(0, &no_observer).ok()?.samples;
    let run = |iterations: usize, tolerance: Option<f64>| {
        let mut scene = scene.clone();
        let mut osem = Osem::new(subsets, iterations);
        osem.tolerance = tolerance;
        scene.reconstruction.method = Method::Osem(osem);
        let phantom = phantom.with_scene(scene).ok()?;
        let mut volume = vec![0.0; phantom.camera().grid().len()];
        let report = phantom.reconstruct_into(0, &views, &mut volume, &no_observer);
        let report = report.ok()?;
        Some((volume, report?.iterations))
    };
    let most = 100;
    let (volume, iterations) = run(most, Some(tolerance))?;
    if iterations == most || iterations < 2 {
        return None;
    }
    let (before, _) = run(iterations - 1, None)?;
    let square = |v: f32| f64::from(v) * f64::from(v);
    let pairs = volume.iter().zip(&before);
    let moved: f64 = pairs.map(|(new, old)| square(new - old)).sum();
    let size: f64 = volume.iter().map(|new| square(*new)).sum();
    // Single precision.
    Some((moved / size).sqrt() / (tolerance + 1e-7))
}
