//! Robots of one name in modules of their own, of every visibility, one named as an item of the prelude is.

#![deny(warnings, missing_docs, unreachable_pub)]

use bb_core::prelude::*;

mod inner {
    use bb_core::prelude::*;
    use bb_ui_tests::*;

    robot! {
        /// Robot with a [`Tilt`].
        pub(super) robot Arm;
        link base { sensor imu: Bmi270(bus = "i2c-1") { estimator tilt: Tilt(); } }
    }

    pub(super) mod deep {
        use bb_core::prelude::*;

        robot! {
            /// Deep inside.
            pub(in super::super) robot Arm;
            link base { sensor imu: External<Imu>(); }
        }
    }
}

robot! {
    /// Outside of both.
    #[derive(PartialEq)]
    robot Arm;
    link base { sensor imu: External<Imu>(); }
}

#[test]
fn compiles() {
    assert!(Arm == Arm);
    let _ = (Arm::builder(), arm::sensor::base::imu);
    let _ = (inner::Arm::builder(), inner::arm::sensor::base::imu::tilt);
    let _ = (inner::deep::Arm::builder(), inner::deep::arm::sensor::base::imu);
}
