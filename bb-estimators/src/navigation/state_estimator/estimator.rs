//! The state estimator.

use alloc::boxed::Box;
use alloc::vec::Vec;

use super::emission::Emission;
use super::engine::{Condition, Left};
use super::entry::Payload;
use super::error::{EstimatorError, OriginError, Reason};
use super::event::{Event, EventKind, EventSink, InputKind};
use super::factor::ProvidedFactor;
use super::gate::GateState;
use super::given::GivenFactor;
use super::input::{
    AttitudeReading, FlightControllerState, FlightControllerWindow, GnssReading, GpsHealthReading, ImageFeatures,
    PoseAnchor, TakeoffOrigin, VioOutput,
};
use super::label::{SourceLabel, Sources};
use super::output::{EstimatorHealth, EstimatorOutput, HealthState, number_of};
use super::params::{StateEstimatorConfig, ns};
use super::queue::{Queue, QueueCounts, Told};
use super::strategy::Pose;
use super::world::World;
use crate::attitude::ParamsError;
use crate::navigation::eskf::ImuMean;
use crate::navigation::factor::NavigationFactor;
use crate::navigation::geodesy::LocalFrame;
use crate::navigation::history::past::Key;
use crate::navigation::numbers::LONGEST_LAG_NS;
use crate::navigation::refusal::Refusal;

/// Result of an input that was accepted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Added {
    /// Input that is in the estimate.
    Taken {
        /// Normalised innovation squared over its dimension, if it was measured.
        nis: Option<f64>,
    },
    /// Input that is newer than the last sample of the IMU, and waits for the next one.
    Waits,
}

/// Position, velocity and attitude without satellite navigation, or with it while it is trusted; see the [module](super).
///
/// `K` receives the events. `F` is the type of factors that outside providers add.
#[derive(Debug)]
pub struct FlightNavigator<K = (), F: ProvidedFactor = NavigationFactor> {
    config: StateEstimatorConfig,
    queue: Queue<F>,
    emission: Emission,
    sink: K,
    label: SourceLabel,
    gate: GateState,
    has_failed: bool,
    added: Counts,
}

/// Numbers of inputs that were added since the last estimate.
#[derive(Clone, Copy, Debug, Default)]
struct Counts {
    imu: u32,
    vio: u32,
    poses: u32,
}

impl<K: EventSink, F: ProvidedFactor> FlightNavigator<K, F> {
    /// Creates an estimator that has not started. Most of its memory is allocated here.
    ///
    /// # Errors
    ///
    /// Returns the name of the first parameter that is outside its accepted range.
    pub fn new(config: StateEstimatorConfig, sink: K) -> Result<Self, ParamsError> {
        config.check()?;
        let mut this = Self {
            config,
            queue: Queue::new(&config)?,
            emission: Emission::new(&config),
            sink,
            label: SourceLabel::default(),
            gate: GateState::default(),
            has_failed: false,
            added: Counts::default(),
        };
        this.tell(0, EventKind::Ready { strategy: config.strategy, window: config.params.window });
        Ok(this)
    }

    /// The configuration it was created with.
    pub fn config(&self) -> &StateEstimatorConfig {
        &self.config
    }

    /// The sink that receives events.
    pub fn sink(&self) -> &K {
        &self.sink
    }

    /// The sink that receives events, for changes.
    pub fn sink_mut(&mut self) -> &mut K {
        &mut self.sink
    }

    /// Sets the position of take-off. The start is levelled by the attitude of the flight controller, or at rest.
    ///
    /// # Errors
    ///
    /// [`OriginError`] after the first measurement, or if the position is invalid. The estimator is then unchanged.
    pub fn set_takeoff_origin(&mut self, origin: TakeoffOrigin) -> Result<(), OriginError> {
        if !self.queue.is_empty() {
            return Err(OriginError::AfterMeasurement);
        }
        origin.check().map_err(OriginError::Refused)?;
        self.queue.set_origin(&origin);
        Ok(())
    }

    /// Starts in the air, from the last known state of the flight controller, with its deviations multiplied by
    /// [`warm_inflation`](super::StateEstimatorParams::warm_inflation). While the estimator is running, the state is refused as
    /// [`Reason::Duplicate`].
    ///
    /// # Errors
    ///
    /// [`EstimatorError`]; the estimator is then unchanged.
    pub fn warm_start(&mut self, state: FlightControllerState) -> Result<Added, EstimatorError> {
        let checked = state.check();
        self.add(InputKind::WarmStart, state.attitude.time_ns, checked, Payload::Warm(state), &[])
    }

    /// Adds a relative pose between two frames of a camera, which need not be successive ones: the smoother relates any two of its
    /// window. The scale is known from one frame to the next; for others, it is as uncertain as it may be.
    ///
    /// # Errors
    ///
    /// [`EstimatorError::Degraded`] if it is not in the estimate, or does not fit. [`EstimatorError::Fatal`] if it broke the
    /// estimate, which continues without it at the next tick.
    pub fn add_vio(&mut self, vio: VioOutput) -> Result<Added, EstimatorError> {
        let frames = [vio.from_ns, vio.to_ns];
        self.add(InputKind::Vio, vio.to_ns, vio.check(), Payload::Vio(vio), &frames)
    }

    /// Adds the landmarks that the camera of the configuration has seen in one image. The smoother's window finds where they are; the
    /// filter beside it is told the motion that the window then knows, unless it has a relative pose to the same frame.
    ///
    /// A landmark that does not fit is left out by itself. An image is refused, for the reason of the first, if none of its landmarks
    /// is accepted; the strategy without a window and one without a camera refuse all as [`NotObservable`](Refusal::NotObservable).
    ///
    /// # Errors
    ///
    /// Same as [`add_vio`](Self::add_vio).
    pub fn add_features(&mut self, image: ImageFeatures) -> Result<Added, EstimatorError> {
        let (time_ns, checked) = (image.time_ns, image.check());
        self.add(InputKind::Features, time_ns, checked, Payload::Features(image.features), &[time_ns])
    }

    /// Adds a pose from a satellite image.
    ///
    /// # Errors
    ///
    /// Same as [`add_vio`](Self::add_vio).
    pub fn add_pose_anchor(&mut self, anchor: PoseAnchor) -> Result<Added, EstimatorError> {
        self.add(InputKind::Anchor, anchor.time_ns, anchor.check(), Payload::Anchor(anchor), &[])
    }

    /// Adds a factor of an outside provider directly to the window, at a time. If there are several providers, each has a number.
    ///
    /// # Errors
    ///
    /// Same as [`add_vio`](Self::add_vio).
    pub fn add_factor(&mut self, time_ns: i64, provider: u32, factor: F) -> Result<Added, EstimatorError> {
        self.add(InputKind::Factor, time_ns, Ok(()), Payload::Provided(provider, factor), &[])
    }

    /// Adds a factor of an outside provider that is plain data. Those on two keyframes are for the smoother: the filter, which holds only
    /// the camera's last frame, refuses others as [`NoKeyframe`](Refusal::NoKeyframe). They change neither the label nor the age of the
    /// anchor.
    ///
    /// # Errors
    ///
    /// Same as [`add_vio`](Self::add_vio).
    pub fn add_given_factor(&mut self, factor: GivenFactor) -> Result<Added, EstimatorError> {
        let payload = Payload::Given(Box::new(factor));
        self.add(InputKind::Factor, factor.time_ns, factor.check(), payload, &[])
    }

    /// Adds the data that the flight controller has sent: samples of its IMU, attitudes, and the health and fixes of its receiver.
    /// All inputs are added, even if some fail. However many there are, they leave room for cameras, anchors and factors, so that a
    /// flood of them is not fatal.
    ///
    /// # Errors
    ///
    /// The error of the first input that is not in the estimate: [`EstimatorError::Degraded`], unless a fix broke the estimate.
    pub fn add_fc_imu(&mut self, window: &FlightControllerWindow<'_>) -> Result<(), EstimatorError> {
        let mut first = Ok(());
        let mut note = |result: Result<(), EstimatorError>| first = first.and(result);
        if !window.imu.is_empty() {
            note(self.add_samples(window.imu));
        }
        window.attitudes.iter().for_each(|attitude| note(self.add_attitude(*attitude).map(drop)));
        window.health.iter().for_each(|health| note(self.add_gps_health(*health).map(drop)));
        window.fixes.iter().for_each(|fix| note(self.add_gnss(*fix).map(drop)));
        first
    }

    /// Adds one sample of the IMU. One that is late changes what came since. That is recomputed once it is needed, for all late
    /// samples at once: when the estimate is read or emitted, with the next input that is no sample, and after at most 0.25 s of
    /// further samples. Events that follow from it are told then.
    ///
    /// # Errors
    ///
    /// [`EstimatorError::Degraded`] if it is refused, or follows a gap. The first sample waits until another stamp agrees with its
    /// own.
    pub fn add_imu(&mut self, sample: &ImuMean) -> Result<(), EstimatorError> {
        self.add_samples(core::slice::from_ref(sample))
    }

    fn add_samples(&mut self, samples: &[ImuMean]) -> Result<(), EstimatorError> {
        let mut first = Ok(());
        let mut waits = false;
        if let Some(sample) = samples.first() {
            self.emission.name_flight(number_of(sample));
        }
        for sample in samples {
            let sampled = self.queue.add_sample(sample, &self.config);
            waits = sampled == Ok(true);
            let result = sampled.map(drop).map_err(EstimatorError::from);
            self.drain();
            if let Err(error) = result {
                self.tell(sample.time_ns, EventKind::of(InputKind::Imu, Err(error)));
            }
            first = first.and(result);
        }
        if let (Ok(()), Some(last)) = (first, samples.last()) {
            self.tell(last.time_ns, EventKind::Added { input: InputKind::Imu, nis: None, waits });
        }
        first
    }

    /// Adds an attitude of the flight controller, which levels the start.
    ///
    /// # Errors
    ///
    /// [`EstimatorError::Degraded`] if it is refused.
    pub fn add_attitude(&mut self, attitude: AttitudeReading) -> Result<Added, EstimatorError> {
        self.add(InputKind::Attitude, attitude.time_ns, attitude.check(), Payload::Attitude(attitude), &[])
    }

    /// Adds the flight controller's report on its GNSS receiver.
    ///
    /// # Errors
    ///
    /// [`EstimatorError::Degraded`] if it is refused.
    pub fn add_gps_health(&mut self, reading: GpsHealthReading) -> Result<Added, EstimatorError> {
        self.add(InputKind::Health, reading.time_ns, Ok(()), Payload::Health(reading.health), &[])
    }

    /// Adds a fix of the flight controller's receiver.
    ///
    /// # Errors
    ///
    /// Same as [`add_vio`](Self::add_vio), and [`Reason::Gate`] if the receiver is not trusted.
    pub fn add_gnss(&mut self, fix: GnssReading) -> Result<Added, EstimatorError> {
        self.add(InputKind::Gnss, fix.time_ns, fix.check(), Payload::Gnss(fix), &[])
    }

    /// Adds inputs that have arrived together, such as those that waited for a silent IMU. They are run together once `add` returns,
    /// however late they are, with the same result as one by one. An input that is accepted is therefore [`Added::Waits`], and what
    /// becomes of it is told by an event. An estimate that is read in `add` may lack them.
    pub fn together(&mut self, add: impl FnOnce(&mut Self)) {
        let is_outermost = self.queue.hold();
        add(self);
        if is_outermost {
            self.queue.release(&self.config);
            self.drain();
        }
    }

    fn add(
        &mut self,
        input: InputKind,
        time_ns: i64,
        checked: Result<(), Refusal>,
        payload: Payload<F>,
        frames: &[i64],
    ) -> Result<Added, EstimatorError> {
        let placed = match checked {
            Ok(()) => self.queue.add(time_ns, payload, frames, &self.config),
            Err(refusal) => Err(self.queue.refuse(refusal)),
        };
        self.drain();
        match placed {
            Ok(key) => self.became(key, input),
            Err(reason) => {
                let error = failed(input, reason);
                self.tell(time_ns, EventKind::of(input, Err(error)));
                Err(error)
            }
        }
    }

    /// Result of an input that is in the queue.
    fn became(&mut self, key: Key, input: InputKind) -> Result<Added, EstimatorError> {
        match self.queue.outcome(key) {
            Some(outcome) => outcome.map(|nis| Added::Taken { nis }),
            None => {
                self.tell(key.time_ns, EventKind::Added { input, nis: None, waits: true });
                Ok(Added::Waits)
            }
        }
    }

    fn tell(&mut self, time_ns: i64, kind: EventKind) {
        match kind {
            EventKind::Added { input: InputKind::Imu, waits: false, .. } => self.added.imu += 1,
            EventKind::Added { input: InputKind::Vio | InputKind::Features, waits: false, .. } => {
                self.added.vio += 1
            }
            EventKind::Added { input: InputKind::Anchor, waits: false, .. } => self.added.poses += 1,
            EventKind::Fatal { .. } => self.has_failed = true,
            _ => {}
        }
        let spoof_block = !self.queue.engine().gate().state().is_open();
        self.sink.event(&Event { time_ns, frame_id: self.emission.last_id(), spoof_block, kind });
    }

    /// Passes on the reports of the queue.
    fn drain(&mut self) {
        let mut told = core::mem::take(&mut self.queue.news.told);
        for told in told.drain(..) {
            match told {
                Told::Event(time_ns, kind) => self.tell(time_ns, kind),
                Told::Left(Left { pose, sources, world }) => {
                    let is_smoothed = self.is_smoothing();
                    if let Some(estimate) = self.describe_past(&pose, &sources, &world, is_smoothed) {
                        self.tell(pose.time_ns, EventKind::Keyframe { estimate });
                    }
                }
            }
        }
        self.queue.news.told = told;
        self.look();
    }

    pub(super) fn is_smoothing(&self) -> bool {
        self.config.strategy.is_smoothing()
    }

    /// Reports changes of label and gate.
    fn look(&mut self) {
        let Some(now_ns) = self.queue.newest().map(|newest| newest.time_ns) else { return };
        let gate = self.queue.engine().gate().state();
        if core::mem::discriminant(&gate) != core::mem::discriminant(&self.gate) {
            let from = core::mem::replace(&mut self.gate, gate);
            self.tell(now_ns, EventKind::Gate { from, to: gate });
        }
        let label = self.queue.engine().sources().label(now_ns, &self.config.params);
        if label != self.label {
            let from = core::mem::replace(&mut self.label, label);
            self.tell(now_ns, EventKind::Label { from, to: label });
        }
    }

    /// Emits an estimate at the output's rate. Call it at least at that rate; more often is fine. Returns `None` if no output is
    /// due, or if there is no estimate.
    pub fn tick(&mut self, now_ns: i64) -> Option<EstimatorOutput> {
        if !self.emission.is_due(now_ns) {
            return None;
        }
        self.catch_up();
        let pose = if core::mem::take(&mut self.has_failed) { None } else { self.pose_at(now_ns) };
        let described = pose.and_then(|pose| {
            let sources = *self.queue.engine().sources();
            self.describe(&pose, &sources)
        });
        let output = described.map(|estimate| {
            let started = self.queue.engine().started();
            let (output, warning) = self.emission.emitted(now_ns, estimate, started, &self.config.params);
            if let Some(ratio) = warning {
                self.tell(now_ns, EventKind::CovarianceGrowing { ratio });
            }
            let Counts { imu, vio, poses } = core::mem::take(&mut self.added);
            let smoothed = u32::try_from(self.queue.engine().keyframes()).unwrap_or(u32::MAX);
            self.tell(now_ns, EventKind::Emitted { imu, vio, poses, smoothed });
            output
        });
        if let Some(kind) = self.emission.watch(now_ns, output.is_some(), &self.config.params) {
            self.tell(now_ns, kind);
        }
        output
    }

    /// Recomputes what late samples have changed. All that reads the estimate for a user begins with this.
    fn catch_up(&mut self) {
        if self.queue.catch_up(&self.config) {
            self.drain();
        }
    }

    /// The estimate predicted to a time. Returns `None` if there is no estimate, or if the last sample of the IMU is too old. Up to
    /// 0.2 s before that sample, it is the estimate at the sample, and its time says so; further back, there is none. How often it is
    /// called does not change the estimate.
    pub fn predicted(&mut self, time_ns: i64) -> Option<EstimatorOutput> {
        self.catch_up();
        let pose = self.pose_at(time_ns)?;
        self.describe(&pose, self.queue.engine().sources())
    }

    fn pose_at(&self, time_ns: i64) -> Option<Pose> {
        let newest = self.queue.newest()?;
        let ahead_ns = time_ns.saturating_sub(newest.time_ns);
        if ahead_ns < -LONGEST_LAG_NS || ahead_ns > ns(self.config.params.longest_prediction) {
            // While the clock may have been set back, an old position must not be reported as a new one.
            return None;
        }
        let predictor = self.queue.predictor()?;
        let pose = if ahead_ns > 0 { predictor.pose_at(time_ns, newest) } else { predictor.pose() };
        pose.filter(Pose::is_finite)
    }

    /// The newest keyframe. Later measurements are not in it. `None` before the start, and while the position is lost.
    pub fn current_estimate(&mut self) -> Option<EstimatorOutput> {
        self.catch_up();
        let (pose, sources) = self.queue.engine().newest()?;
        self.describe(&pose, &sources)
    }

    /// Up to `n` keyframes before the newest, in reverse order of time. The smoother's are corrected by later measurements. The
    /// filter's are as originally estimated, with `smoothed` set to `false`. They are for recorders: only the forward estimate may
    /// be sent out.
    pub fn smoothed_history(&mut self, n: usize) -> Vec<EstimatorOutput> {
        self.catch_up();
        let most = n.min(self.config.params.window as usize);
        let (history, is_smoothed) = self.queue.engine_mut().history(most);
        let poses: Vec<(Pose, Sources)> = history.collect();
        let Some(world) = self.queue.engine().world() else { return Vec::new() };
        poses.iter().filter_map(|(pose, sources)| self.describe_past(pose, sources, world, is_smoothed)).collect()
    }

    /// Reports the keyframes that are still in the window as events, the oldest first: for a recorder, at the end of a flight.
    pub fn finish(&mut self) {
        let mut last = self.smoothed_history(usize::MAX);
        last.reverse();
        last.extend(self.current_estimate());
        for estimate in last {
            // Others were reported when the world moved on.
            if estimate.time_ns > self.queue.news.left_ns {
                self.tell(estimate.time_ns, EventKind::Keyframe { estimate });
            }
        }
    }

    /// The last innovation does not belong to a past keyframe.
    fn describe_past(
        &self,
        pose: &Pose,
        sources: &Sources,
        world: &World,
        smoothed: bool,
    ) -> Option<EstimatorOutput> {
        let engine = self.queue.engine();
        let mut estimate = self.emission.describe(pose, sources, world, engine, &self.config.params)?;
        (estimate.smoothed, estimate.quality.nis) = (smoothed, None);
        Some(estimate)
    }

    /// The estimate in the present world, which no later measurement has corrected.
    fn describe(&self, pose: &Pose, sources: &Sources) -> Option<EstimatorOutput> {
        let engine = self.queue.engine();
        self.emission.describe(pose, sources, engine.world()?, engine, &self.config.params)
    }

    /// Health of the estimator, at the last output or later: late samples may not be in it until they are needed, see
    /// [`add_imu`](Self::add_imu).
    pub fn health(&self) -> EstimatorHealth {
        let engine = self.queue.engine();
        let now_ns = self.queue.newest().map_or(i64::MIN, |newest| newest.time_ns);
        let state = match engine.condition() {
            Condition::Starting => HealthState::Init,
            Condition::Lost => HealthState::Lost,
            Condition::Running if self.emission.is_silent() => HealthState::Lost,
            Condition::Running if engine.is_degraded(now_ns) => HealthState::Degraded,
            Condition::Running => HealthState::Tracking,
        };
        EstimatorHealth {
            state,
            keyframes: engine.keyframes(),
            covariance_growing_s: self.emission.growing_s(),
            gate: engine.gate().state(),
            is_fallback_engaged: self.emission.is_fallback_engaged(),
        }
    }

    /// Source of the estimate, at the newest sample of the IMU. Late samples are in it as in [`health`](Self::health).
    pub fn label(&self) -> SourceLabel {
        self.label
    }

    /// The world of factors that outside providers add. `None` before the origin is known. Its origin moves when the robot is more
    /// than 5 km away from it.
    pub fn frame(&mut self) -> Option<&LocalFrame> {
        self.catch_up();
        self.queue.engine().world().map(|world| world.frame())
    }

    /// Counts of inputs by how they arrived.
    pub fn counts(&self) -> &QueueCounts {
        self.queue.counts()
    }

    #[cfg(test)]
    pub(super) fn held(&self) -> [usize; 3] {
        self.queue.held()
    }

    /// The time up to which the engine has run.
    #[cfg(test)]
    pub(super) fn run_ns(&self) -> Option<i64> {
        self.queue.engine().now_ns()
    }
}

/// The error of an input that was refused. Only what belongs to the window can overflow it.
fn failed(input: InputKind, reason: Reason) -> EstimatorError {
    if reason == Reason::Overflow && input.is_of_window() {
        EstimatorError::Fatal(reason)
    } else {
        EstimatorError::Degraded(reason)
    }
}
