use super::*;
use bb_tests::laws;
use proptest::prelude::*;

fn point(time_s: f64, position: Vector3<f64>) -> TrackPoint {
    TrackPoint { time_ns: (time_s * 1e9) as i64, position, covariance: Matrix3::identity() * 0.25, yaw: 0.0 }
}

laws! {
    /// The track of a robot that accelerates, brakes and turns by up to half a g, with the stated noise.
    #[test]
    fn what_a_robot_measures_on_its_way_agrees(
        period_s in 0.05..10.0,
        velocity in -40.0..40.0,
        acceleration in -5.0..5.0,
        noise in proptest::collection::vec(-1.0..1.0_f64, 60),
    ) {
        let mut track = Track::default();
        for (i, noise) in noise.chunks_exact(3).enumerate() {
            let time_s = i as f64 * period_s;
            // The robot brakes before it becomes too fast.
            let swing = f64::sin(0.2 * time_s) * acceleration / 0.04;
            let position = Vector3::new(velocity * time_s, swing, 0.0) + 0.5 * Vector3::from_column_slice(noise);
            prop_assert!(track.add(point(time_s, position)), "{i}");
        }
        prop_assert_eq!(track.count(), 20);
    }

    /// An offset of kilometres, in any direction, at any time.
    #[test]
    fn what_is_far_off_does_not(
        far in 10_000.0..1e7_f64,
        direction in 0..6_usize,
        at in 1..10_usize,
        period_s in 0.05..10.0,
    ) {
        let mut off = Vector3::zeros();
        off[direction / 2] = if direction % 2 == 0 { far } else { -far };
        let mut track = Track::default();
        for i in 0..at {
            prop_assert!(track.add(point(i as f64 * period_s, Vector3::zeros())));
        }
        prop_assert!(!track.add(point(at as f64 * period_s, off)));
        prop_assert_eq!(track.count(), 1);
        // The correct positions do not agree with it either.
        prop_assert!(!track.add(point((at + 1) as f64 * period_s, Vector3::zeros())));
        prop_assert!(track.add(point((at + 2) as f64 * period_s, Vector3::zeros())));
    }
}

/// The velocity on an arc is that at its end, at a steady turn rate. After a turn of 60° on the way, no velocity is clear.
#[test]
fn the_velocity_on_an_arc_is_that_at_its_end() {
    for (rate, is_clear) in [(0.0, true), (0.25, true), (-0.4, true), (1.1, false)] {
        let mut track = Track::default();
        for i in 0..3 {
            let (time_s, yaw) = (f64::from(i), rate * f64::from(i));
            // On a circle about (0, 8 / rate), counter-clockwise if the rate is positive.
            let on_arc = || Vector3::new(yaw.sin(), 1.0 - yaw.cos(), 0.0) * (8.0 / rate);
            let position = if rate == 0.0 { Vector3::x() * 8.0 * time_s } else { on_arc() };
            track.add(TrackPoint { yaw, covariance: Matrix3::identity() * 1e-4, ..point(time_s, position) });
        }
        let (velocity, deviation) = track.velocity().expect("they are a second apart");
        let heading = 2.0 * rate;
        let expected = Vector3::new(heading.cos(), heading.sin(), 0.0) * 8.0;
        assert!(!is_clear || (velocity - expected).norm() < 1e-6, "{rate}: {velocity}");
        assert_eq!(velocity.norm() > CLEARLY * deviation, is_clear, "{rate}: {deviation}");
    }
}

#[test]
fn a_height_that_is_off_disagrees_unless_it_is_unknown() {
    let here = point(0.0, Vector3::zeros());
    for (variance, agrees) in [(0.25, false), (1e8, true)] {
        let mut there = point(0.2, Vector3::new(0.0, 0.0, 500.0));
        there.covariance[(2, 2)] = variance;
        let mut track = Track::default();
        track.add(here);
        assert_eq!(track.add(there), agrees, "{variance}");
    }
}

#[test]
fn what_is_no_number_or_not_newer_is_never_confirmed() {
    let mut track = Track::default();
    for i in 0..9 {
        track.add(point(f64::from(i), Vector3::repeat(f64::NAN)));
    }
    assert_eq!(track.count(), 1);
    let mut track = Track::default();
    for _ in 0..9 {
        assert!(track.add(point(1.0, Vector3::zeros())));
    }
    assert_eq!((track.count(), track.velocity()), (1, None));
}
