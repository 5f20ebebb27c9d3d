//! The search for the noise of the IMU on this vehicle: two copies of a filter beside it, with more noise and with less.

use super::{Begun, CopiedFilter, Update};
use crate::navigation::math::exp;
use crate::navigation::numbers::{
    MOST_STARTS, SEARCH_EXPONENTS, SEARCH_FIRST, SEARCH_LEAD, SEARCH_MEMORY_S, SEARCH_PAUSE_S, SEARCH_STEP,
};
use crate::navigation::stream::Stream;

/// The multiple of the white noise at a power of [`SEARCH_STEP`].
fn multiple(exponent: i32) -> f64 {
    (0..exponent).fold(1.0, |multiple, _| multiple * SEARCH_STEP)
}

/// The state of the search.
#[derive(Clone, Debug)]
pub(super) struct Search<F: CopiedFilter> {
    is_on: bool,
    /// The power of [`SEARCH_STEP`] of the noise of all starts.
    exponent: i32,
    moved_ns: i64,
    compared_ns: i64,
    /// The start of which the neighbours are copies.
    parent: Option<u32>,
    /// The copies with more and with less noise.
    neighbours: [Option<Neighbour<F>>; 2],
}

/// A copy of the parent with more or less noise.
#[derive(Clone, Debug)]
struct Neighbour<F: CopiedFilter> {
    filter: F,
    /// The log likelihood by which it leads its parent.
    lead: f64,
}

impl<F: CopiedFilter> Search<F> {
    pub(super) fn new(is_on: bool) -> Self {
        let exponent = if is_on { SEARCH_FIRST } else { 0 };
        Self { is_on, exponent, moved_ns: i64::MIN, compared_ns: i64::MIN, parent: None, neighbours: [None, None] }
    }

    /// The multiple at which the search begins.
    pub(super) fn first_multiple(&self) -> f64 {
        if self.is_on { multiple(SEARCH_FIRST) } else { 1.0 }
    }

    /// The multiple of the noise of all starts.
    pub(super) fn multiple(&self) -> f64 {
        multiple(self.exponent)
    }

    pub(super) fn filters_mut(&mut self) -> impl Iterator<Item = &mut F> {
        self.neighbours.iter_mut().flatten().map(|neighbour| &mut neighbour.filter)
    }

    pub(super) fn is_child_of(&self, id: u32) -> bool {
        self.parent == Some(id)
    }

    /// Drops the neighbours, as their parent has been replaced.
    pub(super) fn drop_neighbours(&mut self) {
        self.parent = None;
        self.neighbours = [None, None];
    }

    /// Fuses a measurement in the neighbours. `parent_likelihood` is its log likelihood for their parent.
    pub(super) fn fuse<M, const D: usize>(&mut self, stream: &Stream, measurement: &M, parent_likelihood: f64)
    where
        F: Update<M, D>,
    {
        for neighbour in self.neighbours.iter_mut().flatten() {
            if let Ok(fused) = neighbour.filter.update_ungated(&mut { *stream }, measurement) {
                neighbour.lead += fused.log_likelihood - parent_likelihood;
            }
        }
    }

    /// Moves to a neighbour that leads, or creates neighbours if there are none. Returns whether it has moved.
    pub(super) fn step(&mut self, starts: &mut [Begun<F>], now_ns: i64) -> bool {
        if !self.is_on || starts.len() > MOST_STARTS {
            return false;
        }
        let since = |time_ns: i64| now_ns.saturating_sub(time_ns) as f64 * 1e-9;
        let Some(parent) = starts.iter().position(|begun| self.is_child_of(begun.id)) else {
            self.fork(&starts[0]);
            (self.moved_ns, self.compared_ns) = (now_ns, now_ns);
            return false;
        };
        let kept = exp(-since(self.compared_ns) / SEARCH_MEMORY_S);
        self.compared_ns = now_ns;
        self.neighbours.iter_mut().flatten().for_each(|neighbour| neighbour.lead *= kept);
        if since(self.moved_ns) < SEARCH_PAUSE_S {
            return false;
        }
        for (index, up) in [(0, 1), (1, -1)] {
            let Some(neighbour) = self.neighbours[index].take_if(|neighbour| neighbour.lead > SEARCH_LEAD) else {
                continue;
            };
            self.exponent += up;
            self.moved_ns = now_ns;
            starts[parent].filter = neighbour.filter;
            for begun in starts.iter_mut() {
                begun.filter.multiply_noise(self.multiple());
                if up > 0 {
                    begun.filter.doubt_all(SEARCH_STEP * SEARCH_STEP);
                }
            }
            self.fork(&starts[parent]);
            return true;
        }
        false
    }

    fn fork(&mut self, parent: &Begun<F>) {
        self.parent = Some(parent.id);
        self.neighbours = [1, -1].map(|step| {
            let exponent = self.exponent + step;
            SEARCH_EXPONENTS.contains(&exponent).then(|| {
                let mut filter = parent.filter;
                filter.multiply_noise(multiple(exponent));
                Neighbour { filter, lead: 0.0 }
            })
        });
    }
}
