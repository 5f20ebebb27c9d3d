//! The steps, and what is stored for each.

use crate::LONG;
use crate::motion::{Reading, readings};
use bb_core::nalgebra::{UnitQuaternion, Vector2, Vector3};
use bb_estimators::attitude::{AttitudeFilter, ImuSample, MekfFilter, VqfFilter};
use bb_estimators::navigation::planar::{PlanarEkf, PlanarParams, PlanarPosition, PlanarStart};
use bb_estimators::navigation::{
    Eskf, EskfParams, GnssPosition, Height, ImuMean, Navigation, Refusal, Start, Stream,
};
use std::error::Error;
use std::hint::black_box;

/// What is counted.
pub(crate) struct Step {
    pub(crate) name: &'static str,
    /// Each step does this one as well; its instructions are taken off.
    pub(crate) on: Option<&'static str>,
    /// Instructions.
    pub(crate) stored: f64,
    /// Makes so many steps.
    pub(crate) run: fn(usize) -> Result<(), Box<dyn Error>>,
}

/// In `f64`. Those of `Eskf` have 15 states, those of the attitude filters read the orientation too.
pub(crate) const STEPS: &[Step] = &[
    Step { name: "eskf/sample", on: None, stored: 4993.0, run: |steps| eskf(steps, |_, _, _| Ok(())) },
    Step {
        name: "eskf/update_3_with_gate",
        on: Some("eskf/sample"),
        stored: 6236.0,
        run: |steps| {
            eskf(steps, |filter, stream, reading| {
                let fix = GnssPosition::new(reading.position, 1.0, 1.0);
                passed(filter.update(stream, black_box(&fix)))
            })
        },
    },
    Step {
        name: "eskf/update_1_with_gate",
        on: Some("eskf/sample"),
        stored: 2990.0,
        run: |steps| {
            eskf(steps, |filter, stream, reading| {
                let height = Height { height: reading.position.z, deviation: 1.0 };
                passed(filter.update(stream, black_box(&height)))
            })
        },
    },
    Step { name: "planar/sample", on: None, stored: 1074.0, run: |steps| planar(steps, |_, _, _| Ok(())) },
    Step {
        name: "planar/position_with_gate",
        on: Some("planar/sample"),
        stored: 1866.0,
        run: |steps| {
            planar(steps, |filter, stream, reading| {
                let fix = PlanarPosition::new(reading.position.xy(), 1.0);
                passed(filter.update(stream, black_box(&fix)))
            })
        },
    },
    Step { name: "mekf/nine", on: None, stored: 2054.0, run: attitude::<MekfFilter> },
    Step { name: "vqf/nine", on: None, stored: 1879.0, run: attitude::<VqfFilter> },
];

/// The filter takes a sample and is corrected.
fn eskf(
    steps: usize,
    correct: impl Fn(&mut Eskf<Navigation>, &mut Stream, &Reading) -> Result<(), Refusal>,
) -> Result<(), Box<dyn Error>> {
    let readings = readings(LONG);
    let mut filter = Eskf::<Navigation>::new(EskfParams::default())?;
    let mut stream = Stream::default();
    let (origin, level) = (Vector3::zeros(), UnitQuaternion::identity());
    filter.start(&Start::at(0, (origin, 1.0), (origin, 0.1), (level, 0.05)))?;
    for reading in readings.iter().take(steps) {
        filter.propagate(black_box(&sample(reading)))?;
        correct(&mut filter, &mut stream, reading)?;
    }
    black_box(filter);
    Ok(())
}

fn planar(
    steps: usize,
    correct: impl Fn(&mut PlanarEkf, &mut Stream, &Reading) -> Result<(), Refusal>,
) -> Result<(), Box<dyn Error>> {
    let readings = readings(LONG);
    let mut filter = PlanarEkf::new(PlanarParams::default())?;
    let mut stream = Stream::default();
    let rest = Vector2::zeros();
    filter.start(&PlanarStart::at(0, (rest, 1.0), (0.0, 0.1), (rest, 0.1)))?;
    for reading in readings.iter().take(steps) {
        filter.propagate(black_box(&sample(reading)))?;
        correct(&mut filter, &mut stream, reading)?;
    }
    black_box(filter);
    Ok(())
}

fn attitude<F: AttitudeFilter>(steps: usize) -> Result<(), Box<dyn Error>> {
    let readings = readings(LONG);
    let mut filter = F::new(F::Params::default())?;
    for reading in readings.iter().take(steps) {
        let &Reading { time_ns, angular_velocity, specific_force, magnetic_field, .. } = reading;
        let magnetic_field = Some(magnetic_field);
        filter.update(black_box(&ImuSample { time_ns, angular_velocity, specific_force, magnetic_field }))?;
        black_box(filter.world_from_body());
    }
    Ok(())
}

fn sample(reading: &Reading) -> ImuMean {
    let &Reading { time_ns, angular_velocity, specific_force, .. } = reading;
    ImuMean { time_ns, angular_velocity, specific_force }
}

/// One in 10,000 is far out, as the gate has it.
fn passed<T>(result: Result<T, Refusal>) -> Result<(), Refusal> {
    match result {
        Ok(_) | Err(Refusal::Gate { .. }) => Ok(()),
        Err(error) => Err(error),
    }
}
