//! Parallel loops. Their bodies are trait objects, so that the generic code of rayon is compiled once, with this crate.

use std::slice::ChunksMut;

use rayon::{FnContext, current_num_threads};

/// Processes consecutive chunks, given the index of the first.
type Body<'a, T> = &'a (dyn Fn(usize, ChunksMut<'_, T>) + Sync);

/// Calls `work` with each chunk of `len` elements and its index; the last chunk may be shorter.
pub(crate) fn chunks<T: Send>(data: &mut [T], len: usize, work: &(dyn Fn(usize, &mut [T]) + Sync)) {
    chunks_with(data, len, &|| (), &|(), k, chunk| work(k, chunk));
}

/// As [`chunks`], with a task for each chunk.
pub(crate) fn tasks<T: Send>(data: &mut [T], len: usize, work: &(dyn Fn(usize, &mut [T]) + Sync)) {
    let n = current_num_threads().max(data.len().div_ceil(len));
    divide(data, len, 0, n, &|first, chunks| {
        (first..).zip(chunks).for_each(|(k, chunk)| work(k, chunk));
    });
}

/// As [`chunks`], with work arrays that consecutive chunks share.
pub(crate) fn chunks_with<T: Send, S>(
    data: &mut [T],
    len: usize,
    new: &(dyn Fn() -> S + Sync),
    work: &(dyn Fn(&mut S, usize, &mut [T]) + Sync),
) {
    divide(data, len, 0, current_num_threads(), &|first, chunks| {
        let mut arrays = new();
        for (k, chunk) in (first..).zip(chunks) {
            work(&mut arrays, k, chunk);
        }
    });
}

/// Calls `work` with each item and its index.
pub(crate) fn each<I: Send>(items: &mut [I], work: &(dyn Fn(usize, &mut I) + Sync)) {
    chunks(items, 1, &|k, item| work(k, &mut item[0]));
}

/// Returns `of(k)` for each `k < n`.
pub(crate) fn collect<R: Send>(n: usize, of: &(dyn Fn(usize) -> R + Sync)) -> Vec<R> {
    let mut results: Vec<Option<R>> = Vec::new();
    results.resize_with(n, || None);
    each(&mut results, &|k, result| *result = Some(of(k)));
    results.into_iter().flatten().collect()
}

/// Halves the chunks `splits.ilog2() + 1` times and processes the parts in parallel.
fn divide<T: Send>(data: &mut [T], len: usize, first: usize, splits: usize, body: Body<'_, T>) {
    let half = data.len().div_ceil(len) / 2;
    if half == 0 || splits == 0 {
        return body(first, data.chunks_mut(len));
    }
    let (front, back) = data.split_at_mut(half * len);
    let front = &mut |splits| divide(front, len, first, splits, body);
    let back = &mut |splits| divide(back, len, first + half, splits, body);
    join(splits / 2, front, back);
}

/// A half of a division, given the number of its splits.
type Half<'a> = &'a mut (dyn FnMut(usize) + Send);

/// Processes two halves in parallel. A half that another thread steals is split more often, as in rayon's iterators.
fn join(splits: usize, front: Half<'_>, back: Half<'_>) {
    let splits = |context: FnContext| match context.migrated() {
        true => splits.max(2 * current_num_threads()),
        false => splits,
    };
    rayon::join_context(
        |context| front(splits(context)),
        |context| back(splits(context)),
    );
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    /// Without any steal, so that idle threads find work.
    #[test]
    fn there_are_as_many_parts_as_threads() {
        let n_parts = AtomicUsize::new(0);
        let new = || n_parts.fetch_add(1, Ordering::Relaxed);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build();
        let run = || super::chunks_with(&mut [0; 20], 2, &new, &|_, k, chunk| chunk.fill(k));
        pool.unwrap().install(run);
        assert!(n_parts.into_inner() >= 3);
    }
}
