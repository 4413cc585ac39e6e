//! Random walls between random membranes: material points, sectors, projections through a torso, blur and counts.

use crate::bodies::check_samples;
use crate::{Outcome, with_threads};
use heart_phantom::{Defect, MaterialPoint, Wall};
use membrane_newton::{
    Discretisation, Membrane, NewtonOptions, Pair, ReferenceShape, Solver, Stiffness,
};
use radon::{CountScale, poisson_counts};
use revolve_voxel::nalgebra::{Point3, Vector3};
use revolve_voxel::{
    Assembly, Body, Organ, OrganShape, Organs, ParallelDetector, Pose, Sector, Shown, VoxelGrid,
};
use std::f64::consts::{PI, TAU};
use tests::Random;

pub(crate) fn scene(random: &mut Random) -> Outcome {
    let unit = random.decades(-3.0, 3.0);
    let Some(([rest, wall], pose)) = walls(random, unit) else {
        return Outcome::Rejected;
    };
    let moved = wall.clone().sliding_from(&rest);
    for _ in 0..20 {
        check_point(random, [&rest, &wall, &moved], unit);
    }
    let Some(piece) = check_region(random, &wall) else {
        return Outcome::Rejected;
    };
    match random.integer(0, 2) {
        0 => check_image(random, (&wall, pose), piece, unit),
        1 => check_voxels(random, &wall, piece, unit),
        _ => Some(()),
    }
    .map_or(Outcome::Rejected, |()| Outcome::Answered)
}

/// A wall in the reference configuration and dilated, about ten units long, and its pose.
fn walls(random: &mut Random, unit: f64) -> Option<([Wall; 2], Pose)> {
    let (h, radius) = (
        unit * random.uniform(1.0, 9.0),
        unit * random.uniform(0.5, 3.0),
    );
    let outer_h = if random.one_in(2) {
        h
    } else {
        h * random.uniform(0.95, 1.1)
    };
    let outer_radius = radius * random.uniform(1.02, 2.0);
    let discretisation = if random.one_in(2) {
        Discretisation::FiniteDifferences {
            nodes: random.integer(5, 150),
        }
    } else {
        Discretisation::Spectral {
            degree: random.integer(4, 20),
            per_piece: random.integer(1, 3),
        }
    };
    let mut solver = |h: f64, radius: f64| {
        let stiffness = Stiffness::constant(random.spoiled(1.0)).ok()?;
        let rest = ReferenceShape::balloon(random.spoiled(h), random.spoiled(radius)).ok()?;
        Solver::new(
            &Membrane::new(rest).with_stiffness(stiffness),
            discretisation,
        )
        .ok()
    };
    let pair = Pair::new(solver(h, radius)?, solver(outer_h, outer_radius)?).ok()?;
    let pose = Pose::axis_along_z(0.5 * h)
        .ok()?
        .rotated_x(random.angle(-PI, PI))
        .ok()?
        .rotated_y(random.angle(-PI, PI))
        .ok()?;
    let gain = random.uniform(0.0, 1.5);
    let mut shape = |gain: f64| {
        let solved = pair
            .solve_gain(random.spoiled(gain), &NewtonOptions::default())
            .ok()?;
        Wall::new(&solved, pose).ok()
    };
    Some(([shape(0.0)?, shape(gain)?], pose))
}

fn check_point(random: &mut Random, walls: [&Wall; 3], unit: f64) {
    let near = |random: &mut Random, low: f64, high: f64| match random.integer(0, 9) {
        0 => low,
        1 => high,
        _ => random.uniform(low, high),
    };
    let mut point = MaterialPoint {
        layer: near(random, 0.0, 1.0),
        s: near(random, 0.0, 0.5),
        azimuth: random.angle(-PI, PI),
    };
    point.layer = random.spoiled(point.layer);
    for (k, wall) in walls.into_iter().enumerate() {
        let Ok(p) = wall.position(&point) else {
            assert!(!(0.0..=1.0).contains(&point.layer), "{point:?} rejected");
            return;
        };
        assert!(p.iter().all(|x| x.is_finite()), "{point:?}: {p}");
        let Some(found) = wall.locate(&p) else {
            panic!("{point:?} is at {p}, outside the wall");
        };
        // The point itself, in a wall of about ten units that may be as thin as a thousandth of a unit. Layers jump at the corners of a polyline:
        // rounding decides on which side of it a sliding point is, so that either is valid.
        let back = [0.0, -1e-12, 1e-12].map(|aside| {
            let s = (found.s + aside).clamp(0.0, 0.5);
            wall.position(&MaterialPoint { s, ..found })
                .expect("the located point is in range")
        });
        assert!(
            back.iter().any(|back| (back - p).norm() <= 1e-9 * unit),
            "{point:?} {found:?}: {p} {back:?}"
        );
        let deformation = walls[0].deformation(wall, &point);
        let deformation = deformation.expect("as the position");
        let sides = deformation.gradient * deformation.wall;
        let mut sides = sides.column_iter().map(|side| side.norm());
        assert!(
            sides.all(|x| x.is_finite() && x > 0.0),
            "{point:?}: {deformation:?}"
        );
        if k == 2 && point.s < 0.499 {
            // The third wall slides from the first: it is incompressible. The sides of a polyline jump at its corners, where rounding
            // decides the side.
            let same = (walls[0].volume() / wall.volume() - 1.0).abs();
            assert!(
                (deformation.gradient.determinant() - 1.0).abs() < 1e-6 + 2.0 * same,
                "{point:?}: {deformation:?}"
            );
        }
    }
}

fn check_region(random: &mut Random, wall: &Wall) -> Option<Defect> {
    let ordered = |[a, b]: [f64; 2], random: &mut Random| [random.spoiled(a.min(b)), a.max(b)];
    let layers = ordered([0, 1].map(|_| random.uniform(0.0, 1.0)), random);
    let s = ordered([0, 1].map(|_| random.uniform(0.0, 0.5)), random);
    let opening = ordered([0, 1].map(|_| random.angle(0.0, TAU)), random);
    let region = Defect {
        layers,
        s,
        azimuths_degrees: opening.map(f64::to_degrees),
        activity: 0.0,
    };
    let size = wall.volume().cbrt();
    let solid = wall.sector(&region, 1e-5 * size).ok()?;
    let other = wall.region(layers, s, 1e-5 * size).ok()?;
    let share = (opening[1] - opening[0]) / TAU;
    let exact = share * other.mass_properties().volume;
    assert!((solid.volume() - exact).abs() <= 1e-12 * wall.volume());
    assert!(solid.volume() <= wall.volume() * (1.0 + 1e-3));
    Some(region)
}

fn check_image(
    random: &mut Random,
    (wall, pose): (&Wall, Pose),
    region: Defect,
    unit: f64,
) -> Option<()> {
    let solid = wall.sector(&region, 1e-3 * unit).ok()?;
    let ring = wall.region(region.layers, region.s, 1e-3 * unit).ok()?;
    let [from, to] = region.azimuths_degrees.map(f64::to_radians);
    let rest = Sector::new(ring.clone(), [to, from + TAU], pose).ok()?;
    let whole = Sector::new(ring.clone(), [0.0, TAU], pose).ok()?;
    let (bins, rows) = (random.integer(1, 40), random.integer(1, 30));
    let pitch = [bins, rows].map(|n| random.rounded(24.0 * unit / n as f64));
    let rays = ParallelDetector::new(bins, rows, pitch)
        .ok()?
        .rays(random.angle(-7.0, 7.0))
        .ok()?;
    let axes = [random.uniform(1.0, 20.0), random.uniform(1.0, 20.0)].map(|a| a * unit);
    let torso = OrganShape::cylinder([0.0, random.spoiled(unit)], axes).ok()?;
    let mu = random.spoiled(random_mu(unit));
    let torso = Organ {
        shape: torso,
        activity: 0.0,
        attenuation: mu,
    };
    let torso = Organs::new(vec![torso]).ok()?;
    let body = Body::new(vec![ring], pose).ok()?;
    let see = |sector: &Sector| {
        let mut image = vec![0.0_f64; bins * rows];
        let assembly = Assembly::new(&torso).with_body(&body, &[0.0], None);
        let assembly = assembly.and_then(|own| own.with_sectors(vec![(sector.clone(), 1.0)]));
        let assembly = assembly.expect("finite input");
        (assembly.project_add(&rays, Shown::Change, 1.0, &mut image)).expect("finite input");
        image
    };
    let mut plain = vec![0.0_f64; bins * rows];
    (solid.project_add(&rays, 1.0, &mut plain)).expect("finite input");
    let place = (24.0 * unit, pose.axis());
    check_samples(random, &plain, &rays, place, |ray| solid.chord(ray));
    let seen = with_threads(1, || see(&solid));
    let again = with_threads(2, || see(&solid));
    assert!(seen == again);
    for (a, b) in seen.iter().zip(&plain) {
        assert!(*a >= 0.0 && *a <= b * (1.0 + 1e-9) + 1e-9 * unit, "{a} {b}");
    }
    let (parts, all) = (see(&rest), see(&whole));
    for ((a, b), all) in seen.iter().zip(&parts).zip(&all) {
        assert!((a + b - all).abs() <= 1e-9 * unit, "{a} + {b}, not {all}");
    }
    check_counts(random, &seen)
}

/// Attenuation similar to that of water, on a length of `unit`.
fn random_mu(unit: f64) -> f64 {
    0.15 / unit
}

fn check_counts(random: &mut Random, image: &[f64]) -> Option<()> {
    let (seed, total) = (random.bits(), random.decades(0.0, 7.0));
    let scale = CountScale::Total(random.spoiled(total));
    let draw = || poisson_counts(image, scale, seed);
    let counts = with_threads(1, draw).ok()?;
    assert!(counts == with_threads(2, draw).expect("as with one thread"));
    let CountScale::Total(total) = scale else {
        panic!("a total was requested")
    };
    let sum: f64 = counts.iter().sum();
    // Eight standard deviations: never exceeded in any realistic number of scenes.
    assert!(
        (sum - total).abs() <= 8.0 * total.sqrt() + 8.0,
        "{sum} counts of {total}"
    );
    Some(())
}

fn check_voxels(random: &mut Random, wall: &Wall, region: Defect, unit: f64) -> Option<()> {
    let solid = wall.sector(&region, 1e-3 * unit).ok()?;
    let n = random.integer(1, 16);
    let grid = VoxelGrid::cube(n, random.rounded(30.0 * unit / n as f64)).ok()?;
    let tolerance = random.decades(-3.0, -1.0);
    let fill = || {
        let mut out = vec![0.0_f64; grid.len()];
        solid
            .voxelize_add(&grid, 0..n, tolerance, 1.0, &mut out)
            .expect("finite input");
        out
    };
    let (one, two) = (with_threads(1, fill), with_threads(2, fill));
    assert!(one == two);
    assert!(one.iter().all(|v| (-1e-12..=1.0 + 1e-12).contains(v)));
    // The tolerance bounds each voxel that may be cut, so their sum; the volume is a closed form.
    let cut = one.iter().filter(|v| **v > 0.0 && **v < 1.0).count();
    let volume = one.iter().sum::<f64>() * grid.voxel_volume();
    assert!(
        (volume - solid.volume()).abs() <= tolerance * (cut + 1) as f64 * grid.voxel_volume(),
        "{volume} and {}",
        solid.volume()
    );
    if cut > 0 {
        let k = random.integer(0, cut - 1);
        let mut all = (0..one.len()).filter(|&k| one[k] > 0.0 && one[k] < 1.0);
        let k = all.nth(k).expect("one of them");
        let centre = grid.centre(k % n, k / n % n, k / (n * n));
        let [share, error] = sampled(random, &solid, &centre, grid.spacing()[0]);
        assert!(
            (one[k] - share).abs() <= tolerance + 8.0 * error + 1e-4,
            "{} and {share} +- {error}",
            one[k]
        );
    }
    Some(())
}

/// The fraction of a cube within a solid, by points, and its standard deviation: two points in each of many small cubes, whose difference estimates
/// the error of their mean.
fn sampled(random: &mut Random, solid: &Sector, centre: &Point3<f64>, size: f64) -> [f64; 2] {
    const N: usize = 20;
    let mut inside = |k: usize| {
        let mut at = |k: usize| ((k % N) as f64 + random.any(0.0, 1.0)) / N as f64 - 0.5;
        let offset = Vector3::new(at(k), at(k / N), at(k / (N * N))) * size;
        u32::from(solid.contains(&(centre + offset)))
    };
    let (mut sum, mut differ) = (0, 0);
    for k in 0..N * N * N {
        let [a, b] = [inside(k), inside(k)];
        sum += a + b;
        differ += a ^ b;
    }
    let all = (N * N * N) as f64;
    [
        0.5 * f64::from(sum) / all,
        0.5 * f64::from(differ).sqrt() / all,
    ]
}
