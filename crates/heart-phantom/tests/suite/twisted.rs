//! Regions of a twisted wall as solids, against the material coordinates of points.

use heart_phantom::*;
use proptest::prelude::*;
use revolve_voxel::nalgebra::{Point3, Unit, Vector3};
use revolve_voxel::{Ray, Sector};
use std::f64::consts::TAU;

/// A wall at systole, and a region of it as a solid.
struct Case {
    wall: Wall,
    region: Defect,
    sector: Sector,
}

impl Case {
    fn new(region: Defect, twist: Twist) -> Self {
        let heart = Heart::study(101).unwrap();
        let shapes = heart.shapes(&[0.0, 0.4]).unwrap();
        let wall = |k: usize| Wall::new(shapes[k].solution(), *heart.pose()).unwrap();
        let wall = wall(1).sliding_from(&wall(0)).twisted(twist);
        let sector = wall.sector(&region, 1e-6).unwrap();
        Self {
            wall,
            region,
            sector,
        }
    }

    /// Whether the material at a point belongs to the region.
    fn holds(&self, p: &Point3<f64>) -> bool {
        self.wall.locate(p).is_some_and(|found| {
            let within = |[from, to]: [f64; 2], at: f64| from <= at && at <= to;
            let [from, to] = self.region.azimuths_degrees.map(f64::to_radians);
            within(self.region.layers, found.layer)
                && within(self.region.s, found.s)
                && (found.azimuth - from).rem_euclid(TAU) < to - from
        })
    }

    /// Length of a line inside the region, by points in a distance of `step` and bisection between them.
    fn length(&self, ray: &Ray, step: f64) -> f64 {
        let half = 12.0;
        let n = (2.0 * half / step).ceil() as usize;
        let at = |k: usize| -half + 2.0 * half * k as f64 / n as f64;
        let inside = |t: f64| self.holds(&ray.at(t));
        let (mut sum, mut before) = (0.0, inside(at(0)));
        for k in 1..=n {
            let now = inside(at(k));
            if now && before {
                sum += at(k) - at(k - 1);
            } else if now != before {
                let [mut low, mut high] = [at(k - 1), at(k)];
                for _ in 0..30 {
                    let middle = 0.5 * (low + high);
                    if inside(middle) == before {
                        low = middle;
                    } else {
                        high = middle;
                    }
                }
                sum += if now { at(k) - low } else { low - at(k - 1) };
            }
            before = now;
        }
        sum
    }
}

fn any_region() -> impl Strategy<Value = Defect> {
    let range = |most: f64, least: f64| {
        (0.0..most - least, least..most)
            .prop_map(move |(from, wide)| [from, (from + wide).min(most)])
    };
    (range(1.0, 0.1), range(0.5, 0.05), -7.0..7.0, 0.02..6.2).prop_map(
        |(layers, s, from, wide): (_, _, f64, f64)| Defect {
            layers,
            s,
            azimuths_degrees: [from, from + wide].map(f64::to_degrees),
            activity: 0.0,
        },
    )
}

fn any_twist() -> impl Strategy<Value = Twist> {
    let degrees = || prop::collection::vec(-20.0..20.0, 2..6);
    (degrees(), degrees()).prop_map(|(inner_degrees, outer_degrees)| Twist {
        inner_degrees,
        outer_degrees,
    })
}

fn any_ray() -> impl Strategy<Value = Ray> {
    let number = || -1.0..1.0;
    let three = move || (number(), number(), number()).prop_map(|(x, y, z)| Vector3::new(x, y, z));
    (three(), three()).prop_filter_map("a direction", |(p, d)| {
        let along = Unit::try_new(d, 1e-2)?;
        Ray::new(Point3::from(3.5 * p), along.into_inner()).ok()
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    #[test]
    fn lines_end_where_the_material_of_the_region_ends(
        region in any_region(), twist in any_twist(), rays in prop::collection::vec(any_ray(), 8)
    ) {
        let case = Case::new(region, twist);
        for ray in rays {
            let step = 0.005;
            let [found, expected] = [case.sector.chord(&ray), case.length(&ray, step)];
            // Parts shorter than a step are missed by the points; a line has a few at most.
            prop_assert!((found - expected).abs() < 3.0 * step, "{found} {expected} {ray:?}");
        }
    }

    #[test]
    fn points_of_the_region_are_in_the_solid(
        region in any_region(), twist in any_twist(), rays in prop::collection::vec(any_ray(), 32)
    ) {
        let case = Case::new(region, twist);
        for ray in rays {
            let p = ray.origin();
            let around = [Vector3::x(), Vector3::y(), Vector3::z()].map(|e| 1e-4 * e);
            // The layers of the solid have an error of 1e-6 cm; at points near its surface both may differ.
            let near = |held| around.iter().any(|e| [p + e, p - e].iter().any(|q| case.holds(q) != held));
            let held = case.holds(&p);
            prop_assert!(case.sector.contains(&p) == held || near(held), "{p:?}");
        }
    }
}
