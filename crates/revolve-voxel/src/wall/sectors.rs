//! Many sectors that rays cross: those that a ray misses are skipped, alone and in groups.

use crate::solid::wedge::Wedge;
use crate::wall::body_line::BodyLine;
use crate::{Body, Ray, Sector, Span};

/// Consecutive sectors with a common bounding box.
const GROUP: usize = 16;
/// Margin of the azimuths of a group, radians: more than rounding of sines and cosines.
const MARGIN: f64 = 1e-9;

/// Sectors with an activity each.
#[derive(Debug, Clone, Default)]
pub(crate) struct Sectors {
    all: Vec<(Sector, f64)>,
    /// Bounds of each [`GROUP`] in x and r and in azimuth; `None` for sectors in several poses.
    groups: Vec<Option<([f64; 4], Wedge)>>,
}

impl Sectors {
    pub(crate) fn new(all: Vec<(Sector, f64)>) -> Self {
        let groups = all.chunks(GROUP).map(bounds).collect();
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
            if let Some((range, wedge)) = bounds
                && group[0].0.pose() == pose
                && line.inside(*range, wedge).is_none()
            {
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

/// Returns a range of x and r and a wedge that contain all sectors of a group.
fn bounds(group: &[(Sector, f64)]) -> Option<([f64; 4], Wedge)> {
    let pose = group[0].0.pose();
    if !group.iter().all(|(sector, _)| sector.pose() == pose) {
        return None;
    }
    let join = |(a, [from, to]): ([f64; 4], [f64; 2]), (b, [start, end]): ([f64; 4], [f64; 2])| {
        let [low, least] = [0, 2].map(|k| a[k].min(b[k]));
        let [high, most] = [1, 3].map(|k| a[k].max(b[k]));
        ([low, high, least, most], [from.min(start), to.max(end)])
    };
    let bounds = group.iter().map(|(sector, _)| sector.bounds());
    let (range, [from, to]) = bounds.reduce(join)?;
    let azimuths = [from - MARGIN, to + MARGIN];
    // More than a full turn is not a wedge.
    Some((range, Wedge::new(azimuths).unwrap_or(Wedge::Whole)))
}
