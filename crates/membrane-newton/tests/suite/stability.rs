//! Stability against dense eigenvalues of matrices that are independent of the library's tangents, mass matrices and factorisations.
//!
//! K is minus the central difference of the forces, M a quadrature of the nodal functions, eigenvalues are nalgebra's.

use std::f64::consts::PI;

use membrane_newton::membrane_forces::{FiniteDifferences, SpectralElements};
use membrane_newton::{
    Control, CurvePoint, DiscreteMembrane, Discretisation, Equilibrium, Measure, Membrane,
    MembraneError, NewtonError, NewtonOptions, ReferenceShape, Rubber, Solver, StrainEnergy,
    Thickness,
};
use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// Numbers in [0, 1) of Knuth's linear congruential generator.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = (self.0.wrapping_mul(6364136223846793005)).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
}

fn membrane(random: &mut Random, k: usize) -> Membrane {
    let rest = match k % 3 {
        0 => ReferenceShape::disc(1.0).unwrap(),
        1 => ReferenceShape::balloon(random.between(0.2, 3.0), 1.0).unwrap(),
        _ => {
            let height = random.between(0.4, 1.5);
            let ellipse = move |s: f64| {
                let (sin, cos) = (PI * s).sin_cos();
                CurvePoint {
                    position: [height * sin, cos],
                    first: [PI * height * cos, -PI * sin],
                    second: [-PI * PI * height * sin, -PI * PI * cos],
                }
            };
            ReferenceShape::from_function(ellipse, &[]).unwrap()
        }
    };
    let energy = match k % 4 {
        0 => StrainEnergy::NeoHookean { mu: 1.0 },
        1 => StrainEnergy::MooneyRivlin {
            c1: 0.5,
            c2: random.between(0.0, 0.1),
        },
        2 => StrainEnergy::Ogden {
            terms: vec![[1.491, 1.3], [0.00284, 5.0], [-0.02367, -2.0]],
        },
        _ => StrainEnergy::Gent {
            mu: 1.0,
            jm: random.between(20.0, 90.0),
        },
    };
    let swing = random.between(-0.3, 0.3);
    let thickness = move |s: f64| 0.1 * (swing * (2.0 * PI * s).cos()).exp();
    let rubber = Rubber::new(energy, Thickness::function(thickness, &[]).unwrap()).unwrap();
    Membrane::new(rest).with_rubber(rubber)
}

/// Nodes and weights of Gauss and Legendre's rule of five points on [-1, 1].
const GAUSS: [[f64; 2]; 5] = [
    [-0.906179845938664, 0.23692688505618908],
    [-0.538469310105683, 0.47862867049936647],
    [0.0, 0.5688888888888889],
    [0.538469310105683, 0.47862867049936647],
    [0.906179845938664, 0.23692688505618908],
];

/// The integral of 2 pi r0 h |c0'| times the products of the functions of the x of two nodes.
fn consistent_mass(
    membrane: &Membrane,
    discrete: &SpectralElements,
    thickness: &Thickness,
) -> DMatrix<f64> {
    let n = discrete.start().len() / 2;
    let mut mass = DMatrix::zeros(n, n);
    let mut breaks = membrane.reference().breakpoints().to_vec();
    breaks.retain(|&b| b < 0.5);
    breaks.push(0.5);
    let units: Vec<Vec<f64>> = (0..n)
        .map(|i| {
            (0..2 * n)
                .map(|k| f64::from(u8::from(k == 2 * i)))
                .collect()
        })
        .collect();
    let panels = 8;
    for piece in breaks.windows(2) {
        let width = (piece[1] - piece[0]) / f64::from(panels);
        for panel in 0..panels {
            for [node, weight] in GAUSS {
                let s = piece[0] + width * (f64::from(panel) + 0.5 + 0.5 * node);
                let rest = membrane.reference().at(s);
                let speed = rest.first[0].hypot(rest.first[1]);
                let area = 2.0 * PI * rest.position[1] * thickness.at(s).unwrap() * speed;
                let values = DVector::from_iterator(
                    n,
                    units
                        .iter()
                        .map(|unit| discrete.at(unit, s).unwrap().position[0]),
                );
                mass += &values * values.transpose() * (0.5 * weight * width * area);
            }
        }
    }
    mass
}

/// Half of the volume of the two elements at each node.
fn lumped_mass(discrete: &FiniteDifferences, thickness: &Thickness) -> DMatrix<f64> {
    let points = discrete.start().as_chunks::<2>().0; // fixed in the reference configuration
    let weight = |n: usize| PI * points[n][1] * thickness.at(n as f64 * discrete.ds()).unwrap();
    let mut mass = DMatrix::zeros(points.len(), points.len());
    for n in 0..points.len() - 1 {
        let [a, b] = [points[n], points[n + 1]];
        let half = 0.5 * (b[0] - a[0]).hypot(b[1] - a[1]) * (weight(n) + weight(n + 1));
        mass[(n, n)] += half;
        mass[(n + 1, n + 1)] += half;
    }
    mass
}

/// Eigenvalues at constant pressure and at constant volume, ascending.
fn dense(
    discrete: &dyn DiscreteMembrane,
    mass: &DMatrix<f64>,
    solved: &Equilibrium,
) -> [Vec<f64>; 2] {
    let n = discrete.start().len();
    let nodes = solved.points().as_flattened()[..n].to_vec();
    let free: Vec<usize> = (0..n).filter(|i| !discrete.fixed().contains(i)).collect();
    let forces = |x: &[f64]| {
        let (mut work, mut out) = (vec![0.0; n], vec![0.0; n]);
        (discrete.forces_into(x, solved.intensity, &mut work, &mut out)).unwrap();
        out
    };
    let step = 1e-5;
    let mut stiffness = DMatrix::zeros(free.len(), free.len());
    for (column, &j) in free.iter().enumerate() {
        let moved = |by: f64| {
            let mut x = nodes.clone();
            x[j] += by;
            forces(&x)
        };
        let (ahead, behind) = (moved(step), moved(-step));
        for (row, &i) in free.iter().enumerate() {
            stiffness[(row, column)] = (behind[i] - ahead[i]) / (2.0 * step);
        }
    }
    let stiffness = 0.5 * (&stiffness + stiffness.transpose());
    let mass = DMatrix::from_fn(free.len(), free.len(), |i, j| {
        match free[i] % 2 == free[j] % 2 {
            true => mass[(free[i] / 2, free[j] / 2)],
            false => 0.0,
        }
    });
    let cholesky = mass.cholesky().unwrap();
    let lower = cholesky.l();
    let half = lower.solve_lower_triangular(&stiffness).unwrap();
    let whole = lower.solve_lower_triangular(&half.transpose()).unwrap();
    let whole = 0.5 * (&whole + whole.transpose());
    let mut gradient = vec![0.0; n];
    discrete.measure_gradient_into(Measure::Volume, &nodes, &mut gradient);
    let gradient = DVector::from_iterator(free.len(), free.iter().map(|&i| gradient[i]));
    let normal = lower.solve_lower_triangular(&gradient).unwrap().normalize();
    let projector = DMatrix::identity(free.len(), free.len()) - &normal * normal.transpose();
    // shifts the direction that changes the volume above all other eigenvalues
    let most = whole.norm();
    let within = &projector * &whole * &projector + &normal * normal.transpose() * most;
    [whole, within].map(|matrix| {
        let mut all: Vec<f64> = SymmetricEigen::new(matrix)
            .eigenvalues
            .iter()
            .copied()
            .collect();
        all.sort_by(f64::total_cmp);
        all
    })
}

/// 200 branches of random membranes, four strain energies, both discretisations, to states beyond the limit point.
#[test]
fn counts_and_lowest_eigenvalues_agree_with_dense_matrices() {
    let mut random = Random(7);
    let options = NewtonOptions::default();
    let (mut states, mut past, mut bulging) = (0, 0, 0);
    for k in 0..200 {
        let membrane = membrane(&mut random, k);
        let thickness = match membrane.material() {
            membrane_newton::membrane_forces::Material::Rubber(rubber) => {
                rubber.thickness().clone()
            }
            _ => panic!("rubber"),
        };
        let (discretisation, discrete, mass): (_, Box<dyn DiscreteMembrane>, _) = if k / 4 % 2 == 0
        {
            let elements = SpectralElements::new(&membrane, 8, 1).unwrap();
            let mass = consistent_mass(&membrane, &elements, &thickness);
            let spectral = Discretisation::Spectral {
                degree: 8,
                per_piece: 1,
            };
            (spectral, Box::new(elements), mass)
        } else {
            let differences = FiniteDifferences::half(&membrane, 31).unwrap();
            let mass = lumped_mass(&differences, &thickness);
            let nodes = Discretisation::FiniteDifferences { nodes: 31 };
            (nodes, Box::new(differences), mass)
        };
        let solver = Solver::new(&membrane, discretisation).unwrap();
        let start = solver.start_measures();
        let unit = start.volume.max(1.0);
        let mut last: Option<Equilibrium> = None;
        for gain in [0.2, 0.8, 2.0, 4.0, 7.0, 12.0] {
            let volume = Control::Volume(start.volume + gain * unit);
            let found = match &last {
                Some(last) => solver.solve_from(last, volume, &options),
                None => solver.solve(volume, &options),
            };
            let Ok(solved) = found else { break };
            let case = format!("branch {k}, gain {gain}");
            let stability = solved
                .stability()
                .unwrap_or_else(|error| panic!("{case}: {error}"));
            let both = [stability.at_pressure, stability.at_volume];
            for (modes, all) in both.iter().zip(dense(&*discrete, &mass, &solved)) {
                // differences of forces are accurate to about 1e-9 of the largest eigenvalue
                let off = 1e-8 * all[all.len() - 1];
                assert!(
                    (modes.lowest - all[0]).abs() < off + 1e-7 * all[0].abs(),
                    "{case}: {modes:?}, {}",
                    all[0]
                );
                let below = |bound: f64| all.iter().filter(|value| **value < bound).count();
                assert!(
                    (below(-off)..=below(off)).contains(&modes.unstable),
                    "{case}: {modes:?}, {all:?}"
                );
            }
            // the criterion at constant volume, with the slope of p(V) from neighbours
            let near = |by: f64| {
                let volume = Control::Volume(solved.measures.volume * (1.0 + by));
                solver
                    .solve_from(&solved, volume, &options)
                    .map(|near| near.intensity)
            };
            if let (Ok(behind), Ok(ahead)) = (near(-1e-4), near(1e-4))
                && (ahead - behind).abs() > 1e-9 * solved.intensity
            {
                let falls = usize::from(ahead < behind);
                assert_eq!(both[0].unstable, both[1].unstable + falls, "{case}");
            }
            states += 1;
            past += usize::from(both[0].unstable > 0);
            bulging += usize::from(both[1].unstable > 0);
            last = Some(solved);
        }
    }
    assert!(
        states > 800 && past > 300,
        "{states} states, {past} past the limit, {bulging} bulging"
    );
}

#[test]
fn stability_is_not_defined_for_springs() {
    let springs = Membrane::new(ReferenceShape::balloon(8.5, 1.75).unwrap());
    for how in [
        Discretisation::Spectral {
            degree: 8,
            per_piece: 1,
        },
        Discretisation::FiniteDifferences { nodes: 41 },
    ] {
        let solver = Solver::new(&springs, how).unwrap();
        let solved = solver
            .solve(Control::Load(1.0), &NewtonOptions::default())
            .unwrap();
        let other = MembraneError::OtherMaterial {
            what: "stability",
            needs: "rubber",
        };
        assert_eq!(solved.stability(), Err(NewtonError::Membrane(other)));
    }
}
