//! The newcomer: the filter as if it had been where positions are that it refuses.

use super::{CopiedFilter, Copies, FAR, SLACK, Update, is_near};
use crate::navigation::fused::Fused;
use crate::navigation::refusal::Refusal;
use crate::navigation::stream::Stream;

/// The longest time after which a newcomer that fits takes over, s.
const LONGEST_S: f64 = 20.0;

/// No robot that was right is so far, m, from where it is along any axis.
pub(super) const FARTHEST: f64 = 100_000.0;

/// A filter that waits to take over.
#[derive(Clone, Debug)]
pub(super) struct Newcomer<F: CopiedFilter> {
    pub(super) filter: F,
    born_ns: i64,
    /// Time for which it has to fit, s.
    probation_s: f64,
}

impl<F: CopiedFilter> Newcomer<F> {
    /// Fuses a measurement of another sensor, if it fits.
    pub(super) fn aid<M, const D: usize>(&mut self, own: &M, measurement: &M, most: f64)
    where
        F: Update<M, D>,
    {
        if self.filter.judge(own, 0.0).is_ok_and(|judged| judged.nis <= most) {
            let _ = self.filter.update_ungated(&mut Stream::default(), measurement);
        }
    }
}

impl<F: CopiedFilter> Copies<F> {
    /// Decides between the filter and its newcomer by a position. Returns whether the filter still admits it.
    pub(super) fn settle<M, const D: usize>(
        &mut self,
        stream: &mut Stream,
        measurement: &M,
        admitted: Result<f64, Refusal>,
    ) -> Result<f64, Refusal>
    where
        F: Update<M, D>,
    {
        let refusal = match admitted {
            Ok(_) if self.newcomer.is_none() => return admitted,
            Ok(_) => Refusal::Gate { nis: FAR, limit: FAR },
            Err(refusal @ Refusal::Gate { .. }) => refusal,
            Err(_) => return admitted,
        };
        if let Some(newcomer) = &mut self.newcomer {
            let judged = newcomer.filter.judge(measurement, SLACK).ok().filter(|judged| judged.nis <= FAR);
            let is_better = |theirs: f64| admitted.is_err() || admitted.is_ok_and(|ours| theirs > ours);
            match judged.filter(|judged| is_better(judged.log_likelihood)) {
                Some(_) => {
                    let _ = newcomer.filter.update_ungated(&mut Stream::default(), measurement);
                    return self.take_over(stream, refusal);
                }
                None if admitted.is_ok() => {
                    self.newcomer = None;
                    return admitted;
                }
                None => {}
            }
        }
        self.newcomer = self.found(measurement);
        Err(refusal)
    }

    /// A filter that would have been where this position is.
    fn found<M, const D: usize>(&self, measurement: &M) -> Option<Newcomer<F>>
    where
        F: Update<M, D>,
    {
        let mut filter = *self.best();
        let born_ns = filter.time_ns()?;
        filter.unmoor();
        let _: Fused = filter.update_ungated(&mut Stream::default(), measurement).ok()?;
        let age_s = born_ns.saturating_sub(self.started_ns) as f64 * 1e-9;
        Some(Newcomer { filter, born_ns, probation_s: age_s.min(LONGEST_S) })
    }

    /// Lets a newcomer that has fitted for long enough be the filter. It has fused the position, which the filter thus has not.
    fn take_over(&mut self, stream: &mut Stream, refusal: Refusal) -> Result<f64, Refusal> {
        let is_due = |newcomer: &mut Newcomer<F>| {
            let now_ns = newcomer.filter.time_ns().unwrap_or(i64::MIN);
            now_ns.saturating_sub(newcomer.born_ns) as f64 * 1e-9 >= newcomer.probation_s
        };
        let Some(newcomer) = self.newcomer.take_if(is_due) else { return Err(refusal) };
        if let (Some(there), Some(here)) = (newcomer.filter.position(), self.best().position()) {
            let way = there - here;
            if !is_near(&way) {
                self.elsewhere = Some(way.norm());
                return Err(refusal);
            }
            self.started_ns = newcomer.born_ns;
        }
        self.starts.truncate(1);
        self.starts[0].filter = newcomer.filter;
        self.starts[0].filter.begin_again();
        self.starts[0].log_likelihood = 0.0;
        self.search.orphan();
        stream.forgive();
        Err(refusal)
    }
}
