//! A flight with a camera that looks down: 100 m above the ground at 15 m/s, with tracks of landmarks as in
//! `gen_simflight.py`. A landmark is lost at one keyframe in twenty, or where it leaves the image.

use bb_core::nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector2, Vector3};
use bb_estimators::navigation::{
    AbsolutePose, Camera, FixedLagSmoother, ImuMean, LandmarkParams, Observation, Optional, Refusal, RelativePose,
    SmootherParams, Start, States, Stream,
};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal, StandardUniform};
use std::error::Error;
use std::hint::black_box;

/// States of the smoother: those of navigation, and the scale of relative poses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scaled;

impl States for Scaled {
    const OPTIONAL: &'static [Optional] = &[Optional::RelativeScale];
}

/// Samples of the IMU from one keyframe to the next.
pub const SAMPLES: i64 = 4;
/// The length of a sample.
pub const SAMPLE_NS: i64 = 25_000_000;

/// The probability that a landmark is lost at a keyframe.
const LOST: f64 = 0.05;

/// A generator of keyframes; see the module.
#[derive(Debug)]
pub struct Overflight {
    camera: Camera,
    random: ChaCha8Rng,
    begin: Vector3<f64>,
    speed: Vector3<f64>,
    count: usize,
    keyframe: u64,
    active: Vec<(u64, Vector3<f64>)>,
    next: u64,
}

/// Measurements from one keyframe to the next.
#[derive(Clone, Debug)]
pub struct Keyframe {
    id: u64,
    samples: Vec<ImuMean>,
    way: RelativePose,
    pose: Option<AbsolutePose>,
    seen: Vec<Observation>,
}

impl Overflight {
    /// A flight with so many landmarks in each image.
    pub fn new(count: usize) -> Self {
        let down = Matrix3::new(0.0, -1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, -1.0);
        Self {
            camera: Camera {
                body_from_camera: UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(down)),
                ..Camera::pinhole((458.0, 458.0), (376.0, 240.0), (752.0, 480.0))
            },
            random: ChaCha8Rng::seed_from_u64(54_321),
            begin: Vector3::new(0.0, 0.0, 100.0),
            speed: Vector3::new(15.0, 0.0, 0.0),
            count,
            keyframe: 0,
            active: Vec::new(),
            next: 0,
        }
    }

    /// The next keyframe.
    ///
    /// # Errors
    ///
    /// If the camera cannot see one of its own pixels.
    pub fn next_keyframe(&mut self) -> Result<Keyframe, Box<dyn Error>> {
        self.keyframe += 1;
        let (id, camera) = (self.keyframe, self.camera);
        let samples = (1..=SAMPLES).map(|i| ImuMean {
            time_ns: ((id as i64 - 1) * SAMPLES + i) * SAMPLE_NS,
            angular_velocity: self.vector(1e-3),
            specific_force: Vector3::new(0.0, 0.0, 9.80665) + self.vector(1e-2),
        });
        let samples = samples.collect();
        let step = self.speed * (SAMPLES * SAMPLE_NS) as f64 * 1e-9;
        let position = self.begin + step * id as f64;
        let turn = UnitQuaternion::from_scaled_axis(self.vector(1e-3));
        let way = RelativePose::new(id - 1, (step + self.vector(0.02), 0.02), (turn, 1e-3));
        let turn = UnitQuaternion::from_scaled_axis(self.vector(0.03));
        let pose = AbsolutePose::new((position + self.vector(1.0), 1.0), (turn, 0.03));
        let pixel = |place: &Vector3<f64>| {
            let in_camera = camera.body_from_camera.inverse_transform_vector(&(place - position));
            let seen = camera.seen(&in_camera).ok()?.pixel;
            (0..2).all(|i| (5.0..camera.size[i] - 5.0).contains(&seen[i])).then_some(seen)
        };
        let random = &mut self.random;
        self.active.retain(|(_, place)| pixel(place).is_some() && uniform(random) > LOST);
        let known = self.active.len();
        while self.active.len() < self.count {
            let chosen = Vector2::new(20.0 + 712.0 * self.uniform(), 20.0 + 440.0 * self.uniform());
            let ray = camera.body_from_camera * camera.undistorted(&chosen)?.direction.push(1.0);
            let depth = self.begin.z - 15.0 * self.uniform();
            self.active.push((self.next, position + ray * depth));
            self.next += 1;
        }
        let mut seen = Vec::with_capacity(self.count);
        for index in 0..self.active.len() {
            let Some((landmark, place)) = self.active.get(index).copied() else { continue };
            let Some(exact) = pixel(&place) else { continue };
            let guess = (index >= known).then(|| (place + self.vector(10.0), 10.0));
            seen.push(Observation { guess, ..Observation::new(landmark, exact + self.vector(1.0).xy(), 1.0) });
        }
        Ok(Keyframe { id, samples, way, pose: id.is_multiple_of(10).then_some(pose), seen })
    }

    fn uniform(&mut self) -> f64 {
        uniform(&mut self.random)
    }

    fn vector(&mut self, deviation: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| deviation * Distribution::<f64>::sample(&StandardNormal, &mut self.random))
    }
}

fn uniform(random: &mut ChaCha8Rng) -> f64 {
    Distribution::<f64>::sample(&StandardUniform, random)
}

/// A smoother and its streams.
#[derive(Debug)]
pub struct Pilot {
    smoother: FixedLagSmoother<Scaled, { Scaled::DIMENSION }>,
    anchors: Stream,
    odometry: Stream,
    observations: Stream,
}

impl Pilot {
    /// A smoother at the start of a flight.
    ///
    /// # Errors
    ///
    /// A parameter outside its range.
    pub fn new(params: SmootherParams, flight: &Overflight) -> Result<Self, Box<dyn Error>> {
        let mut smoother = FixedLagSmoother::new(params)?;
        // A window of 100 holds five times the landmarks that one of 20 does.
        smoother.set_camera(flight.camera, LandmarkParams { landmarks: 2000, ..LandmarkParams::default() })?;
        let level = UnitQuaternion::identity();
        smoother.start(0, &Start::at(0, (flight.begin, 1.0), (flight.speed, 0.1), (level, 0.03)))?;
        let stream = Stream::default();
        Ok(Self { smoother, anchors: stream, odometry: stream, observations: stream })
    }

    /// Takes the samples of the IMU.
    ///
    /// # Errors
    ///
    /// If one is refused.
    pub fn propagate(&mut self, keyframe: &Keyframe) -> Result<(), Refusal> {
        keyframe.samples.iter().try_for_each(|sample| self.smoother.propagate(black_box(sample)))
    }

    /// All processing at a keyframe: measurements, update, estimate and covariance of the pose.
    ///
    /// # Errors
    ///
    /// If something is refused, but not by its gate.
    pub fn fly(&mut self, keyframe: &Keyframe) -> Result<(), Refusal> {
        let Self { smoother, anchors, odometry, observations } = self;
        smoother.add_keyframe(keyframe.id)?;
        passed(smoother.add(odometry, keyframe.id, keyframe.way))?;
        if let Some(pose) = keyframe.pose {
            passed(smoother.add(anchors, keyframe.id, pose))?;
        }
        for observation in &keyframe.seen {
            passed(smoother.observe(observations, keyframe.id, black_box(observation)))?;
        }
        smoother.update()?;
        black_box((smoother.estimate(), smoother.pose_covariance()));
        Ok(())
    }
}

/// One in 10,000 is far out, as the gate has it.
///
/// # Errors
///
/// Any other reason.
pub fn passed<T>(result: Result<T, Refusal>) -> Result<(), Refusal> {
    match result {
        Ok(_) | Err(Refusal::Gate { .. }) => Ok(()),
        Err(error) => Err(error),
    }
}
