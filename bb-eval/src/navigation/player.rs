//! The common interface to filters while a data set is played.

use super::allocations::counted;
use super::data::{DataSet, Keyframe, nanoseconds};
use super::filters::{Kind, NavigationFilter, NavigationSetting, aiding, params, uses_landmarks};
use super::flown::Flown;
use super::measured::{Answers, Measured};
use super::step::{Known, Observed, Step};
use bb_core::nalgebra::Matrix6;
use bb_estimators::navigation::{
    FixedLagSmoother, ImuMean, LandmarkParams, Learnt, NAVIGATED, NAVIGATION, Navigated, Navigator, Optional,
    POSITION, ROTATION, Refusal, SmootherParams, Start, States, Stream, StreamParams,
};
use std::time::Instant;

/// State of the smoother: navigation and the scale of relative poses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Scaled;

impl States for Scaled {
    const OPTIONAL: &'static [Optional] = &[Optional::RelativeScale];
}

type Smoother = FixedLagSmoother<Scaled, { Scaled::DIMENSION }>;

/// A filter created for a data set.
pub(crate) enum Player {
    Filter(Box<Navigator>),
    Smoother(Box<Smoothed>),
    State(Box<Flown>),
}

/// A smoother and the filters whose noise it takes.
pub(crate) struct Smoothed {
    smoother: Smoother,
    twin: Option<Box<Navigator>>,
    learnt: Option<Learnt>,
    gnss: Stream,
    poses: Stream,
    relative: Stream,
    velocities: Stream,
    landmarks: Stream,
    /// The observations of landmarks since the last step.
    observed: Observed,
    is_watching: bool,
}

impl Player {
    pub(crate) fn new(
        filter: &NavigationFilter,
        data: &DataSet,
        settings: &[NavigationSetting],
        window: usize,
    ) -> Result<Self, String> {
        let sensors = params(data, settings)?;
        let navigator = |is_bank: bool| {
            let made = if is_bank { Navigator::new(sensors, aiding(data)) } else { Navigator::single(sensors) };
            // It is large: move it to the heap early.
            made.map(Box::new).map_err(|error| error.to_string())
        };
        let smoothed = |is_bank: bool| {
            let twin = if is_bank { Some(navigator(true)?) } else { None };
            let params = SmootherParams { sensors, window, ..SmootherParams::default() };
            let mut smoother = Smoother::new(params).map_err(|error| error.to_string())?;
            let camera = data.camera.filter(|_| uses_landmarks(settings));
            if let Some(camera) = camera {
                // Enough for a data set of any density.
                let params = LandmarkParams { landmarks: 2000, ..LandmarkParams::default() };
                smoother.set_camera(camera, params).map_err(|error| error.to_string())?;
            }
            // As in a bank: fixes are not gated.
            let gnss = Stream::new(StreamParams { gate: 0.0, ..StreamParams::default() });
            let gated = Stream::default();
            Ok(Self::Smoother(Box::new(Smoothed {
                smoother,
                twin,
                learnt: None,
                gnss,
                poses: gated,
                relative: gated,
                velocities: gated,
                landmarks: gated,
                observed: Observed::default(),
                is_watching: camera.is_some(),
            })))
        };
        match filter.kind {
            Kind::Bank => navigator(true).map(Self::Filter),
            Kind::Single => navigator(false).map(Self::Filter),
            Kind::Smoother => smoothed(true),
            Kind::SmootherSingle => smoothed(false),
            Kind::State(strategy) => {
                let flown = Flown::new(data, strategy, sensors, window, filter.is_smoother())?;
                Ok(Self::State(Box::new(flown)))
            }
        }
    }

    pub(crate) fn start(&mut self, data: &DataSet) -> Result<(), String> {
        if let Self::State(flown) = self {
            return flown.start(&data.start);
        }
        self.start_filter(&data.start).map_err(|refusal| refusal.to_string())?;
        if let Self::Smoother(smoothed) = self {
            smoothed.observe(&Measured::at(data, 0), 0);
        }
        Ok(())
    }

    fn start_filter(&mut self, start: &Start) -> Result<(), Refusal> {
        match self {
            Self::State(_) => {}
            Self::Filter(navigator) => {
                navigator.start(start)?;
                navigator.set_keyframe(0);
            }
            Self::Smoother(smoothed) => {
                if let Some(twin) = &mut smoothed.twin {
                    twin.start(start)?;
                    twin.set_keyframe(0);
                    smoothed.learn(None);
                }
                smoothed.smoother.start(0, start)?;
            }
        }
        Ok(())
    }

    /// From the previous keyframe to keyframe `k`.
    pub(crate) fn play(
        &mut self,
        data: &DataSet,
        k: usize,
        from: &Keyframe,
        to: &Keyframe,
    ) -> Result<Step, String> {
        let mut step = Step::default();
        if let Self::State(flown) = self {
            flown.play(data, k, from, to, &mut step)?;
            return Ok(step);
        }
        let began = Instant::now();
        // The time is that of the keyframe plus the lengths of the samples since, as the samples' own stamps may
        // jitter.
        let mut time_s = from.time_s;
        for sample in data.samples.get(from.sample..to.sample).unwrap_or_default() {
            time_s += sample.dt;
            let (angular_velocity, specific_force) = (sample.angular_velocity, sample.specific_force);
            let sample = ImuMean { time_ns: nanoseconds(time_s), angular_velocity, specific_force };
            let propagated = match self {
                Self::Filter(navigator) => navigator.propagate(&sample),
                Self::Smoother(smoothed) => smoothed.smoother.propagate(&sample),
                Self::State(_) => Ok(()),
            };
            match propagated {
                Ok(()) => {}
                Err(error @ Refusal::Gap { .. }) => return Err(format!("at {time_s} s: {error}")),
                Err(error) => {
                    step.refused += 1;
                    step.samples.0 += 1;
                    step.samples.1.get_or_insert_with(|| error.to_string());
                }
            }
        }
        step.propagation_s = began.elapsed().as_secs_f64();
        match self {
            Self::Filter(navigator) => {
                step.answer(Measured::at(data, k as u64).filter(navigator));
                if to.is_referred_to {
                    navigator.set_keyframe(k as u64);
                }
                let _ = navigator.estimate();
                step.keyframe_s = began.elapsed().as_secs_f64();
            }
            Self::Smoother(smoothed) => smoothed.play(data, k as u64, (from, to), &mut step)?,
            Self::State(_) => {}
        }
        Ok(step)
    }

    /// The newest keyframe.
    pub(crate) fn newest(&mut self) -> Option<Known> {
        match self {
            Self::Filter(navigator) => {
                let (estimate, covariance) = navigator.estimate()?;
                let pose = |i: usize| if i < 3 { POSITION + i } else { ROTATION + i - 3 };
                let covariance = Matrix6::from_fn(|i, j| covariance[(pose(i), pose(j))]);
                Some(Known::of(&estimate, covariance))
            }
            Self::Smoother(smoothed) => {
                let smoother = &smoothed.smoother;
                Some(Known::of(&smoother.estimate()?, smoother.pose_covariance()?))
            }
            Self::State(flown) => flown.newest(),
        }
    }

    /// The oldest keyframe of a full window, by its number.
    pub(crate) fn oldest(&mut self) -> Option<(usize, Known)> {
        let smoothed = match self {
            Self::Smoother(smoothed) => smoothed,
            Self::State(flown) => return flown.oldest(),
            Self::Filter(_) => return None,
        };
        let smoother = &mut smoothed.smoother;
        if smoother.keyframes().len() < smoother.params().window {
            return None;
        }
        let id = smoother.keyframes().next()?;
        let covariance = smoother.smoothed_covariance(id)?;
        let pose = |i: usize| if i < 3 { POSITION + i } else { ROTATION + i - 3 };
        let covariance = Matrix6::from_fn(|i, j| covariance[(pose(i), pose(j))]);
        Some((usize::try_from(id).ok()?, Known::of(&smoother.smoothed(id)?, covariance)))
    }
}

impl Smoothed {
    fn play(
        &mut self,
        data: &DataSet,
        k: u64,
        ends: (&Keyframe, &Keyframe),
        step: &mut Step,
    ) -> Result<(), String> {
        let measured = Measured::at(data, k);
        if let Some(twin) = &mut self.twin {
            let (from, to) = ends;
            let mut time_s = from.time_s;
            for sample in data.samples.get(from.sample..to.sample).unwrap_or_default() {
                time_s += sample.dt;
                let (angular_velocity, specific_force) = (sample.angular_velocity, sample.specific_force);
                // It refuses what the smoother refuses.
                let _ = twin.propagate(&ImuMean { time_ns: nanoseconds(time_s), angular_velocity, specific_force });
            }
            measured.all(twin);
            if to.is_referred_to {
                twin.set_keyframe(k);
            }
        }
        let began = Instant::now();
        let mut result = Ok(Answers::default());
        let allocations = counted(|| result = self.keyframe(&measured, k));
        step.keyframe_s = began.elapsed().as_secs_f64();
        step.allocations = allocations;
        step.answer(result.map_err(|error: Refusal| format!("keyframe {k}: {error}"))?);
        step.observe(std::mem::take(&mut self.observed));
        self.learn(Some(k));
        Ok(())
    }

    /// All processing at a keyframe.
    fn keyframe(&mut self, measured: &Measured, k: u64) -> Result<Answers, Refusal> {
        let smoother = &mut self.smoother;
        smoother.add_keyframe(k)?;
        let answers = [
            measured.relative.map(|relative| smoother.add(&mut self.relative, k, relative)),
            measured.anchor.map(|anchor| smoother.add(&mut self.poses, k, anchor)),
            measured.fix.map(|fix| smoother.add(&mut self.gnss, k, fix)),
            measured.velocity.map(|velocity| smoother.add(&mut self.velocities, k, velocity)),
        ];
        self.observe(measured, k);
        let smoother = &mut self.smoother;
        smoother.update()?;
        let _ = (smoother.estimate(), smoother.pose_covariance());
        Ok(answers)
    }

    /// Adds the observations of landmarks at a keyframe.
    fn observe(&mut self, measured: &Measured, k: u64) {
        for observation in measured.seen.iter().filter(|_| self.is_watching) {
            self.observed.all += 1;
            if let Err(refusal) = self.smoother.observe(&mut self.landmarks, k, observation) {
                self.observed.refused += 1;
                self.observed.first.get_or_insert(refusal);
            }
        }
    }

    /// Adopts the noise that the filters have found, if its own is implausible in comparison. It then adopts their
    /// estimate as well: smoothing with the wrong noise gave wrong results.
    fn learn(&mut self, keyframe: Option<u64>) {
        let Some(twin) = &self.twin else { return };
        let (learnt, plausibility) = twin.learnt();
        if self.learnt.is_some_and(|learnt| twin.plausibility(&learnt) * IMPLAUSIBLE > plausibility) {
            return;
        }
        self.learnt = Some(learnt);
        // They were created with it, so it is accepted.
        let _ = self.smoother.set_sensors(learnt.sensors);
        self.gnss.set_variance_factor(learnt.gnss_variance_factor);
        if let (Some(k), Some((estimate, covariance))) = (keyframe, twin.estimate()) {
            // Noise that cannot be adopted leaves the smoother unchanged.
            let _ = self.smoother.adopt::<Navigated, NAVIGATED>(k, &estimate, &covariance);
        }
    }
}

/// Odds against the smoother's noise at which it adopts another: strong evidence according to R. E. Kass, A. E.
/// Raftery, "Bayes factors", Journal of the American Statistical Association 90(430), 1995.
const IMPLAUSIBLE: f64 = 10.0;

const _: () = assert!(Scaled::DIMENSION == NAVIGATION + 1);
