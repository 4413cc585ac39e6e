//! Polynomials from their coefficients, with their derivatives.

/// Some Chebyshev series of one length with their first two derivatives, by Clenshaw's recurrence and its derivatives.
///
/// Inlined, so that unused derivatives are not computed.
#[inline(always)]
pub(crate) fn chebyshev<const N: usize>(series: [&[f64]; N], u: f64) -> [[f64; N]; 3] {
    let n = series[0].len();
    let (mut b, mut db, mut ddb) = ([[0.0; N]; 2], [[0.0; N]; 2], [[0.0; N]; 2]);
    for k in (1..n).rev() {
        for (j, c) in series.iter().enumerate() {
            let c = c[k];
            [ddb[0][j], ddb[1][j]] = [4.0 * db[0][j] + 2.0 * u * ddb[0][j] - ddb[1][j], ddb[0][j]];
            [db[0][j], db[1][j]] = [2.0 * b[0][j] + 2.0 * u * db[0][j] - db[1][j], db[0][j]];
            [b[0][j], b[1][j]] = [c + 2.0 * u * b[0][j] - b[1][j], b[0][j]];
        }
    }
    let mut out = [[0.0; N]; 3];
    for (j, c) in series.iter().enumerate() {
        out[0][j] = c.first().copied().unwrap_or(0.0) + u * b[0][j] - b[1][j];
        out[1][j] = b[0][j] + u * db[0][j] - db[1][j];
        out[2][j] = 2.0 * db[0][j] + u * ddb[0][j] - ddb[1][j];
    }
    out
}

/// Some power series of one length with their first two derivatives, by Horner's rule.
#[inline(always)]
pub(crate) fn power<const N: usize>(series: [&[f64]; N], u: f64) -> [[f64; N]; 3] {
    let mut out = [[0.0; N]; 3];
    for k in (0..series[0].len()).rev() {
        for (j, c) in series.iter().enumerate() {
            let [p, d, dd] = [out[0][j], out[1][j], out[2][j]];
            out[0][j] = c[k] + u * p;
            out[1][j] = p + u * d;
            out[2][j] = 2.0 * d + u * dd;
        }
    }
    out
}
