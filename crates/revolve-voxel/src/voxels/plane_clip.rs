//! The part of a box on one side of a plane.

/// Returns the fraction of a box in the half-space `offset + normal . delta < 0`, delta relative to the centre of the box.
///
/// The closed form of Scardovelli & Zaleski (J. Comput. Phys. 164 (2000) 228, doi:10.1006/jcph.2000.6567).
pub(crate) fn fraction_below(normal: [f64; 3], offset: f64, half: [f64; 3]) -> f64 {
    let mut m = [
        2.0 * half[0] * normal[0].abs(),
        2.0 * half[1] * normal[1].abs(),
        2.0 * half[2] * normal[2].abs(),
    ];
    if m[0] > m[1] {
        m.swap(0, 1);
    }
    if m[1] > m[2] {
        m.swap(1, 2);
    }
    if m[0] > m[1] {
        m.swap(0, 1);
    }
    let total = m[0] + m[1] + m[2];
    if total <= 0.0 {
        return if offset < 0.0 { 1.0 } else { 0.0 };
    }
    // Fill height between the lowest corner (0) and the highest (1).
    let height = 0.5 - offset / total;
    if height <= 0.0 {
        return 0.0;
    }
    if height >= 1.0 {
        return 1.0;
    }
    let a = height.min(1.0 - height);
    let (m1, m2, m3) = (m[0] / total, m[1] / total, m[2] / total);
    let v = filled_below(a, m1, m2, m3);
    if height <= 0.5 { v } else { 1.0 - v }
}

/// Volume below height a <= 1/2 in the unit cube, m1 <= m2 <= m3, m1 + m2 + m3 = 1.
fn filled_below(a: f64, m1: f64, m2: f64, m3: f64) -> f64 {
    // Below these, dividing by m1 (m2) loses more digits than omitting it: the volume is even in m1 about the centre of the box, so
    // omitting it has an error of O(m1^2).
    const TINY: f64 = 1e-6;
    if m2 < TINY {
        return a.min(m3) / m3;
    }
    if m1 < TINY {
        // A rectangle: triangle, then trapezium.
        let a = a - 0.5 * m1;
        return if a < m2 {
            0.5 * a.max(0.0).powi(2) / (m2 * m3)
        } else {
            (a - 0.5 * m2) / m3
        };
    }
    let m12 = m1 + m2;
    if a < m1 {
        a * a * a / (6.0 * m1 * m2 * m3)
    } else if a < m2 {
        (a * (a - m1) + m1 * m1 / 3.0) / (2.0 * m2 * m3)
    } else if a < m12.min(m3) {
        (a * a * (3.0 * m12 - a) + m1 * m1 * (m1 - 3.0 * a) + m2 * m2 * (m2 - 3.0 * a))
            / (6.0 * m1 * m2 * m3)
    } else if m3 < m12 {
        (a * a * (3.0 - 2.0 * a)
            + m1 * m1 * (m1 - 3.0 * a)
            + m2 * m2 * (m2 - 3.0 * a)
            + m3 * m3 * (m3 - 3.0 * a))
            / (6.0 * m1 * m2 * m3)
    } else {
        (a - 0.5 * m12) / m3
    }
}
