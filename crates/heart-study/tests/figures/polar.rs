//! Polar maps of 17 segments.

use super::polar_maps;

/// Segment k of the American Heart Association, with k percent, is on the side of the map that its name states.
#[test]
fn segments_of_a_polar_map_are_on_the_side_of_their_wall() {
    let values = std::array::from_fn(|k| (k + 1) as f64);
    let svg = polar_maps(&[("map", values)], 100.0, "unit");
    assert!(svg.starts_with("<svg") && svg.contains("aria-label=\"Polar maps of 17 segments: map"));
    let place = |k: usize| {
        let text = svg
            .split("<text ")
            .find(|text| text.contains(&format!("\">{k}</text>")));
        ["x=\"", "y=\""].map(|name| {
            let (_, value) = text.unwrap().split_once(name).unwrap();
            value.split('"').next().unwrap().parse::<f64>().unwrap()
        })
    };
    let [x, y] = place(17);
    // Anterior on top, the septum on the left.
    for (side, segments) in [
        ([0.0, -1.0], vec![1, 7, 13]),
        ([-1.0, -0.5], vec![2, 8]),
        ([-1.0, 0.5], vec![3, 9]),
        ([0.0, 1.0], vec![4, 10, 15]),
        ([1.0, 0.5], vec![5, 11]),
        ([1.0, -0.5], vec![6, 12]),
        ([-1.0, 0.0], vec![14]),
        ([1.0, 0.0], vec![16]),
    ] {
        for segment in segments {
            let at = place(segment);
            for (found, side) in [at[0] - x, at[1] - y].into_iter().zip(side) {
                // Signs; zero within the rounding of the coordinates.
                let sign = if found.abs() < 0.02 {
                    0.0
                } else {
                    found.signum()
                };
                assert!(
                    sign == f64::signum(side) * f64::from(side != 0.0),
                    "{segment}: {at:?}"
                );
            }
        }
    }
    let radius = |k: usize| {
        let at = place(k);
        (at[0] - x).hypot(at[1] - y)
    };
    assert!(radius(1) > radius(7) && radius(7) > radius(13) && radius(13) > 0.0);
}
