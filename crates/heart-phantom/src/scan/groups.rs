//! Groups of views that are computed together.

use super::nodes::Node;
use super::view_error::Total;
use super::whole::Scan;
use crate::error::PhantomError;
use std::collections::BTreeSet;
use std::ops::Range;

/// Nodes of the quadrature in a group of views: about 50 MB.
pub(crate) const MOST_NODES: usize = 1 << 20;

/// Views that are computed together.
pub(super) struct Group {
    pub(super) views: Range<usize>,
    /// The nodes of each view, those of all sets in ascending order of their keys; or one list for all views.
    pub(super) plans: Vec<Vec<Node>>,
}

/// Passes on the views in groups whose shapes and nodes fit into memory.
pub(super) fn for_groups(
    sets: &[Scan<'_>],
    views: Range<usize>,
    totals: &mut [Total],
    mut take: impl FnMut(Group, &mut [Total]) -> Result<(), PhantomError>,
) -> Result<(), PhantomError> {
    let rules: Vec<_> = sets.iter().map(Scan::quadrature).collect();
    let plan = |view_idx: usize, totals: &mut [Total]| {
        let mut all = Vec::new();
        for (set, (rule, total)) in rules.iter().zip(totals).enumerate() {
            let of_set = rule.view(view_idx);
            total.plan(&of_set, rule.sphere_error(view_idx, &of_set));
            all.extend(of_set.nodes.into_iter().map(|node| Node { set, ..node }));
        }
        all.sort_by_key(Node::key);
        all
    };
    let alike = |set: &Scan<'_>| (set.acquisition).same_for_all_views(set.cycle, set.camera);
    if sets.iter().all(alike) {
        let plans = vec![plan(views.start, totals)];
        return take(Group { views, plans }, totals);
    }
    let most = sets[0].heart.most_shapes();
    let begin = |view_idx: usize| Group {
        views: view_idx..view_idx,
        plans: Vec::new(),
    };
    let mut group = begin(views.start);
    let (mut gains, mut n_nodes) = (BTreeSet::new(), 0);
    for view_idx in views {
        let plan = plan(view_idx, totals);
        let own: BTreeSet<u64> = plan.iter().map(|node| node.gain.to_bits()).collect();
        let more = own.difference(&gains).count();
        if gains.len() + more > most || n_nodes + plan.len() > MOST_NODES {
            take(std::mem::replace(&mut group, begin(view_idx)), totals)?;
            (gains, n_nodes) = (BTreeSet::new(), 0);
        }
        gains.extend(own);
        n_nodes += plan.len();
        group.views.end += 1;
        group.plans.push(plan);
    }
    take(group, totals)
}

impl Group {
    /// The nodes of all views at once; or, where one list alone needs more shapes, part by part.
    pub(super) fn batches(&self, most: usize) -> Vec<Range<usize>> {
        let [plan] = &self.plans[..] else {
            return vec![Range {
                start: 0,
                end: usize::MAX,
            }];
        };
        let (mut batches, mut gains, mut start) = (Vec::new(), BTreeSet::new(), 0);
        for (k, node) in plan.iter().enumerate() {
            let gain = node.gain.to_bits();
            if gains.len() == most && !gains.contains(&gain) {
                batches.push(start..k);
                (gains, start) = (BTreeSet::new(), k);
            }
            gains.insert(gain);
        }
        batches.push(start..plan.len());
        batches
    }
}
