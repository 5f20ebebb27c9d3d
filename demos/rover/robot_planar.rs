//! The robots, each with its filter: an IMU that drives it, wheels, and satellites.

use bb_core::prelude::*;
use bb_estimators::PlanarEkf;

/// Name of the filter in the output.
pub(crate) const FILTER: &str = "PlanarEkf, on a plane";

robot! {
    /// A rover with an antenna on a mast.
    pub(crate) robot Rover;

    link base {
        sensor wheels: External<Odometry>();
        joint bracket: fixed {
            // Upside down and turned by a quarter.
            origin: { xyz: [10 cm, 0 m, 30 cm], rpy: [180 deg, 0 deg, 90 deg] };
            link board { sensor imu: External<Imu>(); }
        }
        joint mast: fixed {
            origin: { xyz: [-50 cm, 20 cm, 1.5 m] };
            link antenna { sensor gnss: External<GnssFix>(); }
        }
        estimator navigation: PlanarEkf(heading_deviation = 3 deg) {
            input imu: sensor::base::bracket::board::imu, driver;
            input gnss: sensor::base::mast::antenna::gnss, optional;
            input odometry: sensor::base::wheels, optional;
            lost_after: 200 ms;
            recover_after: 20;
        }
    }
}

robot! {
    /// The car of a recorded drive: no wheels, and fixes that are those of the IMU.
    pub(crate) robot Car;

    link base {
        sensor imu: External<Imu>();
        sensor gnss: External<GnssFix>();
        estimator navigation: PlanarEkf() {
            input imu: sensor::base::imu, driver;
            input gnss: sensor::base::gnss, optional;
            lost_after: 200 ms;
            recover_after: 20;
        }
    }
}
