//! The figures of the algorithms on one motion, which are those of the standard library's functions and of libm's: `.ci/run` runs
//! this test with each.

use bb_estimators::attitude::{AnyFilter, AnyParams, AttitudeFilter, FilterParams, ImuSample};
use bb_estimators::navigation::planar::{PlanarFilter, PlanarParams, PlanarPosition, PlanarStart};
#[cfg(feature = "smoother")]
use bb_estimators::navigation::{AbsolutePose, FixedLagSmoother, SmootherParams};
use bb_estimators::navigation::{
    EskfFilter, EskfParams, GnssPosition, ImuMean, NAVIGATION, Navigation, Start, Stream,
};
use nalgebra::{UnitQuaternion, Vector2, Vector3};
use std::error::Error;

const GRAVITY: f64 = 9.80665;
const PERIOD_S: f64 = 0.02;
const SAMPLES: i64 = 3000;
/// The largest difference between the figures of two libraries.
const ROUNDING: f64 = 1e-9;

/// One minute of a body that turns about all axes and hardly moves.
fn motion() -> impl Iterator<Item = (i64, Vector3<f64>, UnitQuaternion<f64>)> {
    let mut orientation = UnitQuaternion::from_euler_angles(0.2, -0.1, 0.7);
    (1..=SAMPLES).map(move |sample| {
        let time_s = sample as f64 * PERIOD_S;
        let rate = Vector3::new(0.3 * (0.7 * time_s).sin(), 0.4 * (0.9 * time_s).cos(), 0.5 * (0.3 * time_s).sin());
        orientation *= UnitQuaternion::from_scaled_axis(rate * PERIOD_S);
        (sample * 20_000_000, rate, orientation)
    })
}

/// The specific force of a body with this orientation, which moves east and west.
fn specific_force(time_ns: i64, world_from_body: &UnitQuaternion<f64>) -> Vector3<f64> {
    let acceleration = Vector3::x() * (0.5 * (1.3e-9 * time_ns as f64).sin());
    world_from_body.inverse() * (acceleration + Vector3::z() * GRAVITY)
}

/// The position of the body of [`specific_force`], to about a decimetre.
fn position(time_ns: i64) -> Vector3<f64> {
    Vector3::x() * (-0.5 / (1.3 * 1.3) * (1.3e-9 * time_ns as f64).sin())
}

fn attitude(params: FilterParams) -> Result<[f64; 3], Box<dyn Error>> {
    let mut filter: AnyFilter = AnyFilter::new(AnyParams { filter: params })?;
    let iron = Vector3::new(3e-6, -8e-6, 5e-6);
    for (time_ns, rate, world_from_body) in motion() {
        filter.update(&ImuSample {
            time_ns,
            angular_velocity: rate + Vector3::new(0.01, -0.005, 0.008),
            specific_force: specific_force(time_ns, &world_from_body),
            magnetic_field: Some(world_from_body.inverse() * Vector3::new(1e-6, 20e-6, -43e-6) + iron),
        })?;
    }
    Ok(filter.world_from_body().ok_or("it has an orientation")?.scaled_axis().into())
}

fn sample(time_ns: i64, rate: Vector3<f64>, world_from_body: &UnitQuaternion<f64>) -> ImuMean {
    ImuMean { time_ns, angular_velocity: rate, specific_force: specific_force(time_ns, world_from_body) }
}

fn start() -> Start {
    let orientation = UnitQuaternion::from_euler_angles(0.25, -0.05, 0.6);
    Start::at(0, (position(0), 5.0), (Vector3::zeros(), 0.5), (orientation, 0.2))
}

fn eskf() -> Result<[f64; 3], Box<dyn Error>> {
    let mut filter = EskfFilter::<Navigation, NAVIGATION>::new(EskfParams::default())?;
    let mut fixes = Stream::default();
    filter.start(&start())?;
    for (time_ns, rate, world_from_body) in motion() {
        filter.propagate(&sample(time_ns, rate, &world_from_body))?;
        if time_ns % 1_000_000_000 == 0 {
            filter.update(&mut fixes, &GnssPosition::new(position(time_ns) + Vector3::repeat(0.3), 0.5, 1.0))?;
        }
    }
    let estimate = filter.estimate().ok_or("it has an estimate")?;
    Ok((estimate.position + estimate.world_from_body.scaled_axis()).into())
}

fn planar() -> Result<[f64; 3], Box<dyn Error>> {
    let mut filter = PlanarFilter::new(PlanarParams::default())?;
    let mut fixes = Stream::default();
    filter.start(&PlanarStart::at(0, (Vector2::zeros(), 5.0), (0.0, 0.1), (Vector2::x(), 0.1)))?;
    for (time_ns, rate, _) in motion() {
        let rate = Vector3::z() * rate.z;
        filter.propagate(&sample(time_ns, rate, &UnitQuaternion::identity()))?;
        if time_ns % 1_000_000_000 == 0 {
            filter.update(&mut fixes, &PlanarPosition::new(position(time_ns).xy(), 0.5))?;
        }
    }
    let estimate = filter.estimate().ok_or("it has an estimate")?;
    Ok([estimate.position.x, estimate.position.y, estimate.velocity.x])
}

#[cfg(feature = "smoother")]
fn smoother() -> Result<[f64; 3], Box<dyn Error>> {
    let mut smoother: FixedLagSmoother = FixedLagSmoother::new(SmootherParams::default())?;
    let mut anchors = Stream::default();
    smoother.start(0, &start())?;
    for (time_ns, rate, world_from_body) in motion() {
        smoother.propagate(&sample(time_ns, rate, &world_from_body))?;
        if time_ns % 1_000_000_000 == 0 {
            let keyframe = (time_ns / 1_000_000_000) as u64;
            smoother.add_keyframe(keyframe)?;
            smoother.add(
                &mut anchors,
                keyframe,
                AbsolutePose::new((position(time_ns), 0.5), (world_from_body, 0.05)),
            )?;
            smoother.update()?;
        }
    }
    let estimate = smoother.estimate().ok_or("it has an estimate")?;
    Ok((estimate.position + estimate.world_from_body.scaled_axis()).into())
}

#[test]
fn figures_are_those_of_either_library() -> Result<(), Box<dyn Error>> {
    let mut found = Vec::new();
    for params in FilterParams::ALL {
        let params = params();
        found.push((params.name(), attitude(params)?));
    }
    found.push(("eskf", eskf()?));
    found.push(("planar", planar()?));
    #[cfg(feature = "smoother")]
    found.push(("smoother", smoother()?));
    let is_as_stored = |(name, figures): &(&str, [f64; 3])| {
        let stored = STORED.iter().find(|(stored, _)| stored == name);
        stored.is_some_and(|(_, stored)| {
            std::iter::zip(figures, stored).all(|(found, stored)| (found - stored).abs() < ROUNDING)
        })
    };
    found.retain(|figures| !is_as_stored(figures));
    assert!(found.is_empty(), "other figures than stored: {found:#?}");
    Ok(())
}

/// Figures with the standard library's functions.
const STORED: &[(&str, [f64; 3])] = &[
    ("mekf", [0.2478149179080035, -1.9012087504976372, 0.3890457849906966]),
    ("madgwick", [0.22394602459538238, -1.9383856155900634, 0.38113392679998526]),
    ("vqf", [0.12634909114338194, -1.9040607796594444, 0.3069625119347485]),
    ("complementary", [0.03737492054469131, -1.9076499017631567, 0.27969546771061204]),
    ("mahony", [0.0537352667592763, -1.9119374906087425, 0.2731517825959204]),
    ("fusion", [0.08152522433232366, -1.9185782813116157, 0.30048389588166957]),
    ("tilt", [0.13812774799068844, -1.9048685203896303, 0.38410030745843676]),
    ("eskf", [-0.03674764506937998, -1.388059563618028, 0.6759965728164785]),
    ("planar", [-0.19475440090487195, 0.022244987238331886, -0.015269154191961523]),
    ("smoother", [-0.16661675769890733, -1.7355621017308038, 0.37584109485464384]),
];
