//! How large the window is, and how it is solved.

use crate::navigation::eskf::EskfParams;
use crate::params::{Params, ParamsError};

/// The tuning of [`FixedLagSmoother`](super::FixedLagSmoother).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmootherParams {
    /// The noise of the IMU and of optional states, gravity and gaps, as of the filter.
    pub sensors: EskfParams,
    /// How many keyframes are held.
    ///
    /// Small: measurements that come later are refused, and nothing is corrected in hindsight. Large: costs memory, about
    /// 25 kB a keyframe, and time where much is linearised again. From 2 to 1000.
    ///
    /// Unit: keyframes. Default: 20. Source: two seconds of a visual odometry.
    pub window: usize,
    /// How many factors a keyframe takes, those to the one before included; more are refused.
    ///
    /// Small: a provider that floods is stopped sooner. Large: costs memory. From 1 to 10,000.
    ///
    /// Unit: factors. Default: 16. Source: a few of every kind.
    pub factors: usize,
    /// A keyframe whose rotation is off by more from where it was linearised is linearised again.
    ///
    /// Small: as exact as a batch, at its cost. Large: errors of the second order stay. From 0 to 1.
    ///
    /// Unit: rad. Default: 0.01: it leaves 5e-5 rad. Source: below the noise of any attitude.
    pub relinearise_rotation: f64,
    /// The same of the position. Only factors that are not linear in it need it, ranges for instance.
    ///
    /// Small: as exact as a batch, at its cost. Large: errors of the second order stay. From 0 to 1e9.
    ///
    /// Unit: m. Default: 5. Source: ranges to beacons a hundred metres off, to within 0.1 m.
    pub relinearise_position: f64,
    /// How often an update may linearise again before it leaves the rest to the next.
    ///
    /// Small: bounds the time of an update. Large: as exact as a batch, at its cost. From 0 to 100.
    ///
    /// Unit: times. Default: 2. Source: the Gauss–Newton method converges within two so close to the solution.
    pub iterations: usize,
}

impl Default for SmootherParams {
    fn default() -> Self {
        Self {
            sensors: EskfParams::default(),
            window: 20,
            factors: 16,
            relinearise_rotation: 0.01,
            relinearise_position: 5.0,
            iterations: 2,
        }
    }
}

impl SmootherParams {
    pub(super) fn check(&self) -> Result<(), ParamsError> {
        self.sensors.check()?;
        accept("window", self.window as f64, (2.0, 1000.0), "keyframes")?;
        accept("factors", self.factors as f64, (1.0, 1e4), "")?;
        accept("relinearise_rotation", self.relinearise_rotation, (0.0, 1.0), "rad")?;
        accept("relinearise_position", self.relinearise_position, (0.0, 1e9), "m")?;
        accept("iterations", self.iterations as f64, (0.0, 100.0), "")
    }
}

fn accept(
    parameter: &'static str,
    value: f64,
    (min, max): (f64, f64),
    unit: &'static str,
) -> Result<(), ParamsError> {
    if (min..=max).contains(&value) { Ok(()) } else { Err(ParamsError { parameter, value, min, max, unit }) }
}
