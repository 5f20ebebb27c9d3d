//! Samples of an IMU and readings of a magnetometer, each disturbed, and joined again as a robot joins them.

use crate::disturb::{Disturbances, Disturber, IMU, MAGNETIC_FIELD, Time};
use bb_core::nalgebra::Vector3;
use bb_estimators::attitude::ImuSample;
use std::collections::VecDeque;

/// Disturbed samples. A sample has the newest reading that has come since the one before.
#[derive(Debug)]
pub(super) struct Rejoined<'a> {
    disturber: Disturber<'a>,
    samples: VecDeque<ImuSample>,
    fields: VecDeque<(Time, Vector3<f64>)>,
    /// The time by which readings come later, ns.
    field_delay_ns: Time,
}

impl<'a> Rejoined<'a> {
    /// `None` if nothing is disturbed.
    pub(super) fn new(disturbances: &'a Disturbances, first_ns: Time) -> Option<Self> {
        let disturber = disturbances.of(MAGNETIC_FIELD, first_ns);
        let fields = VecDeque::new();
        (!disturbances.is_none()).then(|| Self { disturber, samples: VecDeque::new(), fields, field_delay_ns: 0 })
    }

    /// Replaces samples, in the order of time, by those that are complete until now: all of them at the end.
    pub(super) fn replace(&mut self, samples: &mut Vec<ImuSample>, is_end: bool) {
        let mut known_ns = Time::MIN;
        for mut sample in samples.drain(..) {
            known_ns = sample.time_ns;
            if let Some(field) = sample.magnetic_field.take()
                && self.disturber.keeps(MAGNETIC_FIELD, known_ns)
            {
                self.field_delay_ns = self.disturber.delay_ns(MAGNETIC_FIELD);
                self.fields.push_back((known_ns + self.field_delay_ns, field));
            }
            if self.disturber.keeps(IMU, known_ns) {
                sample.time_ns += self.disturber.delay_ns(IMU);
                self.samples.push_back(sample);
            }
        }
        let known_ns = known_ns.saturating_add(self.field_delay_ns);
        while let Some(mut sample) = self.samples.pop_front_if(|sample| is_end || sample.time_ns <= known_ns) {
            while let Some((_, field)) = self.fields.pop_front_if(|(time_ns, _)| *time_ns <= sample.time_ns) {
                sample.magnetic_field = Some(field);
            }
            samples.push(sample);
        }
    }

    /// Returns whether the field is withheld at a time.
    pub(super) fn is_out(&self, time_ns: Time) -> bool {
        self.disturber.is_out(time_ns)
    }

    /// Checks that each option has changed something.
    ///
    /// # Errors
    /// The option that has not, in words.
    pub(super) fn check(&self) -> Result<(), String> {
        self.disturber.check()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Time = 1_000_000;

    /// Twenty samples 10 ms apart, each with the number of its reading.
    /// Times of samples, with the field where they have one.
    type Fields = Vec<(Time, Option<f64>)>;

    fn rejoined(disturbances: &Disturbances) -> (Fields, Result<(), String>) {
        let mut rejoined = Rejoined::new(disturbances, 0).expect("something is disturbed");
        let mut all = Vec::new();
        // In blocks, as a recording is read.
        for block in 0..4 {
            let sample = |index: i64| ImuSample {
                time_ns: index * 10 * MS,
                angular_velocity: Vector3::zeros(),
                specific_force: Vector3::zeros(),
                magnetic_field: Some(Vector3::repeat(index as f64)),
            };
            let mut samples: Vec<_> = (block * 5..block * 5 + 5).map(sample).collect();
            rejoined.replace(&mut samples, block == 3);
            all.extend(
                samples.iter().map(|sample| (sample.time_ns / MS, sample.magnetic_field.map(|field| field.x))),
            );
        }
        (all, rejoined.check())
    }

    #[test]
    fn readings_are_late_early_or_withheld() {
        let late =
            |text: &str| Disturbances { delay: vec![text.parse().expect("is one")], ..Disturbances::default() };
        let (samples, checked) = rejoined(&late("magnetic_field=25ms"));
        assert_eq!(checked, Ok(()));
        assert_eq!(samples[..5], [(0, None), (10, None), (20, None), (30, Some(0.0)), (40, Some(1.0))]);
        assert_eq!(samples.len(), 20);
        let (samples, _) = rejoined(&late("magnetic_field=-20ms"));
        assert_eq!(samples[..2], [(0, Some(2.0)), (10, Some(3.0))]);
        assert_eq!(samples[17..], [(170, Some(19.0)), (180, None), (190, None)]);
        // Those of the IMU come later, and find newer readings.
        let (samples, _) = rejoined(&late("imu=20ms"));
        assert_eq!(samples[..2], [(20, Some(2.0)), (30, Some(3.0))]);

        let outage = Disturbances { outage: "50ms/100ms".parse().ok(), ..Disturbances::default() };
        let (samples, _) = rejoined(&outage);
        assert_eq!(samples.iter().filter(|(_, field)| field.is_none()).count(), 10);
        assert_eq!((samples[4].1, samples[5].1, samples[10].1), (Some(4.0), None, Some(10.0)));
        let every = Disturbances { every: Some(4), ..Disturbances::default() };
        assert_eq!(rejoined(&every).0.iter().filter(|(_, field)| field.is_some()).count(), 5);
        let drop =
            Disturbances { drop: vec!["imu=30ms/100ms".parse().expect("is one")], ..Disturbances::default() };
        let (samples, _) = rejoined(&drop);
        // The readings go on, and the newest meets the next sample.
        assert_eq!((samples.len(), samples[6..8].to_vec()), (14, vec![(60, Some(6.0)), (100, Some(10.0))]));
    }

    #[test]
    fn what_changes_nothing_is_named() {
        let drop =
            Disturbances { drop: vec!["gnss=30ms/100ms".parse().expect("is one")], ..Disturbances::default() };
        let fault = rejoined(&drop).1.expect_err("there are no fixes");
        assert_eq!(fault, "--drop changes nothing: no message of `gnss` falls in it");
        let long = Disturbances { outage: "30s/90s".parse().ok(), ..Disturbances::default() };
        assert!(rejoined(&long).1.expect_err("it is shorter").starts_with("--outage changes nothing"));
    }
}
