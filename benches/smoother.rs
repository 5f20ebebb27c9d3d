//! Cost of a keyframe of the fixed-lag smoother: with the usual thresholds, and with all of the window linearised and eliminated again each
//! time, and with landmarks; and the cost of a sample of the IMU. The time of a keyframe is the least of several runs, so that other work of
//! the machine is not counted.
//!
//! `cargo bench -p bb-benches --bench smoother` prints one JSON object a line. A number of keyframes as argument makes one long
//! run of a window of 20 in place of these, and prints each tenth of it, and the memory in use; a second number is that of the
//! landmarks in each image of that run.

use bb_benches::overflight::{Overflight, Pilot, SAMPLE_NS, SAMPLES, Scaled, passed};
use bb_core::nalgebra::{UnitQuaternion, Vector3};
use bb_estimators::navigation::{
    AbsolutePose, EskfParams, FixedLagSmoother, ImuMean, Preintegration, RelativePose, SmootherParams, Start,
    States, Stream,
};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use std::error::Error;
use std::hint::black_box;
use std::time::Instant;

/// Runs of which the fastest counts.
const RUNS: usize = 7;

type Smoother = FixedLagSmoother<Scaled, { Scaled::DIMENSION }>;

fn main() -> Result<(), Box<dyn Error>> {
    let mut numbers = std::env::args().filter_map(|argument| argument.parse::<usize>().ok());
    if let Some(keyframes) = numbers.next() {
        let times = match numbers.next() {
            Some(landmarks) => run_with_landmarks(SmootherParams::default(), landmarks, keyframes)?,
            None => run(SmootherParams::default(), keyframes)?,
        };
        let tenth = keyframes.div_ceil(10).max(1);
        for (name, part) in times.chunks(tenth).enumerate() {
            println!("{}", line(&format!("tenth_{name}"), 20, part));
        }
        let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
        let resident = status.lines().find(|line| line.starts_with("VmRSS"));
        println!("{{\"name\": \"memory\", \"of\": {:?}}}", resident.unwrap_or("unknown"));
        return Ok(());
    }
    for window in [10, 20, 50, 100] {
        let params = SmootherParams { window, ..SmootherParams::default() };
        println!("{}", line("keyframe", window, &least(|| run(params, 2000))?));
        let all = SmootherParams { relinearise_rotation: 0.0, iterations: 1, ..params };
        println!("{}", line("keyframe_all_again", window, &least(|| run(all, 300))?));
    }
    for (landmarks, window) in [(30, 10), (30, 20), (30, 50), (30, 100), (100, 20)] {
        let params = SmootherParams { window, ..SmootherParams::default() };
        let times = least(|| run_with_landmarks(params, landmarks, 1000))?;
        println!("{}", line(&format!("keyframe_{landmarks}_landmarks"), window, &times));
    }
    println!("{{\"name\": \"imu_sample\", \"us\": {:.3}}}", sample_us());
    Ok(())
}

/// The time of each keyframe in the fastest of several equal runs.
fn least(mut run: impl FnMut() -> Result<Vec<u32>, Box<dyn Error>>) -> Result<Vec<u32>, Box<dyn Error>> {
    let mut least = run()?;
    for _ in 1..RUNS {
        least.iter_mut().zip(run()?).for_each(|(least, time)| *least = time.min(*least));
    }
    Ok(least)
}

fn line(name: &str, window: usize, times: &[u32]) -> String {
    let mut sorted = times.to_vec();
    sorted.sort_unstable();
    let percentile = |part: f64| {
        let index = ((sorted.len().max(1) - 1) as f64 * part) as usize;
        f64::from(sorted.get(index).copied().unwrap_or(0)) * 1e-6
    };
    let (p50, p99) = (percentile(0.5), percentile(0.99));
    format!("{{\"name\": {name:?}, \"window\": {window}, \"p50_ms\": {p50:.4}, \"p99_ms\": {p99:.4}}}")
}

/// The time of each keyframe, ns: odometry at each, a pose in the world at every tenth.
fn run(params: SmootherParams, keyframes: usize) -> Result<Vec<u32>, Box<dyn Error>> {
    let mut smoother = Smoother::new(params)?;
    let mut noise = Noise(ChaCha8Rng::seed_from_u64(12_345));
    let (rest, level) = (Vector3::zeros(), UnitQuaternion::identity());
    smoother.start(0, &Start::at(0, (rest, 1.0), (rest, 0.1), (level, 0.03)))?;
    let (mut anchors, mut odometry) = (Stream::default(), Stream::default());
    let mut times = Vec::with_capacity(keyframes);
    for k in 1..=keyframes as u64 {
        for i in 1..=SAMPLES {
            let time_ns = ((k as i64 - 1) * SAMPLES + i) * SAMPLE_NS;
            let specific_force = Vector3::new(0.0, 0.0, 9.80665) + noise.vector(1e-2);
            smoother.propagate(&ImuMean { time_ns, angular_velocity: noise.vector(1e-3), specific_force })?;
        }
        let turn = UnitQuaternion::from_scaled_axis(noise.vector(1e-3));
        let way = RelativePose::new(k - 1, (noise.vector(0.02), 0.02), (turn, 1e-3));
        let turn = UnitQuaternion::from_scaled_axis(noise.vector(0.03));
        let pose = AbsolutePose::new((noise.vector(1.0), 1.0), (turn, 0.03));
        let began = Instant::now();
        smoother.add_keyframe(k)?;
        passed(smoother.add(&mut odometry, k, way))?;
        if k.is_multiple_of(10) {
            passed(smoother.add(&mut anchors, k, pose))?;
        }
        smoother.update()?;
        black_box((smoother.estimate(), smoother.pose_covariance()));
        times.push(u32::try_from(began.elapsed().as_nanos()).unwrap_or(u32::MAX));
    }
    Ok(times)
}

/// The time of each keyframe with as many landmarks in every image, ns.
fn run_with_landmarks(params: SmootherParams, count: usize, keyframes: usize) -> Result<Vec<u32>, Box<dyn Error>> {
    let mut overflight = Overflight::new(count);
    let mut pilot = Pilot::new(params, &overflight)?;
    let mut times = Vec::with_capacity(keyframes);
    for _ in 0..keyframes {
        let keyframe = overflight.next_keyframe()?;
        pilot.propagate(&keyframe)?;
        let began = Instant::now();
        pilot.fly(&keyframe)?;
        times.push(u32::try_from(began.elapsed().as_nanos()).unwrap_or(u32::MAX));
    }
    Ok(times)
}

/// The least of 20 runs.
fn sample_us() -> f64 {
    let densities = EskfParams::default().densities();
    let mut least = f64::INFINITY;
    for _ in 0..20 {
        let began = Instant::now();
        for _ in 0..1000 {
            let mut motion = Preintegration::new(Vector3::zeros(), Vector3::zeros());
            for i in 0..20 {
                let turn = Vector3::new(0.3, 0.1, 0.01 * f64::from(i));
                motion.add(black_box(&turn), black_box(&Vector3::new(0.1, 0.2, 9.8)), black_box(0.005), &densities);
            }
            black_box(&motion);
        }
        least = least.min(began.elapsed().as_secs_f64() * 1e6 / 20_000.0);
    }
    least
}

/// Noise that is the same in every run.
struct Noise(ChaCha8Rng);

impl Noise {
    fn vector(&mut self, deviation: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| deviation * Distribution::<f64>::sample(&StandardNormal, &mut self.0))
    }
}
