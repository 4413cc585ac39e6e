//! Sobol points, which cover the space of the fields more evenly than independent points.

use std::sync::OnceLock;

/// Largest number of dimensions: the case and the varied fields.
pub(crate) const MOST_DIMENSIONS: usize = 64;
const BITS: u32 = 32;
/// Degree, polynomial and initial direction numbers of each dimension from the second on, by S. Joe and F. Y. Kuo (2008),
/// doi 10.1137/070709359; the licence is in the same directory.
const NUMBERS: &str = include_str!("../data/joe-kuo-64.txt");

/// Returns the coordinate of point `index` along `dimension`, both from 0, as a 32-bit fraction of 1, without shift or scrambling.
///
/// `x = sum of bits k of index: v_k`, in the order of van der Corput (no Gray code): any aligned block of `2^m` indices is a net.
pub(crate) fn sobol(index: u32, dimension: usize) -> u32 {
    let directions = &directions()[dimension];
    (0..BITS)
        .filter(|k| index >> k & 1 == 1)
        .fold(0, |x, k| x ^ directions[k as usize])
}

fn directions() -> &'static [[u32; BITS as usize]] {
    static KNOWN: OnceLock<Vec<[u32; BITS as usize]>> = OnceLock::new();
    KNOWN.get_or_init(|| {
        let first = std::array::from_fn(|k| 1 << (BITS as usize - 1 - k));
        let others = NUMBERS.lines().skip(1).map(of_line);
        std::iter::once(first).chain(others).collect()
    })
}

/// `v_k = m_k 2^-k`, and beyond the degree s: `v_k = v_(k-s) ^ (v_(k-s) >> s) ^ xor of a_j v_(k-j)`.
fn of_line(line: &str) -> [u32; BITS as usize] {
    let numbers: Vec<u32> = line
        .split(' ')
        .filter_map(|word| word.parse().ok())
        .collect();
    let (degree, polynomial, initial) = (numbers[1] as usize, numbers[2], &numbers[3..]);
    let mut v = [0; BITS as usize];
    for k in 0..BITS as usize {
        v[k] = match initial.get(k) {
            Some(m) => m << (BITS as usize - 1 - k),
            None => (1..degree)
                .filter(|j| polynomial >> (degree - 1 - j) & 1 == 1)
                .fold(v[k - degree] ^ v[k - degree] >> degree, |x, j| x ^ v[k - j]),
        };
    }
    v
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each block of 256 points has one point in each of 256 equal intervals of every dimension: the property of a net, which a
    /// wrong direction number breaks.
    #[test]
    fn every_dimension_fills_every_interval_once() {
        assert_eq!(directions().len(), MOST_DIMENSIONS);
        for dimension in 0..MOST_DIMENSIONS {
            for block in [0, 1, 5, 1000] {
                let mut seen = [false; 256];
                for index in 256 * block..256 * (block + 1) {
                    seen[(sobol(index, dimension) >> 24) as usize] = true;
                }
                assert_eq!(seen, [true; 256], "dimension {dimension}");
            }
        }
    }

    /// Published points: the first of the sequence in dimensions 2 and 3; Gray code only changes their order.
    #[test]
    fn the_first_points_agree_with_published_ones() {
        let points: Vec<[f64; 3]> = (0..4)
            .map(|k| [0, 1, 2].map(|d| f64::from(sobol(k, d)) / 4_294_967_296.0))
            .collect();
        let known = [[0.0; 3], [0.5; 3], [0.25, 0.75, 0.75], [0.75, 0.25, 0.25]];
        assert_eq!(points, known);
    }
}
