//! A switch with hysteresis.

/// Switch with hysteresis: on at or above one threshold, off at or below a lower one, and unchanged between them: for a
/// fan, a heater (reversed), a pump.
///
/// ```
/// use bb_estimators::motion::Threshold;
///
/// let mut fan = Threshold::new(60.0, 50.0).ok_or("`off_at` is above `on_at`")?;
/// assert_eq!([55.0, 60.0, 55.0, 50.0].map(|celsius| fan.update(celsius)), [false, true, true, false]);
/// # Ok::<(), &str>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Threshold {
    on_at: f64,
    off_at: f64,
    is_on: bool,
}

impl Threshold {
    /// Initially off. `None` unless `off_at` is at most `on_at`.
    pub fn new(on_at: f64, off_at: f64) -> Option<Self> {
        (off_at <= on_at).then_some(Self { on_at, off_at, is_on: false })
    }

    /// Returns whether it is on after this measurement. NaN changes nothing.
    pub fn update(&mut self, measurement: f64) -> bool {
        if measurement >= self.on_at {
            self.is_on = true;
        } else if measurement <= self.off_at {
            self.is_on = false;
        }
        self.is_on
    }

    /// Returns whether it is on.
    pub fn is_on(&self) -> bool {
        self.is_on
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bb_tests::laws;
    use proptest::prelude::*;

    #[test]
    fn it_switches_at_its_thresholds_and_keeps_between() {
        let mut fan = Threshold::new(60.0, 50.0).expect("in order");
        let states: Vec<bool> =
            [55.0, 60.0, 55.0, f64::NAN, 50.0, 59.9].map(|measurement| fan.update(measurement)).into();
        assert_eq!(states, [false, true, true, true, false, false]);
        assert_eq!(Threshold::new(50.0, 60.0), None);
        assert_eq!(Threshold::new(f64::NAN, 60.0), None);
    }

    laws! {
        /// A measurement that stays within the hysteresis switches it at most once.
        #[test]
        fn noise_within_the_hysteresis_does_not_make_it_chatter(noise in proptest::collection::vec(-0.99..0.99, 1..200)) {
            let mut switch = Threshold::new(1.0, -1.0).expect("in order");
            let states: Vec<bool> = noise.into_iter().map(|measurement| switch.update(measurement)).collect();
            prop_assert!(states.iter().all(|is_on| !is_on));
        }
    }
}
