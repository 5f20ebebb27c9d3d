use super::*;

/// On a straight track to the north.
fn trust_of_each(agreement: &mut Agreement, period_s: i64, speed: f64, count: i64) -> Vec<Trust> {
    let frame = LocalFrame::new(Geodetic { latitude: 0.9, longitude: 0.2, height: 100.0 });
    let at = |i: i64| frame.geodetic(&Vector3::new(0.0, speed * (i * period_s) as f64, 0.0));
    (0..count).map(|i| agreement.add(i * period_s * 1_000_000_000, &at(i), &Matrix3::identity())).collect()
}

#[test]
fn slow_anchors_and_a_fast_aircraft_are_believed() {
    use Trust::{Believed, Doubted};
    for (period_s, speed) in [(1, 20.0), (90, 20.0), (600, 5.0), (1, 300.0), (1, 950.0), (90, 300.0)] {
        let trust = trust_of_each(&mut Agreement::default(), period_s, speed, 5);
        assert_eq!(trust, [Doubted, Doubted, Doubted, Believed, Believed], "{period_s} s, {speed} m/s");
    }
    for (period_s, speed) in [(601, 5.0), (1, 1100.0)] {
        let trust = trust_of_each(&mut Agreement::default(), period_s, speed, 5);
        assert_eq!(trust, [Doubted; 5], "{period_s} s, {speed} m/s");
    }
}

/// With two providers at one stamp, the second is not believed because the first is.
#[test]
fn what_is_not_newer_is_doubted() {
    let mut agreement = Agreement::default();
    assert_eq!(trust_of_each(&mut agreement, 1, 20.0, 5).last(), Some(&Trust::Believed));
    let elsewhere = Geodetic { latitude: 0.91, longitude: 0.2, height: 100.0 };
    for time_ns in [4_000_000_000, 3_500_000_000] {
        assert_eq!(agreement.add(time_ns, &elsewhere, &Matrix3::identity()), Trust::Doubted, "{time_ns}");
    }
    assert_eq!(agreement.track.count(), 5, "the track goes on");
}
