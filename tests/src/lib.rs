//! Tests of whole robots; see the test targets of this crate. The code in the documents is compiled here.

pub mod random;
pub mod recordings;

#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
struct Readme;

#[cfg(doctest)]
#[doc = include_str!("../../docs/components.md")]
struct Components;

#[cfg(doctest)]
#[doc = include_str!("../../docs/attitude.md")]
struct Attitude;

#[cfg(doctest)]
#[doc = include_str!("../../docs/calibrate.md")]
struct Calibrate;

#[cfg(doctest)]
#[doc = include_str!("../../docs/navigation.md")]
struct Navigation;

#[cfg(doctest)]
#[doc = include_str!("../../docs/kinematics.md")]
struct Kinematics;

#[cfg(doctest)]
#[doc = include_str!("../../docs/motion.md")]
struct Motion;

#[cfg(doctest)]
#[doc = include_str!("../../docs/joints.md")]
struct Joints;

#[cfg(doctest)]
#[doc = include_str!("../../docs/planar.md")]
struct Planar;

#[cfg(doctest)]
#[doc = include_str!("../../docs/runtime.md")]
struct Runtime;

#[cfg(doctest)]
#[doc = include_str!("../../docs/beam-bots.md")]
struct BeamBots;

#[cfg(doctest)]
#[doc = include_str!("../../docs/recording.md")]
struct Recording;

#[cfg(doctest)]
#[doc = include_str!("../../docs/settings.md")]
struct Settings;

#[cfg(doctest)]
#[doc = include_str!("../../docs/mavlink.md")]
struct Mavlink;

#[cfg(doctest)]
#[doc = include_str!("../../docs/drivers.md")]
struct Drivers;

#[cfg(doctest)]
#[doc = include_str!("../../docs/programs.md")]
struct Programs;

#[cfg(doctest)]
#[doc = include_str!("../../docs/coming-from.md")]
struct ComingFrom;
