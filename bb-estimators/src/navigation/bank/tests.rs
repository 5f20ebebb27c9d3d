//! Tests which filter a bank comes to favour.

use nalgebra::{UnitQuaternion, Vector3};

use super::Bank;
use crate::navigation::noise::Noise;
use crate::navigation::{
    Eskf, EskfParams, GaussMarkov, GnssPosition, ImuMean, Optional, RelativePose, Start, States, Stream,
    StreamParams,
};

#[derive(Clone, Copy, Debug, PartialEq)]
struct Odometry;

impl States for Odometry {
    const OPTIONAL: &'static [Optional] = &[Optional::Keyframe, Optional::RelativeScale];
}

const N: usize = Odometry::DIMENSION;

/// A minute of straight flight at 20 m/s, with 10 Hz odometry whose scale is wrong and one fix per second.
fn fly(scale: f64) -> (Bank<Odometry, N, 2>, [[Stream; 2]; 2]) {
    let filter = |deviation: f64| {
        let relative_scale = GaussMarkov::new(deviation, 20.0);
        Eskf::<Odometry, N>::new(EskfParams { relative_scale, ..EskfParams::default() }).unwrap()
    };
    let mut bank = Bank::new([(filter(0.0), 1.0), (filter(0.02), 1.0)]);
    let velocity = Vector3::new(20.0, 0.0, 0.0);
    let start = Start::at(0, (Vector3::zeros(), 1.0), (velocity, 0.3), (UnitQuaternion::identity(), 0.03));
    bank.start(&start).unwrap();
    bank.set_keyframe(0);
    let mut noise = Noise::new(1);
    let mut odometry = [Stream::default(); 2];
    let mut gnss = [Stream::new(StreamParams { gate: 1e-4, ..StreamParams::default() }); 2];
    let up = Vector3::new(0.0, 0.0, EskfParams::default().gravity);
    for i in 1..=6000_u32 {
        let time_ns = i64::from(i) * 10_000_000;
        let angular_velocity = noise.vector(1.7e-3);
        let specific_force = up + noise.vector(2e-2);
        bank.propagate(&ImuMean { time_ns, angular_velocity, specific_force }).unwrap();
        if i % 10 == 0 {
            let way = velocity * (0.1 * (1.0 + scale)) + noise.vector(0.02);
            let turn = UnitQuaternion::from_scaled_axis(noise.vector(1e-3));
            let relative = RelativePose::new(u64::from(i / 10 - 1), (way, 0.02), (turn, 1e-3));
            let _ = bank.update(&mut odometry, &relative);
            bank.set_keyframe(u64::from(i / 10));
        }
        if i % 100 == 0 {
            let fix = velocity * (f64::from(i) * 0.01) + noise.vector(1.0);
            let _ = bank.update(&mut gnss, &GnssPosition::new(fix, 1.0, 1.0));
        }
    }
    (bank, [odometry, gnss])
}

#[test]
fn a_scale_that_drifts_is_believed_and_one_that_does_not_is_not() {
    let (bank, _) = fly(0.0);
    assert!(bank.weights()[0] > 0.9, "{:?}", bank.weights());
    let (bank, _) = fly(0.02);
    assert!(bank.weights()[1] > 0.999, "{:?}", bank.weights());
    let (estimate, covariance) = bank.estimate().unwrap();
    assert!((estimate.scalar::<Odometry>(Optional::RelativeScale) - 0.02).abs() < 0.01);
    let error = (estimate.position - Vector3::new(1200.0, 0.0, 0.0)).norm();
    assert!(error < 4.0 * covariance.fixed_view::<3, 3>(0, 0).trace().sqrt(), "{error}");
}

#[test]
fn a_filter_that_was_dropped_costs_nothing_more() {
    let (bank, streams) = fly(0.02);
    assert_eq!(bank.weights()[0], 0.0);
    let [dropped, kept] = [0, 1].map(|i| streams[1][i].counts().fused + streams[1][i].counts().gate);
    assert!(dropped < 60 && kept == 60, "{dropped} {kept}");
    let last = |i: usize| bank.filters()[i].estimate().unwrap().time_ns;
    assert!(last(0) < last(1));
}

#[test]
fn outliers_do_not_decide() {
    let (mut bank, [_, mut gnss]) = fly(0.0);
    let before = bank.weights();
    for _ in 0..3 {
        let far = GnssPosition::new(Vector3::new(0.0, 1e4, 0.0), 1.0, 1.0);
        assert!(bank.update(&mut gnss, &far).is_err());
    }
    assert_eq!(bank.weights(), before);
}
