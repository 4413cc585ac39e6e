//! Meridians with fewer points.

use crate::Meridian;
use crate::solid::segment::on_chord;

/// Largest number of segments that become one, which limits the cost.
const LONGEST: usize = 64;

impl Meridian {
    /// Returns a meridian through some of the points, with all others within `deviation` of it; `None` if it needs more than half
    /// of the points, or would cross itself.
    pub(crate) fn simplified(&self, deviation: f64) -> Option<Self> {
        let mut path: Vec<[f64; 2]> = Vec::with_capacity(self.segments().len() + 2);
        for segment in self.segments() {
            // Segments on the axis are omitted.
            if path.last() != Some(&segment.start()) {
                path.push(segment.start());
            }
            path.push(segment.end());
        }
        let (mut kept, mut first) = (vec![path[0]], 0);
        for k in 1..path.len() {
            let is_last = k + 1 == path.len();
            if is_last || path[k][1] == 0.0 || !near(&path[first..=k + 1], deviation) {
                kept.push(path[k]);
                first = k;
            }
        }
        if 2 * kept.len() > path.len() {
            return None;
        }
        // other paths begin on the axis
        let ring = path[0][1] > 0.0;
        Self::from_path(kept, ring).ok()
    }
}

/// Whether all points are within `most` of the line between the first and the last.
fn near(points: &[[f64; 2]], most: f64) -> bool {
    let ends = [points[0], points[points.len() - 1]];
    let is_near = |p: &[f64; 2]| on_chord(*p, ends)[1] <= most * most;
    points.len() <= LONGEST + 1 && points.iter().all(is_near)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_surface_moves_by_at_most_the_deviation() {
        let wave = |k: i32| f64::from(k) / 400.0 * std::f64::consts::TAU;
        // Closed by discs; from the axis to the axis; a ring.
        let waist: Vec<_> = (0..=400)
            .map(|k| [wave(k), 1.1 + 0.2 * (2.0 * wave(k)).sin()])
            .collect();
        let sphere: Vec<_> = (0..=400)
            .map(|k| (0.5 * wave(k)).sin_cos())
            .map(|(r, x)| [-x, r])
            .collect();
        let torus: Vec<_> = (0..400)
            .map(|k| wave(k).sin_cos())
            .map(|(r, x)| [x, 2.0 + r])
            .collect();
        let solids = [
            Meridian::new(&waist),
            Meridian::new(&sphere),
            Meridian::ring(&torus),
        ];
        for full in solids.map(Result::unwrap) {
            let deviation = 1e-3;
            let simple = full.simplified(deviation).unwrap();
            let (many, few) = (full.mass_properties(), simple.mass_properties());
            assert!(
                3 * simple.n_segments() < full.n_segments(),
                "{}",
                simple.n_segments()
            );
            assert!((many.volume - few.volume).abs() < deviation * many.surface);
            for segment in full.segments() {
                assert!(simple.distance_at(segment.x0, segment.r0).abs() <= deviation);
            }
            assert!(full.simplified(1e-9).is_none());
        }
    }

    #[test]
    fn a_meridian_that_would_cross_itself_is_kept() {
        // A shell thinner than the deviation, with other points inside than outside.
        let arc = |n: i32, radius: f64| {
            (0..=n).map(move |k| {
                let (sin, cos) = (1.0 + f64::from(k) / f64::from(n)).sin_cos();
                [radius * cos, radius * sin]
            })
        };
        let path: Vec<_> = arc(400, 1.0)
            .chain(arc(310, 1.001).collect::<Vec<_>>().into_iter().rev())
            .collect();
        let shell = Meridian::ring(&path).unwrap();
        assert!(shell.simplified(1e-2).is_none());
        assert!(shell.simplified(1e-4).is_some());
    }
}
