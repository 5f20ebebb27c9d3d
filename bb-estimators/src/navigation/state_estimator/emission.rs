//! Emission of estimates at the output's rate, with monitoring of covariance growth and of ticks without an estimate.

use super::engine::Engine;
use super::event::{EventKind, StartedFrom};
use super::factor::ProvidedFactor;
use super::fallback::Watchdog;
use super::input::check_position;
use super::label::{SourceLabel, Sources};
use super::output::{EstimatorOutput, FrameIds, Quality};
use super::params::{StateEstimatorConfig, StateEstimatorParams, ns};
use super::strategy::Pose;
use super::world::{World, turned_pose};
use crate::navigation::math::sqrt;
use crate::navigation::numbers::{REARMED, STEADY_GAIN};
use nalgebra::Matrix6;
use uuid::Uuid;

/// See the module.
#[derive(Debug)]
pub(super) struct Emission {
    period_ns: i64,
    next_ns: Option<i64>,
    ids: FrameIds,
    last_id: Uuid,
    watchdog: Watchdog,
    is_silent: bool,
    last: Option<Norm>,
    growing_since_ns: Option<i64>,
    steady: Option<f64>,
    is_warned: bool,
}

/// The last emitted norm.
#[derive(Clone, Copy, Debug)]
struct Norm {
    time_ns: i64,
    norm: f64,
    /// Traces of the position and rotation blocks.
    traces: [f64; 2],
    label: SourceLabel,
    started: Option<(i64, StartedFrom)>,
}

impl Norm {
    fn of(output: &EstimatorOutput, started: Option<(i64, StartedFrom)>) -> Self {
        let (time_ns, label) = (output.emitted_ns, output.label);
        Self { time_ns, norm: output.covariance.norm(), traces: traces(&output.covariance), label, started }
    }
}

fn traces(covariance: &Matrix6<f64>) -> [f64; 2] {
    [0, 3].map(|first| (first..first + 3).map(|i| covariance[(i, i)]).sum())
}

impl Emission {
    pub(super) fn new(config: &StateEstimatorConfig) -> Self {
        Self {
            period_ns: ns(1.0 / config.params.output_rate).max(1),
            next_ns: None,
            ids: FrameIds::new(config.flight),
            last_id: Uuid::nil(),
            watchdog: Watchdog::default(),
            is_silent: false,
            last: None,
            growing_since_ns: None,
            steady: None,
            is_warned: false,
        }
    }

    /// Sets the number of a flight that has none.
    pub(super) fn name_flight(&mut self, number: u64) {
        self.ids.name(number);
    }

    /// Id of the last output; nil before the first.
    pub(super) fn last_id(&self) -> Uuid {
        self.last_id
    }

    /// Returns whether an output is due. If so, the next one is scheduled.
    pub(super) fn is_due(&mut self, now_ns: i64) -> bool {
        let next_ns = match self.next_ns {
            // Setting the clock back must not stop the output.
            Some(next_ns) if next_ns.saturating_sub(now_ns) <= self.period_ns => next_ns,
            _ => now_ns,
        };
        if now_ns < next_ns {
            return false;
        }
        let following_ns = next_ns.saturating_add(self.period_ns);
        self.next_ns =
            Some(if following_ns > now_ns { following_ns } else { now_ns.saturating_add(self.period_ns) });
        true
    }

    /// An estimate in the form for users. `world` is that of the pose. Its id is assigned when it is emitted.
    pub(super) fn describe<F: ProvidedFactor>(
        &self,
        pose: &Pose,
        sources: &Sources,
        world: &World,
        engine: &Engine<F>,
        params: &StateEstimatorParams,
    ) -> Option<EstimatorOutput> {
        let (position, turn) = world.local(&pose.position);
        // A position that has diverged off the Earth is no estimate.
        check_position(&position).ok()?;
        let covariance = turned_pose(&turn, &pose.covariance);
        let label = sources.label(pose.time_ns, params);
        let anchor_age_ms = sources.age_ns(pose.time_ns).map(|age_ns| age_ns.unsigned_abs() / 1_000_000);
        let quality = Quality {
            label,
            covariance_norm: covariance.norm(),
            anchor_age_ms,
            nis: engine.nis(),
            is_anchor_degraded: engine.is_anchor_degraded(),
        };
        Some(EstimatorOutput {
            frame_id: Uuid::nil(),
            emitted_ns: pose.time_ns,
            time_ns: pose.time_ns,
            position,
            world_from_body: turn * pose.world_from_body,
            velocity: turn * pose.velocity,
            covariance,
            label,
            anchor_age_ms,
            smoothed: false,
            degraded: engine.is_degraded(pose.time_ns),
            resets: engine.resets(),
            quality,
        })
    }

    /// Turns an estimate into an output. `started` is the start that it comes from. Returns the factor by which the covariance has
    /// grown, if that requires a warning.
    pub(super) fn emitted(
        &mut self,
        now_ns: i64,
        estimate: EstimatorOutput,
        started: Option<(i64, StartedFrom)>,
        params: &StateEstimatorParams,
    ) -> (EstimatorOutput, Option<f64>) {
        self.last_id = self.ids.next();
        let mut output = EstimatorOutput { frame_id: self.last_id, emitted_ns: now_ns, ..estimate };
        if let Some(last) = self.last
            && output.label == SourceLabel::DeadReckoned
            && last.label == SourceLabel::DeadReckoned
            // The flight controller knows what another start was uncertain of.
            && last.started == started
        {
            raise(&mut output.covariance, &last);
        }
        output.quality.covariance_norm = output.covariance.norm();
        let norm = Norm::of(&output, started);
        self.growing_since_ns = match (self.last, self.growing_since_ns) {
            // If the clock was set back, the time is measured from there.
            (Some(last), since_ns) if norm.norm > last.norm => {
                Some(since_ns.unwrap_or(last.time_ns).min(norm.time_ns))
            }
            _ => None,
        };
        self.last = Some(norm);
        if norm.label == SourceLabel::SatelliteAnchored {
            let steady = self.steady.get_or_insert(norm.norm);
            *steady += STEADY_GAIN * (norm.norm - *steady);
        }
        let ratio = self.steady.filter(|steady| *steady > 0.0).map_or(1.0, |steady| norm.norm / steady);
        let is_large = ratio > params.growing_covariance;
        let warning = (is_large && !self.is_warned).then_some(ratio);
        self.is_warned = is_large || (self.is_warned && ratio > REARMED * params.growing_covariance);
        (output, warning)
    }

    /// Counts a tick with or without an estimate.
    pub(super) fn watch(
        &mut self,
        now_ns: i64,
        has_estimate: bool,
        params: &StateEstimatorParams,
    ) -> Option<EventKind> {
        self.is_silent = !has_estimate;
        self.watchdog.tick(now_ns, has_estimate, params)
    }

    /// Time for which the norm of the covariance has been growing, s.
    pub(super) fn growing_s(&self) -> f64 {
        let since = self.last.zip(self.growing_since_ns);
        since.map_or(0.0, |(last, since_ns)| last.time_ns.saturating_sub(since_ns) as f64 * 1e-9)
    }

    /// Returns whether there was no estimate at the last tick.
    pub(super) fn is_silent(&self) -> bool {
        self.is_silent
    }

    pub(super) fn is_fallback_engaged(&self) -> bool {
        self.watchdog.is_engaged()
    }
}

/// Margin against rounding, which must not reduce the covariance.
const ABOVE: f64 = 1.0 + 1e-12;

/// Raises a covariance in dead reckoning, where the reported one must not shrink. Reductions by a relative pose, or by the correlation with
/// the velocity, are undone. `D P D` with a diagonal D is a covariance if P is one.
fn raise(covariance: &mut Matrix6<f64>, last: &Norm) {
    let now = traces(covariance);
    let factor = |i: usize| if now[i] < last.traces[i] { sqrt(last.traces[i] / now[i]) * ABOVE } else { 1.0 };
    let factors = [factor(0), factor(1)];
    *covariance = Matrix6::from_fn(|i, j| covariance[(i, j)] * factors[i / 3] * factors[j / 3]);
    let norm = covariance.norm();
    if norm < last.norm {
        *covariance *= last.norm / norm * ABOVE;
    }
}
