//! Tests which filter a bank comes to favour.

use nalgebra::{UnitQuaternion, Vector3};

use super::Bank;
use crate::navigation::noise::Noise;
use crate::navigation::{
    Aiding, Eskf, EskfParams, Fused, GaussMarkov, GnssPosition, History, ImuMean, Navigator, Optional, Propagate,
    Refusal, RelativePose, Replayed, Start, States, Stream, StreamParams,
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

/// A navigator whose late fixes are fused at their own time; on the heap, since three of them overflow the stack of a test.
#[derive(Clone)]
struct Flown(Box<Navigator>);

impl Replayed for Flown {
    type Filter = Navigator;
    type Measurement = GnssPosition;

    fn filter(&self) -> &Navigator {
        &self.0
    }

    fn filter_mut(&mut self) -> &mut Navigator {
        &mut self.0
    }

    fn update(&mut self, fix: &GnssPosition) -> Result<Fused, Refusal> {
        self.0.gnss_position(fix)
    }
}

/// A fix that says next to nothing, in the middle of a gap of 180 ms: both parts are shorter than a sample may be.
#[test]
fn a_gap_that_a_fix_divides_is_a_gap() {
    let after = |is_divided: bool| {
        let mut navigator = Navigator::new(EskfParams::default(), Aiding::Gnss).unwrap();
        let rest = Vector3::zeros();
        navigator.start(&Start::at(0, (rest, 1.0), (rest, 0.1), (UnitQuaternion::identity(), 0.01))).unwrap();
        let mut history = History::<_, 10, 4, 2>::new(Flown(Box::new(navigator)), 200_000_000).unwrap();
        let specific_force = Vector3::new(0.0, 0.0, EskfParams::default().gravity);
        let sample = |time_ns| ImuMean { time_ns, angular_velocity: rest, specific_force };
        history.propagate(&sample(10_000_000)).unwrap();
        if is_divided {
            history.update(100_000_000, &GnssPosition::new(rest, 1e6, 1e6)).unwrap();
        }
        history.propagate(&sample(190_000_000)).unwrap();
        let (_, covariance) = history.now().0.estimate().unwrap();
        // Of a component of the velocity, and of the heading.
        [covariance[(3, 3)], covariance[(8, 8)]]
    };
    let (whole, divided) = (after(false), after(true));
    assert!(whole[0] > 1.0 && whole[1] > 0.1, "a gap hides much: {whole:?}");
    for (whole, divided) in whole.into_iter().zip(divided) {
        assert!((0.99 * whole..1.2 * whole).contains(&divided), "{whole} and {divided}");
    }
}

/// Filters may differ in what is a gap; the parts of a sample are gaps for all of them if it is one for any.
#[test]
fn the_shortest_sample_decides_what_is_a_gap() {
    let filter = |longest_sample: f64| Eskf::new(EskfParams { longest_sample, ..EskfParams::default() }).unwrap();
    let bank: Bank<crate::navigation::Navigation, 15, 2> = Bank::new([(filter(0.2), 1.0), (filter(0.05), 1.0)]);
    assert_eq!(bank.longest_sample(), 0.05);
}

/// A sample that one filter takes for a gap and the other does not, with a fix that arrives only after it.
#[test]
fn filters_that_differ_in_what_is_a_gap_fuse_late_fixes_as_in_time() {
    #[derive(Clone, PartialEq, Debug)]
    struct Pair(Bank<crate::navigation::Navigation, 15, 2>, [Stream; 2]);

    impl Replayed for Pair {
        type Filter = Bank<crate::navigation::Navigation, 15, 2>;
        type Measurement = GnssPosition;

        fn filter(&self) -> &Self::Filter {
            &self.0
        }

        fn filter_mut(&mut self) -> &mut Self::Filter {
            &mut self.0
        }

        fn update(&mut self, fix: &GnssPosition) -> Result<Fused, Refusal> {
            self.0.update(&mut self.1, fix)
        }
    }

    let filter = |longest_sample: f64| Eskf::new(EskfParams { longest_sample, ..EskfParams::default() }).unwrap();
    let mut bank = Bank::new([(filter(0.3), 1.0), (filter(0.1), 1.0)]);
    let rest = Vector3::zeros();
    bank.start(&Start::at(0, (rest, 1.0), (rest, 0.1), (UnitQuaternion::identity(), 0.01))).unwrap();
    let after = |arrives_ns: i64| {
        let mut history = History::<_, 10, 4, 2>::new(Pair(bank.clone(), Default::default()), 0).unwrap();
        let specific_force = Vector3::new(0.0, 0.0, EskfParams::default().gravity);
        for time_ns in [10_000_000, 20_000_000, 220_000_000, 230_000_000] {
            history.propagate(&ImuMean { time_ns, angular_velocity: rest, specific_force }).unwrap();
            if time_ns == arrives_ns {
                history.update(20_000_000, &GnssPosition::new(rest, 1.0, 1.0)).unwrap();
            }
        }
        history.now().clone()
    };
    assert_eq!(after(20_000_000), after(230_000_000));
}

/// Like that of a single filter, the covariance of each is raised until the fix fits.
#[test]
fn a_fix_that_overrides_the_gates_raises_every_covariance() {
    let (mut bank, [_, mut gnss]) = fly(0.0);
    let before = bank.weights();
    let far = GnssPosition::new(Vector3::new(1200.0, 1e3, 0.0), 1.0, 1.0);
    for _ in 0..3 {
        assert!(bank.update(&mut gnss, &far).is_err());
    }
    let fused = bank.update(&mut gnss, &far).unwrap();
    assert!(fused.raised > 1.0, "{fused:?}");
    for (i, filter) in bank.filters().iter().enumerate().filter(|(i, _)| before[*i] > 0.0) {
        assert_eq!(gnss[i].counts().recoveries, 1);
        let off = (filter.estimate().unwrap().position - far.position).norm();
        assert!(off < 5.0 && filter.is_consistent(), "{i}: {off} m");
    }
    assert_eq!(bank.weights(), before);
}
