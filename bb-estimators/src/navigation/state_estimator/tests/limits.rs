//! The limits of time and of room, for each kind of input.

use super::*;

/// All kinds that wait in the queue.
const KINDS: [InputKind; 8] = [
    InputKind::Vio,
    InputKind::Features,
    InputKind::Anchor,
    InputKind::Factor,
    InputKind::Gnss,
    InputKind::Health,
    InputKind::Attitude,
    InputKind::WarmStart,
];

fn add(estimator: &mut Providing, flight: &Flight, kind: InputKind, time_ns: i64) -> Result<Added, EstimatorError> {
    match kind {
        InputKind::Vio => {
            estimator.add_vio(VioOutput { from_ns: time_ns - FRAME, to_ns: time_ns, ..flight.vio[0] })
        }
        InputKind::Features => estimator.add_features(ImageFeatures { time_ns, features: Vec::new() }),
        InputKind::Anchor => estimator.add_pose_anchor(PoseAnchor { time_ns, ..flight.anchors[0] }),
        InputKind::Factor => {
            let place = GnssPosition::new(Vector3::zeros(), 1.0, 1.0);
            estimator.add_factor(time_ns, 0, Provided::Place(place.into()))
        }
        InputKind::Gnss => estimator.add_gnss(GnssReading { time_ns, ..flight.fixes[0] }),
        InputKind::Health => estimator.add_gps_health(GpsHealthReading { time_ns, health: GpsHealth::NoFix }),
        InputKind::Attitude => estimator.add_attitude(AttitudeReading { time_ns, ..flight.warm_start(0).attitude }),
        InputKind::WarmStart => {
            let mut state = flight.warm_start(0);
            state.attitude.time_ns = time_ns;
            estimator.warm_start(state)
        }
        InputKind::Imu | InputKind::Frame => unreachable!("they are not added like this"),
    }
}

/// Errors of a kind that were told, with their times.
fn told(estimator: &Providing, kind: InputKind) -> Vec<(i64, EventKind)> {
    let is_it = |event: &&Event| match event.kind {
        EventKind::Degraded { input, .. } | EventKind::Fatal { input, .. } => input == kind,
        _ => false,
    };
    estimator.sink().iter().filter(is_it).map(|event| (event.time_ns, event.kind)).collect()
}

#[test]
fn each_kind_is_refused_once_it_is_too_old_or_too_far_ahead() {
    let flight = Flight::new(4, 1);
    let (oldest_ns, latest_ns) = (2 * SECOND, 4 * SECOND + SECOND / 2);
    for (strategy, kind) in each(KINDS) {
        let mut estimator: Providing = by_imu(&flight, strategy);
        for (time_ns, refusal, text) in [
            (oldest_ns - 1, Refusal::TooOld { time_ns: oldest_ns - 1 }, "is older than the history"),
            (latest_ns + 1, Refusal::InTheFuture { time_ns: latest_ns + 1 }, "is in the future"),
        ] {
            let refused = add(&mut estimator, &flight, kind, time_ns);
            assert_eq!(refused, degraded(refusal), "{strategy:?}, {kind:?}");
            let said = refused.unwrap_err().to_string();
            assert_eq!(said, std::format!("degraded: time stamp {time_ns} ns {text}"));
            let reason = refusal.into();
            let event = (time_ns, EventKind::Degraded { input: kind, reason });
            assert_eq!(told(&estimator, kind).last(), Some(&event), "{strategy:?}, {kind:?}");
        }
        assert_eq!(told(&estimator, kind).len(), 2, "{strategy:?}, {kind:?}");
        let counted = |estimator: &Providing| {
            let counts = estimator.counts();
            (counts.too_old, counts.in_the_future, counts.late)
        };
        assert_eq!(counted(&estimator), (1, 1, 0), "{kind:?}");
        // At the limits it is placed, whatever then becomes of it.
        assert_eq!(add(&mut estimator, &flight, kind, latest_ns), Ok(Added::Waits), "{kind:?}");
        ignore(add(&mut estimator, &flight, kind, oldest_ns));
        assert_eq!(counted(&estimator), (1, 1, 1), "{kind:?}");
    }
}

/// Only what belongs to the window is fatal. What comes from the flight controller leaves a quarter of the room.
#[test]
fn each_kind_is_refused_without_room() {
    let (flight, later) = (Flight::new(4, 1), Flight::new(7, 1));
    for (strategy, kind) in each(KINDS) {
        let mut estimator: Providing = by_imu(&flight, strategy);
        assert!(estimator.tick(4 * SECOND).is_some());
        let (room, held) = (estimator.config().params.room()[1], estimator.held()[1]);
        let now_ns = 4 * SECOND;
        let results: Vec<_> = (1..=700).map(|i| add(&mut estimator, &flight, kind, now_ns + i)).collect();
        let taken = results.iter().take_while(|result| **result == Ok(Added::Waits)).count();
        // A relative pose comes with its two frames, and an image with its own.
        let (expected, is_fatal) = match kind {
            InputKind::Vio => ((room - held) / 3, true),
            InputKind::Features => ((room - held) / 2, true),
            InputKind::Anchor | InputKind::Factor => (room - held, true),
            _ => (room - room / 4 - held, false),
        };
        assert_eq!(taken, expected, "{strategy:?}, {kind:?}");
        let (reason, input) = (Reason::Overflow, kind);
        let (error, event) = match is_fatal {
            true => (EstimatorError::Fatal(reason), EventKind::Fatal { input, reason }),
            false => (EstimatorError::Degraded(reason), EventKind::Degraded { input, reason }),
        };
        assert!(results[taken..].iter().all(|result| *result == Err(error)), "{kind:?}");
        assert_eq!(estimator.counts().overflows, (700 - taken) as u64);
        let told = told(&estimator, kind);
        assert!(told.len() == 700 - taken && told.iter().all(|(_, kind)| *kind == event), "each is told");
        let next = estimator.tick(now_ns + SECOND / 5);
        assert_eq!(next.is_none(), is_fatal, "{strategy:?}, {kind:?}: no estimate for this tick");
        // Even then there is room for a relative pose and an anchor beside the flight controller.
        if !is_fatal {
            for kind in [InputKind::Vio, InputKind::Anchor] {
                assert_eq!(add(&mut estimator, &flight, kind, now_ns + 2 * STEP), Ok(Added::Waits), "{kind:?}");
            }
        }
        // Once they are older than the history, there is an estimate and room again.
        later.samples[800..].iter().for_each(|sample| ignore(estimator.add_imu(sample)));
        assert!(estimator.tick(7 * SECOND).is_some(), "{strategy:?}, {kind:?}");
        assert_eq!(add(&mut estimator, &flight, kind, 7 * SECOND + FRAME), Ok(Added::Waits), "{kind:?}");
    }
}

/// The IMU sets the time: it is too old by the lateness, and ahead by more than that.
#[test]
fn samples_of_the_imu_have_their_own_limits() {
    for (_, flight, mut estimator) in flights_by_imu::<Provided>(4, 1) {
        let sample = |time_ns| ImuMean { time_ns, ..flight.samples[0] };
        let time_ns = 2 * SECOND - 1;
        assert_eq!(estimator.add_imu(&sample(time_ns)), degraded(Refusal::TooOld { time_ns }));
        assert_eq!(estimator.add_imu(&sample(2 * SECOND + 1)), Ok(()), "late, but placed");
        let time_ns = 6 * SECOND + 1;
        assert_eq!(estimator.add_imu(&sample(time_ns)), degraded(Refusal::InTheFuture { time_ns }));
        let counts = *estimator.counts();
        assert_eq!((counts.too_old, counts.late, counts.in_the_future), (1, 1, 1));
        assert_eq!(told(&estimator, InputKind::Imu).len(), 2, "each is told");
    }
}
