//! All instruction sets give the same results.

use simd_set::{Set, Work};

struct Dot<'a>(&'a [f64], &'a [f64]);

impl Work for Dot<'_> {
    type Out = f64;
    #[inline(always)]
    fn run(self) -> f64 {
        let mut sums = [0.0; 8];
        for (i, (a, b)) in self.0.iter().zip(self.1).enumerate() {
            sums[i % 8] += a * b;
        }
        sums.iter().sum()
    }
}

#[test]
fn every_set_is_bitwise_identical_and_a_missing_one_is_the_baseline() {
    let at = |k: f64| (0..1001).map(|i| (k * f64::from(i)).sin()).collect();
    let (a, b): (Vec<f64>, Vec<f64>) = (at(0.7), at(1.3));
    let expected = Set::Baseline.run(Dot(&a, &b));
    for set in [Set::Avx2, Set::Avx512, Set::Neon, Set::detect()] {
        assert_eq!(
            set.run(Dot(&a, &b)).to_bits(),
            expected.to_bits(),
            "{set:?}"
        );
    }
    assert!(Set::Baseline.is_available() && Set::detect().is_available());
}

#[test]
fn units_and_parts_count_the_completed_fraction() {
    let watch = std::sync::Arc::new(simd_set::Watch::default());
    simd_set::watch_with(watch.clone());
    for _ in 0..2 {
        watch.restart();
        assert_eq!(watch.fraction(), 0.0);
        for k in 0..2 {
            let _part = simd_set::part(k..k + 1, 4);
            simd_set::unit(2);
            assert_eq!(watch.fraction(), 0.25 * k as f64 + 0.125);
            let _inner = simd_set::part(1..2, 2);
            assert_eq!(watch.fraction(), 0.25 * k as f64 + 0.125);
        }
        assert_eq!(watch.fraction(), 0.5);
        simd_set::unit(2);
        assert_eq!(watch.fraction(), 1.0);
    }
}
