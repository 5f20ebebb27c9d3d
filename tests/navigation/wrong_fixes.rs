//! Fixes that are kilometres off, at the start and later: no filter begins at one that no other agrees with, and one that has
//! begun at wrong ones, or followed them, is moved to where the right ones are and is as good as before.

use super::rover::{Noise, ORIGIN, Truth, truth};
use bb_core::nalgebra::{Matrix3, UnitQuaternion, Vector3};
use bb_core::payload::{GeodeticPosition, GnssFix, GnssServices, GnssStatus, Twist};
use bb_core::prelude::*;
use bb_estimators::navigation::planar::PlanarOutputs;
use bb_estimators::navigation::{Geodetic, LocalFrame, NavigationOutputs};
use bb_estimators::{Eskf, PlanarEkf};

robot! {
    robot Ferry;

    link base {
        sensor imu: External<Imu>();
        sensor wheels: External<Odometry>();
        sensor gnss: External<GnssFix>();
        estimator eskf: Eskf<NavigationOutputs>(
            heading_deviation = 3 deg, wheel_mounting = 1 deg, gnss_delay = 1 ms
        ) {
            input imu: sensor::base::imu, driver;
            input gnss: sensor::base::gnss, optional;
            input odometry: sensor::base::wheels, optional;
            output odometry;
            output status;
            recover_after: 20;
        }
        estimator planar: PlanarEkf<PlanarOutputs>(heading_deviation = 3 deg) {
            input imu: sensor::base::imu, driver;
            input gnss: sensor::base::gnss, optional;
            input odometry: sensor::base::wheels, optional;
            output odometry;
            output status;
            recover_after: 20;
        }
    }
}

/// Outputs of one filter; its world is turned as that of the drive, but for the Earth between.
#[derive(Debug, Default)]
struct Seen {
    /// Seconds and poses.
    poses: Vec<(f64, Pose)>,
    resets: u32,
    refused: u64,
    gyroscope_bias: f64,
    health: Vec<(f64, HealthState)>,
}

impl Seen {
    /// The largest error in a world that begins at `origin`, of a drive that began at `start`, in a span of time: m, rad.
    fn worst(&self, origin: &Geodetic, start: &Geodetic, span: std::ops::Range<f64>) -> (f64, f64) {
        let (world, of_drive) = (LocalFrame::new(*origin), LocalFrame::new(*start));
        let turn = of_drive.other_from_self(&world).rotation;
        let mut worst = (0.0_f64, 0.0_f64);
        let mut count = 0;
        for (now, pose) in self.poses.iter().filter(|(now, _)| span.contains(now)) {
            let Truth { position, heading, .. } = truth(*now);
            let expected = world.position(&of_drive.geodetic(&position));
            let turned = turn * UnitQuaternion::from_euler_angles(0.0, 0.0, heading);
            worst.0 = worst.0.max((pose.position - expected).xy().norm());
            worst.1 = worst.1.max(turned.angle_to(&pose.world_from_body));
            count += 1;
        }
        assert!(count > 0, "nothing in {span:?}: {:?}", self.poses.len());
        worst
    }

    fn state_at(&self, time_s: f64) -> HealthState {
        let last = self.health.iter().rev().find(|(at, _)| *at <= time_s);
        last.map_or(HealthState::Healthy, |(_, state)| *state)
    }
}

/// The drive of `truth`, begun at `start`; `shown` says where a fix is, if there is one, of where it should be, with its number.
fn drive(start: &Geodetic, seconds: u64, shown: impl Fn(u64, Geodetic) -> Option<Geodetic>) -> [Seen; 2] {
    drive_as(truth, start, seconds, shown)
}

fn drive_as(
    truth: impl Fn(f64) -> Truth,
    start: &Geodetic,
    seconds: u64,
    shown: impl Fn(u64, Geodetic) -> Option<Geodetic>,
) -> [Seen; 2] {
    let builder = Ferry::builder();
    let room = || Overflow::DropOldest { capacity: 1 << 16 };
    let odometry = [
        builder.subscribe_with(ferry::estimator::base::eskf::odometry, room()),
        builder.subscribe_with(ferry::estimator::base::planar::odometry, room()),
    ];
    let of_eskf = builder.subscribe_with(ferry::estimator::base::eskf::status, room());
    let of_planar = builder.subscribe_with(ferry::estimator::base::planar::status, room());
    let health = builder.subscribe_with(system::Health, room());
    let mut simulation = builder.simulate().expect("it starts");
    let frame = LocalFrame::new(*start);
    let mut noise = Noise::new(3);
    for millis in (0..seconds * 1000).step_by(10) {
        let (now, time) = (millis as f64 * 1e-3, MonotonicTime::ZERO + Duration::from_millis(millis));
        let Truth { position, speed, .. } = truth(now);
        if millis.is_multiple_of(50) {
            let linear = Vector3::new(speed, 0.0, 0.0) + 0.05 * noise.vector();
            let pose = Pose { position, world_from_body: UnitQuaternion::identity(), covariance: None };
            let angular = Vector3::z() * truth(now).rate;
            let twist = Twist { linear, angular, covariance: None };
            simulation.publish(ferry::sensor::base::wheels, time, Odometry { pose, twist });
        }
        let measured = position + 0.3 * noise.vector();
        if millis.is_multiple_of(200)
            && let Some(at) = shown(millis / 200, frame.geodetic(&measured))
        {
            let position = GeodeticPosition {
                latitude_rad: at.latitude,
                longitude_rad: at.longitude,
                altitude: Some(at.height),
            };
            let (status, services) = (GnssStatus::Fix, GnssServices::default());
            let position_covariance = Some(Matrix3::identity() * 0.09);
            let fix = GnssFix { status, services, position: Some(position), position_covariance };
            simulation.publish(ferry::sensor::base::gnss, time, fix);
        }
        let Truth { rate, acceleration, .. } = truth(now - 0.005);
        let force = acceleration + Vector3::new(0.0, 0.0, 9.80665) + 0.02 * noise.vector();
        let turning = Vector3::z() * (rate + 0.003) + 0.0017 * noise.vector();
        simulation.publish(ferry::sensor::base::imu, time, Imu::new(turning, force));
    }
    let seconds = |time: MonotonicTime| time.seconds_since(MonotonicTime::ZERO);
    let mut seen = odometry.map(|odometry| Seen {
        poses: odometry.drain().map(|message| (seconds(message.monotonic_time), message.pose)).collect(),
        ..Seen::default()
    });
    let status = of_eskf.drain().last().map(|status| status.payload).expect("it has started");
    (seen[0].resets, seen[0].refused) = (status.resets, status.gnss.refused);
    seen[0].gyroscope_bias = status.gyroscope_bias.z;
    let status = of_planar.drain().last().map(|status| status.payload).expect("it has started");
    (seen[1].resets, seen[1].refused) = (status.resets, status.gnss.refused);
    seen[1].gyroscope_bias = status.gyroscope_bias;
    for change in health.drain() {
        let of_planar = change.payload.estimator.to_string().ends_with("planar");
        seen[usize::from(of_planar)].health.push((seconds(change.monotonic_time), change.payload.to));
    }
    seen
}

fn munich() -> Geodetic {
    Geodetic::from_degrees(ORIGIN.0, ORIGIN.1, ORIGIN.2)
}

/// Ten kilometres north, half a kilometre up, in Africa, and where latitude and longitude are zero.
fn wrong(right: &Geodetic) -> [Geodetic; 4] {
    let north = LocalFrame::new(*right).geodetic(&Vector3::new(0.0, 10_000.0, 0.0));
    let up = Geodetic { height: right.height + 500.0, ..*right };
    [north, up, Geodetic::from_degrees(-20.0, 15.0, 900.0), Geodetic::from_degrees(0.0, 0.0, 0.0)]
}

#[test]
fn a_world_does_not_begin_at_a_fix_that_no_other_agrees_with() {
    for off in wrong(&munich()) {
        let seen = drive(&munich(), 30, |number, right| Some(if number == 0 { off } else { right }));
        for seen in seen {
            // It begins at the second fix.
            let (position, turned) = seen.worst(&munich(), &munich(), 0.0..30.0);
            assert!(position < 1.5 && turned < 0.06, "{off:?}: {position} m, {turned} rad");
            assert_eq!((seen.resets, seen.refused, seen.health.len()), (0, 0, 0), "{off:?}: {:?}", seen.health);
        }
    }
}

/// A receiver that shows where it was switched off for a second and a half, until it has found its satellites.
#[test]
fn a_filter_that_began_at_wrong_fixes_is_moved_to_the_right_ones() {
    for off in wrong(&munich()) {
        let seen = drive(&munich(), 60, |number, right| Some(if number < 8 { off } else { right }));
        for (seen, is_planar) in seen.into_iter().zip([false, true]) {
            // A plane has no height.
            if is_planar && off.latitude == munich().latitude {
                continue;
            }
            // Ten kilometres away it is the same world; where no robot could have come from, it is not.
            let here = LocalFrame::new(munich()).position(&off).norm() < 100_000.0;
            if here {
                assert_eq!(seen.resets, 1, "{off:?}");
                assert!((4..=12).contains(&seen.refused), "{off:?}: {}", seen.refused);
            } else {
                // A new filter.
                assert_eq!((seen.resets, seen.refused), (0, 0), "{off:?}");
            }
            let (position, turned) = if here {
                let origin = if is_planar { Geodetic { height: off.height, ..off } } else { off };
                seen.worst(&origin, &munich(), 20.0..60.0)
            } else {
                seen.worst(&munich(), &munich(), 20.0..60.0)
            };
            assert!(position < 1.5 && turned < 0.06, "{off:?}: {position} m, {turned} rad");
            assert!((seen.gyroscope_bias - 0.003).abs() < 1e-3, "{off:?}: {}", seen.gyroscope_bias);
            // It says so, and it is over.
            let was = |(at, state): &(f64, HealthState)| *at < 8.0 && *state != HealthState::Healthy;
            assert!(seen.health.iter().any(was), "{off:?}: {:?}", seen.health);
            assert_eq!(seen.state_at(20.0), HealthState::Healthy, "{off:?}: {:?}", seen.health);
        }
    }
}

/// A filter follows wrong fixes that last 40 s, having refused them for twenty, and comes back undamaged when they are right again.
#[test]
fn a_filter_that_followed_wrong_fixes_comes_back_undamaged() {
    for off in wrong(&munich()) {
        let seen = drive(&munich(), 160, |number, right| {
            let is_wrong = (200..400).contains(&number);
            let away = LocalFrame::new(off).geodetic(&LocalFrame::new(munich()).position(&right));
            Some(if is_wrong { away } else { right })
        });
        for (seen, is_planar) in seen.into_iter().zip([false, true]) {
            // A plane has no height.
            if is_planar && off.latitude == munich().latitude {
                continue;
            }
            let is_near = LocalFrame::new(munich()).position(&off).norm() < 100_000.0;
            let (before, _) = seen.worst(&munich(), &munich(), 5.0..39.7);
            assert!(before < 1.0, "{off:?}: {before} m");
            assert_eq!((seen.state_at(45.0), seen.state_at(150.0)), (HealthState::Degraded, HealthState::Healthy));
            assert!((seen.gyroscope_bias - 0.003).abs() < 1e-3, "{off:?}: {}", seen.gyroscope_bias);
            if !is_near {
                // Each time it was another filter, and the last has its own world.
                assert_eq!(seen.resets, 0, "{off:?}");
                continue;
            }
            let (after, turned) = seen.worst(&munich(), &munich(), 125.0..160.0);
            assert!(after < 1.0 && turned < 0.05, "{off:?}: {after} m, {turned} rad");
            assert_eq!(seen.resets, 2, "{off:?}");
        }
    }
}

#[test]
fn fixes_that_disagree_among_each_other_move_no_filter() {
    let seen = drive(&munich(), 90, |number, right| {
        let turn = f64::from(u32::try_from(number % 1000).expect("it is small"));
        let away = Vector3::new(10_000.0 * (1.7 * turn).sin(), 10_000.0 * (1.7 * turn).cos(), 0.0);
        Some(if (200..400).contains(&number) { LocalFrame::new(right).geodetic(&away) } else { right })
    });
    for seen in seen {
        // On wheels alone it drifts for 40 s.
        let (position, _) = seen.worst(&munich(), &munich(), 5.0..90.0);
        assert!(position < 1.5 && seen.resets == 0 && seen.refused >= 199, "{position} m, {}", seen.refused);
    }
}

/// A ship in the gulf of Guinea: agreement counts, not the number.
#[test]
fn where_latitude_and_longitude_are_zero_is_a_place_too() {
    let zero = Geodetic::from_degrees(0.0, 0.0, 0.0);
    for seen in drive(&zero, 30, |_, right| Some(right)) {
        let (position, turned) = seen.worst(&zero, &zero, 0.0..30.0);
        assert!(position < 1.5 && turned < 0.07 && seen.resets == 0, "{position} m, {turned} rad");
    }
}

/// A fix that stays the only one begins the world after ten seconds in which no other came.
#[test]
fn a_fix_that_stays_the_only_one_begins_the_world_late() {
    for seen in drive_as(|_| truth(0.0), &munich(), 20, |number, right| (number == 0).then_some(right)) {
        let first = seen.poses.first().map(|(now, _)| *now);
        assert!(first.is_some_and(|first| (10.0..=10.1).contains(&first)), "{first:?}");
    }
}

robot! {
    robot Mapped;

    link base {
        sensor imu: External<Imu>();
        sensor map: External<Pose>();
        estimator eskf: Eskf<NavigationOutputs>() {
            input imu: sensor::base::imu, driver;
            input pose: sensor::base::map, optional;
            output odometry;
            output status;
        }
        estimator planar: PlanarEkf<PlanarOutputs>() {
            input imu: sensor::base::imu, driver;
            input pose: sensor::base::map, optional;
            output odometry;
            output status;
        }
    }
}

/// Two kilometres from where the map begins, and turned: nothing but the poses says so.
#[test]
fn poses_that_agree_move_a_filter_too() -> Result<(), StartError> {
    let builder = Mapped::builder();
    let odometry = [
        builder.subscribe(mapped::estimator::base::eskf::odometry),
        builder.subscribe(mapped::estimator::base::planar::odometry),
    ];
    let mut simulation = builder.simulate()?;
    let there = Vector3::new(2000.0, -300.0, 0.0);
    let world_from_body = UnitQuaternion::from_euler_angles(0.0, 0.0, 2.5);
    for millis in (0..6_000).step_by(10) {
        let time = MonotonicTime::ZERO + Duration::from_millis(millis);
        if millis % 100 == 0 {
            let pose = Pose { position: there, world_from_body, covariance: None };
            simulation.publish(mapped::sensor::base::map, time, pose);
        }
        let at_rest = Imu::new(Vector3::zeros(), Vector3::new(0.0, 0.0, 9.80665));
        simulation.publish(mapped::sensor::base::imu, time, at_rest);
    }
    for odometry in odometry {
        let Pose { position, world_from_body: turned, .. } = odometry.drain().last().expect("it runs").pose;
        let off = turned.angle_to(&world_from_body);
        assert!((position - there).norm() < 0.1 && off < 0.01, "{position}, {off} rad");
    }
    Ok(())
}
