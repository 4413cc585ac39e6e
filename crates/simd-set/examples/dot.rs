//! A scalar product compiled for each instruction set; this machine runs the widest one that it supports.

use simd_set::{Set, Work};

struct Dot<'a>(&'a [f32], &'a [f32]);

impl Work for Dot<'_> {
    type Out = f32;

    #[inline(always)]
    fn run(self) -> f32 {
        let mut sums = [0.0_f32; 16];
        let (a, b) = (self.0.as_chunks::<16>().0, self.1.as_chunks::<16>().0);
        for (a, b) in a.iter().zip(b) {
            for lane in 0..16 {
                sums[lane] += a[lane] * b[lane];
            }
        }
        sums.iter().sum()
    }
}

fn main() {
    let (a, b) = (vec![0.5; 1 << 20], vec![2.0; 1 << 20]);
    let set = Set::detect();
    println!("{set:?}: {}", set.run(Dot(&a, &b)));
}
