//! Signs that a recording is wrong, so that the errors are not those of the filters.

use super::Player;
use crate::filters::Axes;
use crate::recording::Recording;
use crate::truths::{ALIKE, Verdict};
use crate::turns::{Align, cause};
use crate::units::Units;
use bb_core::nalgebra::Isometry3;
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

/// Explains why no filter agrees with the truth: a rotation of the IMU or of the truth's world, or another convention of
/// the truth, judged by the filter that fits it best. Of what fits, the closest is named.
pub(super) fn truth_doubt(recording: &Recording, players: &[Player], align: Align) -> Option<String> {
    let verdicts = players.iter().filter_map(|player| Some((player, player.truths.verdict(recording.axes)?)));
    let best = verdicts.reduce(|best, other| if other.1.otherwise < best.1.otherwise { other } else { best });
    // With six axes the heading is any.
    let is_whole = recording.axes == Axes::Nine;
    let spread = |player: &Player| player.of_body.mean().map_or(f64::INFINITY, |turn| turn.spread);
    let closest = players.iter().filter(|_| is_whole).min_by(|a, b| spread(a).total_cmp(&spread(b)));
    let explained = closest.and_then(|player| {
        let rms = player.score.rms()?.total.to_radians();
        let least = spread(player).min(player.of_world.mean().map_or(f64::INFINITY, |turn| turn.spread));
        let base_from_imu = Isometry3::from_parts(Default::default(), recording.base_from_imu());
        let said =
            cause(rms, &player.of_body, &player.of_world, &base_from_imu, &recording.imu_name, align, |_| true)?;
        // A convention that fits alike is the more telling one, but for an inverse: on a plane, that of a turned body looks like
        // another turned body.
        let is_closer = |(_, verdict): &(&Player, Verdict)| match verdict.name.starts_with("inverse") {
            true => least <= verdict.otherwise + ALIKE,
            false => least + ALIKE < verdict.otherwise,
        };
        best.as_ref().is_none_or(is_closer).then_some(said)
    });
    explained.or_else(|| {
        let (player, verdict) = best?;
        Some(format!(
            "{}: the truth looks to be {}: with it read so, {} is off by {:.1} deg, and as it is by {:.1} deg; it should be \
             `world_from_body` in east, north, up",
            recording.truth_topic.as_deref().unwrap_or_default(),
            verdict.name,
            player.name,
            verdict.otherwise.to_degrees(),
            verdict.as_read.to_degrees()
        ))
    })
}
