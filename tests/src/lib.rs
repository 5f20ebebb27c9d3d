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
    Actuators: "book/src/how-to/actuators.md",
    Attitude: "book/src/how-to/attitude.md",
    Calibrate: "book/src/how-to/calibrate.md",
    Commands: "book/src/how-to/commands.md",
    Components: "book/src/how-to/components.md",
    Drivers: "book/src/how-to/drivers.md",
    Joints: "book/src/how-to/joints.md",
    Kinematics: "book/src/how-to/kinematics.md",
    Mavlink: "book/src/how-to/mavlink.md",
    Metrics: "book/src/how-to/metrics.md",
    Motion: "book/src/how-to/motion.md",
    Programs: "book/src/how-to/programs.md",
    Recording: "book/src/how-to/recording.md",
    Requests: "book/src/how-to/requests.md",
    Settings: "book/src/how-to/settings.md",
    Topics: "book/src/how-to/topics.md",
    TutorialAttitude: "book/src/tutorial/1-attitude.md",
    TutorialTwoImus: "book/src/tutorial/2-two-imus.md",
    TutorialDriver: "book/src/tutorial/3-driver.md",
    TutorialFailingSensors: "book/src/tutorial/4-failing-sensors.md",
    TutorialRover: "book/src/tutorial/5-rover.md",
    TutorialNoSatellites: "book/src/tutorial/6-no-satellites.md",
    Navigation: "book/src/how-to/navigation.md",
    Planar: "book/src/how-to/planar.md",
}
