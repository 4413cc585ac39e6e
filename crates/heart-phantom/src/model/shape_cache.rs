//! The cache of shapes of a heart: least recently used shapes are evicted.

use super::shape::HeartShape;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

/// Shapes by gain, shared by threads.
#[derive(Debug, Default)]
pub(super) struct ShapeCache(Mutex<Shapes>);

#[derive(Debug, Default)]
struct Shapes {
    /// Each with the index of the call that used it last.
    by_gain: BTreeMap<u64, (Arc<HeartShape>, usize)>,
    calls: usize,
    solved: usize,
    /// Shapes in memory, cached or referenced, and their largest number.
    alive: Vec<Weak<HeartShape>>,
    most_alive: usize,
}

impl ShapeCache {
    /// Returns the cached shapes of the gains, and the missing gains. Evicts the least recently used shapes beyond `most`.
    pub(super) fn take(
        &self,
        gains: &[f64],
        most: usize,
    ) -> (BTreeMap<u64, Arc<HeartShape>>, Vec<f64>) {
        let mut kept = self.lock();
        kept.calls += 1;
        let now = kept.calls;
        let (mut there, mut missing) = (BTreeMap::new(), Vec::new());
        for gain in gains {
            match kept.by_gain.get_mut(&gain.to_bits()) {
                Some((shape, used)) => {
                    *used = now;
                    there.insert(gain.to_bits(), shape.clone());
                }
                None => missing.push(*gain),
            }
        }
        missing.sort_by(f64::total_cmp);
        missing.dedup_by_key(|gain| gain.to_bits());
        kept.drop_down_to(most.saturating_sub(missing.len()), now);
        (there, missing)
    }

    /// Adds new shapes.
    pub(super) fn add(&self, new: &[Arc<HeartShape>]) {
        let mut kept = self.lock();
        let now = kept.calls;
        for shape in new {
            let mut added = false;
            kept.by_gain
                .entry(shape.gain().to_bits())
                .or_insert_with(|| {
                    added = true;
                    (shape.clone(), now)
                });
            kept.solved += usize::from(added);
        }
        kept.alive.retain(|shape| shape.strong_count() > 0);
        kept.alive.extend(new.iter().map(Arc::downgrade));
        kept.most_alive = kept.most_alive.max(kept.alive.len());
    }

    /// Number of shapes solved so far.
    pub(super) fn solved(&self) -> usize {
        self.lock().solved
    }

    /// Returns the number of shapes in memory, cached or referenced, and the largest number so far.
    pub(super) fn alive(&self) -> [usize; 2] {
        let kept = self.lock();
        let alive = kept.alive.iter().filter(|shape| shape.strong_count() > 0);
        [alive.count(), kept.most_alive]
    }

    /// The map is consistent even after a panic elsewhere.
    fn lock(&self) -> MutexGuard<'_, Shapes> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Shapes {
    /// Evicts the least recently used shapes, except those in use.
    fn drop_down_to(&mut self, most: usize, now: usize) {
        let surplus = self.by_gain.len().saturating_sub(most);
        if surplus == 0 {
            return;
        }
        let mut by_age: Vec<(usize, u64)> = (self.by_gain.iter())
            .map(|(gain, (_, used))| (*used, *gain))
            .filter(|(used, _)| *used < now)
            .collect();
        by_age.sort_unstable();
        for (_, gain) in by_age.into_iter().take(surplus) {
            self.by_gain.remove(&gain);
        }
    }
}
