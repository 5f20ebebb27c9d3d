//! A car without wheels that stands still in a tunnel: the filter sees that it does, unless the car moves as quietly as it stands.

use super::optional_states::{driven, fix, imu, velocity};
use super::rover::{Noise, ORIGIN};
use bb_core::payload::GnssFix;
use bb_core::prelude::*;
use bb_estimators::Eskf;
use bb_estimators::navigation::{Geodetic, LocalFrame};

robot! {
    robot Car;

    link base {
        sensor imu: External<Imu>();
        sensor gnss: External<GnssFix>();
        estimator navigation: Eskf() {
            input imu: sensor::base::imu, driver;
            input gnss: sensor::base::gnss, optional;
        }
    }
}

/// Seconds at which the tunnel begins, the car stands, and all ends.
const TUNNEL: f64 = 70.0;
const STANDS: f64 = 75.0;
const END: usize = 120;

/// Drives in curves, and brakes for the stand, if there is one, within two seconds.
fn motion(seconds: f64, stands: bool, turns: f64) -> (f64, f64) {
    let since = seconds - 10.0;
    let braked = if stands { ((seconds - STANDS + 2.0) / 2.0).clamp(0.0, 1.0) } else { 0.0 };
    let goes = (since / 2.0).clamp(0.0, 1.0) - braked;
    (goes * (6.0 + 2.0 * (0.7 * since).sin()), goes * turns * (0.1 + 0.3 * (0.31 * since).sin()))
}

/// The errors of velocity and position at the end, m/s and m, each with the deviation that is stated of its x component. `rough` is the vibration
/// of a moving car at a time, m/s².
fn tunnel(
    stands: bool,
    turns: impl Fn(f64) -> f64,
    rough: impl Fn(f64) -> f64,
    seed: u64,
) -> Result<[(f64, f64); 2], StartError> {
    let builder = Car::builder();
    let odometry = builder.subscribe(car::estimator::base::navigation);
    let mut simulation = builder.simulate()?;
    let frame = LocalFrame::new(Geodetic::from_degrees(ORIGIN.0, ORIGIN.1, ORIGIN.2));
    let way = driven(END, |seconds| motion(seconds, stands, turns(seconds)));
    let mut noise = Noise::new(seed);
    let mut first = None;
    for millis in (0..END * 1000).step_by(10) {
        let time = MonotonicTime::ZERO + Duration::from_millis(millis as u64);
        if millis % 1000 == 0 && (millis as f64) < TUNNEL * 1000.0 {
            let place = way[millis].position + 0.1 * noise.vector();
            first.get_or_insert(place);
            simulation.publish(car::sensor::base::gnss, time, fix(&frame, &place, 0.1));
        }
        let mut sample = imu(&way, millis, &mut noise);
        if way[millis].speed > 0.0 {
            sample.linear_acceleration += rough(millis as f64 * 1e-3) * noise.vector();
        }
        simulation.publish(car::sensor::base::imu, time, sample);
    }
    let message = odometry.drain().last().expect("it has started");
    let state = &way[END * 1000 - 10];
    let world_from_body = message.pose.world_from_body;
    let (pose, twist) =
        (message.pose.covariance.expect("it states one"), message.twist.covariance.expect("it states one"));
    let off = world_from_body * message.twist.linear - velocity(state);
    let away = message.pose.position - (state.position - first.expect("there were fixes"));
    Ok([(off.norm(), twist[(0, 0)].sqrt()), (away.norm(), pose[(0, 0)].sqrt())])
}

#[test]
fn a_car_that_stands_in_a_tunnel_is_seen_to() -> Result<(), StartError> {
    for seed in 0..8 {
        let [speed, position] = tunnel(true, |_| 1.0, |_| 0.3, seed)?;
        println!("seed {seed}: {speed:?} m/s, {position:?} m");
        assert!(speed.0 < 0.05 && speed.1 < 0.1, "{speed:?} m/s");
        assert!(position.0 < 4.0 * position.1.max(0.1) && position.0 < 3.0, "{position:?} m");
        // On rails nothing shows that it stands: it drifts, and says so.
        let [speed, position] = tunnel(true, |_| 1.0, |_| 0.0, seed)?;
        println!("on rails: {speed:?} m/s, {position:?} m");
        assert!(speed.1 > 0.2 && speed.0 < 4.0 * speed.1, "{speed:?} m/s");
        assert!(position.0 < 4.0 * position.1, "{position:?} m");
        // Where the road becomes smooth, that is no rest.
        let [speed, position] = tunnel(false, |_| 1.0, |seconds| if seconds < TUNNEL { 0.3 } else { 0.0 }, seed)?;
        println!("smooth: {speed:?} m/s, {position:?} m");
        assert!(speed.1 > 0.2 && speed.0 < 4.0 * speed.1, "{speed:?} m/s");
        assert!(position.0 < 4.0 * position.1, "{position:?} m");
    }
    Ok(())
}

/// A moving car vibrates by 1.5 times the noise of its IMU at least. One that begins to move as quietly as it stands, straight ahead and where its
/// speed is not known, would be taken to stand.
#[test]
fn no_car_that_moves_is_taken_to_stand() -> Result<(), StartError> {
    for seed in 0..50 {
        let mut noise = Noise::new(seed);
        let mut draw = || (noise.vector().x.abs() * 10.0).fract();
        let [before, after] = [(); 2].map(|()| [0.03, 0.1, 0.3, 1.0][(draw() * 4.0) as usize]);
        let (changes_at, stands, is_straight) = (40.0 + 75.0 * draw(), draw() < 0.3, draw() < 0.5);
        let turns = |seconds: f64| if is_straight && seconds > TUNNEL { 0.0 } else { 1.0 };
        let rough = |seconds: f64| if seconds < changes_at { before } else { after };
        let [speed, position] = tunnel(stands, turns, rough, seed)?;
        let is_honest = speed.0 < 4.0 * speed.1 && position.0 < 4.0 * position.1.max(0.1);
        assert!(is_honest, "seed {seed}, from {before} to {after} m/s²: {speed:?} m/s, {position:?} m");
    }
    Ok(())
}
