//! `ODOMETRY`: the estimate in a local frame with axes to north, east and down.

use crate::axes::{body_matrix, ned_from_frd, swap_body, swap_world, turned, world_matrix};
use bb_core::nalgebra::{Matrix3, Matrix6, UnitQuaternion, Vector3};
use bb_core::payload::Odometry;
use bb_core::time::WallTime;
use bb_estimators::navigation::state_estimator::FlightEstimate;
use bb_estimators::navigation::{Geodetic, LocalFrame};
use mavlink::dialects::ardupilotmega::{MavEstimatorType, MavFrame, ODOMETRY_DATA};

/// A larger jump of the estimate, m, shows that the origin was far from the robot.
const JUMP: f64 = 1000.0;

/// The frame of flight estimates.
#[derive(Clone, Debug)]
pub(super) struct OdometryFrame {
    origin: Origin,
    /// Number of changes of the origin.
    moves: u32,
    /// The last estimate: its position, and its count of jumps.
    last: Option<(Geodetic, u32)>,
    frame_id: MavFrame,
}

/// The origin of the local frame.
#[derive(Clone, Debug)]
enum Origin {
    /// Origin from the options: it stays.
    Given(LocalFrame),
    /// Position of an estimate that was not degraded: it stays, unless it proves to be wrong.
    Trusted(LocalFrame),
    /// Position of an estimate, until one is not degraded.
    Provisional(LocalFrame),
    /// Origin that is not known yet: there is no estimate.
    Unknown,
}

impl OdometryFrame {
    pub(super) fn new(origin: Option<LocalFrame>, frame_id: MavFrame) -> Self {
        let origin = origin.map_or(Origin::Unknown, Origin::Given);
        Self { origin, moves: 0, last: None, frame_id }
    }

    /// The origin for an estimate.
    fn origin(&mut self, here: &Geodetic, estimate: &FlightEstimate) -> LocalFrame {
        let last = self.last.replace((*here, estimate.resets));
        let has_jumped = last.is_some_and(|(before, resets)| {
            resets != estimate.resets && LocalFrame::new(before).position(here).norm() > JUMP
        });
        if let (Origin::Trusted(frame), true) = (&self.origin, has_jumped) {
            self.origin = Origin::Provisional(*frame);
        }
        let frame = match &self.origin {
            Origin::Given(frame) | Origin::Trusted(frame) => return *frame,
            Origin::Provisional(frame) if estimate.degraded => return *frame,
            Origin::Provisional(_) => {
                self.moves = self.moves.wrapping_add(1);
                LocalFrame::new(*here)
            }
            Origin::Unknown => LocalFrame::new(*here),
        };
        self.origin = if estimate.degraded { Origin::Provisional(frame) } else { Origin::Trusted(frame) };
        frame
    }

    /// The message for a flight estimate. `None` if a value is not finite.
    pub(super) fn of_flight(&mut self, estimate: &FlightEstimate, wall: WallTime) -> Option<ODOMETRY_DATA> {
        let position = &estimate.position;
        let here = Geodetic {
            latitude: position.latitude_rad,
            longitude: position.longitude_rad,
            height: position.altitude?,
        };
        let is_on_earth = [here.latitude, here.longitude, here.height].iter().all(|value| value.is_finite());
        is_on_earth.then_some(())?;
        let origin = self.origin(&here, estimate);
        // The horizontal planes of the two places differ.
        let origin_from_here = LocalFrame::new(here).other_from_self(&origin).rotation;
        let world_from_body = origin_from_here * estimate.world_from_body;
        let body_from_here = estimate.world_from_body.inverse();
        // The position is in the world; the orientation is a small rotation of the body.
        let covariance = turned(
            &estimate.covariance,
            origin_from_here.to_rotation_matrix().matrix(),
            body_from_here.to_rotation_matrix().matrix(),
        );
        Motion {
            position: origin.position(&here),
            world_from_body,
            covariance: Some(covariance),
            velocity: body_from_here * estimate.velocity,
            angular_velocity: None,
            velocity_covariance: None,
            resets: estimate.resets.wrapping_add(self.moves),
        }
        .message(wall, self.frame_id, MavEstimatorType::MAV_ESTIMATOR_TYPE_VIO)
    }

    /// The message for an odometry. `None` if a value is not finite.
    pub(super) fn of_odometry(&self, estimate: &Odometry, wall: WallTime) -> Option<ODOMETRY_DATA> {
        let Odometry { pose, twist } = estimate;
        // The orientation is about the axes of the world; MAVLink has those of the body.
        let body_from_world = pose.world_from_body.inverse().to_rotation_matrix();
        let in_body = |covariance| turned(&covariance, &Matrix3::identity(), body_from_world.matrix());
        Motion {
            position: pose.position,
            world_from_body: pose.world_from_body,
            covariance: pose.covariance.map(in_body),
            velocity: twist.linear,
            angular_velocity: Some(twist.angular),
            velocity_covariance: twist.covariance,
            // Not contained in odometry.
            resets: 0,
        }
        .message(wall, self.frame_id, MavEstimatorType::MAV_ESTIMATOR_TYPE_UNKNOWN)
    }
}

/// State in the axes of the framework: the world's for position, the body's for the rest.
struct Motion {
    position: Vector3<f64>,
    world_from_body: UnitQuaternion<f64>,
    covariance: Option<Matrix6<f64>>,
    velocity: Vector3<f64>,
    angular_velocity: Option<Vector3<f64>>,
    velocity_covariance: Option<Matrix6<f64>>,
    resets: u32,
}

impl Motion {
    fn message(
        &self,
        wall: WallTime,
        frame_id: MavFrame,
        estimator_type: MavEstimatorType,
    ) -> Option<ODOMETRY_DATA> {
        let position = swap_world(&self.position).cast::<f32>();
        let rotation = ned_from_frd(&self.world_from_body);
        let velocity = swap_body(&self.velocity).cast::<f32>();
        let unknown = Vector3::repeat(f32::NAN);
        let rates = self.angular_velocity.map_or(unknown, |rates| swap_body(&rates).cast());
        let body = body_matrix();
        let pose_covariance = self.covariance.map(|covariance| turned(&covariance, &world_matrix(), &body));
        let velocity_covariance = self.velocity_covariance.map(|covariance| turned(&covariance, &body, &body));
        let mut sent =
            position.iter().chain(velocity.iter()).copied().map(f64::from).chain(rotation.coords.iter().copied());
        let fits = |covariance: Option<Matrix6<f64>>| {
            covariance.is_none_or(|covariance| covariance.iter().all(|value| (*value as f32).is_finite()))
        };
        let has_rates = self.angular_velocity.is_none() || rates.iter().all(|rate| rate.is_finite());
        let is_finite = sent.all(f64::is_finite) && has_rates && fits(pose_covariance) && fits(velocity_covariance);
        is_finite.then(|| ODOMETRY_DATA {
            time_usec: u64::try_from(wall.as_unix_nanos() / 1_000).unwrap_or(0),
            x: position.x,
            y: position.y,
            z: position.z,
            q: [rotation.w, rotation.i, rotation.j, rotation.k].map(|value| value as f32),
            vx: velocity.x,
            vy: velocity.y,
            vz: velocity.z,
            rollspeed: rates.x,
            pitchspeed: rates.y,
            yawspeed: rates.z,
            pose_covariance: upper_triangle(pose_covariance),
            velocity_covariance: upper_triangle(velocity_covariance),
            frame_id,
            child_frame_id: MavFrame::MAV_FRAME_BODY_FRD,
            // The counter wraps; receivers check whether it has changed.
            reset_counter: self.resets.to_le_bytes()[0],
            estimator_type,
            // Unknown: see the covariance.
            quality: 0,
        })
    }
}

/// The upper triangle of a covariance, row by row. An unknown one begins with NaN.
fn upper_triangle(covariance: Option<Matrix6<f64>>) -> [f32; 21] {
    let mut entries = [0.0; 21];
    let Some(covariance) = covariance else {
        entries[0] = f32::NAN;
        return entries;
    };
    let upper = (0..6).flat_map(|row| (row..6).map(move |column| (row, column)));
    for (entry, at) in entries.iter_mut().zip(upper) {
        *entry = covariance[at] as f32;
    }
    entries
}

#[cfg(test)]
mod tests {
    use super::super::gps_input::tests::estimate;
    use super::*;
    use bb_core::payload::{Pose, Twist};
    use bb_core::time::WallTime;

    const NED: MavFrame = MavFrame::MAV_FRAME_LOCAL_NED;
    const NOW: WallTime = WallTime::from_unix_nanos(1_795_305_600_000_000_000);

    #[test]
    fn a_flight_estimate_is_relative_to_the_origin() {
        let origin =
            Geodetic { latitude: 48.099_f64.to_radians(), longitude: 11.5_f64.to_radians(), height: 500.0 };
        let mut frame = OdometryFrame::new(Some(LocalFrame::new(origin)), NED);
        let message = frame.of_flight(&estimate(), NOW).expect("it can be sent");
        assert!((message.x - 111.2).abs() < 0.1 && message.y.abs() < 1e-3, "{} {}", message.x, message.y);
        assert!((message.z + 47.5).abs() < 0.01, "{}", message.z);
        // Forward points north-west: 135° to the left of east, 45° to the left of north.
        let yaw = 2.0 * message.q[3].atan2(message.q[0]).to_degrees();
        assert!((yaw.rem_euclid(360.0) - 315.0).abs() < 0.01, "{yaw}");
        // 2 m/s to the north and 1 m/s to the west are 3/√2 m/s forward and 1/√2 m/s to the right.
        let half = std::f32::consts::FRAC_1_SQRT_2;
        assert!(
            (message.vx - 3.0 * half).abs() < 1e-3 && (message.vy - half).abs() < 1e-3,
            "{} {}",
            message.vx,
            message.vy
        );
        assert!((message.vz + 0.5).abs() < 1e-3);
        assert_eq!(
            (message.frame_id, message.child_frame_id),
            (MavFrame::MAV_FRAME_LOCAL_NED, MavFrame::MAV_FRAME_BODY_FRD)
        );
        // North, east, down; then the mean of both about the forward and the right axis, since they are at 45 degrees
        // to the world's.
        let diagonal = [0, 6, 11, 15, 18, 20].map(|at| message.pose_covariance[at]);
        for (entry, expected) in diagonal.iter().zip([4.0, 25.0, 9.0, 2.5e-4, 2.5e-4, 9e-4]) {
            assert!((entry - expected).abs() < 1e-4 * expected, "{diagonal:?}");
        }
        assert!(message.velocity_covariance[0].is_nan() && message.rollspeed.is_nan());
        assert_eq!(message.time_usec, 1_795_305_600_000_000);
    }

    /// Ten degrees to the east on the equator, the vertical leans to the east by ten degrees.
    #[test]
    fn level_far_away_is_not_level_at_the_origin() {
        let origin = Geodetic { latitude: 0.0, longitude: 0.0, height: 0.0 };
        let mut far = estimate();
        (far.position.latitude_rad, far.position.longitude_rad) = (0.0, 10_f64.to_radians());
        let message =
            OdometryFrame::new(Some(LocalFrame::new(origin)), NED).of_flight(&far, NOW).expect("it can be sent");
        let [w, i, j, k] = message.q.map(f64::from);
        let ned_from_frd = UnitQuaternion::from_quaternion(bb_core::nalgebra::Quaternion::new(w, i, j, k));
        let up = ned_from_frd * Vector3::new(0.0, 0.0, -1.0);
        let (sin, cos) = 10_f64.to_radians().sin_cos();
        assert!((up - Vector3::new(0.0, sin, -cos)).norm() < 1e-6, "{up}");
    }

    #[test]
    fn without_an_origin_the_first_estimate_is_it() {
        let mut frame = OdometryFrame::new(None, NED);
        let first = frame.of_flight(&estimate(), NOW).expect("it can be sent");
        assert!([first.x, first.y, first.z].iter().all(|coordinate| coordinate.abs() < 1e-6));
        let mut higher = estimate();
        higher.position.altitude = Some(557.5);
        let second = frame.of_flight(&higher, NOW).expect("it can be sent");
        assert!((second.z + 10.0).abs() < 1e-4, "{}", second.z);
    }

    /// Four and a half kilometres to the north.
    fn away(estimate: &FlightEstimate) -> FlightEstimate {
        let mut away = *estimate;
        away.position.latitude_rad += 4500.0 / 6.37e6;
        away
    }

    #[test]
    fn an_origin_at_a_degraded_estimate_is_provisional() {
        let mut frame = OdometryFrame::new(None, NED);
        let doubted = FlightEstimate { degraded: true, ..estimate() };
        let first = frame.of_flight(&doubted, NOW).expect("it can be sent");
        let still = frame.of_flight(&away(&doubted), NOW).expect("it can be sent");
        assert!((still.x - 4500.0).abs() < 20.0, "{}", still.x);
        let trusted = frame.of_flight(&away(&estimate()), NOW).expect("it can be sent");
        assert!(trusted.x.abs() < 1e-3, "{}", trusted.x);
        assert_eq!([first, still, trusted].map(|message| message.reset_counter), [0, 0, 1]);
    }

    #[test]
    fn an_origin_that_was_wrong_is_corrected_once_the_estimate_is_trusted_again() {
        let mut frame = OdometryFrame::new(None, NED);
        let sent = |frame: &mut OdometryFrame, estimate: &FlightEstimate| {
            let message = frame.of_flight(estimate, NOW).expect("it can be sent");
            (message.x.round(), message.reset_counter)
        };
        assert_eq!(sent(&mut frame, &estimate()), (0.0, 0));
        // Without a jump, the origin stays.
        let (there, _) = sent(&mut frame, &away(&estimate()));
        assert!((there - 4500.0).abs() < 20.0, "{there}");
        // A jump is a reset, and makes the origin provisional.
        let back = FlightEstimate { degraded: true, resets: 254, ..estimate() };
        assert_eq!(sent(&mut frame, &back), (0.0, 254));
        let moved = FlightEstimate { degraded: false, ..away(&back) };
        assert_eq!(sent(&mut frame, &moved), (0.0, 255));
        // A small jump is a reset, but does not move the origin; the count wraps.
        assert_eq!(sent(&mut frame, &FlightEstimate { resets: 255, ..moved }), (0.0, 0));
        // An origin from the options stays.
        let origin = Geodetic { latitude: 0.8, longitude: 0.2, height: 0.0 };
        let mut given = OdometryFrame::new(Some(LocalFrame::new(origin)), NED);
        let (before, _) = sent(&mut given, &estimate());
        let (after, counter) = sent(&mut given, &FlightEstimate { resets: 7, ..away(&estimate()) });
        assert!(after - before > 4000.0 && counter == 7, "{before} {after} {counter}");
    }

    #[test]
    fn ned_and_frd_differ_in_the_frame_id_only() {
        let sent =
            |frame_id| OdometryFrame::new(None, frame_id).of_flight(&estimate(), NOW).expect("it can be sent");
        let [ned, frd] = [NED, MavFrame::MAV_FRAME_LOCAL_FRD].map(sent);
        assert_eq!((ned.q, ned.vx, frd.frame_id), (frd.q, frd.vx, MavFrame::MAV_FRAME_LOCAL_FRD));
    }

    #[test]
    fn odometry_of_any_estimator_keeps_its_covariances() {
        let pose = Pose {
            position: Vector3::new(1.0, 2.0, 3.0),
            world_from_body: UnitQuaternion::identity(),
            covariance: None,
        };
        let covariance = Some(Matrix6::from_fn(|row, column| (row.min(column) * 10 + row.max(column)) as f64));
        let twist = Twist { linear: Vector3::new(1.0, 2.0, 3.0), angular: Vector3::new(0.1, 0.2, 0.3), covariance };
        let message =
            OdometryFrame::new(None, NED).of_odometry(&Odometry { pose, twist }, NOW).expect("it can be sent");
        assert_eq!([message.x, message.y, message.z], [2.0, 1.0, -3.0]);
        assert_eq!([message.vx, message.vy, message.vz], [1.0, -2.0, -3.0]);
        assert_eq!([message.rollspeed, message.pitchspeed, message.yawspeed], [0.1, -0.2, -0.3]);
        assert!(message.pose_covariance[0].is_nan());
        // The sign changes with each of the two axes that is reversed.
        let signs = [1.0, -1.0, -1.0, 1.0, -1.0, -1.0];
        let mut at = 0;
        for row in 0..6 {
            for column in row..6 {
                let expected = signs[row] * signs[column] * (row * 10 + column) as f32;
                assert_eq!(message.velocity_covariance[at], expected, "{row} {column}");
                at += 1;
            }
        }
    }

    /// Facing north, the forward axis of the body is the north of the world.
    #[test]
    fn the_rotation_covariance_of_any_estimator_is_sent_in_the_bodys_axes() {
        let diagonal = bb_core::nalgebra::Vector6::new(1.0, 2.0, 3.0, 1e-4, 4e-4, 9e-4);
        let pose = Pose {
            position: Vector3::zeros(),
            world_from_body: UnitQuaternion::from_euler_angles(0.0, 0.0, core::f64::consts::FRAC_PI_2),
            covariance: Some(Matrix6::from_diagonal(&diagonal)),
        };
        let twist = Twist { linear: Vector3::zeros(), angular: Vector3::zeros(), covariance: None };
        let message =
            OdometryFrame::new(None, NED).of_odometry(&Odometry { pose, twist }, NOW).expect("it can be sent");
        // North, east, down; forward, right, down.
        let expected = [2.0, 1.0, 3.0, 4e-4, 1e-4, 9e-4];
        for (index, (at, expected)) in [0, 6, 11, 15, 18, 20].into_iter().zip(expected).enumerate() {
            let sent = f64::from(message.pose_covariance[at]);
            assert!((sent - expected).abs() < 1e-6 * expected, "{index}: {sent}");
        }
    }

    #[test]
    fn non_finite_estimates_are_not_sent() {
        let mut wrong = estimate();
        wrong.velocity.x = f64::NAN;
        assert_eq!(OdometryFrame::new(None, NED).of_flight(&wrong, NOW), None);
        // Finite, but not in single precision.
        wrong = estimate();
        wrong.velocity.x = 1e39;
        assert_eq!(OdometryFrame::new(None, NED).of_flight(&wrong, NOW), None);
        wrong = estimate();
        wrong.position.latitude_rad = f64::NAN;
        let mut frame = OdometryFrame::new(None, NED);
        assert_eq!(frame.of_flight(&wrong, NOW), None);
        assert!(matches!(frame.origin, Origin::Unknown), "it does not become the origin");
    }
}
