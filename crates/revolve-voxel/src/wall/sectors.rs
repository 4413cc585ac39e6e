//! Many sectors that rays cross: those that a ray misses are skipped, alone and in groups.

use crate::wall::body_line::BodyLine;
use crate::{Body, Ray, Sector, Span};

/// Consecutive sectors with a common bounding box.
const GROUP: usize = 16;

/// Sectors with an activity each.
#[derive(Debug, Clone, Default)]
pub(crate) struct Sectors {
    all: Vec<(Sector, f64)>,
    /// Bounds of each [`GROUP`] in x and r.
    groups: Vec<[f64; 4]>,
}

impl Sectors {
    pub(crate) fn new(all: Vec<(Sector, f64)>) -> Self {
        let groups = all.chunks(GROUP).map(|group| {
            let same = |(sector, _): &(Sector, f64)| sector.pose() == group[0].0.pose();
            if !group.iter().all(same) {
                let all = f64::INFINITY;
                return [-all, all, 0.0, all];
            }
            let bounds = group.iter().map(|(sector, _)| sector.bounds());
            let join = |a: [f64; 4], b: [f64; 4]| {
                let [from, least] = [0, 2].map(|k| a[k].min(b[k]));
                let [to, most] = [1, 3].map(|k| a[k].max(b[k]));
                [from, to, least, most]
            };
            bounds.reduce(join).unwrap_or_default()
        });
        let groups = groups.collect();
        Self { all, groups }
    }

    /// Returns the rings of the sectors of a full turn.
    pub(crate) fn rings(&self) -> impl Iterator<Item = &Body> {
        self.all.iter().filter_map(|(sector, _)| sector.ring())
    }

    /// Calls `each` with the intervals of a line inside each sector, and its activity.
    pub(crate) fn for_spans(&self, ray: &Ray, mut each: impl FnMut(Span, f64)) {
        let Some((first, _)) = self.all.first() else {
            return;
        };
        let mut pose = first.pose();
        let mut line = BodyLine::new(pose, ray);
        for (group, bounds) in self.all.chunks(GROUP).zip(&self.groups) {
            if group[0].0.pose() == pose && line.within(*bounds).is_none() {
                continue;
            }
            for (sector, activity) in group {
                if sector.pose() != pose {
                    pose = sector.pose();
                    line = BodyLine::new(pose, ray);
                }
                sector.for_spans(ray, &line, |span| each(span, *activity));
            }
        }
    }
}
