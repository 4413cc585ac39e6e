//! Interval arithmetic with outward rounding in fixed-point numbers: multiples of 2^-96 below 2^31 (overflow panics).

use std::ops::{Add, Div, Mul, Neg, Sub};

/// Bits after the binary point.
const BITS: u32 = 96;
const UNIT: i128 = 1 << BITS;

/// All real numbers from `low` to `high`, in units of 2^-96.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Interval {
    low: i128,
    high: i128,
}

impl Interval {
    pub(crate) const ZERO: Self = Self { low: 0, high: 0 };
    pub(crate) const ONE: Self = Self {
        low: UNIT,
        high: UNIT,
    };
    /// The first 24 hexadecimal fractional digits of pi, and the next number.
    pub(crate) const PI: Self = Self {
        low: 0x3_243F_6A88_85A3_08D3_1319_8A2E,
        high: 0x3_243F_6A88_85A3_08D3_1319_8A2F,
    };

    /// A number, exact if it is a multiple of the unit.
    pub(crate) fn point(value: f64) -> Self {
        let scaled = value * UNIT as f64;
        assert!(scaled.abs() < i128::MAX as f64);
        Self {
            low: scaled.floor() as i128,
            high: scaled.ceil() as i128,
        }
    }

    /// The numbers within `radius` of this interval.
    pub(crate) fn widened(self, radius: f64) -> Self {
        let radius = Self::point(radius);
        Self {
            low: self.low - radius.high,
            high: self.high + radius.high,
        }
    }

    /// A number near the midpoint.
    pub(crate) fn middle(self) -> f64 {
        (self.low + (self.high - self.low) / 2) as f64 / UNIT as f64
    }

    /// Largest distance of a member from zero, to rounding.
    pub(crate) fn magnitude(self) -> f64 {
        self.low.abs().max(self.high.abs()) as f64 / UNIT as f64
    }

    /// Whether every member lies inside `other` and is none of its ends.
    pub(crate) fn is_inside(self, other: Self) -> bool {
        other.low < self.low && self.high < other.high
    }

    fn contains_zero(self) -> bool {
        self.low <= 0 && 0 <= self.high
    }

    pub(crate) fn square(self) -> Self {
        let product = self * self;
        let low = if self.contains_zero() { 0 } else { product.low };
        Self { low, ..product }
    }

    /// The square roots of members, all of which must be positive.
    pub(crate) fn sqrt(self) -> Self {
        assert!(self.low > 0);
        let near = |square: i128| {
            let guess = ((square as f64 / UNIT as f64).sqrt() * UNIT as f64) as i128;
            (guess + divide(square, guess)) / 2
        };
        let (mut low, mut high) = (near(self.low), near(self.high));
        while -multiply(-low, low) > self.low {
            low -= 1;
        }
        while multiply(high, high) < self.high {
            high += 1;
        }
        Self { low, high }
    }

    /// The sines of members, all within [-2, 2]: the series up to x^37, as nested factors. The rest is alternating, so that the last factor is
    /// between 1 - x^2/1482 and 1.
    pub(crate) fn sin(self) -> Self {
        let (square, two) = (self.square(), 2 * UNIT);
        assert!(-two <= self.low && self.high <= two);
        let mut series = Self::point(0.995).union(Self::ONE);
        for k in (1..=18).rev() {
            let factors = Self::point(f64::from(2 * k * (2 * k + 1)));
            series = Self::ONE - square / factors * series;
        }
        self * series
    }

    fn union(self, other: Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
        }
    }

    /// The interval of the results at pairs of ends, each rounded down by `floor`, and up as minus `floor` of minus the first number.
    fn of_ends(self, other: Self, floor: fn(i128, i128) -> i128) -> Self {
        let pairs = [self.low, self.high].map(|a| [other.low, other.high].map(|b| (a, b)));
        let all = pairs.as_flattened().iter().map(|&(a, b)| Self {
            low: floor(a, b),
            high: -floor(-a, b),
        });
        all.reduce(Self::union).unwrap()
    }
}

/// The product, rounded down: a b / 2^96 with a = a1 2^64 + a0 and the same for b.
fn multiply(a: i128, b: i128) -> i128 {
    let halves = |x: i128| (x >> 64, x & i128::from(u64::MAX));
    let ((a1, a0), (b1, b0)) = (halves(a), halves(b));
    let low = (a0 as u128 * b0 as u128) >> 64;
    let middle = a1 * b0 + a0 * b1 + low as i128;
    let high = a1 * b1;
    assert!(high.unsigned_abs() >> (127 - 32) == 0);
    (high << 32) + (middle >> 32)
}

/// The quotient, rounded down, by long division.
fn divide(a: i128, b: i128) -> i128 {
    let (a, b) = if b < 0 { (-a, -b) } else { (a, b) };
    assert!(b > 0 && b < i128::MAX / 2);
    let (mut quotient, mut rest) = (a.div_euclid(b), a.rem_euclid(b));
    for _ in 0..BITS {
        rest *= 2;
        let bit = i128::from(rest >= b);
        rest -= bit * b;
        quotient = 2 * quotient + bit;
    }
    quotient
}

impl Neg for Interval {
    type Output = Self;

    fn neg(self) -> Self {
        Self {
            low: -self.high,
            high: -self.low,
        }
    }
}

impl Add for Interval {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            low: self.low + other.low,
            high: self.high + other.high,
        }
    }
}

impl Sub for Interval {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Interval {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        self.of_ends(other, multiply)
    }
}

impl Div for Interval {
    type Output = Self;

    /// The quotients by numbers, none of which may be zero.
    fn div(self, other: Self) -> Self {
        assert!(!other.contains_zero());
        self.of_ends(other, divide)
    }
}

/// Sum.
pub(crate) fn sum(terms: impl IntoIterator<Item = Interval>) -> Interval {
    terms.into_iter().fold(Interval::ZERO, Add::add)
}

/// Sum of products.
pub(crate) fn dot(
    a: impl IntoIterator<Item = Interval>,
    b: impl IntoIterator<Item = Interval>,
) -> Interval {
    sum(a.into_iter().zip(b).map(|(a, b)| a * b))
}

#[test]
fn operations_enclose_exact_results() {
    let is_near = |found: Interval, exact: f64| {
        let apart = found - Interval::point(exact);
        apart.contains_zero() && apart.magnitude() < 1e-27
    };
    let int = Interval::point;
    let third = Interval::ONE / int(-3.0);
    assert!(third.low < third.high && is_near(third * int(3.0), -1.0));
    assert!(is_near(int(-2.0).square().sqrt(), 2.0) && is_near(int(2.0).sqrt().square(), 2.0));
    // (2^20 + 2^-40)^2 = 2^40 + ..., in 96 bits (2^12 + 2^-40)^2 = 2^24 + 2^-27 + 2^-80 exactly
    let (large, small) = (12.0_f64.exp2(), (-40.0_f64).exp2());
    let exact = int(24.0_f64.exp2()) + int((-27.0_f64).exp2()) + int((-80.0_f64).exp2());
    assert_eq!((int(large) + int(small)).square(), exact);
    for (parts, sine) in [(6.0, 0.5), (2.0, 1.0), (-2.0, -1.0), (-6.0, -0.5)] {
        assert!(is_near((Interval::PI / int(parts)).sin(), sine));
    }
    let cosine = (Interval::PI / int(2.0) - int(0.7)).sin();
    assert!(is_near(int(0.7).sin().square() + cosine.square(), 1.0));
    let mixed = int(0.0).widened(1.0) * int(-3.0).widened(1.0);
    assert_eq!(mixed, Interval::ZERO.widened(4.0));
    assert!(int(0.1).contains_zero() != int(0.1).widened(0.2).contains_zero());
}
