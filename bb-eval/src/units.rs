//! Detects units that look wrong, from the usual range of the quantities on Earth.

mod gyroscope;

use bb_core::nalgebra::Vector3;

/// Samples kept for the verdict: minutes of a fast IMU, with bounded memory.
const MOST: usize = 200_000;

/// Values collected from the messages of a topic.
#[derive(Debug, Default)]
pub struct Units {
    /// Time in seconds, angular velocity, specific force.
    imu: Vec<(f64, Vector3<f64>, Vector3<f64>)>,
    /// Norms of magnetic fields.
    fields: Vec<f64>,
    pressures: Vec<f64>,
}

/// The range of a quantity in a unit that is not SI: from, to, and the unit it looks like.
type Guess = (f64, f64, &'static str);

const FORCES: [Guess; 3] =
    [(0.8, 1.2, "in g"), (800.0, 1200.0, "in mg"), (0.0, 0.5, "free of gravity, which the filters need")];
/// The range plausible as m/s².
const FORCE: (f64, f64) = (8.8, 11.5);

/// Bounds for a body that never rests, a runner's say: the median then has 5 to 30 m/s².
const MOVING_FORCES: [Guess; 2] = [(0.5, 3.0, "in g"), (500.0, 3000.0, "in mg")];
const MOVING: (f64, f64) = (3.0, 100.0);

/// A body rests where the force deviates by less than this part of it.
const STILL: f64 = 0.01;

/// The Earth's field is 22 to 67 µT; with disturbances 10 to 150 µT.
const FIELDS: [Guess; 5] = [
    (0.1, 1.5, "in gauss"),
    (10.0, 150.0, "in µT"),
    (0.01, 0.1, "in mT"),
    (150.0, 1500.0, "in milligauss"),
    (1e4, 1.5e5, "in nT"),
];
const FIELD: (f64, f64) = (1e-5, 1.5e-4);
/// Offsets of the field of the magnets in a phone, which a calibration takes out, T.
const OFFSET: std::ops::Range<f64> = 1.5e-4..2e-3;

const PRESSURES: [Guess; 2] = [(300.0, 1100.0, "in hPa"), (30.0, 110.0, "in kPa")];
/// Pressures from the top of the highest mountain to some metres under water, Pa.
const PRESSURE_PA: (f64, f64) = (3e4, 2e5);

impl Units {
    /// Returns whether enough is collected.
    pub fn is_full(&self) -> bool {
        [self.imu.len(), self.fields.len(), self.pressures.len()].contains(&MOST)
    }

    /// Adds a sample of an IMU: its time in nanoseconds, its angular velocity and its specific force.
    pub fn take_imu(&mut self, time_ns: i64, rate: Vector3<f64>, force: Vector3<f64>) {
        if rate.iter().chain(&force).all(|value| value.is_finite()) && self.imu.len() < MOST {
            self.imu.push((time_ns as f64 * 1e-9, rate, force));
        }
    }

    /// Adds a reading of a magnetometer.
    pub fn take_field(&mut self, field: &Vector3<f64>) {
        self.keep(field.norm(), |units| &mut units.fields);
    }

    /// Adds a reading of a barometer.
    pub fn take_pressure(&mut self, pressure: f64) {
        self.keep(pressure, |units| &mut units.pressures);
    }

    fn keep(&mut self, value: f64, list: fn(&mut Self) -> &mut Vec<f64>) {
        if value.is_finite() && list(self).len() < MOST {
            list(self).push(value);
        }
    }

    /// Remarks on the IMU and the magnetometer, each with its topic.
    #[cfg(feature = "recordings")]
    pub(crate) fn of_topics(&self, imu: &str, magnetometer: Option<&str>) -> Vec<String> {
        let of_imu = self.of_imu().into_iter().map(|fault| format!("{imu}: {fault}"));
        let magnetometer = magnetometer.unwrap_or_default();
        of_imu.chain(self.of_field().map(|fault| format!("{magnetometer}: {fault}"))).collect()
    }

    /// Remarks on the specific force and the angular velocity.
    pub fn of_imu(&self) -> Vec<String> {
        let forces: Vec<f64> = self.imu.iter().map(|(_, _, force)| force.norm()).collect();
        let calm = calm(&forces);
        let still: Vec<f64> =
            calm.iter().filter(|(deviation, _)| *deviation < STILL).map(|(_, mean)| *mean).collect();
        let force = match still.is_empty() {
            // It never rests: only a unit of another order shows.
            true => guess("the specific force", forces, MOVING, &MOVING_FORCES, "m/s²"),
            false => guess("the specific force", still, FORCE, &FORCES, "m/s²"),
        };
        let mut means: Vec<f64> = calm.into_iter().map(|(_, mean)| mean).collect();
        means.sort_by(f64::total_cmp);
        let gravity = means.get(means.len() / 2).copied();
        force.into_iter().chain(gyroscope::verdict(&self.imu, gravity)).collect()
    }

    /// A remark on the magnetic field.
    pub fn of_field(&self) -> Option<String> {
        let mut fields = self.fields.clone();
        fields.sort_by(f64::total_cmp);
        let median = fields.get(fields.len() / 2).copied().filter(|median| OFFSET.contains(median));
        match median {
            Some(median) => Some(format!(
                "the magnetic field has a median of {:.0} µT, and the Earth's has 22 to 67: the magnetometer is not \
                 calibrated",
                median * 1e6
            )),
            None => guess("the magnetic field", fields, FIELD, &FIELDS, "T"),
        }
    }

    /// A remark on the pressure.
    pub fn of_pressure(&self) -> Option<String> {
        guess("the pressure", self.pressures.clone(), PRESSURE_PA, &PRESSURES, "Pa")
    }
}

/// The calmest tenth of short stretches, with their deviations as parts of their means: in fast motion, the force differs
/// from gravity.
fn calm(norms: &[f64]) -> Vec<(f64, f64)> {
    /// Samples: a fraction of a second.
    const STRETCH: usize = 50;
    let stretches = norms.chunks(STRETCH).filter(|stretch| stretch.len() == STRETCH.min(norms.len()));
    let stretches = stretches.map(|stretch| {
        let count = stretch.len() as f64;
        let mean = stretch.iter().sum::<f64>() / count;
        let variance = stretch.iter().map(|norm| (norm - mean).powi(2)).sum::<f64>() / count;
        // Relative, so that the unit does not matter; without any force it is calm.
        (if mean > 0.0 { variance.sqrt() / mean } else { 0.0 }, mean)
    });
    let mut stretches: Vec<(f64, f64)> = stretches.collect();
    stretches.sort_by(|a, b| a.0.total_cmp(&b.0));
    stretches.truncate(stretches.len().div_ceil(10));
    stretches
}

/// The unit suggested by the median of a quantity; `None` if it is plausible in SI.
fn guess(what: &str, mut values: Vec<f64>, si: (f64, f64), guesses: &[Guess], unit: &str) -> Option<String> {
    values.sort_by(f64::total_cmp);
    let median = *values.get(values.len() / 2)?;
    if (si.0..=si.1).contains(&median) {
        return None;
    }
    // Three digits of it.
    let decimals = if median > 0.0 { (2.0 - median.log10().floor()).clamp(3.0, 12.0) as usize } else { 3 };
    let said = format!("{what} has a median of {median:.decimals$}");
    Some(match guesses.iter().find(|(low, high, _)| (*low..=*high).contains(&median)) {
        Some((_, _, looks)) => format!("{said}: it looks to be {looks}; ROS has {unit}"),
        None => format!("{said}, and {} to {} {unit} are usual", si.0, si.1),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn field(norm: f64) -> Option<String> {
        guess("the magnetic field", vec![norm; 3], FIELD, &FIELDS, "T")
    }

    #[test]
    fn the_unit_is_named() {
        assert_eq!(field(48e-6), None);
        assert_eq!(
            field(0.48).as_deref(),
            Some("the magnetic field has a median of 0.480: it looks to be in gauss; ROS has T")
        );
        for (norm, unit) in [(48.0, "in µT"), (0.048, "in mT"), (480.0, "in milligauss"), (48_000.0, "in nT")] {
            assert!(field(norm).expect("is wrong").contains(unit), "{norm}");
        }
        assert_eq!(
            field(3e-9).as_deref(),
            Some("the magnetic field has a median of 0.00000000300, and 0.00001 to 0.00015 T are usual")
        );
        assert_eq!(guess("x", Vec::new(), FIELD, &FIELDS, "T"), None);
    }

    /// Half a minute of it, and four seconds of rest.
    #[test]
    fn fast_motion_hides_no_gravity() {
        let shaken = (0..3000).map(|index| 25.0 + 20.0 * (f64::from(index) * 0.1).sin());
        let rest = std::iter::repeat_n(9.81, 400);
        let norms: Vec<f64> = shaken.chain(rest).collect();
        let means = |norms: &[f64]| calm(norms).into_iter().map(|(_, mean)| mean).collect::<Vec<_>>();
        assert_eq!(guess("f", means(&norms), FORCE, &FORCES, "m/s²"), None);
        assert!(guess("f", norms, FORCE, &FORCES, "m/s²").is_some());
        assert!((means(&[9.81; 3])[0] - 9.81).abs() < 1e-9 && calm(&[]).is_empty());
    }

    /// A runner's, and the raw field of a phone.
    #[test]
    fn motion_and_an_offset_are_no_units() {
        let run = |unit: f64| {
            let mut units = Units::default();
            for index in 0..3000 {
                let force = unit * (18.0 + 15.0 * (f64::from(index) * 0.2).sin());
                units.take_imu(i64::from(index) * 10_000_000, Vector3::zeros(), Vector3::new(0.0, 0.0, force));
            }
            units.of_imu()
        };
        assert_eq!(run(1.0), [""; 0]);
        assert!(run(1.0 / 9.81)[0].contains("looks to be in g;"));
        let mut units = Units::default();
        units.take_field(&Vector3::new(0.0, 5.71e-4, 0.0));
        assert_eq!(
            units.of_field().as_deref(),
            Some(
                "the magnetic field has a median of 571 µT, and the Earth's has 22 to 67: the magnetometer is not calibrated"
            )
        );
    }

    #[test]
    fn gravity_tells_the_unit_of_the_force() {
        let force = |norm| guess("f", vec![norm; 5], FORCE, &FORCES, "m/s²");
        assert_eq!(force(9.81), None);
        assert!(force(1.0).expect("is wrong").contains("in g;"));
        assert!(force(1000.0).expect("is wrong").contains("in mg;"));
        assert!(force(0.02).expect("is wrong").contains("free of gravity"));
    }
}
