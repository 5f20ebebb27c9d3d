//! What a keyframe of the fixed-lag smoother costs: with the usual thresholds, and with all of the window linearised and
//! eliminated again each time, and with landmarks; and what a sample of the IMU does.
//!
//! `cargo bench -p bb-benches --bench smoother` prints one JSON object a line. A number of keyframes as argument makes one long
//! run of a window of 20 in place of these, and prints its first and its last tenth, and the memory in use.

use bb_core::nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector2, Vector3};
use bb_estimators::navigation::{
    AbsolutePose, Camera, EskfParams, FixedLagSmoother, ImuMean, LandmarkParams, Observation, Optional,
    Preintegration, Refusal, RelativePose, SmootherParams, Start, States, Stream,
};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal, StandardUniform};
use std::error::Error;
use std::hint::black_box;
use std::time::Instant;

#[derive(Clone, Copy, Debug, PartialEq)]
struct Scaled;

impl States for Scaled {
    const OPTIONAL: &'static [Optional] = &[Optional::RelativeScale];
}

type Smoother = FixedLagSmoother<Scaled, { Scaled::DIMENSION }>;

/// Samples of the IMU from one keyframe to the next, and their length.
const SAMPLES: i64 = 4;
const SAMPLE_NS: i64 = 25_000_000;

fn main() -> Result<(), Box<dyn Error>> {
    let keyframes = std::env::args().find_map(|argument| argument.parse::<usize>().ok());
    if let Some(keyframes) = keyframes {
        let times = run(SmootherParams::default(), keyframes)?;
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
        println!("{}", line("keyframe", window, &run(params, 2000)?));
        let all = SmootherParams { relinearise_rotation: 0.0, iterations: 1, ..params };
        println!("{}", line("keyframe_all_again", window, &run(all, 300)?));
    }
    for landmarks in [30, 100] {
        let times = run_with_landmarks(SmootherParams::default(), landmarks, 1000)?;
        println!("{}", line(&format!("keyframe_{landmarks}_landmarks"), 20, &times));
    }
    println!("{{\"name\": \"imu_sample\", \"us\": {:.3}}}", sample_us());
    Ok(())
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
        refused(smoother.add(&mut odometry, k, way))?;
        if k.is_multiple_of(10) {
            refused(smoother.add(&mut anchors, k, pose))?;
        }
        smoother.update()?;
        black_box((smoother.estimate(), smoother.pose_covariance()));
        times.push(u32::try_from(began.elapsed().as_nanos()).unwrap_or(u32::MAX));
    }
    Ok(times)
}

/// The time of each keyframe with as many landmarks in every image, ns: 100 m above the ground at 15 m/s, with tracks as in
/// `gen_simflight.py`: a landmark is lost at one keyframe in twenty, or where it leaves the image.
fn run_with_landmarks(params: SmootherParams, count: usize, keyframes: usize) -> Result<Vec<u32>, Box<dyn Error>> {
    let down = Matrix3::new(0.0, -1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, -1.0);
    let camera = Camera {
        body_from_camera: UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(down)),
        ..Camera::pinhole((458.0, 458.0), (376.0, 240.0), (752.0, 480.0))
    };
    let mut smoother = Smoother::new(params)?;
    smoother.set_camera(camera, LandmarkParams { landmarks: 1000, ..LandmarkParams::default() })?;
    let mut noise = Noise(ChaCha8Rng::seed_from_u64(54_321));
    let (level, speed, height) = (UnitQuaternion::identity(), Vector3::new(15.0, 0.0, 0.0), 100.0);
    let begin = Vector3::new(0.0, 0.0, height);
    smoother.start(0, &Start::at(0, (begin, 1.0), (speed, 0.1), (level, 0.03)))?;
    let (mut anchors, mut odometry, mut sights) = (Stream::default(), Stream::default(), Stream::default());
    let mut times = Vec::with_capacity(keyframes);
    let (mut active, mut next): (Vec<(u64, Vector3<f64>)>, u64) = (Vec::new(), 0);
    for k in 1..=keyframes as u64 {
        for i in 1..=SAMPLES {
            let time_ns = ((k as i64 - 1) * SAMPLES + i) * SAMPLE_NS;
            let specific_force = Vector3::new(0.0, 0.0, 9.80665) + noise.vector(1e-2);
            smoother.propagate(&ImuMean { time_ns, angular_velocity: noise.vector(1e-3), specific_force })?;
        }
        let step = speed * (SAMPLES * SAMPLE_NS) as f64 * 1e-9;
        let position = begin + step * k as f64;
        let turn = UnitQuaternion::from_scaled_axis(noise.vector(1e-3));
        let way = RelativePose::new(k - 1, (step + noise.vector(0.02), 0.02), (turn, 1e-3));
        let turn = UnitQuaternion::from_scaled_axis(noise.vector(0.03));
        let pose = AbsolutePose::new((position + noise.vector(1.0), 1.0), (turn, 0.03));
        let pixel = |place: &Vector3<f64>| {
            let seen =
                camera.seen(&camera.body_from_camera.inverse_transform_vector(&(place - position))).ok()?.pixel;
            (0..2).all(|i| (5.0..camera.size[i] - 5.0).contains(&seen[i])).then_some(seen)
        };
        active.retain(|(_, place)| pixel(place).is_some() && noise.uniform() > 0.05);
        let known = active.len();
        while active.len() < count {
            let chosen = Vector2::new(20.0 + 712.0 * noise.uniform(), 20.0 + 440.0 * noise.uniform());
            let ray = camera.body_from_camera * camera.undistorted(&chosen)?.direction.push(1.0);
            active.push((next, position + ray * (height - 15.0 * noise.uniform())));
            next += 1;
        }
        let mut seen = Vec::with_capacity(count);
        for (index, (id, place)) in active.iter().enumerate() {
            let Some(exact) = pixel(place) else { continue };
            let guess = (index >= known).then(|| (place + noise.vector(10.0), 10.0));
            seen.push(Observation { guess, ..Observation::new(*id, exact + noise.vector(1.0).xy(), 1.0) });
        }
        let began = Instant::now();
        smoother.add_keyframe(k)?;
        refused(smoother.add(&mut odometry, k, way))?;
        if k.is_multiple_of(10) {
            refused(smoother.add(&mut anchors, k, pose))?;
        }
        for observation in &seen {
            refused(smoother.observe(&mut sights, k, observation))?;
        }
        smoother.update()?;
        black_box((smoother.estimate(), smoother.pose_covariance()));
        times.push(u32::try_from(began.elapsed().as_nanos()).unwrap_or(u32::MAX));
    }
    Ok(times)
}

/// One in 10,000 is far out, as the gate has it.
fn refused<T>(result: Result<T, Refusal>) -> Result<(), Refusal> {
    match result {
        Ok(_) | Err(Refusal::Gate { .. }) => Ok(()),
        Err(error) => Err(error),
    }
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
    fn uniform(&mut self) -> f64 {
        Distribution::<f64>::sample(&StandardUniform, &mut self.0)
    }

    fn vector(&mut self, deviation: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| deviation * Distribution::<f64>::sample(&StandardNormal, &mut self.0))
    }
}
