//! Tests of whole robots; see the test targets of this crate. The code in the documents is compiled here.

pub mod random;
pub mod recordings;

/// Documents whose code is compiled, and run unless it says `no_run`.
macro_rules! compiled {
    ($($name:ident: $path:literal,)*) => {$(
        #[cfg(doctest)]
        #[doc = include_str!(concat!("../../", $path))]
        struct $name;
    )*};
}

// A test of the architecture checks that each page of the book with code is here.
compiled! {
    Readme: "README.md",
    Components: "book/src/how-to/components.md",
    Attitude: "book/src/how-to/attitude.md",
    Calibrate: "book/src/how-to/calibrate.md",
    Navigation: "docs/navigation.md",
    Kinematics: "book/src/how-to/kinematics.md",
    Motion: "book/src/how-to/motion.md",
    Joints: "book/src/how-to/joints.md",
    Planar: "docs/planar.md",
    Runtime: "book/src/how-to/runtime.md",
    BeamBots: "book/src/coming-from/beam-bots.md",
    Recording: "book/src/how-to/recording.md",
    Settings: "book/src/how-to/settings.md",
    Mavlink: "book/src/how-to/mavlink.md",
    Drivers: "book/src/how-to/drivers.md",
    Programs: "book/src/how-to/programs.md",
    ComingFrom: "book/src/coming-from/ros2.md",
}
