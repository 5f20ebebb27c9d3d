//! The gyroscope and the accelerometer of two files as one IMU.

use super::entry::{Entry, What};
use std::collections::VecDeque;

/// The longest time between two specific forces that another is interpolated between, ns.
const LONGEST_NS: i64 = 100_000_000;

/// Interpolates the specific force at the times of the angular velocity. Other entries pass in their order.
#[derive(Debug, Default)]
pub(super) struct Join {
    last: Option<(i64, [f64; 3])>,
    /// Begins with an angular velocity, if there are any.
    waiting: VecDeque<Entry>,
    /// Angular velocities without a specific force before and after them.
    pub(super) alone: u64,
}

impl Join {
    /// Takes the next entry by time, and passes on those that are complete.
    pub(super) fn push(
        &mut self,
        entry: Entry,
        out: &mut dyn FnMut(Entry) -> Result<(), String>,
    ) -> Result<(), String> {
        let What::SpecificForce(force) = entry.what else {
            if self.waiting.is_empty() && !matches!(entry.what, What::AngularVelocity(_)) {
                return out(entry);
            }
            self.waiting.push_back(entry);
            return Ok(());
        };
        let time_ns = entry.time_ns;
        let last = self.last.replace((time_ns, force));
        for Entry { time_ns: at_ns, what } in std::mem::take(&mut self.waiting) {
            let what = match what {
                What::AngularVelocity(angular_velocity) => {
                    let Some(specific_force) = between(last, (time_ns, force), at_ns) else {
                        self.alone += 1;
                        continue;
                    };
                    What::Imu { angular_velocity, specific_force }
                }
                other => other,
            };
            out(Entry { time_ns: at_ns, what })?;
        }
        Ok(())
    }

    /// Passes on what is left at the end.
    pub(super) fn finish(&mut self, out: &mut dyn FnMut(Entry) -> Result<(), String>) -> Result<(), String> {
        for entry in std::mem::take(&mut self.waiting) {
            match entry.what {
                What::AngularVelocity(_) => self.alone += 1,
                _ => out(entry)?,
            }
        }
        Ok(())
    }
}

fn between(last: Option<(i64, [f64; 3])>, (end_ns, end): (i64, [f64; 3]), at_ns: i64) -> Option<[f64; 3]> {
    if at_ns == end_ns {
        return Some(end);
    }
    let (start_ns, start) = last?;
    let length = end_ns - start_ns;
    if at_ns < start_ns || length > LONGEST_NS {
        return None;
    }
    let part = (at_ns - start_ns) as f64 / length as f64;
    Some(std::array::from_fn(|axis| start[axis] + part * (end[axis] - start[axis])))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn joined(entries: Vec<Entry>) -> (Vec<(i64, Option<f64>)>, u64) {
        let mut all = Vec::new();
        let mut out = |entry: Entry| {
            let force = match entry.what {
                What::Imu { specific_force, .. } => Some(specific_force[0]),
                _ => None,
            };
            all.push((entry.time_ns, force));
            Ok(())
        };
        let mut join = Join::default();
        for entry in entries {
            join.push(entry, &mut out).expect("is written");
        }
        join.finish(&mut out).expect("is written");
        (all, join.alone)
    }

    fn gyroscope(time_ns: i64) -> Entry {
        Entry { time_ns, what: What::AngularVelocity([0.0; 3]) }
    }

    fn accelerometer(time_ns: i64, x: f64) -> Entry {
        Entry { time_ns, what: What::SpecificForce([x, 0.0, 0.0]) }
    }

    #[test]
    fn forces_are_interpolated_and_the_order_stays() {
        let field = Entry { time_ns: 14, what: What::MagneticField([0.0; 3]) };
        let entries = vec![
            gyroscope(5),
            accelerometer(10, 1.0),
            gyroscope(10),
            gyroscope(12),
            field,
            gyroscope(20),
            accelerometer(20, 2.0),
            gyroscope(25),
        ];
        let (all, alone) = joined(entries);
        assert_eq!(all, [(10, Some(1.0)), (12, Some(1.2)), (14, None), (20, Some(2.0))]);
        assert_eq!(alone, 2, "before the first force, and after the last");
    }

    #[test]
    fn nothing_is_interpolated_over_a_gap() {
        let late = LONGEST_NS + 1;
        let (all, alone) = joined(vec![accelerometer(0, 1.0), gyroscope(5), accelerometer(late, 2.0)]);
        assert_eq!((all, alone), (vec![], 1));
    }
}
