//! Single rays through a body: chords, spans, line integrals.

use crate::rays::chord::Hint;
use crate::rays::direction::Direction;
use crate::{Body, Meridian, Ray, RevolveError, Span};

impl Body {
    /// Returns the length of the line inside one layer, the filled solid. In a wall it is [`line_integral`](Self::line_integral) with the
    /// activity 1 there and 0 elsewhere.
    ///
    /// It is a continuous function of the line, except for lines along the surface, which are limits from one side
    /// ([conventions](crate#conventions)).
    ///
    /// Cost: the logarithm of the number of segments.
    ///
    /// # Errors
    /// [`RevolveError::NoSuchLayer`].
    pub fn chord(&self, layer: usize, ray: &Ray) -> Result<f64, RevolveError> {
        Ok(self.chord_in(self.layer(layer)?, ray))
    }

    fn chord_in(&self, layer: &Meridian, ray: &Ray) -> f64 {
        let (mut sum, mut hints) = (0.0, vec![Hint::default(); layer.chains().len()]);
        self.intervals(layer, ray, &mut hints, |sign, [low, high]| {
            sum += sign * (high - low);
        });
        sum.max(0.0)
    }

    /// Returns the line integral of the activity along the whole line.
    ///
    /// # Errors
    /// [`RevolveError::WrongLength`] or [`RevolveError::NotFinite`] for the activities.
    pub fn line_integral(&self, ray: &Ray, activity: &[f64]) -> Result<f64, RevolveError> {
        let weights = self.weights(activity)?;
        let chords = self.layers().iter().map(|layer| self.chord_in(layer, ray));
        Ok(weights.iter().zip(chords).map(|(w, chord)| w * chord).sum())
    }

    /// Returns the sorted, disjoint intervals of the line inside one layer, the filled solid. Those in a wall are the intervals of its layer less
    /// those of the next inner one.
    ///
    /// # Errors
    /// [`RevolveError::NoSuchLayer`].
    pub fn spans(&self, layer: usize, ray: &Ray) -> Result<Vec<Span>, RevolveError> {
        let (layer, mut spans) = (self.layer(layer)?, Vec::new());
        self.for_spans(layer, ray, &mut Search::default(), |span| spans.push(span));
        Ok(spans)
    }

    /// Calls `each` with the sorted, disjoint intervals of the line inside one layer. Neighbouring lines share `search`.
    #[inline(always)]
    pub(crate) fn for_spans(
        &self,
        layer: &Meridian,
        ray: &Ray,
        search: &mut Search,
        mut each: impl FnMut(Span),
    ) {
        let Search { hints, ends } = search;
        ends.clear();
        hints.resize(layer.chains().len(), Hint::default());
        self.intervals(layer, ray, hints, |sign, [low, high]| {
            ends.extend([(low, sign), (high, -sign)]);
        });
        if let [(enter, 1.0), (exit, _)] = ends[..] {
            if enter < exit {
                each(Span { enter, exit });
            }
            return;
        }
        ends.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (mut depth, mut enter) = (0.0, 0.0);
        for at_one in ends.chunk_by(|a, b| a.0 == b.0) {
            let before: f64 = depth;
            depth += at_one.iter().map(|(_, sign)| sign).sum::<f64>();
            match (before < 0.5, depth < 0.5) {
                (true, false) => enter = at_one[0].0,
                (false, true) => each(Span {
                    enter,
                    exit: at_one[0].0,
                }),
                _ => {}
            }
        }
    }

    /// Calls `each` with the sign and the ends of the interval of every chain.
    #[inline(always)]
    fn intervals(
        &self,
        meridian: &Meridian,
        ray: &Ray,
        hints: &mut [Hint],
        mut each: impl FnMut(f64, [f64; 2]),
    ) {
        let farthest = self.pose().farthest(ray.origin().coords.amax());
        let d = self.pose().vector_to_body(&ray.direction());
        let direction = Direction::new(meridian, farthest, &d);
        let [w, q, shift] = direction.coordinates(&self.pose().to_body(&ray.origin()));
        for (sign, faces) in direction.intervals(meridian, [w, q], hints) {
            each(sign, direction.ends([w, q], &faces).map(|t| t - shift));
        }
    }
}

/// Work arrays of lines through one layer.
#[derive(Debug, Clone, Default)]
pub(crate) struct Search {
    /// Faces that the previous line intersected.
    hints: Vec<Hint>,
    /// Ends of the intervals of one line, with their signs.
    ends: Vec<(f64, f64)>,
}
