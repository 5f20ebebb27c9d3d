//! The result is that of the order of the stamps, regardless of the order of arrival.

use bb_tests::laws;
use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;

use super::{History, Placed, Replayed};
use crate::navigation::{
    EskfFilter, EskfParams, Fused, GnssPosition, GnssVelocity, ImuMean, Refusal, Start, Stream, StreamParams,
};

#[derive(Clone, Copy, Debug, PartialEq)]
enum Sensed {
    Position(GnssPosition),
    Velocity(GnssVelocity),
}

#[derive(Clone, Debug, PartialEq)]
struct Drone {
    filter: EskfFilter,
    positions: Stream,
    velocities: Stream,
}

impl Replayed for Drone {
    type Filter = EskfFilter;
    type Measurement = Sensed;

    fn filter(&self) -> &EskfFilter {
        &self.filter
    }

    fn filter_mut(&mut self) -> &mut EskfFilter {
        &mut self.filter
    }

    fn update(&mut self, measurement: &Sensed) -> Result<Fused, Refusal> {
        match measurement {
            Sensed::Position(position) => self.filter.update(&mut self.positions, position),
            Sensed::Velocity(velocity) => self.filter.update(&mut self.velocities, velocity),
        }
    }
}

type Long = History<Drone, 100, 60, 10>;

const SAMPLE_NS: i64 = 10_000_000;

fn drone() -> Drone {
    let mut filter = EskfFilter::new(EskfParams::default()).unwrap();
    let rest = Vector3::zeros();
    filter.start(&Start::at(0, (rest, 2.0), (rest, 0.5), (UnitQuaternion::identity(), 0.1))).unwrap();
    let robust = StreamParams { robust: 0.05, ..StreamParams::default() };
    Drone { filter, positions: Stream::new(robust), velocities: Stream::default() }
}

fn history<const MEASURED: usize>(hold_ns: i64) -> History<Drone, 100, MEASURED, 10> {
    History::new(drone(), hold_ns).unwrap()
}

fn sample(i: i64) -> ImuMean {
    let t = i as f64 * 0.01;
    ImuMean {
        time_ns: i * SAMPLE_NS,
        angular_velocity: Vector3::new(0.3 * t.sin(), 0.2 * (1.3 * t).cos(), 0.4),
        specific_force: Vector3::new(0.3 * t.cos(), 0.2 * (0.8 * t).sin(), 9.8),
    }
}

/// Includes a few measurements that the gate rejects.
fn sensed(kind: bool, value: f64) -> Sensed {
    let value = Vector3::new(value, -value, 0.5 * value);
    match kind {
        true => Sensed::Position(GnssPosition::new(value * 3.0, 1.0, 2.0)),
        false => Sensed::Velocity(GnssVelocity::new(value, 0.3, 0.5)),
    }
}

/// Flies for some samples; each measurement arrives with the sample of its arrival.
pub(in crate::navigation) fn replayed<R: Replayed, const S: usize, const M: usize, const K: usize>(
    mut history: History<R, S, M, K>,
    samples: i64,
    sample: fn(i64) -> ImuMean,
    mut arrivals: Vec<(i64, i64, R::Measurement)>,
) -> History<R, S, M, K> {
    arrivals.sort_by_key(|(arrival, ..)| *arrival);
    let mut arrivals = arrivals.into_iter().peekable();
    for i in 1..=samples {
        history.propagate(&sample(i)).unwrap();
        while let Some((_, time_ns, measurement)) = arrivals.next_if(|(arrival, ..)| *arrival <= i) {
            match history.update(time_ns, &measurement) {
                Ok(_) | Err(Refusal::Gate { .. }) => {}
                Err(error) => panic!("{error}"),
            }
        }
    }
    history
}

/// The filter after a gap between two samples and one sample more. Measurements divide the gap, before it ends or when it is over.
pub(in crate::navigation) fn over_a_gap<R: Replayed, const S: usize, const M: usize, const K: usize>(
    mut history: History<R, S, M, K>,
    (last, next): (i64, i64),
    sample: fn(i64) -> ImuMean,
    measured: &[(i64, R::Measurement)],
    is_late: bool,
) -> R {
    (1..=last).for_each(|i| history.propagate(&sample(i)).unwrap());
    for (i, is_due) in [(next, !is_late), (next + 1, is_late)] {
        for (time_ns, measurement) in measured.iter().filter(|_| is_due) {
            history.update(*time_ns, measurement).unwrap();
        }
        history.propagate(&sample(i)).unwrap();
    }
    history.now().clone()
}

fn fly(arrivals: Vec<(i64, i64, Sensed)>) -> Long {
    replayed(history(SAMPLE_NS), 200, sample, arrivals)
}

laws! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn late_and_out_of_order_is_as_in_order(
        measured in proptest::collection::vec((1..199 * SAMPLE_NS, 0..80_i64, any::<bool>(), -3.0..3.0), 1..40),
    ) {
        let mut measured = measured;
        // Two measurements with the same stamp are fused in the order of arrival.
        measured.sort_by_key(|(time_ns, ..)| *time_ns);
        measured.dedup_by_key(|(time_ns, ..)| *time_ns);
        let all = |delayed: i64| -> Vec<_> {
            let one = |(time_ns, delay, kind, value): &(i64, i64, bool, f64)| {
                let arrives = (time_ns + SAMPLE_NS - 1) / SAMPLE_NS + delayed * delay;
                (arrives.min(200), *time_ns, sensed(*kind, *value))
            };
            measured.iter().map(one).collect()
        };
        let (in_order, late) = (fly(all(0)), fly(all(1)));
        prop_assert_eq!(in_order.now(), late.now());
        prop_assert_eq!(late.arrivals().too_old, 0);
    }
}

#[test]
fn what_is_ahead_waits_and_what_is_too_far_away_is_refused() {
    let mut history: Long = history(SAMPLE_NS);
    let measured = sensed(true, 0.1);
    assert_eq!(history.update(SAMPLE_NS / 2, &measured), Ok(Placed::Waits));
    let far = 5 * SAMPLE_NS;
    assert_eq!(history.update(far, &measured), Err(Refusal::InTheFuture { time_ns: far }));
    assert_eq!(history.update(i64::MAX, &measured), Err(Refusal::InTheFuture { time_ns: i64::MAX }));
    assert_eq!(history.now().positions.counts().fused, 0);
    history.propagate(&sample(1)).unwrap();
    assert_eq!(history.now().positions.counts().fused, 1);
    for i in 2..300 {
        history.propagate(&sample(i)).unwrap();
    }
    for time_ns in [SAMPLE_NS, i64::MIN] {
        assert_eq!(history.update(time_ns, &measured), Err(Refusal::TooOld { time_ns }));
    }
    let counts = history.arrivals();
    assert_eq!((counts.in_the_future, counts.too_old, counts.late), (2, 2, 0));
    let before = history.now().clone();
    let nan = ImuMean { specific_force: Vector3::repeat(f64::NAN), ..sample(300) };
    assert_eq!(history.propagate(&nan), Err(Refusal::NonFinite));
    assert_eq!(history.now(), &before);
    let nan = GnssPosition::new(Vector3::repeat(f64::NAN), 1.0, 1.0);
    assert_eq!(history.update(295 * SAMPLE_NS, &Sensed::Position(nan)), Err(Refusal::NonFinite));
    assert_eq!(history.now().filter, before.filter);
}

#[test]
fn more_measurements_than_there_is_room_for_shorten_the_history() {
    let mut history = history::<4>(SAMPLE_NS);
    for i in 1..=90 {
        history.propagate(&sample(i)).unwrap();
        history.update(i * SAMPLE_NS, &sensed(false, 0.1)).unwrap();
    }
    let early = history.update(30 * SAMPLE_NS, &sensed(false, 0.1));
    assert!(matches!(early, Err(Refusal::TooOld { .. })), "{early:?}");
    for i in 91..=100 {
        history.propagate(&sample(i)).unwrap();
    }
    assert!(history.update(95 * SAMPLE_NS, &sensed(false, 0.1)).is_ok());
}

/// A velocity that says next to nothing, in a gap of 180 ms: both parts are shorter than a sample may be.
#[test]
fn a_gap_that_a_measurement_divides_is_a_gap() {
    let after = |in_gap_ns: &[i64], is_late: bool| {
        let nothing = Sensed::Velocity(GnssVelocity::new(Vector3::zeros(), 1e6, 1e6));
        let measured: Vec<_> = in_gap_ns.iter().map(|time_ns| (*time_ns, nothing)).collect();
        over_a_gap(history::<60>(20 * SAMPLE_NS), (50, 68), sample, &measured, is_late)
    };
    let whole = after(&[], false);
    assert_eq!(whole.filter.gaps(), 1);
    for in_gap_ns in [51 * SAMPLE_NS, 59 * SAMPLE_NS, 67 * SAMPLE_NS] {
        let divided = after(&[in_gap_ns], false);
        assert_eq!(divided, after(&[in_gap_ns], true));
        assert_eq!(divided.filter.gaps(), 2, "each part counts");
        assert_eq!(divided.velocities.counts().fused, 1);
        for i in 3..9 {
            let (whole, divided) = (whole.filter.covariance()[(i, i)], divided.filter.covariance()[(i, i)]);
            // The tilt turns gravity from part to part.
            assert!((0.99 * whole..1.2 * whole).contains(&divided), "{i}: {whole} and {divided}");
        }
    }
}

/// The oldest of as many measurements as there is room for goes, and with it every state from before it: a replay from there would lack
/// the measurement. A state that contains it stays.
#[test]
fn what_makes_room_takes_along_the_states_without_it() {
    let measured = |i: i64| sensed(i % 2 == 0, 0.01 * i as f64);
    let full = |first: i64, late: i64| {
        let mut history = history::<4>(SAMPLE_NS);
        let mut alone = drone();
        for i in 1..=35 {
            history.propagate(&sample(i)).unwrap();
            alone.filter.propagate(&sample(i)).unwrap();
            if (first..first + 4).contains(&i) {
                history.update(i * SAMPLE_NS, &measured(i)).unwrap();
            }
            if i == late || (first..first + 4).contains(&i) {
                alone.update(&measured(i)).unwrap();
            }
        }
        (history, alone)
    };
    // There is a state at every tenth sample. The one at sample 20 contains the measurement at its time.
    let (mut history, alone) = full(20, 24);
    history.update(24 * SAMPLE_NS, &measured(24)).unwrap();
    assert_eq!(history.now(), &alone, "the filter alone");
    assert_eq!(history.arrivals().longest_delay_ns, 11 * SAMPLE_NS);
    let (mut history, alone) = full(21, 31);
    let before = history.now().clone();
    let time_ns = 24 * SAMPLE_NS;
    assert_eq!(history.update(time_ns, &measured(24)), Err(Refusal::TooOld { time_ns }));
    assert_eq!(history.now(), &before);
    history.update(31 * SAMPLE_NS, &measured(31)).unwrap();
    assert_eq!(history.now(), &alone);
}
