//! Newton with the general sparse LU of faer.

use faer::prelude::Solve;
use faer::sparse::{SparseColMat, Triplet};
use membrane_forces::{DiscreteMembrane, FiniteDifferences, Measure};

/// Newton at f = 17.5 with the same forces and a general sparse LU; returns the volume.
pub(crate) fn newton(differences: &FiniteDifferences) -> f64 {
    let mut x = differences.start().to_vec();
    let n = x.len();
    let (mut elastic, mut residual) = (vec![0.0; n], vec![0.0; n]);
    for _ in 0..10 {
        differences.elastic_force_into(&x, &mut elastic);
        differences
            .pressure_force_into(&x, 17.5, &mut residual)
            .expect("regular curve");
        let mut tangent = differences.tangent();
        differences
            .tangent_into(&x, 17.5, &mut tangent)
            .expect("regular curve");
        let mut entries = Vec::with_capacity(5 * n);
        for i in 0..n {
            for j in i.saturating_sub(3)..(i + 4).min(n) {
                let value = tangent.band.get(i, j).expect("in the matrix");
                if value != 0.0 {
                    entries.push(Triplet::new(i, j, value));
                }
            }
        }
        let matrix =
            SparseColMat::<usize, f64>::try_new_from_triplets(n, n, &entries).expect("in range");
        let lu = matrix.sp_lu().expect("regular tangent");
        let rhs = faer::Mat::from_fn(n, 1, |i, _| elastic[i] + residual[i]);
        let step = lu.solve(&rhs);
        let mut size = 0.0f64;
        for i in 0..n {
            x[i] -= step[(i, 0)];
            size = size.max(step[(i, 0)].abs());
        }
        if size < 1e-7 {
            break;
        }
    }
    Measure::Volume.of(x.as_chunks().0)
}
