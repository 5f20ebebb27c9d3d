//! A recording as the messages that a robot gets, in the order of their arrival.

use bb_core::nalgebra::Isometry3;
use bb_core::payload::{GnssFix, Imu, MagneticField, Odometry, Orientation, Pose, RelativePose, Twist};
use bb_estimators::navigation::{Geodetic, LocalFrame};

use crate::disturb::{Disturbances, GNSS, GNSS_HEADING, GNSS_VELOCITY, IMU, MAGNETIC_FIELD};
pub(crate) use crate::disturb::{INPUTS, START, Time};

/// A message to an input of a filter.
#[derive(Clone, Debug)]
pub(crate) enum What {
    Imu(Imu),
    Gnss(GnssFix),
    Odometry(Odometry),
    Pose(Pose),
    Relative(RelativePose),
    MagneticField(MagneticField),
    GnssVelocity(Twist),
    GnssHeading(Orientation),
    Start(Odometry),
}

impl What {
    /// The number of its input among [`INPUTS`].
    pub(crate) fn input(&self) -> usize {
        match self {
            Self::Imu(_) => IMU,
            Self::Gnss(_) => GNSS,
            Self::Odometry(_) => 2,
            Self::Pose(_) => 3,
            Self::Relative(_) => 4,
            Self::MagneticField(_) => MAGNETIC_FIELD,
            Self::GnssVelocity(_) => GNSS_VELOCITY,
            Self::GnssHeading(_) => GNSS_HEADING,
            Self::Start(_) => START,
        }
    }
}

/// A message with its times.
#[derive(Clone, Debug)]
pub(crate) struct Message {
    /// Time at which it reaches the robot.
    pub(crate) arrival_ns: Time,
    /// Time at which it was measured, as its header says.
    pub(crate) stamp_ns: Time,
    pub(crate) what: What,
}

/// The messages and the placement of the sensors.
#[derive(Clone, Debug, Default)]
pub(crate) struct Feed {
    pub(crate) messages: Vec<Message>,
    /// Takes the coordinates of each input's sensor to the link; `None` for an input that the recording lacks.
    pub(crate) mounts: [Option<Isometry3<f64>>; INPUTS.len()],
    /// Place of the world on the Earth, for a filter that takes poses as places there.
    pub(crate) world: Option<LocalFrame>,
}

impl Feed {
    /// Puts the messages in the order in which they arrive: those at one time in the order of their inputs, so that the
    /// sample of the IMU, which makes a filter run, comes last.
    pub(crate) fn sort(&mut self) {
        self.messages.sort_by_key(|message| (message.arrival_ns, message.what.input() == 0));
    }

    /// Returns the messages to an input, without fixes that have no position.
    pub(crate) fn usable(&self, input: &str) -> impl Iterator<Item = &Message> {
        let is_usable = |message: &&Message| match &message.what {
            What::Gnss(fix) => Geodetic::of_fix(fix, 0.0).is_some(),
            _ => true,
        };
        let input = INPUTS.iter().position(|known| *known == input);
        self.messages.iter().filter(move |message| Some(message.what.input()) == input).filter(is_usable)
    }

    /// Returns the first of all times, ns.
    pub(crate) fn first_ns(&self) -> Option<Time> {
        self.messages.iter().map(|message| message.stamp_ns.min(message.arrival_ns)).min()
    }

    /// Makes it harder. Returns the fixes that the filter does not get, with their own stamps.
    ///
    /// # Errors
    /// An option changes nothing; names it.
    pub(crate) fn disturb(&mut self, disturbances: &Disturbances) -> Result<Vec<(Time, GnssFix)>, String> {
        let first_ns = self.messages.iter().map(|message| message.stamp_ns).min().unwrap_or(0);
        let mut disturber = disturbances.of(GNSS, first_ns);
        let mut withheld = Vec::new();
        self.messages.retain_mut(|message| {
            let input = message.what.input();
            let is_kept = disturber.keeps(input, message.stamp_ns);
            match &message.what {
                What::Gnss(fix) if !is_kept => withheld.push((message.stamp_ns, *fix)),
                _ => {}
            }
            let delay_ns = if is_kept { disturber.delay_ns(input) } else { 0 };
            message.stamp_ns += delay_ns;
            message.arrival_ns += delay_ns;
            is_kept
        });
        disturber.check()?;
        self.sort();
        Ok(withheld)
    }
}
