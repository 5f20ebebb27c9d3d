//! The steps, and what is stored for each.

use crate::hop;
use crate::motion::{Reading, readings};
use crate::{LONG, SHORT};
use bb_benches::overflight::{Overflight, Pilot, passed};
use bb_core::nalgebra::{UnitQuaternion, Vector2, Vector3};
use bb_estimators::attitude::{AttitudeFilter, ImuSample, MekfFilter, VqfFilter};
use bb_estimators::navigation::planar::{PlanarFilter, PlanarParams, PlanarPosition, PlanarStart};
use bb_estimators::navigation::{
    Copies, EskfFilter, EskfParams, Fused, GnssPosition, Height, History, ImuMean, Navigation, Propagate, Refusal,
    Replayed, SmootherParams, Start, Stream, Ways,
};
use std::error::Error;
use std::hint::black_box;

/// Step whose instructions are counted.
pub(crate) struct Step {
    pub(crate) name: &'static str,
    /// Each step does this one as well; its instructions are taken off.
    pub(crate) on: Option<&'static str>,
    /// Steps of the two runs that are subtracted.
    pub(crate) steps: (usize, usize),
    /// Instructions.
    pub(crate) stored: f64,
    /// Makes so many steps.
    pub(crate) run: fn(usize) -> Result<(), Box<dyn Error>>,
}

/// Numbers of steps that take microseconds.
const USUAL: (usize, usize) = (SHORT, LONG);
/// Numbers of keyframes, after the window of 20 is full of tracks.
const KEYFRAMES: (usize, usize) = (60, 160);

/// Steps, in `f64`. Those of `EskfFilter` have 15 states, those of the attitude filters read the orientation too.
pub(crate) const STEPS: &[Step] = &[
    Step { name: "hop/none", on: None, steps: USUAL, stored: 212.0, run: hop::direct },
    // Sixteen hops each.
    Step { name: "hop/chain_16", on: Some("hop/none"), steps: USUAL, stored: 3782.0, run: hop::chain },
    Step { name: "hop/chain_16_measured", on: Some("hop/none"), steps: USUAL, stored: 6067.0, run: hop::measured },
    // By outside code, at a path of its own.
    Step { name: "hop/journaled", on: None, steps: USUAL, stored: 1223.0, run: hop::journaled },
    Step {
        name: "eskf/sample",
        on: None,
        steps: USUAL,
        stored: 5049.0,
        run: |steps| eskf(steps, |_, _, _| Ok(())),
    },
    Step {
        name: "eskf/update_3_with_gate",
        on: Some("eskf/sample"),
        steps: USUAL,
        stored: 19_145.0,
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
        steps: USUAL,
        stored: 10_516.0,
        run: |steps| {
            eskf(steps, |filter, stream, reading| {
                let height = Height { height: reading.position.z, deviation: 1.0 };
                passed(filter.update(stream, black_box(&height)))
            })
        },
    },
    // Late by a sample, so that two samples and two heights are replayed.
    Step { name: "eskf/late_height", on: Some("eskf/sample"), steps: USUAL, stored: 36_060.0, run: late },
    // After the fix with which the search for the noise of the IMU begins.
    Step { name: "eskf/sample_of_3_copies", on: None, steps: USUAL, stored: 15_835.0, run: copies },
    Step {
        name: "planar/sample",
        on: None,
        steps: USUAL,
        stored: 1087.0,
        run: |steps| planar(steps, |_, _, _| Ok(())),
    },
    Step {
        name: "planar/position_with_gate",
        on: Some("planar/sample"),
        steps: USUAL,
        stored: 5732.0,
        run: |steps| {
            planar(steps, |filter, stream, reading| {
                let fix = PlanarPosition::new(reading.position.xy(), 1.0);
                passed(filter.update(stream, black_box(&fix)))
            })
        },
    },
    Step { name: "mekf/nine", on: None, steps: USUAL, stored: 1450.0, run: attitude::<MekfFilter> },
    Step {
        name: "smoother/30_landmarks",
        on: None,
        steps: KEYFRAMES,
        stored: 10_442_158.0,
        run: |steps| smoother(steps, 30),
    },
    Step {
        name: "smoother/100_landmarks",
        on: None,
        steps: KEYFRAMES,
        stored: 19_260_779.0,
        run: |steps| smoother(steps, 100),
    },
    Step { name: "vqf/nine", on: None, steps: USUAL, stored: 1879.0, run: attitude::<VqfFilter> },
];

/// The filter takes a sample and is corrected.
fn eskf(
    steps: usize,
    correct: impl Fn(&mut EskfFilter<Navigation>, &mut Stream, &Reading) -> Result<(), Refusal>,
) -> Result<(), Box<dyn Error>> {
    let readings = readings(LONG);
    let mut filter = EskfFilter::<Navigation>::new(EskfParams::default())?;
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

/// Three copies of the filter, with three multiples of the noise of the IMU, take a sample.
fn copies(steps: usize) -> Result<(), Box<dyn Error>> {
    let readings = readings(LONG);
    let (origin, level) = (Vector3::zeros(), UnitQuaternion::identity());
    let mut copies =
        Copies::<EskfFilter<Navigation>>::new(EskfParams::default(), Ways { noise: true, scale: false })?;
    copies.start(&Start::at(0, (origin, 1.0), (origin, 0.1), (level, 0.05)))?;
    copies.update_fix(&mut Stream::default(), &GnssPosition::new(origin, 1.0, 1.0))?;
    for reading in readings.iter().take(steps) {
        copies.propagate(black_box(&sample(reading)))?;
    }
    black_box(copies);
    Ok(())
}

/// A filter with the stream of its heights.
#[derive(Clone)]
struct Flying(EskfFilter<Navigation>, Stream);

impl Replayed for Flying {
    type Filter = EskfFilter<Navigation>;
    type Measurement = Height;

    fn filter(&self) -> &Self::Filter {
        &self.0
    }

    fn filter_mut(&mut self) -> &mut Self::Filter {
        &mut self.0
    }

    fn update(&mut self, height: &Height) -> Result<Fused, Refusal> {
        self.0.update(&mut self.1, height)
    }
}

/// The filter takes a sample, and a height at the one before.
fn late(steps: usize) -> Result<(), Box<dyn Error>> {
    let readings = readings(LONG);
    let (origin, level) = (Vector3::zeros(), UnitQuaternion::identity());
    let mut filter = EskfFilter::<Navigation>::new(EskfParams::default())?;
    filter.start(&Start::at(0, (origin, 1.0), (origin, 0.1), (level, 0.05)))?;
    let mut history = History::<_, 512, 128, 8>::new(Flying(filter, Stream::default()), 0)?;
    let mut before: Option<&Reading> = None;
    for reading in readings.iter().take(steps) {
        history.propagate(black_box(&sample(reading)))?;
        if let Some(Reading { time_ns, position, .. }) = before.replace(reading) {
            let height = Height { height: position.z, deviation: 1.0 };
            passed(history.update(*time_ns, black_box(&height)))?;
        }
    }
    black_box(history);
    Ok(())
}

fn planar(
    steps: usize,
    correct: impl Fn(&mut PlanarFilter, &mut Stream, &Reading) -> Result<(), Refusal>,
) -> Result<(), Box<dyn Error>> {
    let readings = readings(LONG);
    let mut filter = PlanarFilter::new(PlanarParams::default())?;
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

/// A keyframe with so many landmarks in its image, and its samples.
fn smoother(steps: usize, landmarks: usize) -> Result<(), Box<dyn Error>> {
    let mut overflight = Overflight::new(landmarks);
    let mut pilot = Pilot::new(SmootherParams::default(), &overflight)?;
    let keyframes = (0..KEYFRAMES.1).map(|_| overflight.next_keyframe()).collect::<Result<Vec<_>, _>>()?;
    for keyframe in keyframes.iter().take(steps) {
        pilot.propagate(keyframe)?;
        pilot.fly(keyframe)?;
    }
    black_box(pilot);
    Ok(())
}

fn sample(reading: &Reading) -> ImuMean {
    let &Reading { time_ns, angular_velocity, specific_force, .. } = reading;
    ImuMean { time_ns, angular_velocity, specific_force }
}
