//! Copies of one filter that differ in what nobody knows, the best by likelihood.
//!
//! Three questions have the same answer, a few copies of the filter side by side:
//!
//! * **Where it begins.** A heading that is not known begins as six, 60° apart; so does the yaw of an IMU in its vehicle, where wheels
//!   are declared. The scale of relative poses begins as one that is exact and one that drifts. A copy that is e¹² times less likely
//!   than the best is dropped, and so is one that has become the same as the best. A gap that leaves the attitude unknown begins it
//!   again: as six headings, unless some are still compared, or as 24 attitudes, 90° apart, if the tilt is unknown too.
//! * **How noisy the IMU is on this vehicle.** Once what is left of the first question is small, two more copies have four times the
//!   white noise, and a quarter. All move on to the multiple of a copy that leads by e³, over the past two minutes. The search begins
//!   at 16 times the data sheet, since too little confidence heals and too much locks biases in; for the same reason the covariance
//!   grows with the noise when the search moves up.
//! * **Whether it is in the wrong place.** A position that the gate refuses founds a newcomer: the filter as if it had been there. Each
//!   further position goes to whom it fits better. A newcomer that has refused none for as long as the filter had been right, at
//!   most 20 s, takes over; one that loses a position is gone. "My place was wrong" and "these fixes have an offset" explain the data
//!   equally well, so that time decides and not likelihood.
//!
//! Copies are never mixed: the estimate is that of one filter. A gap in the samples is bridged as `holding.rs` says, rest is found as
//! `rest.rs` says, and fixes that scatter more than they state get the noise of their scatter (`scatter.rs`).

mod filter;
mod flight;
mod holding;
mod newcomer;
mod rest;
mod scatter;
mod search;
#[cfg(test)]
pub(super) mod tests;

use alloc::vec;
use alloc::vec::Vec;

use nalgebra::{Isometry3, Vector3};

pub(super) use self::filter::{CopiedFilter, Fix, Update, is_same};
pub(in crate::navigation) use self::holding::Holding;
use self::newcomer::Newcomer;
use self::rest::Rest;
use self::scatter::Scatter;
use self::search::Search;
use super::bounds::is_within;
use super::eskf::{Doubt, EskfFilter, ImuMean, seconds_between};
use super::fused::Fused;
use super::propagate::Propagate;
use super::refusal::Refusal;
use super::state::States;
use super::stream::Stream;
use crate::attitude::ParamsError;
use crate::navigation::numbers::{
    BETTER, FAR_POSITION, FARTHEST_JUMP, IMPLAUSIBLE, IMPOSSIBLE, MOST_STARTS, MOVES, POSITION_SLACK, PROBABLY,
    TURNS, UNKNOWN_HEADING,
};

/// Further differences between the copies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ways {
    /// Searches the noise of the IMU; without it, the filter has that of its parameters.
    pub noise: bool,
    /// Adds copies whose scale of relative poses is exact to those in which it drifts.
    pub scale: bool,
}

/// Copies of one filter, such as [`EskfFilter`], that differ in where they begin, in the noise of the IMU, and in where they believe to be. The best by
/// likelihood is the estimate; they are never mixed.
#[derive(Clone, Debug)]
pub struct Copies<F: CopiedFilter> {
    params: F::Params,
    ways: Ways,
    /// Copies of the filter, at least one once it has started, the best first.
    starts: Vec<Begun<F>>,
    search: Search<F>,
    newcomer: Option<Newcomer<F>>,
    started_ns: i64,
    changes: u32,
    holding: Holding,
    rest: Rest,
    scatter: Scatter,
    /// The last whole sample.
    last: Option<ImuMean>,
    /// The distance of positions that would have moved the filter, m, if they are not on this part of the Earth.
    elsewhere: Option<f64>,
}

/// A copy that began in its own way.
#[derive(Clone, Debug)]
struct Begun<F: CopiedFilter> {
    id: u32,
    filter: F,
    /// Relative to the best.
    log_likelihood: f64,
}

impl<F: CopiedFilter> Copies<F> {
    /// Creates copies that have not started.
    ///
    /// # Errors
    ///
    /// Returns the name of the first parameter outside its accepted range.
    pub fn new(params: F::Params, ways: Ways) -> Result<Self, ParamsError> {
        let starts = vec![Begun { id: 0, filter: F::new(params)?, log_likelihood: 0.0 }];
        Ok(Self {
            params,
            ways,
            starts,
            search: Search::new(ways.noise),
            newcomer: None,
            started_ns: 0,
            changes: 0,
            holding: Holding::default(),
            rest: Rest::default(),
            scatter: Scatter::default(),
            last: None,
            elsewhere: None,
        })
    }

    /// Starts or restarts all copies, in each way of what is unknown of the start.
    ///
    /// # Errors
    ///
    /// The same as those of the filter.
    pub fn start(&mut self, start: &F::Start) -> Result<(), Refusal> {
        let filters = F::starts(&self.params, self.ways, start)?;
        self.search = Search::new(self.ways.noise);
        let begun = |(id, mut filter): (u32, F)| {
            filter.multiply_noise(self.search.first_multiple());
            Begun { id, filter, log_likelihood: 0.0 }
        };
        self.starts = (0..).zip(filters).map(begun).collect();
        self.newcomer = None;
        self.scatter.interrupt(0.0);
        self.elsewhere = None;
        self.started_ns = self.time_ns().unwrap_or(0);
        Ok(())
    }

    /// The best copy.
    pub fn best(&self) -> &F {
        &self.starts[0].filter
    }

    /// The estimate of the best copy; `None` before the start.
    pub fn estimate(&self) -> Option<&F::Estimate> {
        self.best().estimate()
    }

    /// Number of times that another filter became the best.
    pub(in crate::navigation) fn changes(&self) -> u32 {
        self.changes
    }

    /// The number of copies that began in different ways and are all plausible.
    pub fn starts(&self) -> usize {
        self.starts.len()
    }

    /// The multiple of the IMU's white noise that fits best.
    pub fn noise(&self) -> f64 {
        self.search.multiple()
    }

    /// The distance of positions, m, to which the filter would have moved if they were not beyond any way of a robot: its world has its
    /// origin in the wrong place, and it should start again.
    pub fn elsewhere(&self) -> Option<f64> {
        self.elsewhere
    }

    /// The standard deviation of the heading, rad: of the best copy, or of a whole turn while the headings of others that are
    /// plausible are far from it.
    pub fn heading_deviation(&self) -> f64 {
        let is_far = |begun: &Begun<F>| self.best().turn_to(&begun.filter).abs() > UNKNOWN_HEADING;
        if self.starts.iter().any(is_far) {
            return core::f64::consts::PI / 1.732_050_807_568_877_2;
        }
        self.best().heading_deviation()
    }

    /// Fuses a measurement, unless the gate of `stream` refuses it for every copy.
    ///
    /// # Errors
    ///
    /// Returns a [`Refusal`] for the best copy, which the stream has counted.
    pub fn update<M, const D: usize>(&mut self, stream: &mut Stream, measurement: &M) -> Result<Fused, Refusal>
    where
        F: Update<M, D>,
    {
        self.update_correlated(stream, measurement, measurement)
    }

    /// Fuses a measurement whose noise is correlated over time, and therefore larger than its own, which the gate compares it with:
    /// `own` is the same measurement with that.
    ///
    /// # Errors
    ///
    /// The same as [`update`](Self::update).
    pub fn update_correlated<M, const D: usize>(
        &mut self,
        stream: &mut Stream,
        own: &M,
        measurement: &M,
    ) -> Result<Fused, Refusal>
    where
        F: Update<M, D>,
    {
        let most = stream.gate(D);
        let result = self.is_admitted(own, 0.0, most);
        if let Some(newcomer) = &mut self.newcomer {
            newcomer.aid(own, measurement, most);
        }
        self.fuse(stream, measurement, result)
    }

    /// Fuses a position or pose in the world. One that the filter cannot believe may show that the filter is wrong.
    ///
    /// # Errors
    ///
    /// The same as [`update`](Self::update).
    pub fn update_position<M, const D: usize>(
        &mut self,
        stream: &mut Stream,
        measurement: &M,
    ) -> Result<Fused, Refusal>
    where
        F: Update<M, D>,
    {
        let result = self.is_admitted(measurement, POSITION_SLACK, FAR_POSITION);
        let result = self.settle(stream, measurement, result);
        self.fuse(stream, measurement, result)
    }

    /// Fuses a fix like [`update_position`](Self::update_position), with the noise that the last ones have shown if they have stated
    /// less.
    ///
    /// # Errors
    ///
    /// The same as [`update`](Self::update).
    pub fn update_fix<M: Fix, const D: usize>(&mut self, stream: &mut Stream, fix: &M) -> Result<Fused, Refusal>
    where
        F: Update<M, D>,
    {
        let result = self.is_admitted(fix, POSITION_SLACK, FAR_POSITION);
        let result = self.settle(stream, fix, result);
        let shown = self.shown(fix);
        self.fuse(stream, &shown, result)
    }

    /// A fix with the noise that the last ones have shown.
    fn shown<M: Fix>(&mut self, fix: &M) -> M {
        if fix.position().iter().all(|x| x.is_finite()) { self.scatter.fix(fix) } else { *fix }
    }

    /// Adds what a sample of `dt` seconds shows of the acceleration to the scatter of fixes.
    fn scatter(&mut self, dt: f64) {
        match self.best().acceleration() {
            Some(acceleration) => {
                self.scatter.propagate(&acceleration, dt, self.heading_deviation() > UNKNOWN_HEADING)
            }
            None => self.scatter.interrupt(dt),
        }
    }

    /// Learns from a window how quiet motion is, or stops the filters that may be at rest.
    fn rest(&mut self, window: &rest::Window) {
        let Some((speed, deviation)) = self.best().speed() else { return };
        let has_moved = self.best().is_moving();
        if has_moved || speed + PROBABLY * deviation < MOVES {
            self.rest.remember(window, has_moved);
        }
        if self.rest.is_rest(window) && !has_moved {
            let _ = self.each(|filter| {
                filter.stop(&window.bias);
                Ok(())
            });
        }
    }

    /// Returns the log likelihood of a measurement for the best copy, if any copy admits it.
    fn is_admitted<M, const D: usize>(&self, measurement: &M, slack: f64, most: f64) -> Result<f64, Refusal>
    where
        F: Update<M, D>,
    {
        let judged = self.best().judge(measurement, slack)?;
        let fits = |begun: &Begun<F>| begun.filter.judge(measurement, slack).is_ok_and(|judged| judged.nis <= most);
        if judged.nis <= most || self.starts.iter().skip(1).any(fits) {
            return Ok(judged.log_likelihood);
        }
        // Also refuses what is no number.
        Err(Refusal::Gate { nis: judged.nis, limit: most })
    }

    /// Fuses a measurement that is admitted, and weighs the copies by it.
    fn fuse<M, const D: usize>(
        &mut self,
        stream: &mut Stream,
        measurement: &M,
        admitted: Result<f64, Refusal>,
    ) -> Result<Fused, Refusal>
    where
        F: Update<M, D>,
    {
        if let Err(refusal) = admitted {
            let result = Err(refusal);
            stream.count(&result);
            return result;
        }
        let others = *stream;
        let mut answer = Err(Refusal::NotStarted);
        let mut of_parent = 0.0;
        for (i, begun) in self.starts.iter_mut().enumerate() {
            let result = if i == 0 {
                answer = begun.filter.update_ungated(stream, measurement);
                answer
            } else {
                begun.filter.update_ungated(&mut { others }, measurement)
            };
            let log_likelihood = match (&result, &answer) {
                (Ok(fused), _) => fused.log_likelihood,
                (Err(_), Ok(best)) => best.log_likelihood - IMPOSSIBLE,
                (Err(_), Err(_)) => 0.0,
            };
            begun.log_likelihood += log_likelihood;
            if self.search.is_child_of(begun.id) {
                of_parent = log_likelihood;
            }
        }
        let fused = answer?;
        self.search.fuse(&others, measurement, of_parent);
        self.choose();
        Ok(fused)
    }

    /// Puts the best first, drops what is implausible or the same, and goes on with the search.
    fn choose(&mut self) {
        let starts = &mut self.starts;
        let better = |a: &(usize, f64), b: &(usize, f64)| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0));
        let likelihoods = starts.iter().map(|begun| begun.log_likelihood).enumerate();
        if let Some((best, most)) = likelihoods.max_by(better) {
            if most > starts[0].log_likelihood + BETTER {
                starts.swap(0, best);
                self.changes = self.changes.wrapping_add(1);
            }
            let most = starts[0].log_likelihood;
            starts.iter_mut().for_each(|begun| begun.log_likelihood -= most);
        }
        if starts.len() > 1 {
            let best = starts[0].filter;
            let mut is_best = true;
            starts.retain(|begun| {
                core::mem::take(&mut is_best) || begun.log_likelihood > -IMPLAUSIBLE && !best.is_same(&begun.filter)
            });
        }
        if let Some(now_ns) = self.time_ns() {
            let has_moved = self.search.step(&mut self.starts, now_ns);
            self.changes = self.changes.wrapping_add(u32::from(has_moved));
        }
    }

    /// Begins again in several attitudes if a gap has left it unknown.
    fn fork(&mut self) {
        if self.starts.len() > MOST_STARTS {
            // Those that are still compared cover what nobody knows of the heading, and one of them alone would not.
            if self.best().forks().len() <= TURNS as usize {
                return;
            }
            self.starts.truncate(1);
            self.starts[0].filter.forget_attitude();
        }
        let mut forked = Vec::new();
        for begun in &self.starts {
            for (filter, prior) in begun.filter.forks() {
                let log_likelihood = begun.log_likelihood + prior;
                forked.push(Begun { id: forked.len() as u32, filter, log_likelihood });
            }
        }
        if !forked.is_empty() {
            self.starts = forked;
            self.changes = self.changes.wrapping_add(1);
            self.search.drop_neighbours();
            self.newcomer = None;
        }
    }

    /// The reading that is held until `time_ns`, and the doubt in it, if a sample since `since_ns` follows a gap.
    ///
    /// # Errors
    ///
    /// [`Refusal`] if the filter has not started, the sample is not fit, or the gap is too long.
    #[inline]
    pub(in crate::navigation) fn held(
        &self,
        time_ns: i64,
        sample: &ImuMean,
        since_ns: i64,
    ) -> Result<Option<(ImuMean, Doubt)>, Refusal> {
        let (now_ns, longest_s) = (self.time_ns().ok_or(Refusal::NotStarted)?, self.best().longest_sample());
        let is_moving = self.best().is_moving();
        let last = self.last.as_ref().unwrap_or(sample);
        self.holding.held(last, sample, since_ns, longest_s, [now_ns, time_ns], is_moving)
    }

    /// Statistics of what holding a reading has lately done wrong.
    pub(in crate::navigation) fn holding(&self) -> &Holding {
        &self.holding
    }

    /// Calls a function for each filter.
    fn each(&mut self, mut with: impl FnMut(&mut F) -> Result<(), Refusal>) -> Result<(), Refusal> {
        let starts = self.starts.iter_mut().map(|begun| &mut begun.filter);
        let newcomer = self.newcomer.iter_mut().map(|newcomer| &mut newcomer.filter);
        starts.chain(self.search.filters_mut()).chain(newcomer).try_for_each(&mut with)
    }
}

impl<S: States, const N: usize> Copies<EskfFilter<S, N>> {
    /// See [`EskfFilter::set_keyframe`].
    pub fn set_keyframe(&mut self, id: u64) {
        let _ = self.each(|filter| {
            filter.set_keyframe(id);
            Ok(())
        });
    }

    /// See [`EskfFilter::move_world`].
    ///
    /// # Errors
    ///
    /// The same as [`EskfFilter::move_world`].
    pub fn move_world(&mut self, new_from_old: &Isometry3<f64>) -> Result<(), Refusal> {
        self.each(|filter| filter.move_world(new_from_old))?;
        self.scatter.interrupt(0.0);
        Ok(())
    }
}

impl<F: CopiedFilter> Propagate for Copies<F> {
    fn time_ns(&self) -> Option<i64> {
        self.best().time_ns()
    }

    fn admits(&self, sample: &ImuMean) -> Result<(), Refusal> {
        self.best().admits(sample)
    }

    fn propagate_until(&mut self, time_ns: i64, sample: &ImuMean, since_ns: i64) -> Result<(), Refusal> {
        let Some((held, doubt)) = self.held(time_ns, sample, since_ns)? else {
            let part_s = seconds_between(self.time_ns().ok_or(Refusal::NotStarted)?, time_ns)?;
            let part = ImuMean { time_ns, ..*sample };
            self.each(|filter| filter.propagate_until(time_ns, sample, since_ns))?;
            self.holding.add(&part, part_s);
            // A measurement divides a sample into parts that are alike, which say nothing of how much the body vibrates.
            if time_ns == sample.time_ns
                && let Some(window) = self.rest.add(sample, seconds_between(since_ns, time_ns)?)
            {
                self.rest(&window);
            }
            self.scatter(part_s);
            self.last = Some(part);
            return Ok(());
        };
        self.scatter.interrupt(seconds_between(self.time_ns().ok_or(Refusal::NotStarted)?, time_ns)?);
        self.rest.interrupt();
        self.each(|filter| filter.hold(&held, &doubt))?;
        if time_ns == sample.time_ns {
            self.holding.interrupt();
            self.last = Some(*sample);
            self.fork();
        }
        Ok(())
    }
}

/// Returns whether a distance is one on this part of the Earth.
fn is_near(distance: &Vector3<f64>) -> bool {
    is_within(distance, FARTHEST_JUMP)
}
