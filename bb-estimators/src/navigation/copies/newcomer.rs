//! The newcomer: the filter as if it had been where positions are that it refuses.

use super::{CopiedFilter, Copies, Update, is_near};
use crate::navigation::fused::Fused;
use crate::navigation::numbers::LONGEST_PROBATION_S;
use crate::navigation::numbers::{FAR_POSITION, POSITION_SLACK};
use crate::navigation::refusal::Refusal;
use crate::navigation::stream::Stream;

/// A filter that waits to take over.
#[derive(Clone, Debug)]
pub(super) struct Newcomer<F: CopiedFilter> {
    pub(super) filter: F,
    born_ns: i64,
    /// Time for which it has to fit, s.
    probation_s: f64,
}

impl<F: CopiedFilter> Newcomer<F> {
    /// A copy of a filter that had been right since a time, as if it were where this position is.
    fn new<M, const D: usize>(filter: F, right_since_ns: i64, measurement: &M) -> Option<Self>
    where
        F: Update<M, D>,
    {
        let born_ns = filter.time_ns()?;
        let there = |is_turned: bool| {
            let mut there = filter;
            there.unmoor();
            if is_turned {
                there.forget_attitude();
            }
            let _: Fused = there.update_ungated(&mut Stream::default(), measurement).ok()?;
            Some(there).filter(|there| {
                there.judge(measurement, POSITION_SLACK).is_ok_and(|judged| judged.nis <= FAR_POSITION)
            })
        };
        // A pose may show that the attitude was wrong as well.
        let filter = there(false).or_else(|| there(true))?;
        let age_s = born_ns.saturating_sub(right_since_ns) as f64 * 1e-9;
        Some(Self { filter, born_ns, probation_s: age_s.min(LONGEST_PROBATION_S) })
    }

    /// Fuses a measurement of another sensor, if it fits.
    pub(super) fn aid<M, const D: usize>(&mut self, own: &M, measurement: &M, most: f64)
    where
        F: Update<M, D>,
    {
        if self.filter.judge(own, 0.0).is_ok_and(|judged| judged.nis <= most) {
            let _ = self.filter.update_ungated(&mut Stream::default(), measurement);
        }
    }

    fn is_due(&self) -> bool {
        let now_ns = self.filter.time_ns().unwrap_or(i64::MIN);
        now_ns.saturating_sub(self.born_ns) as f64 * 1e-9 >= self.probation_s
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
            Ok(_) => Refusal::Gate { nis: FAR_POSITION, limit: FAR_POSITION },
            Err(refusal @ Refusal::Gate { .. }) => refusal,
            Err(_) => return admitted,
        };
        if let Some(newcomer) = &mut self.newcomer {
            let judged =
                newcomer.filter.judge(measurement, POSITION_SLACK).ok().filter(|judged| judged.nis <= FAR_POSITION);
            if judged
                .is_some_and(|judged| admitted.is_ok_and(|ours| judged.log_likelihood > ours) || admitted.is_err())
            {
                let _ = newcomer.filter.update_ungated(&mut Stream::default(), measurement);
                if let Some(newcomer) = self.newcomer.take_if(|newcomer| newcomer.is_due()) {
                    self.take_over(stream, &newcomer);
                }
                return Err(refusal);
            }
            self.newcomer = None;
        }
        if admitted.is_err() {
            self.newcomer = Newcomer::new(*self.best(), self.started_ns, measurement);
        }
        admitted
    }

    /// Lets a newcomer that has fitted for long enough be the filter.
    fn take_over(&mut self, stream: &mut Stream, newcomer: &Newcomer<F>) {
        if let (Some(there), Some(here)) = (newcomer.filter.position(), self.best().position()) {
            let way = there - here;
            if !is_near(&way) {
                self.elsewhere = Some(way.norm());
                return;
            }
            self.started_ns = newcomer.born_ns;
        }
        self.starts.truncate(1);
        self.starts[0].filter = newcomer.filter;
        self.starts[0].filter.begin_again();
        self.starts[0].log_likelihood = 0.0;
        self.changes = self.changes.wrapping_add(1);
        self.search.drop_neighbours();
        stream.forgive();
    }
}
