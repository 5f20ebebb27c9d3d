//! What the Kalman filter alone does; the laws of all filters are checked here for it, too.

use super::{MekfFilter, MekfParams};
use crate::attitude::laws::attitude_laws;
use crate::attitude::{AttitudeFilter, ImuSample};

fn filter(magnetometer: bool) -> MekfFilter {
    MekfFilter::new(MekfParams { magnetometer, ..MekfParams::default() }).unwrap()
}

attitude_laws!(nine_axes: filter(true), six_axes: filter(false));
