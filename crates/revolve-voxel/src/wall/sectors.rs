//! Many sectors that rays cross.

use crate::wall::body_line::BodyLine;
use crate::{Body, Ray, Sector, Span};

/// Sectors with an activity each.
#[derive(Debug, Clone, Default)]
pub(crate) struct Sectors(Vec<(Sector, f64)>);

impl Sectors {
    pub(crate) fn new(all: Vec<(Sector, f64)>) -> Self {
        Self(all)
    }

    /// Returns the rings of the sectors of a full turn.
    pub(crate) fn rings(&self) -> impl Iterator<Item = &Body> {
        self.0.iter().filter_map(|(sector, _)| sector.ring())
    }

    /// Calls `each` with the intervals of a line inside each sector, and its activity.
    pub(crate) fn for_spans(&self, ray: &Ray, mut each: impl FnMut(Span, f64)) {
        let Some((first, _)) = self.0.first() else {
            return;
        };
        let mut pose = first.pose();
        let mut line = BodyLine::new(pose, ray);
        for (sector, activity) in &self.0 {
            if sector.pose() != pose {
                pose = sector.pose();
                line = BodyLine::new(pose, ray);
            }
            sector.for_spans(ray, &line, |span| each(span, *activity));
        }
    }
}
