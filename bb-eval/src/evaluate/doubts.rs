//! Signs that a recording is wrong, so that the errors are not those of the filters.

use super::Player;
use crate::recording::Recording;
use crate::units::Units;
use bb_estimators::attitude::ImuSample;

/// Adds samples.
pub(super) fn take_units(units: &mut Units, samples: &[ImuSample]) {
    if units.is_full() {
        return;
    }
    for sample in samples {
        units.take_imu(sample.time_ns, sample.angular_velocity, sample.specific_force);
        if let Some(field) = &sample.magnetic_field {
            units.take_field(field);
        }
    }
}

/// Units that look wrong: the errors are then those of the recording, and not of the filters.
pub(super) fn unit_doubts(recording: &Recording, units: &Units) -> Vec<String> {
    let imu = units.of_imu().into_iter().map(|fault| format!("{}: {fault}", recording.imu_topic));
    let magnetometer = recording.magnetometer_topic.as_deref().unwrap_or_default();
    imu.chain(units.of_field().map(|fault| format!("{magnetometer}: {fault}"))).collect()
}

/// The convention that the truth seems to use, if it is another one, judged by the filter that fits it best.
pub(super) fn truth_doubt(recording: &Recording, players: &[Player]) -> Option<String> {
    let verdicts = players.iter().filter_map(|player| Some((player.name, player.truths.verdict(recording.axes)?)));
    let best = verdicts.reduce(|best, other| if other.1.otherwise < best.1.otherwise { other } else { best });
    best.map(|(filter, verdict)| {
        format!(
            "{}: the truth looks to be {}: with it read so, {filter} is off by {:.1} deg, and as it is by {:.1} deg; it \
             should be `world_from_body` in east, north, up",
            recording.truth_topic.as_deref().unwrap_or_default(),
            verdict.name,
            verdict.otherwise.to_degrees(),
            verdict.as_read.to_degrees()
        )
    })
}
