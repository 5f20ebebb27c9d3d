//! Late samples of the IMU share one run, and every estimate that is read contains them all.

use super::*;
use bb_tests::laws;
use proptest::prelude::*;

/// A way to read the estimate.
#[derive(Clone, Copy, Debug)]
enum Read {
    Predicted,
    Current,
    History,
    Tick,
    Frame,
}

const READS: [Read; 5] = [Read::Predicted, Read::Current, Read::History, Read::Tick, Read::Frame];

/// Returns what is read, and what is known of it after that.
fn read(estimator: &mut Estimator, read: Read, now_ns: i64) -> impl PartialEq + core::fmt::Debug + use<> {
    let outputs: Vec<EstimatorOutput> = match read {
        Read::Predicted => estimator.predicted(now_ns).into_iter().collect(),
        Read::Current => estimator.current_estimate().into_iter().collect(),
        Read::History => estimator.smoothed_history(20),
        Read::Tick => estimator.tick(now_ns).into_iter().collect(),
        Read::Frame => Vec::new(),
    };
    let frame = matches!(read, Read::Frame).then(|| estimator.frame().map(|frame| *frame.origin()));
    // If no output was due, nothing was run.
    let is_read = !matches!(read, Read::Tick) || !outputs.is_empty();
    let known = is_read.then(|| (estimator.label(), estimator.health()));
    (outputs, frame, known.map(|(label, health)| (label, health.gate, health.state, health.keyframes)))
}

/// Returns an estimator in flight for two seconds, and 40 samples, every other one, that are held back until the end.
fn with_samples_held_back(flight: &Flight, strategy: StrategyKind) -> (Estimator, Vec<ImuMean>) {
    let is_held = |sample: &ImuMean| {
        (SECOND..SECOND + 80 * STEP).contains(&sample.time_ns) && sample.time_ns % (2 * STEP) == 0
    };
    let mut estimator = started(flight, strategy);
    let is_in_time = |sent: &&Sent| !matches!(sent, Sent::Imu(sample) if is_held(sample));
    flight.sent(true, true, false).iter().filter(is_in_time).for_each(|sent| ignore(sent.to(&mut estimator)));
    (estimator, flight.samples.iter().filter(|sample| is_held(sample)).copied().collect())
}

/// Before an outage, some samples are late, and come in one burst after it: the clock was not set back.
#[test]
fn samples_of_before_an_outage_that_come_after_it_are_late() {
    let flight = Flight::new(9, 3);
    for (strategy, (every, silent_ns)) in each([(2, SECOND / 2), (20, SECOND), (5, 11 * SECOND / 10)]) {
        let (from_ns, to_ns) = (4 * SECOND, 4 * SECOND + silent_ns);
        let is_held =
            |time_ns: i64| (from_ns - 4 * SECOND / 5..from_ns).contains(&time_ns) && (time_ns / STEP) % every == 0;
        let (mut late, mut in_order) = (started(&flight, strategy), started(&flight, strategy));
        let mut held = Vec::new();
        for sent in flight.sent(true, true, true) {
            let time_ns = sent.time_ns();
            match sent {
                Sent::Imu(_) if (from_ns..to_ns).contains(&time_ns) => continue,
                Sent::Imu(sample) if is_held(time_ns) => held.push(sample),
                sent => ignore(sent.to(&mut late)),
            }
            ignore(sent.to(&mut in_order));
            if matches!(sent, Sent::Imu(_)) && time_ns >= to_ns {
                add_all(&mut late, &core::mem::take(&mut held));
            }
        }
        let counts = late.counts();
        assert_eq!((counts.set_back, counts.too_old), (0, 0), "{strategy:?}: {every}, {silent_ns}");
        assert_eq!(late.predicted(9 * SECOND), in_order.predicted(9 * SECOND), "{strategy:?}");
    }
}

/// A burst is run once, for a reader; or with the next input, or after a quarter of a second of samples, for a user
/// who reads events only.
#[test]
fn a_burst_of_late_samples_is_run_once_and_does_not_wait_for_a_reader() {
    let (flight, later) = (Flight::new(2, 3), Flight::new(3, 3));
    for strategy in StrategyKind::ALL {
        let burst = || {
            let (mut estimator, held) = with_samples_held_back(&flight, *strategy);
            let (before, without) = (*estimator.counts(), estimator.predicted(2 * SECOND));
            add_all(&mut estimator, &held);
            assert_eq!((held.len(), estimator.counts().late - before.late), (40, 40), "each is counted");
            (estimator, without, before.reruns)
        };
        let (mut estimator, without, before) = burst();
        let with = estimator.predicted(2 * SECOND);
        assert!(with.is_some() && with != without);
        // What has not changed is not run again.
        READS.iter().for_each(|by| drop(read(&mut estimator, *by, 2 * SECOND)));
        assert_eq!(estimator.counts().reruns, before + 1, "{strategy:?}");

        let (mut estimator, _, before) = burst();
        add_all(&mut estimator, &later.samples[400..401]);
        assert_eq!(estimator.counts().reruns, before);
        let (time_ns, health) = (later.samples[400].time_ns, GpsHealth::NoFix);
        estimator.add_gps_health(GpsHealthReading { time_ns, health }).unwrap();
        assert_eq!(estimator.counts().reruns, before + 1, "{strategy:?}, with an input");

        let (mut estimator, _, before) = burst();
        add_all(&mut estimator, &later.samples[400..450]);
        assert_eq!(estimator.counts().reruns, before);
        add_all(&mut estimator, &later.samples[450..451]);
        assert_eq!(estimator.counts().reruns, before + 1, "{strategy:?}, after a quarter of a second");
    }
}

/// A start at almost the velocity at which the estimate is given up: 10 km/s.
fn fast(flight: &Flight) -> FlightControllerState {
    FlightControllerState { velocity: Vector3::new(9_990.0, 0.0, 0.0), ..flight.warm_start(0) }
}

/// A sample with which an estimate that is as fast as that is given up.
fn broken(sample: &ImuMean) -> ImuMean {
    ImuMean {
        specific_force: Flight::truth(0).world_from_body.inverse() * Vector3::new(9_000.0, 0.0, 0.0),
        ..*sample
    }
}

/// A late sample that breaks the estimate: the next tick has no estimate and reports the event.
#[test]
fn a_late_sample_that_breaks_the_estimate_is_told_with_the_next_output() {
    let flight = Flight::new(1, 3);
    for strategy in StrategyKind::ALL {
        let mut estimator = estimator(*strategy);
        estimator.warm_start(fast(&flight)).unwrap();
        let (late, in_time): (Vec<ImuMean>, Vec<ImuMean>) =
            flight.samples.iter().partition(|sample| sample.time_ns == SECOND / 2);
        add_all(&mut estimator, &in_time);
        assert!(estimator.tick(SECOND).is_some());
        estimator.add_imu(&broken(&late[0])).unwrap();
        assert_eq!((count(estimator.sink(), "fatal"), estimator.health().state), (0, HealthState::Tracking));
        assert!(estimator.tick(SECOND + SECOND / 10).is_none(), "not due");
        assert_eq!(count(estimator.sink(), "fatal"), 0);
        assert!(estimator.tick(SECOND + SECOND / 5).is_none());
        assert_eq!((count(estimator.sink(), "fatal"), estimator.health().state), (1, HealthState::Lost));
    }
}

/// The first relative pose is sent before the sample at its end, and the frame at its beginning has been passed.
#[test]
fn a_relative_pose_that_is_early_finds_the_frame_it_begins_at() {
    let flight = Flight::new(2, 3);
    for strategy in StrategyKind::ALL {
        let run = |is_early: bool| {
            let mut estimator = started(&flight, *strategy);
            // The engine was last run up to 1.025 s.
            let vio = flight.vio[10];
            for sample in &flight.samples[1..] {
                if sample.time_ns == vio.to_ns && is_early {
                    assert_eq!(estimator.add_vio(vio), Ok(Added::Waits));
                }
                estimator.add_imu(sample).unwrap();
                if sample.time_ns == vio.to_ns && !is_early {
                    assert!(matches!(estimator.add_vio(vio), Ok(Added::Taken { .. })), "{strategy:?}");
                }
            }
            assert_eq!(count(estimator.sink(), "degraded"), 0, "{strategy:?}");
            estimator
        };
        let [mut early, mut late] = [run(true), run(false)];
        for by in READS {
            let (found, expected) = [&mut early, &mut late].map(|estimator| read(estimator, by, 2 * SECOND)).into();
            assert_eq!(found, expected, "{strategy:?}, {by:?}");
        }
    }
}

const LENGTH_S: i64 = 3;

/// Samples that arrive late.
#[derive(Clone, Copy, Debug)]
struct Burst {
    first: usize,
    count: usize,
    /// One in so many.
    stride: usize,
    late_ns: i64,
    /// `true` if they arrive all at once, and not each as late as the others.
    is_at_once: bool,
}

fn burst() -> impl Strategy<Value = Burst> {
    (0..LENGTH_S as usize * 200, 1..100_usize, 1..4_usize, 0..SECOND, any::<bool>())
        .prop_map(|(first, count, stride, late_ns, is_at_once)| Burst { first, count, stride, late_ns, is_at_once })
}

/// Something unusual.
#[derive(Clone, Copy, Debug)]
enum Trouble {
    /// Positions far from the Earth, the fourth of which breaks the estimate.
    Factors,
    /// A sample that breaks an estimate that is [`fast`].
    Sample,
    /// A report of spoofing, so long ago that it is refused if it is more than two seconds.
    Alarm(i64),
}

fn trouble() -> impl Strategy<Value = (i64, Trouble)> {
    let trouble = prop_oneof![
        2 => Just(Trouble::Factors),
        1 => Just(Trouble::Sample),
        2 => (0..3 * SECOND).prop_map(Trouble::Alarm),
    ];
    (0..LENGTH_S * SECOND, trouble)
}

#[expect(clippy::large_enum_variant, reason = "most of them are the largest")]
#[derive(Clone, Copy, Debug)]
enum Step {
    Add(Sent),
    Factors,
    Read(Read),
}

/// Source of the start.
#[derive(Clone, Copy, Debug)]
enum From {
    Warm,
    Fast,
    Anchor,
    Origin,
}

/// All there is to do, in the order in which it is done.
fn steps(
    flight: &Flight,
    bursts: &[Burst],
    shares: &[f64],
    troubles: &[(i64, Trouble)],
    reads: &[Option<Read>],
    jump: Option<(i64, i64)>,
) -> Vec<(i64, Step)> {
    let behind_ns = |at_ns: i64| jump.filter(|(jump_ns, _)| at_ns >= *jump_ns).map_or(0, |(_, by_ns)| by_ns);
    let mut arriving: Vec<(i64, Sent)> = Vec::new();
    for (i, sent) in flight.sent(true, true, true).into_iter().enumerate() {
        let time_ns = sent.time_ns();
        let late_ns = match &sent {
            Sent::Imu(_) => {
                let index = (time_ns / STEP) as usize;
                let is_of = |burst: &&Burst| {
                    (burst.first..burst.first + burst.count).contains(&index)
                        && (index - burst.first).is_multiple_of(burst.stride)
                };
                bursts.iter().find(is_of).map_or(0, |burst| {
                    let wait = if burst.is_at_once { burst.first + burst.count - index } else { 0 };
                    burst.late_ns + wait as i64 * STEP
                })
            }
            _ => {
                let share = shares[i % shares.len()];
                (1.6e9 * share * share * share) as i64
            }
        };
        arriving.push((time_ns + late_ns, sent.behind(behind_ns(time_ns))));
    }
    arriving.sort_by_key(|(at_ns, _)| *at_ns);
    let mut troubles = troubles.to_vec();
    troubles.sort_by_key(|(at_ns, _)| *at_ns);
    let mut troubles = troubles.into_iter().peekable();
    let mut steps = Vec::new();
    for (i, (at_ns, mut sent)) in arriving.into_iter().enumerate() {
        // On the clock of the IMU.
        let now_ns = at_ns - behind_ns(at_ns);
        match (troubles.next_if(|(from_ns, _)| *from_ns <= at_ns), &mut sent) {
            (Some((_, Trouble::Sample)), Sent::Imu(sample)) => *sample = broken(sample),
            (Some((_, Trouble::Factors)), _) => steps.push((now_ns, Step::Factors)),
            (Some((_, Trouble::Alarm(ago_ns))), _) => {
                let reading = GpsHealthReading { time_ns: now_ns - ago_ns, health: GpsHealth::Spoofed };
                steps.push((now_ns, Step::Add(Sent::Health(reading))));
            }
            _ => {}
        }
        steps.push((now_ns, Step::Add(sent)));
        steps.extend(reads[i % reads.len()].map(|read| (now_ns, Step::Read(read))));
    }
    steps
}

/// Starts, and takes the first sample.
fn begun(flight: &Flight, config: StateEstimatorConfig, from: From) -> Estimator {
    let mut estimator = FlightNavigator::new(config, Events::new()).unwrap();
    let state = flight.warm_start(0);
    match from {
        From::Warm => drop(estimator.warm_start(state).unwrap()),
        From::Fast => drop(estimator.warm_start(fast(flight)).unwrap()),
        From::Anchor => {}
        From::Origin => {
            estimator.set_takeoff_origin(TakeoffOrigin::new(state.position)).unwrap();
            let time_ns = SECOND / 2 + STEP / 3;
            estimator.add_attitude(AttitudeReading { time_ns, ..state.attitude }).unwrap();
        }
    }
    estimator.add_imu(&flight.samples[0]).unwrap();
    estimator
}

fn add(estimator: &mut Estimator, step: &Step, now_ns: i64) -> Vec<Result<(), EstimatorError>> {
    match step {
        Step::Add(sent) => std::vec![sent.to(estimator)],
        Step::Factors => (1..=4_i64)
            .map(|i| {
                let place = GnssPosition::new(Vector3::new(1e12, 0.0, 0.0), 1.0, 1.0);
                estimator.add_factor(now_ns - i, i as u32, place.into()).map(drop)
            })
            .collect(),
        Step::Read(_) => Vec::new(),
    }
}

laws! {
    #![proptest_config(ProptestConfig::with_cases(6))]

    /// Late samples may be run at any time: each at once, since somebody reads after each input, or many together when somebody reads at
    /// last: each input becomes the same, and so does what is read. And both are as in order.
    #[test]
    fn it_does_not_matter_when_late_samples_are_run(
        bursts in prop::collection::vec(burst(), 1..6),
        shares in prop::collection::vec(0.0..1.0_f64, 64),
        troubles in prop::collection::vec(trouble(), 0..4),
        reads in prop::collection::vec(prop::option::weighted(0.05, prop::sample::select(READS.as_slice())), 97),
        jump in prop::option::weighted(0.3, (SECOND..2 * SECOND, 700_000_000..10 * SECOND)),
        from in prop::sample::select([From::Warm, From::Fast, From::Anchor, From::Origin].as_slice()),
        has_little_room in prop::bool::weighted(0.2),
        seed in 0..1000_u64,
    ) {
        let flight = Flight::new(LENGTH_S, seed);
        let steps = steps(&flight, &bursts, &shares, &troubles, &reads, jump);
        for strategy in StrategyKind::ALL {
            let mut config = config(*strategy);
            config.params.dwell = 0.5;
            if has_little_room {
                (config.params.imu_rate, config.params.lateness) = (150.0, 1.0);
            }
            let (mut eager, mut lazy) = (begun(&flight, config, from), begun(&flight, config, from));
            let is_flown = |eager: &Estimator| {
                matches!(from, From::Warm | From::Fast) && count(eager.sink(), "fatal") == 0
            };
            for (now_ns, step) in &steps {
                if let Step::Read(by) = step {
                    let (found, expected) =
                        [&mut lazy, &mut eager].map(|estimator| read(estimator, *by, *now_ns)).into();
                    // Without an estimate, the engine is run up to the newest sample. Who does not look while it is lost for a moment,
                    // or before the start, runs it less far, and sees the start a little later; and has an output for that time.
                    let is_alike = is_flown(&eager) || (!matches!(by, Read::Tick) && lazy.run_ns() == eager.run_ns());
                    prop_assert!(!is_alike || found == expected, "{by:?} at {now_ns}: {found:?}, {expected:?}");
                } else {
                    prop_assert_eq!(add(&mut lazy, step, *now_ns), add(&mut eager, step, *now_ns));
                }
                let _ = eager.predicted(*now_ns);
                prop_assert!(lazy.held()[0] <= config.params.room()[0] && lazy.held()[2] <= 9);
            }
            let counts = [&lazy, &eager].map(|estimator| *estimator.counts());
            prop_assert_eq!(answers(&mut lazy), answers(&mut eager));
            // An input at a time that is not run yet is not late. Until the start, samples are run at once.
            let [found, expected] = counts.map(|counts| {
                QueueCounts { reruns: 0, late: if is_flown(&eager) { counts.late } else { 0 }, ..counts }
            });
            prop_assert_eq!(found, expected);
            // Once at each read and each other input, once in a quarter of a second, and where an input breaks it or there is no room.
            let others = steps.iter().map(|(_, step)| match step {
                Step::Add(Sent::Imu(_)) => 0,
                Step::Add(_) | Step::Read(_) => 1,
                Step::Factors => 4,
            });
            let rest = ["fatal", "samples_dropped"].map(|name| count(lazy.sink(), name)).iter().sum::<usize>();
            let most = others.sum::<usize>() + 4 * (LENGTH_S as usize + 2) + rest;
            prop_assert!(counts[0].reruns <= most as u64, "{:?}, at most {most}", counts[0]);

            let QueueCounts { too_old, in_the_future, set_back, .. } = counts[0];
            if troubles.is_empty() && jump.is_none() && too_old + in_the_future + set_back == 0 {
                let mut in_order = begun(&flight, config, from);
                flight.sent(true, true, true).iter().for_each(|sent| ignore(sent.to(&mut in_order)));
                prop_assert_eq!(answers(&mut lazy), answers(&mut in_order));
            }
        }
    }
}
