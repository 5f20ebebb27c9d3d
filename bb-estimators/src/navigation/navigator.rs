//! A filter bank for a robot whose only known characteristics are its data sheets; `bb eval navigation` runs it.

use nalgebra::SMatrix;

use super::bank::Bank;
use super::eskf::{Eskf, EskfParams, GaussMarkov, ImuMean, Start};
use super::fused::Fused;
use super::measurement::{AbsolutePose, BodyVelocity, GnssPosition, RelativePose};
use super::propagate::Propagate;
use super::refusal::Refusal;
use super::state::{Estimate, Optional, States};
use super::stream::{Stream, StreamParams};
use crate::attitude::ParamsError;

/// The capacity of the bank, in filters.
const FILTERS: usize = 36;

/// Factors on the data sheet's gyroscope white noise, to cover vibration, scale errors and a mounting that bends.
const GYROSCOPE: [f64; 4] = [1.0, 3.0, 10.0, 30.0];

/// The same for the accelerometer.
const ACCELEROMETER: [f64; 3] = [1.0, 3.0, 10.0];

/// Factors on the receiver's stated variance of satellite positions: some receivers are conservative.
const GNSS: [f64; 3] = [1.0, 0.25, 0.0625];

/// Factor on the prior weight for each deviation from the data sheets.
const DEPARTURE: f64 = 0.1;

/// States of the [`Navigator`]: those of navigation, a keyframe, and the scale of relative poses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Navigated;

impl States for Navigated {
    const OPTIONAL: &'static [Optional] = &[Optional::Keyframe, Optional::RelativeScale];
}

/// The number of errors of [`Navigated`].
pub const NAVIGATED: usize = Navigated::DIMENSION;

/// The sensors besides the IMU, which determine how the filters of the bank differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aiding {
    /// Satellite positions, and optionally poses.
    Gnss,
    /// Relative poses, and optionally poses and satellite positions.
    RelativePoses,
}

/// Position, velocity and attitude from an IMU, positions, poses and relative poses, without tuning. It is a [`Bank`] of filters
/// whose noise is that of the data sheets and multiples of it. The scale of their relative poses is either 1 or drifts according
/// to [`EskfParams::relative_scale`].
///
/// All 36 filters are stored inline, 210 kB in total: keep a navigator in a `Box` or a `static` where the stack is small.
#[derive(Clone, Debug)]
pub struct Navigator {
    bank: Bank<Navigated, NAVIGATED, FILTERS>,
    gnss: [Stream; FILTERS],
    poses: [Stream; FILTERS],
    relative: [Stream; FILTERS],
    velocities: [Stream; FILTERS],
}

/// One filter of the bank: its noise factors, and whether the scale drifts.
#[derive(Clone, Copy, Debug)]
struct Hypothesis {
    gyroscope: f64,
    accelerometer: f64,
    gnss: f64,
    scale: bool,
}

impl Navigator {
    /// Creates a navigator that has not started. The densities in `params` are those of data sheets.
    ///
    /// # Errors
    ///
    /// Returns the name of the first parameter outside its accepted range.
    pub fn new(params: EskfParams, aiding: Aiding) -> Result<Self, ParamsError> {
        let plain = Eskf::new(params)?;
        let mut filters = [(plain, 0.0); FILTERS];
        // Positions are not gated: an overconfident filter must not reject the evidence against it.
        let open = StreamParams { gate: 0.0, ..StreamParams::default() };
        let mut gnss = [Stream::new(open); FILTERS];
        for (i, slot) in filters.iter_mut().enumerate() {
            let Some(hypothesis) = Hypothesis::number(i, aiding) else { continue };
            *slot = (Eskf::new(hypothesis.apply(&params))?, hypothesis.prior());
            gnss[i] = Stream::new(StreamParams { variance_factor: hypothesis.gnss, ..open });
        }
        let gated = [Stream::default(); FILTERS];
        Ok(Self { bank: Bank::new(filters), gnss, poses: gated, relative: gated, velocities: gated })
    }

    /// Creates a navigator with a single, tuned filter instead of a bank.
    ///
    /// # Errors
    ///
    /// Returns the name of the first parameter outside its accepted range.
    pub fn single(params: EskfParams) -> Result<Self, ParamsError> {
        let mut filters = [(Eskf::new(params)?, 0.0); FILTERS];
        filters[0].1 = 1.0;
        let open = [Stream::new(StreamParams { gate: 0.0, ..StreamParams::default() }); FILTERS];
        let gated = [Stream::default(); FILTERS];
        Ok(Self { bank: Bank::new(filters), gnss: open, poses: gated, relative: gated, velocities: gated })
    }

    /// See [`Eskf::start`].
    ///
    /// # Errors
    ///
    /// The same as [`Eskf::start`].
    pub fn start(&mut self, start: &Start) -> Result<(), Refusal> {
        self.bank.start(start)
    }

    /// See [`Eskf::propagate`].
    ///
    /// # Errors
    ///
    /// The same as [`Eskf::propagate`].
    pub fn propagate(&mut self, sample: &ImuMean) -> Result<(), Refusal> {
        self.bank.propagate(sample)
    }

    /// Fuses a satellite position; see [`Bank::update`].
    ///
    /// # Errors
    ///
    /// The same as [`Bank::update`].
    pub fn gnss_position(&mut self, measurement: &GnssPosition) -> Result<Fused, Refusal> {
        self.bank.update(&mut self.gnss, measurement)
    }

    /// Fuses a pose in the world; see [`Bank::update`].
    ///
    /// # Errors
    ///
    /// The same as [`Bank::update`].
    pub fn absolute_pose(&mut self, measurement: &AbsolutePose) -> Result<Fused, Refusal> {
        self.bank.update(&mut self.poses, measurement)
    }

    /// Fuses a pose relative to the keyframe; see [`Bank::update`].
    ///
    /// # Errors
    ///
    /// The same as [`Bank::update`].
    pub fn relative_pose(&mut self, measurement: &RelativePose) -> Result<Fused, Refusal> {
        self.bank.update(&mut self.relative, measurement)
    }

    /// Fuses the velocity of the body, from wheels; see [`Bank::update`].
    ///
    /// # Errors
    ///
    /// The same as [`Bank::update`].
    pub fn body_velocity(&mut self, measurement: &BodyVelocity) -> Result<Fused, Refusal> {
        self.bank.update(&mut self.velocities, measurement)
    }

    /// See [`Eskf::set_keyframe`].
    pub fn set_keyframe(&mut self, id: u64) {
        self.bank.set_keyframe(id);
    }

    /// See [`Bank::estimate`].
    pub fn estimate(&self) -> Option<(Estimate<NAVIGATED>, SMatrix<f64, NAVIGATED, NAVIGATED>)> {
        self.bank.estimate()
    }

    /// The streams of the most plausible filter: GNSS positions, poses, relative poses, velocities.
    pub fn streams(&self) -> [&Stream; 4] {
        let best = self.bank.best();
        [&self.gnss[best], &self.poses[best], &self.relative[best], &self.velocities[best]]
    }

    /// The parameters of the most plausible filter, which the bank has learnt, and its weight.
    pub fn learnt(&self) -> (Learnt, f64) {
        let best = self.bank.best();
        (self.hypothesis(best), self.bank.weights()[best])
    }

    /// The weight of the filter with these parameters; 0 if there is no such filter or it was dropped.
    pub fn plausibility(&self, learnt: &Learnt) -> f64 {
        let weights = self.bank.weights();
        let found = (0..FILTERS).filter(|i| weights[*i] > 0.0).find(|i| self.hypothesis(*i) == *learnt);
        found.map_or(0.0, |i| weights[i])
    }

    fn hypothesis(&self, i: usize) -> Learnt {
        let sensors = *self.bank.filters()[i].params();
        Learnt { sensors, gnss_variance_factor: self.gnss[i].params().variance_factor }
    }
}

/// The findings of a bank, for use by another estimator of the same robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Learnt {
    /// The parameters of the most plausible filter.
    pub sensors: EskfParams,
    /// The filter's factor on the variance of satellite positions.
    pub gnss_variance_factor: f64,
}

impl Hypothesis {
    /// The filter with this index, if it exists.
    fn number(i: usize, aiding: Aiding) -> Option<Self> {
        let gyroscope = GYROSCOPE[i % GYROSCOPE.len()];
        let i = i / GYROSCOPE.len();
        let accelerometer = ACCELEROMETER[i % ACCELEROMETER.len()];
        let i = i / ACCELEROMETER.len();
        match aiding {
            Aiding::Gnss => Some(Self { gyroscope, accelerometer, gnss: *GNSS.get(i)?, scale: false }),
            Aiding::RelativePoses if i < 2 => Some(Self { gyroscope, accelerometer, gnss: 1.0, scale: i == 1 }),
            Aiding::RelativePoses => None,
        }
    }

    /// The prior weight of the filter; weights need not sum to 1.
    fn prior(self) -> f64 {
        let departs = [self.gyroscope != 1.0, self.accelerometer != 1.0, self.gnss != 1.0, self.scale];
        departs.into_iter().filter(|departs| *departs).map(|_| DEPARTURE).product()
    }

    fn apply(self, params: &EskfParams) -> EskfParams {
        let known = GaussMarkov::constant(0.0);
        EskfParams {
            gyroscope_noise: (params.gyroscope_noise * self.gyroscope).min(10.0),
            accelerometer_noise: (params.accelerometer_noise * self.accelerometer).min(100.0),
            relative_scale: if self.scale { params.relative_scale } else { known },
            ..*params
        }
    }
}

impl Propagate for Navigator {
    fn time_ns(&self) -> Option<i64> {
        self.bank.time_ns()
    }

    fn propagate(&mut self, sample: &ImuMean) -> Result<(), Refusal> {
        self.propagate(sample)
    }

    fn longest_sample(&self) -> f64 {
        self.bank.longest_sample()
    }

    fn propagate_part(&mut self, part: &ImuMean, is_gap: bool) -> Result<(), Refusal> {
        self.bank.propagate_part(part, is_gap)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_learnt_is_as_plausible_as_it_is_said_to_be() {
        for aiding in [Aiding::Gnss, Aiding::RelativePoses] {
            let navigator = Navigator::new(EskfParams::default(), aiding).unwrap();
            let (learnt, plausibility) = navigator.learnt();
            assert!(plausibility > 0.5, "nothing speaks against the data sheets yet: {plausibility}");
            assert_eq!(navigator.plausibility(&learnt), plausibility);
            let sensors = EskfParams { gyroscope_noise: 3.0 * learnt.sensors.gyroscope_noise, ..learnt.sensors };
            let noisier = navigator.plausibility(&Learnt { sensors, ..learnt });
            assert!((noisier / plausibility - DEPARTURE).abs() < 1e-12, "{noisier}");
            let sensors = EskfParams { gravity: 3.0, ..learnt.sensors };
            assert_eq!(navigator.plausibility(&Learnt { sensors, ..learnt }), 0.0, "no such filter");
        }
    }
}
