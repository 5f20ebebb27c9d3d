//! Landmarks in the images of a camera.

use super::*;
use crate::navigation::Camera;
use crate::navigation::noise::Noise;
use nalgebra::{Rotation3, Vector2};

const PIXEL: f64 = 1.0;

/// A camera that looks down, on a lens with distortion.
fn camera() -> Camera {
    let down = Matrix3::new(0.0, -1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, -1.0);
    Camera {
        distortion: [-0.05, 0.01, 0.0, 2e-4, -1e-4],
        body_from_camera: UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(down)),
        position: Vector3::new(0.1, 0.0, -0.05),
        ..Camera::pinhole((458.0, 458.0), (376.0, 240.0), (752.0, 480.0))
    }
}

/// The images of a flight over ground 40 m below, with `count` landmarks each, which are followed for as long as they are seen.
fn images(length_s: i64, seed: u64, count: usize) -> Vec<ImageFeatures> {
    let mut noise = Noise::new(seed ^ 0x5eed);
    let camera = camera();
    let mut places: Vec<(u64, Vector3<f64>)> = Vec::new();
    let mut next = 0;
    let frames = 1..=length_s * SECOND / FRAME;
    let image = |i: i64| {
        let truth = Flight::truth(i * FRAME);
        let world_from_camera = truth.world_from_body * camera.body_from_camera;
        let centre = truth.position + truth.world_from_body * camera.position;
        let pixel = |place: &Vector3<f64>| {
            let seen = camera.seen(&(world_from_camera.inverse() * (place - centre))).ok()?.pixel;
            (0..2).all(|i| (6.0..camera.size[i] - 6.0).contains(&seen[i])).then_some(seen)
        };
        places.retain(|(_, place)| pixel(place).is_some());
        while places.len() < count {
            let at = Vector2::new(noise.between(10.0, 742.0), noise.between(10.0, 470.0));
            let ray = camera.undistorted(&at).unwrap().direction.push(1.0);
            places.push((next, centre + world_from_camera * ray * noise.between(25.0, 55.0)));
            next += 1;
        }
        let seen = places.iter().filter_map(|(landmark, place)| {
            let pixel = pixel(place)? + noise.vector(PIXEL).xy();
            Some(Feature { landmark: *landmark, pixel, deviation_px: PIXEL })
        });
        ImageFeatures { time_ns: i * FRAME, features: seen.collect() }
    };
    frames.map(image).collect()
}

fn with_camera(flight: &Flight) -> Estimator {
    let config = StateEstimatorConfig { camera: Some(camera()), ..config(StrategyKind::FixedLagSmoother) };
    let mut estimator = FlightNavigator::new(config, Events::new()).unwrap();
    estimator.warm_start(flight.warm_start(0)).unwrap();
    estimator.add_imu(&flight.samples[0]).unwrap();
    estimator
}

/// Estimator after a flight with one anchor at 2 s, whose images each arrive `late_ns` after their stamps.
fn flown(flight: &Flight, images: &[ImageFeatures], late_ns: i64) -> Estimator {
    let mut estimator = with_camera(flight);
    let mut left = images.iter();
    let mut next = left.next();
    for sent in flight.sent(false, false, false) {
        sent.to(&mut estimator).unwrap();
        let now_ns = sent.time_ns();
        while let Some(image) = next.filter(|image| image.time_ns + late_ns <= now_ns) {
            ignore(estimator.add_features(image.clone()));
            next = left.next();
        }
        if now_ns == 2 * SECOND + 10 * STEP {
            estimator.add_pose_anchor(flight.anchors[1]).unwrap();
        }
    }
    next.into_iter().chain(left).for_each(|image| ignore(estimator.add_features(image.clone())));
    estimator
}

/// Position error, m, and its square over the covariance.
fn error(flight: &Flight, estimator: &mut Estimator, time_ns: i64) -> (f64, f64) {
    let output = estimator.predicted(time_ns).unwrap();
    let off = flight.off(&output);
    let covariance = output.covariance.fixed_view::<3, 3>(0, 0).into_owned();
    (off.norm(), off.dot(&(covariance.try_inverse().unwrap() * off)))
}

/// Half a minute after the only anchor. The gate of the next ones is the filter's, which must know the motion as well as the window does: no
/// better, or it refuses good ones, and no worse, or it takes wrong ones.
#[test]
fn landmarks_are_the_visual_odometry() {
    let (length, seeds) = (32, 1..=4);
    let (mut offs, mut errors, mut anchors) = ([0.0; 2], [0.0; 2], 0.0);
    for seed in seeds.clone() {
        let flight = Flight::new(length, seed);
        let images = images(length, seed, 20);
        let [mut blind, mut seeing] = [&images[..0], &images].map(|images| flown(&flight, images, 0));
        for (i, estimator) in [&mut blind, &mut seeing].into_iter().enumerate() {
            let (off, nees) = error(&flight, estimator, length * SECOND);
            offs[i] += off;
            errors[i] += nees;
        }
        assert_eq!((blind.label(), seeing.label()), (SourceLabel::DeadReckoned, SourceLabel::VisualPropagated));
        let (time_ns, truth) = (length * SECOND, Flight::truth(length * SECOND));
        let anchor = |provider: u32, off: Vector3<f64>| {
            let position = flight.frame.geodetic(&(truth.position + off));
            let world_from_body = truth.world_from_body;
            PoseAnchor { time_ns, provider, position, world_from_body, ..flight.anchors[0] }
        };
        let (good, wrong) = (anchor(0, Vector3::zeros()), anchor(1, Vector3::new(150.0, -100.0, 0.0)));
        assert!(blind.add_pose_anchor(wrong).is_ok(), "{seed}: the IMU alone does not know better");
        let refused = seeing.add_pose_anchor(wrong);
        assert!(is_gated(&refused), "{seed}: {refused:?}");
        match seeing.add_pose_anchor(good) {
            Ok(Added::Taken { nis: Some(nis) }) => anchors += nis,
            other => panic!("{seed}: {other:?}"),
        }
    }
    let count = seeds.count() as f64;
    assert!(offs[1] < 0.02 * offs[0], "{offs:?}");
    // Three if its covariance is right; without positions, the IMU counts as less good than it is.
    assert!((0.3..4.0).contains(&(errors[1] / count)), "{errors:?}");
    assert!(anchors / count < 0.5, "{}", anchors / count);
}

/// A landmark that was seen once says nothing, and an image of such landmarks is no camera for the label.
#[test]
fn landmarks_that_wait_are_no_camera() {
    let flight = Flight::new(5, 1);
    let mut images = images(5, 1, 12);
    let all = images.iter_mut().flat_map(|image| &mut image.features);
    all.enumerate().for_each(|(i, feature)| feature.landmark = i as u64);
    let mut estimator = flown(&flight, &images, 0);
    assert_eq!(count(estimator.sink(), "degraded"), 0);
    assert_eq!(estimator.label(), SourceLabel::DeadReckoned);
    let mut alone = flown(&flight, &[], 0);
    let [with, without] = [&mut estimator, &mut alone].map(|estimator| error(&flight, estimator, 5 * SECOND).0);
    assert!((with - without).abs() < 0.1 * without, "{with} {without}");
}

/// Images that come 0.7 s late give the same bits as those in order.
#[test]
fn images_may_come_late() {
    let flight = Flight::new(3, 2);
    let images = images(3, 2, 12);
    let [mut in_order, mut late] = [0, 7 * FRAME].map(|late_ns| flown(&flight, &images, late_ns));
    assert!(late.counts().late > 10, "{:?}", late.counts());
    assert_eq!(answers(&mut in_order), answers(&mut late));
}

#[test]
fn what_is_wrong_is_refused_by_name() {
    let flight = Flight::new(3, 1);
    let images = images(3, 1, 12);
    let (last, before) = images.split_last().unwrap();
    let with = |change: &dyn Fn(&mut Feature)| {
        let mut image = last.clone();
        image.features.truncate(1);
        image.features.iter_mut().for_each(change);
        image
    };
    let cases = [
        (with(&|feature| feature.pixel.x = f64::NAN), Refusal::NonFinite),
        (with(&|feature| feature.deviation_px = f64::INFINITY), Refusal::NonFinite),
        (with(&|feature| feature.deviation_px = 0.0), Refusal::Noise),
        (with(&|feature| feature.deviation_px = -1.0), Refusal::Noise),
        (with(&|feature| feature.pixel.x = 752.5), Refusal::OutOfRange),
        (with(&|feature| feature.pixel = Vector2::repeat(1e300)), Refusal::OutOfRange),
    ];
    for (image, refusal) in cases {
        let mut estimator = flown(&flight, before, 0);
        assert_eq!(estimator.add_features(image), degraded(refusal));
        assert!(estimator.predicted(3 * SECOND).is_some());
    }
    let mut estimator = flown(&flight, before, 0);
    // Landmarks that do not fit are left out by themselves.
    let mut image = last.clone();
    let inwards = camera().centre - image.features[0].pixel;
    image.features[0].pixel += inwards.normalize() * 100.0;
    let twice = image.features[1];
    image.features.push(twice);
    assert!(matches!(estimator.add_features(image.clone()), Ok(Added::Taken { nis: Some(nis) }) if nis < 3.0));
    assert_eq!(estimator.add_features(image.clone()), degraded(Reason::Duplicate));
    let mut estimator = flown(&flight, before, 0);
    image.features.truncate(1);
    let refused = estimator.add_features(image);
    assert!(is_gated(&refused), "{refused:?}");
    // Without a camera, or without a window, nothing says where a landmark is.
    for strategy in StrategyKind::ALL {
        let mut estimator = started(&flight, *strategy);
        flight.sent(false, false, false).iter().for_each(|sent| sent.to(&mut estimator).unwrap());
        let refused = estimator.add_features(last.clone());
        assert_eq!(refused, degraded(Refusal::NotObservable), "{strategy:?}");
    }
    let lens = Camera { focal_length: Vector2::new(0.0, 400.0), ..camera() };
    let config = StateEstimatorConfig { camera: Some(lens), ..StateEstimatorConfig::default() };
    assert_eq!(FlightNavigator::<()>::new(config, ()).unwrap_err().parameter, "camera");
}
