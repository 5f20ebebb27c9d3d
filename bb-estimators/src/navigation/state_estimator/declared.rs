//! The state estimator to declare in `robot!`.

mod input;
mod log;
mod options;
mod output;

pub use input::{
    AnchorReading, AttitudeReport, FactorReading, FeaturesReading, FlightInputs, GpsReport, RelativePoseReading,
    WarmStartReport,
};
pub use log::TracingSink;
pub use options::FlightOptions;
pub use output::{FlightEstimate, FlightEvent, FlightEvents, FlightHealth, FlightOutputs};

use super::{EstimatorOutput, Event, EventKind, EventSink, FlightNavigator, HealthState, Level};
use crate::navigation::estimator::measured::sample;
use bb_core::component::{HandleCall, Info, Request, RequestCodec};
use bb_core::{Context, Estimator, Fault, Payload, Reply};
use input::Mounting;
use std::time::Duration;

/// Position, velocity and attitude of a flight as an estimator of a robot. It is a [`FlightNavigator`] with an IMU, relative poses,
/// poses from satellite images, and the flight controller's GNSS receiver.
///
/// ```
/// # fn main() {}
/// use bb_core::prelude::*;
/// use bb_estimators::StateEstimator;
/// use bb_estimators::navigation::state_estimator::{AnchorReading, GpsReport, RelativePoseReading, WarmStartReport};
///
/// robot! {
///     robot Drone;
///
///     link base {
///         sensor imu: External<Imu>();
///         sensor camera: External<RelativePoseReading>();
///         sensor matcher: External<AnchorReading>();
///         sensor gps: External<GnssFix>();
///         sensor gps_report: External<GpsReport>();
///         sensor state: External<WarmStartReport>();
///         // The smoother takes a millisecond now and then: on a worker it holds up no sample of the IMU.
///         estimator navigation: StateEstimator(strategy = "smoother") {
///             input imu: sensor::base::imu, driver;
///             input vio: sensor::base::camera, optional;
///             input anchor: sensor::base::matcher, optional;
///             input gnss: sensor::base::gps, optional;
///             input gps_health: sensor::base::gps_report, optional;
///             input warm_start: sensor::base::state, optional;
///             output estimate;
///             output health;
///             output events;
///             runs_on: worker;
///         }
///         // Its twin answers with each sample.
///         estimator twin: StateEstimator(strategy = "eskf", output_rate = 200 Hz) {
///             input imu: sensor::base::imu, driver;
///             input vio: sensor::base::camera, optional;
///             input anchor: sensor::base::matcher, optional;
///             output estimate;
///             output health;
///             output events;
///         }
///     }
/// }
/// ```
///
/// It starts in one of three ways: at the origin of the options, at the state from the input `warm_start` with its deviations
/// doubled, or at the first anchor. At the origin it is levelled by the input `attitude`, or once it has been at rest for a second.
/// The body is the IMU, with the axes of the link. The joints give the position of the `gnss` antenna in it.
///
/// The input `features` takes the landmarks that a camera has seen, in place of `vio`, with the lens in the options: see
/// [`FeaturesReading`].
///
/// The input `factor` takes what other providers say of a pose, or of two: see [`FactorReading`].
///
/// All relative poses, anchors, factors, fixes and reports on the receiver that arrive between two samples of the IMU are taken together, as
/// far as there is room for them. If more reports than [`Every::MOST`](bb_core::Every::MOST) wait for a silent IMU, the estimator assumes
/// that those which were lost told of spoofing. On a worker that is held up for so long that its inbox is full, reports are lost like all
/// other messages, which is counted. If the estimator fails and is restarted, the gate is open as at the start.
///
/// Estimates are emitted at the output's rate, with the health. Events at the levels error, warn and info, and keyframes that leave
/// the window, are emitted as they occur, and those still in it at the end and before a restart: record `events` for a flight-data
/// recorder. All events also go to `tracing` as structured fields.
#[derive(Debug)]
pub struct FlightEstimator {
    estimator: FlightNavigator<Sink>,
    mounting: Mounting,
    period_ns: i64,
    /// The last sample of the IMU, and the ticks since then.
    last_ns: i64,
    ticks: i64,
    health: Option<FlightHealth>,
}

/// Logs events, and stores those to be published.
#[derive(Debug, Default)]
struct Sink {
    log: TracingSink,
    events: FlightEvents,
}

impl EventSink for Sink {
    fn event(&mut self, event: &Event) {
        self.log.event(event);
        if event.level() <= Level::Info || matches!(event.kind, EventKind::Keyframe { .. }) {
            self.events.events.push(FlightEvent::of(event));
        }
    }
}

impl FlightEstimator {
    fn reply(&mut self, now_ns: i64) -> Reply<FlightOutputs> {
        let emitted: Option<EstimatorOutput> = self.estimator.tick(now_ns);
        let health = FlightHealth::of(&self.estimator.health());
        let changed = self.health.is_none_or(|before| before.differs(&health));
        let events = std::mem::take(&mut self.estimator.sink_mut().events);
        let outputs = FlightOutputs {
            estimate: emitted.as_ref().map(FlightEstimate::of),
            health: (emitted.is_some() || changed).then_some(health),
            events: (!events.events.is_empty()).then_some(events),
        };
        self.health = outputs.health.or(self.health);
        let is_empty = outputs.estimate.is_none() && outputs.health.is_none() && outputs.events.is_none();
        let reply = if is_empty { Reply::none() } else { Reply::emit(outputs) };
        match health.state {
            HealthState::Lost => reply.diverged("it has no estimate"),
            HealthState::Degraded => reply.diverged("something does not fit, or is missing"),
            HealthState::Init | HealthState::Tracking => reply,
        }
    }
}

impl FlightEstimator {
    /// Passes on the attitude to an estimator that may have none, and the warm start to one that has no position. Others would refuse
    /// them, or have no use for them.
    fn start(&mut self, inputs: &FlightInputs<'_>) {
        let state = self.estimator.health().state;
        if let Some(attitude) = inputs.attitude.filter(|attitude| attitude.is_new() && state == HealthState::Init) {
            let _ = self.estimator.add_attitude(input::attitude(attitude.message()));
        }
        if matches!(state, HealthState::Init | HealthState::Lost)
            && let Some(state) = inputs.warm_start.filter(|state| state.is_new())
            && let Some(state) = input::warm_start(state.message())
        {
            let _ = self.estimator.warm_start(state);
        }
    }
}

/// Request for the last keyframes before the newest, in reverse order of time: see
/// [`FlightNavigator::smoothed_history`]. They are for recorders, and not to be flown with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Payload)]
pub struct SmoothedHistory {
    /// The most keyframes that are wanted.
    pub most: u32,
}

/// Request for the present health, see [`FlightNavigator::health`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HealthSnapshot;

impl HandleCall<SmoothedHistory> for FlightEstimator {
    type Response = Vec<FlightEstimate>;

    // What late samples have changed is recomputed for the answer.
    const RECORD: Option<RequestCodec<SmoothedHistory>> = Some(RequestCodec::bytes());

    fn handle_call(
        &mut self,
        request: SmoothedHistory,
    ) -> Result<(Vec<FlightEstimate>, Reply<FlightOutputs>), Fault> {
        let history = self.estimator.smoothed_history(request.most as usize);
        Ok((history.iter().map(FlightEstimate::of).collect(), Reply::none()))
    }
}

impl HandleCall<HealthSnapshot> for FlightEstimator {
    type Response = FlightHealth;

    fn handle_call(&mut self, _: HealthSnapshot) -> Result<(FlightHealth, Reply<FlightOutputs>), Fault> {
        Ok((FlightHealth::of(&self.estimator.health()), Reply::none()))
    }
}

impl Estimator for FlightEstimator {
    type Options = FlightOptions;
    type Input = FlightInputs<'static>;
    type Output = FlightOutputs;

    fn init(options: FlightOptions, context: &Context) -> Result<Self, Fault> {
        let mounting = Mounting::of(context)?;
        let config = options.config(mounting.body_from_camera)?;
        let mut estimator = FlightNavigator::new(config, Sink::default())?;
        if let Some(origin) = options.origin() {
            estimator.set_takeoff_origin(origin).map_err(|error| Fault::new(error.to_string()))?;
        }
        let period = Duration::from_secs_f64(1.0 / options.output_rate);
        // The IMU may stop. Its consequences must not wait for another sample.
        context.request(Request::Tick(period.max(SLOWEST_LOOK)));
        let period_ns = period.max(SLOWEST_LOOK).as_nanos() as i64;
        Ok(Self { estimator, mounting, period_ns, last_ns: context.now().as_nanos(), ticks: 0, health: None })
    }

    /// Refusals are reported by events.
    fn handle_input(&mut self, inputs: FlightInputs<'_>) -> Result<Reply<FlightOutputs>, Fault> {
        let sample = sample(inputs.imu.message(), &self.mounting.link_from_imu.rotation);
        (self.last_ns, self.ticks) = (sample.time_ns, 0);
        self.start(&inputs);
        let _ = self.estimator.add_imu(&sample);
        // One by one, so that each change of the gate is told.
        for report in input::healths(inputs.gps_health, sample.time_ns) {
            let _ = self.estimator.add_gps_health(report);
        }
        let mounting = &self.mounting;
        // After a silence of the IMU they are many.
        self.estimator.together(|estimator| {
            for vio in inputs.vio {
                let _ = estimator.add_vio(input::vio(vio));
            }
            for image in inputs.features {
                let _ = estimator.add_features(input::features(image));
            }
            for anchor in inputs.anchor.iter().filter_map(input::anchor) {
                let _ = estimator.add_pose_anchor(anchor);
            }
            for factor in inputs.factor.iter().filter_map(input::factor) {
                let _ = estimator.add_given_factor(factor);
            }
            for fix in inputs.gnss.iter().filter_map(|fix| input::fix(fix, mounting)) {
                let _ = estimator.add_gnss(fix);
            }
        });
        Ok(self.reply(sample.time_ns))
    }

    /// Emits the keyframes that are still in the window.
    fn handle_end(&mut self) -> Option<FlightOutputs> {
        self.estimator.finish();
        let events = std::mem::take(&mut self.estimator.sink_mut().events);
        (!events.events.is_empty()).then(|| FlightOutputs { events: Some(events), ..FlightOutputs::default() })
    }

    fn handle_info(&mut self, _: Info) -> Result<Reply<FlightOutputs>, Fault> {
        self.ticks += 1;
        if self.ticks < 2 {
            // The IMU is running, and its samples drive the ticks.
            return Ok(Reply::none());
        }
        Ok(self.reply(self.last_ns.saturating_add(self.ticks.saturating_mul(self.period_ns))))
    }
}

/// Shortest period of the checks for a silent IMU.
const SLOWEST_LOOK: Duration = Duration::from_millis(50);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::navigation::ImuMean;
    use bb_core::Options as _;
    use nalgebra::{Isometry3, Vector3};

    #[test]
    fn history_and_health_are_answered() {
        let options = FlightOptions { origin_latitude: 0.8, ..FlightOptions::defaults() };
        let mut estimator =
            FlightEstimator::init(options, &Context::for_test(&[("imu", Isometry3::identity())])).unwrap();
        let ask = |estimator: &mut FlightEstimator| {
            let (history, _) = estimator.handle_call(SmoothedHistory { most: 3 }).unwrap();
            (history, estimator.handle_call(HealthSnapshot).unwrap().0)
        };
        let (history, health) = ask(&mut estimator);
        assert_eq!((history.len(), health.state, health.keyframes), (0, HealthState::Init, 0));
        for i in 0..1200 {
            let specific_force = Vector3::new(0.0, 0.0, 9.80665);
            let sample = ImuMean { time_ns: i * 5_000_000, angular_velocity: Vector3::zeros(), specific_force };
            let _ = estimator.estimator.add_imu(&sample);
        }
        let (history, health) = ask(&mut estimator);
        assert!(history.len() == 3 && health.keyframes > 3 && health.state != HealthState::Init, "{health:?}");
        assert!(history.is_sorted_by(|a, b| a.time > b.time), "{history:?}");
    }
}
