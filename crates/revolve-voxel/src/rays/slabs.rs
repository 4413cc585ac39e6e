//! Segments of a line cut at perpendicular planes, and their transmission.

/// Calls `each` with the part of a segment in every slab that it intersects. Planes ascend relative to `origin`.
#[inline(always)]
pub(crate) fn for_slabs(
    planes: &[f64],
    origin: f64,
    [low, high]: [f64; 2],
    mut each: impl FnMut(usize, [f64; 2]),
) {
    if planes.is_empty() {
        return each(0, [low, high]);
    }
    let mut from = low;
    for slab in planes.partition_point(|plane| plane + origin <= low)..=planes.len() {
        let to = planes
            .get(slab)
            .map_or(high, |plane| high.min(plane + origin));
        each(slab, [from, to]);
        from = to;
        if to >= high {
            return;
        }
    }
}

/// Returns the average of exp(-t) over t from 0 to `thick`.
#[inline(always)]
pub(crate) fn mean_transmission(thick: f64) -> f64 {
    match thick > 0.0 {
        true => -(-thick).exp_m1() / thick,
        false => 1.0,
    }
}
