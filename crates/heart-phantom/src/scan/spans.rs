//! The time of a view, divided by beats and respiratory cycles.

use super::acquisition::Acquisition;
use super::settings::Mode;
use crate::model::{RespiratoryMotion, Rhythm, wrap};
use crate::{Cycle, RespiratoryGates};
use std::borrow::Cow;

/// Times below this are rounding.
const NO_SECONDS: f64 = 1e-9;

/// An interval in which cardiac and respiratory phase are linear in time, and volume and respiratory position monotone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Span {
    /// Start and end in seconds after the start of the first view.
    pub(super) time: [f64; 2],
    /// Cardiac phase at both ends.
    pub(super) phase: [f64; 2],
    /// Respiratory phase at both ends, 0 to 1.
    pub(super) breath: [f64; 2],
    /// Number of repetitions in consecutive beats.
    pub(super) copies: f64,
    /// Average delay of the repetitions, seconds.
    pub(super) delay: f64,
}

impl Span {
    /// Returns the duration in seconds.
    pub(super) fn seconds(&self) -> f64 {
        self.time[1] - self.time[0]
    }

    /// Returns the part between two times.
    pub(super) fn part(&self, [from, to]: [f64; 2]) -> Option<Self> {
        let [from, to] = [from.max(self.time[0]), to.min(self.time[1])];
        (to > from).then(|| Self {
            time: [from, to],
            phase: [from, to].map(|t| self.phase_at(t)),
            breath: [from, to].map(|t| self.breath_at(t)),
            ..*self
        })
    }

    pub(super) fn phase_at(&self, t: f64) -> f64 {
        self.along(self.phase, t)
    }

    pub(super) fn breath_at(&self, t: f64) -> f64 {
        self.along(self.breath, t)
    }

    fn along(&self, [from, to]: [f64; 2], t: f64) -> f64 {
        let share = (t - self.time[0]) / self.seconds();
        // Exact at the ends.
        from + (to - from)
            * if self.seconds() > 0.0 {
                share.clamp(0.0, 1.0)
            } else {
                0.0
            }
    }
}

/// Returns the spans of a time window in order.
pub(super) fn between(acquisition: Acquisition, cycle: &Cycle, window: [f64; 2]) -> Vec<Span> {
    let beating = match acquisition.mode {
        Mode::Static { phase } => vec![Span {
            time: window,
            phase: [wrap(phase); 2],
            breath: [0.0; 2],
            copies: 1.0,
            delay: 0.0,
        }],
        Mode::Gated { gates } => beats(cycle, window, Some([acquisition.gate[0], gates])),
        Mode::Instants | Mode::Exposure { .. } | Mode::WholeCycle => beats(cycle, window, None),
    };
    match cycle.breathing() {
        None => beating,
        Some(breathing) => (beating.into_iter())
            .flat_map(|span| breaths(&span, breathing, acquisition.gate[1]))
            .collect(),
    }
}

/// Returns the total duration and the mean time of some spans; `start` if they are empty.
pub(super) fn seen(spans: &[Span], start: f64) -> [f64; 2] {
    let [mut seconds, mut moment] = [0.0; 2];
    for span in spans {
        let own = span.copies * span.seconds();
        seconds += own;
        moment += own * (0.5 * (span.time[0] + span.time[1]) + span.delay);
    }
    match seconds > NO_SECONDS {
        true => [seconds, moment / seconds],
        false => [0.0, start],
    }
}

/// Returns the parts of a time window in accepted beats, or in a gate of them.
fn beats(cycle: &Cycle, [from, to]: [f64; 2], gate: Option<[usize; 2]>) -> Vec<Span> {
    let rhythm: Cow<'_, Rhythm> = match cycle.rhythm() {
        Some(rhythm) => Cow::Borrowed(rhythm),
        None => Cow::Owned(Rhythm::regular(cycle.period())),
    };
    let repeats = cycle.rhythm().is_none() && cycle.breathing().is_none();
    let mut spans = Vec::new();
    let mut k = rhythm.number_at(from);
    loop {
        let beat = rhythm.beat(k);
        if beat.start >= to {
            break;
        }
        let copies = match repeats && beat.start >= from {
            true => ((to - beat.start + NO_SECONDS) / beat.length)
                .floor()
                .max(1.0),
            false => 1.0,
        };
        k += copies as usize;
        if !rhythm.accepts(&beat) {
            continue;
        }
        let [open, close] = match gate {
            None => [0.0, beat.length],
            Some([gate, gates]) => rhythm.gate(&beat, gate, gates),
        };
        for (seconds, phases) in rhythm.linear_parts(&beat) {
            let part = Span {
                time: seconds.map(|t| beat.start + t),
                phase: phases,
                breath: [0.0; 2],
                copies,
                delay: 0.5 * (copies - 1.0) * beat.length,
            };
            let window = [from.max(beat.start + open), to.min(beat.start + close)];
            let Some(part) = part.part(window) else {
                continue;
            };
            let [a, b] = part.phase;
            let per_phase = part.seconds() / (b - a);
            let knots = cycle.height().knots_between(a, b);
            let at = |phase: &f64| part.time[0] + (phase - a) * per_phase;
            cut(&part, &knots.iter().map(at).collect::<Vec<_>>(), &mut spans);
        }
    }
    spans
}

/// Divides a span by respiratory cycles, limited to a respiratory gate if there are any.
fn breaths(span: &Span, breathing: &RespiratoryMotion, gate: usize) -> Vec<Span> {
    let [from, to] = span.time.map(|t| breathing.breaths(t));
    let mut spans = Vec::new();
    let mut whole = from.floor();
    while whole < to {
        let ends = [0.0, 1.0].map(|phase| breathing.time_of(whole + phase));
        if let Some(mut part) = span.part(ends) {
            part.breath = part
                .time
                .map(|t| (breathing.breaths(t) - whole).clamp(0.0, 1.0));
            let [a, b] = part.breath;
            let knots = breathing.curve().knots_between(a, b);
            let at = |phase: &f64| breathing.time_of(whole + phase);
            cut(&part, &knots.iter().map(at).collect::<Vec<_>>(), &mut spans);
        }
        whole += 1.0;
    }
    let Some(gates) = breathing.breathing().gates else {
        return spans;
    };
    let [low, high] = [gate, gate + 1].map(|g| g as f64 / gates.count() as f64);
    let within = |span: &Span| match gates {
        RespiratoryGates::Phase(_) => {
            let [a, b] = span.breath;
            let rate = span.seconds() / (b - a);
            span.part([low, high].map(|phase| span.time[0] + (phase - a) * rate))
        }
        RespiratoryGates::Amplitude(_) => {
            let [a, b] = span.breath.map(|phase| breathing.at_phase(phase));
            // The upper limit belongs to the last gate.
            if a == b {
                let held = a >= low && (a < high || gate + 1 == gates.count());
                return held.then_some(*span);
            }
            let position = |t: f64| breathing.at_phase(span.breath_at(t));
            let at = |level: f64| root(span.time, position, level);
            let [x, y] = [at(low), at(high)];
            span.part([x.min(y), x.max(y)])
        }
    };
    spans.iter().filter_map(within).collect()
}

/// Returns the argument at which a monotone function reaches a level, or the nearer end.
pub(super) fn root([mut a, mut b]: [f64; 2], at: impl Fn(f64) -> f64, level: f64) -> f64 {
    let ends = [at(a), at(b)];
    let [mut low, mut high] = ends.map(|end| end - level);
    if low == 0.0 {
        return a;
    } else if high == 0.0 {
        return b;
    } else if (low > 0.0) == (high > 0.0) {
        // By the values: their differences from a distant level may be equal by rounding.
        let first_is_nearer = (low < 0.0) == (ends[0] > ends[1]);
        return if first_is_nearer { a } else { b };
    }
    // Illinois method: regula falsi that halves the value of a retained end (Dowell and Jarratt 1971, doi:10.1007/BF01934364).
    let mut last = 0;
    for _ in 0..60 {
        let x = (a * high - b * low) / (high - low);
        let x = if x > a && x < b { x } else { 0.5 * (a + b) };
        let value = at(x) - level;
        if value == 0.0 || b - a <= 1e-13 * (a.abs() + b.abs()) {
            return x;
        }
        if (value > 0.0) == (high > 0.0) {
            (b, high) = (x, value);
            if last == 1 {
                low *= 0.5;
            }
            last = 1;
        } else {
            (a, low) = (x, value);
            if last == -1 {
                high *= 0.5;
            }
            last = -1;
        }
    }
    0.5 * (a + b)
}

/// Divides a span at ascending times.
fn cut(span: &Span, at: &[f64], into: &mut Vec<Span>) {
    let mut from = span.time[0];
    for &to in at.iter().chain([&span.time[1]]) {
        into.extend(span.part([from, to]));
        from = to;
    }
}
