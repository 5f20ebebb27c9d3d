//! Landmarks below a simulated flight, and their observations by a camera.

use core::ops::Range;

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector2, Vector3};

use super::flight::{Flight, Smoother, open};
use crate::navigation::noise::Noise;
use crate::navigation::{Camera, Kernel, LandmarkParams, Observation, Refusal, SmootherParams, Stream};

/// The deviation of a pixel.
pub(super) const PIXEL: f64 = 1.0;

/// The observations at each keyframe.
pub(super) struct Scenery {
    pub(super) places: Vec<Vector3<f64>>,
    pub(super) seen: Vec<Vec<Observation>>,
}

/// A downward-looking camera with lens distortion.
pub(super) fn camera() -> Camera {
    let down = Matrix3::new(0.0, -1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, -1.0);
    Camera {
        distortion: [-0.05, 0.01, 0.0, 2e-4, -1e-4],
        body_from_camera: UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(down)),
        position: Vector3::new(0.1, 0.0, -0.05),
        ..Camera::pinhole((458.0, 458.0), (376.0, 240.0), (752.0, 480.0))
    }
}

/// Iterates to convergence, with equal weights.
pub(super) fn exact() -> LandmarkParams {
    LandmarkParams { kernel: Kernel::Squares, relinearise: 0.0, ..LandmarkParams::default() }
}

impl Scenery {
    /// `count` landmarks in each image, each seen from at most `longest` keyframes. If `guess` is given, each has a
    /// prior to within that many metres.
    pub(super) fn new(flight: &Flight, seed: u64, count: usize, longest: usize, guess: Option<f64>) -> Self {
        let mut noise = Noise::new(seed ^ 0x5eed);
        let camera = camera();
        let mut scenery = Self { places: Vec::new(), seen: Vec::new() };
        let mut active: Vec<(usize, usize)> = Vec::new();
        for truth in &flight.truth {
            let (camera_from_world, centre) = camera.placed(&truth.position, &truth.world_from_body);
            let pixel = |place: &Vector3<f64>| {
                let seen = camera.seen(&(camera_from_world * (place - centre))).ok()?.pixel;
                let is_inside = (0..2).all(|i| (6.0..camera.size[i] - 6.0).contains(&seen[i]));
                is_inside.then_some(seen)
            };
            active.retain(|(id, age)| *age < longest && pixel(&scenery.places[*id]).is_some());
            while active.len() < count {
                let at = |size: f64, number: f64| size * (0.5 + 0.45 * number.sin());
                let chosen = Vector2::new(at(752.0, 3.0 * noise.next()), at(480.0, 3.0 * noise.next()));
                let depth = 40.0 + 15.0 * noise.next().sin();
                let ray = camera.undistorted(&chosen).unwrap().direction.push(1.0);
                scenery.places.push(centre + camera_from_world.transpose() * ray * depth);
                active.push((scenery.places.len() - 1, 0));
            }
            let mut seen = Vec::new();
            for (id, age) in &mut active {
                let Some(exact) = pixel(&scenery.places[*id]) else { continue };
                let known = guess.filter(|_| *age == 0);
                seen.push(Observation {
                    guess: known.map(|deviation| (scenery.places[*id] + noise.vector(deviation), deviation)),
                    ..Observation::new(*id as u64, exact + noise.vector(PIXEL).xy(), PIXEL)
                });
                *age += 1;
            }
            scenery.seen.push(seen);
        }
        scenery
    }

    /// Adds the observations at keyframe k, ungated.
    pub(super) fn observe(&self, smoother: &mut Smoother, k: usize) {
        for observation in &self.seen[k] {
            // Occasionally the directions do not intersect within their noise, or only behind a camera.
            match smoother.observe(&mut open(), k as u64, observation) {
                Ok(_) | Err(Refusal::NotObservable) => {}
                Err(refusal) => panic!("{k}: {refusal}"),
            }
        }
    }

    /// Adds the observations at keyframe k to a stream, also if it refuses some.
    pub(super) fn observe_in(&self, stream: &mut Stream, smoother: &mut Smoother, k: usize) {
        for observation in &self.seen[k] {
            let _ = smoother.observe(stream, k as u64, observation);
        }
    }

    /// Flies the whole flight with landmarks, with an update at each keyframe.
    pub(super) fn flown(&self, flight: &Flight, params: SmootherParams, landmarks: LandmarkParams) -> Smoother {
        let mut smoother = seeing(flight, params, landmarks);
        self.fly(flight, &mut smoother, 0..flight.samples.len());
        smoother
    }

    /// Flies through some keyframes, with an update at each.
    pub(super) fn fly(&self, flight: &Flight, smoother: &mut Smoother, keyframes: Range<usize>) {
        for k in keyframes {
            if k > 0 {
                flight.advance(smoother, k);
            }
            self.observe(smoother, k);
            if k > 0 {
                smoother.update().unwrap();
            }
        }
    }
}

/// A smoother with a camera at the start of the flight.
pub(super) fn seeing(flight: &Flight, params: SmootherParams, landmarks: LandmarkParams) -> Smoother {
    let mut smoother = Smoother::new(params).unwrap();
    smoother.set_camera(camera(), landmarks).unwrap();
    smoother.start(0, &flight.start).unwrap();
    smoother
}
