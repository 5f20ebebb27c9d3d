//! Signs that a recording is wrong, so that the errors are not those of the filters.

use super::Player;
use crate::motion::latency::{self, Oddity};
use crate::motion::{Motion, Sample};
use crate::recording::Recording;
use crate::truths::doubt;
use crate::turns::{Align, TURNED_BY_COMPASS, cause};
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

/// Stamps of the truth, or a unit of the gyroscope, that the turns of both contradict; in words too.
pub(super) fn turn_doubt(recording: &Recording, samples: &[Sample]) -> Option<(Oddity, String)> {
    let zero_ns = samples.first()?.0;
    let truth = samples
        .iter()
        .filter_map(|(time_ns, ..)| Some(((time_ns - zero_ns) as f64 * 1e-9, recording.truth.at(*time_ns).0?)));
    let found = latency::of_orientations(&truth.collect::<Vec<_>>(), &Motion::new(samples, zero_ns))?;
    let said = match found {
        Oddity::Late(latency_s) => latency::remark(latency_s, &recording.imu_topic, "the turns"),
        Oddity::Scaled(times) => latency::scaled(times, &recording.imu_topic),
    };
    Some((found, format!("{}: {said}", recording.truth_topic.as_deref().unwrap_or_default())))
}

/// Explains why no filter agrees with the truth, see [`doubt`].
pub(super) fn truth_doubt(recording: &Recording, players: &[Player], align: Align) -> Option<String> {
    let filters: Vec<_> = players.iter().map(|player| (player.name, &player.compared)).collect();
    let base_from_imu = Isometry3::from_parts(Default::default(), recording.base_from_imu());
    doubt(recording.axes, &filters, recording.truth_topic.as_deref().unwrap_or_default(), |rms, of| {
        let imu = (&*recording.imu_name, &base_from_imu);
        cause(rms, &of.of_body, &of.of_world, imu, align, TURNED_BY_COMPASS, |_| true)
    })
}
