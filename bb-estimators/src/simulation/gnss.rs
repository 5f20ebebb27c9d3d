//! A simulated receiver of satellite navigation.

use super::fault::GnssFault;
use super::probe::Probe;
use super::random::{hash, normal};
use crate::navigation::{Geodetic, LocalFrame};
use bb_core::payload::{GeodeticPosition, GnssFix, GnssServices, GnssStatus};
use bb_core::{Fault, MonotonicTime, Options, Reading, Sensor, SensorContext};
use nalgebra::{Matrix3, Vector3};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use std::collections::VecDeque;
use std::f64::consts::{FRAC_PI_2, PI};
use std::time::Duration;

/// A receiver of satellite navigation whose antenna is where it is mounted in the
/// [`SimulatedWorld`](super::SimulatedWorld). The axes of the world are east, north and up.
///
/// It measures at its declared rate, with independent noise in each fix, and publishes a fix after `delay`, with the time at
/// which it was measured.
#[derive(Debug)]
pub struct SimulatedGnss {
    options: SimulatedGnssOptions,
    frame: LocalFrame,
    probe: Probe,
    period: Duration,
    /// Time of the next measurement.
    next: Option<MonotonicTime>,
    /// Fixes that are measured and not published yet.
    waiting: VecDeque<(MonotonicTime, GnssFix)>,
    random: ChaCha8Rng,
}

/// Options of [`SimulatedGnss`]. The noise is that of a receiver without corrections.
#[derive(Clone, Debug, PartialEq, Options)]
pub struct SimulatedGnssOptions {
    /// Latitude of the world's origin. Unit: rad. Default: 48.1°.
    #[option(default = 48.1_f64.to_radians(), range = -FRAC_PI_2..=FRAC_PI_2, unit = "rad")]
    pub latitude: f64,
    /// Longitude of the world's origin. Unit: rad. Default: 11.6°.
    #[option(default = 11.6_f64.to_radians(), range = -PI..=PI, unit = "rad")]
    pub longitude: f64,
    /// Height of the world's origin above the ellipsoid. Unit: m. Default: 520 m.
    #[option(default = 520.0, range = -1000.0..=100_000.0, unit = "m")]
    pub height: f64,
    /// Standard deviation of a fix to the east and to the north. Unit: m. Default: 0.5 m.
    #[option(default = 0.5, range = 0.0..=1000.0, unit = "m")]
    pub horizontal_noise: f64,
    /// Standard deviation of a fix in height. Unit: m. Default: 1 m.
    #[option(default = 1.0, range = 0.0..=1000.0, unit = "m")]
    pub vertical_noise: f64,
    /// Delay from the measurement until it is published. Unit: s. Default: 0.
    #[option(default = Duration::ZERO)]
    pub delay: Duration,
    /// Chooses the noise. Default: 0.
    #[option(default = 0)]
    pub seed: u64,
}

impl Sensor for SimulatedGnss {
    type Options = SimulatedGnssOptions;
    type Output = GnssFix;

    fn init(options: SimulatedGnssOptions, context: &SensorContext) -> Result<Self, Fault> {
        let period = context.period_s().and_then(|period_s| Duration::try_from_secs_f64(period_s).ok());
        let period = period.ok_or_else(|| Fault::permanent("it measures at a rate; declare `rate`"))?;
        let origin = Geodetic { latitude: options.latitude, longitude: options.longitude, height: options.height };
        Ok(Self {
            frame: LocalFrame::new(origin),
            probe: Probe::new(context)?,
            period,
            next: None,
            waiting: VecDeque::new(),
            random: ChaCha8Rng::seed_from_u64(options.seed ^ hash(context.path())),
            options,
        })
    }

    fn read(&mut self, now: MonotonicTime) -> Result<Reading<GnssFix>, Fault> {
        let mut next = self.next.unwrap_or(now);
        if now >= next {
            let fix = self.measure(now)?;
            self.waiting.push_back((now, fix));
            // In real time it may be read late; the fixes that it missed are left out.
            while next <= now {
                next = next + self.period;
            }
            self.next = Some(next);
        }
        let delay = self.options.delay;
        let is_due = self.waiting.front().is_some_and(|(time, _)| *time + delay <= now);
        let ready = if is_due { self.waiting.pop_front() } else { None };
        let reading = ready.map_or_else(Reading::nothing, |(time, fix)| Reading::at(time, fix));
        let published = self.waiting.front().map(|(time, _)| *time + delay);
        Ok(reading.next_at(published.map_or(next, |published| published.min(next))))
    }
}

impl SimulatedGnss {
    fn measure(&mut self, now: MonotonicTime) -> Result<GnssFix, Fault> {
        let (world_from_antenna, _) = self.probe.read(now)?;
        let SimulatedGnssOptions { horizontal_noise, vertical_noise, .. } = self.options;
        let deviation = Vector3::new(horizontal_noise, horizontal_noise, vertical_noise);
        // Drawn in any case: what fails does not change the noise of what follows.
        let noise = deviation.component_mul(&normal(&mut self.random));
        let services = GnssServices { gps: true, ..GnssServices::default() };
        let offset = match self.probe.world.gnss_fault(self.probe.path()) {
            GnssFault::None => Vector3::zeros(),
            GnssFault::Offset(offset) => offset,
            GnssFault::Outage => {
                return Ok(GnssFix {
                    status: GnssStatus::NoFix,
                    services,
                    position: None,
                    position_covariance: None,
                });
            }
        };
        let place = self.frame.geodetic(&(world_from_antenna.translation.vector + offset + noise));
        Ok(GnssFix {
            status: GnssStatus::Fix,
            services,
            position: Some(GeodeticPosition {
                latitude_rad: place.latitude,
                longitude_rad: place.longitude,
                altitude: Some(place.height),
            }),
            position_covariance: Some(Matrix3::from_diagonal(&deviation.component_mul(&deviation))),
        })
    }
}
