//! Size of the window and settings of the solver.

use super::kernel::Kernel;
use crate::navigation::eskf::EskfParams;
use crate::params::{Params, ParamsError};

/// The tuning of [`FixedLagSmoother`](super::FixedLagSmoother).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmootherParams {
    /// The noise of the IMU and of optional states, gravity and gaps, as of the filter.
    pub sensors: EskfParams,
    /// Number of keyframes that are held.
    ///
    /// Small: measurements that come later are refused, and nothing is corrected in hindsight. Large: costs memory, about
    /// 25 kB a keyframe, and time where much is linearised again. From 2 to 1000.
    ///
    /// Unit: keyframes. Default: 20. Source: two seconds of a visual odometry.
    pub window: usize,
    /// Number of factors that a keyframe takes, those to the one before included; more are refused.
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
    /// Change of the position beyond which a keyframe is linearised again. Only factors that are not linear in it need
    /// it, ranges for instance.
    ///
    /// Small: as exact as a batch, at its cost. Large: errors of the second order stay. From 0 to 1e9.
    ///
    /// Unit: m. Default: 5. Source: ranges to beacons a hundred metres off, to within 0.1 m.
    pub relinearise_position: f64,
    /// Number of times that an update may linearise again before it leaves the rest to the next.
    ///
    /// Small: bounds the time of an update. Large: as exact as a batch, at its cost. From 0 to 100. At 0 nothing is linearised again,
    /// and an update that moves a keyframe beyond its threshold has not converged.
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

/// Use of landmarks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LandmarkParams {
    /// Number of landmarks that are held at once; more are refused.
    ///
    /// Small: landmarks are refused although their tracks would help. Large: costs memory, about 4 kB each with a window of
    /// 20. From 1 to 100,000.
    ///
    /// Unit: landmarks. Default: 512. Source: 100 in each image, with tracks of 10 keyframes in a window of 20.
    pub landmarks: usize,
    /// Largest number of landmarks that keep what is known of them when their track outlives the window; others begin
    /// again then, as if unknown.
    ///
    /// Small: long tracks are cut, so the estimate drifts more. Large: costs time, as each is an unknown of its own,
    /// and memory, 0.4 MB at 32 and 150 MB at 1000. From 0 to 1000.
    ///
    /// Unit: landmarks. Default: 32. Source: every long track among 30 landmarks an image; more reduce errors little.
    pub persistent: usize,
    /// The angle between two directions from which a landmark can be triangulated; those with a guess need none.
    ///
    /// Small: landmarks are used sooner, where their distance is a guess. Large: later. From 1e-4 to 1.
    ///
    /// Unit: rad. Default: 0.02. Source: at 0.1° of noise, a distance known to a tenth.
    pub parallax: f64,
    /// Weight of an observation that does not fit once it has passed the gate.
    ///
    /// Default: Huber's with 1.345·√2, as an observation has two numbers.
    pub kernel: Kernel,
    /// A landmark that is off by more of its distance from where it was linearised is linearised again.
    ///
    /// Small: as exact as a batch, at its cost. Large: errors of the second order stay. From 0 to 1.
    ///
    /// Default: 0.01. Source: leaves 1e-4 of the distance to the principal point, a twentieth of a pixel.
    pub relinearise: f64,
    /// After how many refusals in a row an id is taken to be that of another landmark now, and begins afresh.
    ///
    /// Small: a few wrong matches cost a landmark. Large: an id that was reused is refused for longer. From 1 to 1000.
    ///
    /// Unit: observations. Default: 3.
    pub patience: u32,
}

impl Default for LandmarkParams {
    fn default() -> Self {
        let kernel = Kernel::Huber(1.9);
        Self { landmarks: 512, persistent: 32, parallax: 0.02, kernel, relinearise: 0.01, patience: 3 }
    }
}

impl LandmarkParams {
    pub(super) fn check(&self) -> Result<(), ParamsError> {
        accept("landmarks", self.landmarks as f64, (1.0, 1e5), "")?;
        accept("persistent", self.persistent as f64, (0.0, 1000.0), "")?;
        accept("parallax", self.parallax, (1e-4, 1.0), "rad")?;
        accept("relinearise", self.relinearise, (0.0, 1.0), "")?;
        accept("patience", f64::from(self.patience), (1.0, 1000.0), "")
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
