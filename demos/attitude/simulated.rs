//! Two simulated IMUs on one rigid body.

use crate::arguments::Arguments;
use crate::outcome::{Outcome, Series};
use bb_core::prelude::*;
use bb_estimators::attitude::{AnyFilter, AnyParams, Attitude};
use bb_estimators::simulation::Motion;
use bb_estimators::{OrientationAverage, SimulatedImu};
use bb_eval::{Axes, Progress};
use std::error::Error;
use std::time::Instant;

robot! {
    /// One IMU in the base and one up the mast, tilted and turned; an average of both.
    robot TwoImus;

    link base {
        sensor imu: SimulatedImu(duration = 60 s) {
            rate: 200 Hz;
            estimator orientation: Attitude<AnyFilter, Marg>();
        }
        estimator attitude: OrientationAverage() {
            input first: sensor::base::imu::orientation, driver;
            input second: sensor::base::mount::mast::imu::orientation;
            sync_tolerance: 10 ms;
        }
        joint mount: fixed {
            origin: { xyz: [0.2 m, 0 m, 0.9 m], rpy: [10 deg, 0 deg, 90 deg] };
            link mast {
                sensor imu: SimulatedImu(duration = 60 s) {
                    rate: 200 Hz;
                    estimator orientation: Attitude<AnyFilter, Marg>();
                }
            }
        }
    }
}

const DURATION_S: f64 = 60.0;

pub(crate) fn run(arguments: &Arguments, params: AnyParams) -> Result<Outcome, Box<dyn Error>> {
    let mut builder = TwoImus::builder();
    *builder.options(two_imus::sensor::base::imu::orientation) = params;
    *builder.options(two_imus::sensor::base::mount::mast::imu::orientation) = params;
    let base = builder.subscribe(two_imus::sensor::base::imu::orientation);
    let mast = builder.subscribe(two_imus::sensor::base::mount::mast::imu::orientation);
    let fused = builder.subscribe(two_imus::estimator::base::attitude);

    let root_from_mast = TwoImus::TOPOLOGY.link("mast").and_then(|mast| mast.root_from_link);
    let root_from_mast = root_from_mast.ok_or("the mast is not fixed to the base")?.isometry();
    let base_truth = |time_s| Motion.world_from_root(time_s).rotation;
    let mast_truth = |time_s| (Motion.world_from_root(time_s) * root_from_mast).rotation;
    let mut series =
        [(base, Series::new("base")), (mast, Series::new("mast")), (fused, Series::new("average of both"))];

    let mut simulation = builder.simulate()?;
    let progress = Progress::new("simulating", DURATION_S as u64);
    let started = Instant::now();
    while simulation.next_due().is_some() {
        simulation.run_for(Duration::from_secs(1));
        for (messages, series) in &mut series {
            for message in messages.drain() {
                let time_s = message.monotonic_time.seconds_since(MonotonicTime::ZERO);
                let truth = if series.name == "mast" { mast_truth(time_s) } else { base_truth(time_s) };
                series.add(time_s, message.world_from_body, Some(truth), true);
            }
        }
        progress.set(simulation.clock().now().seconds_since(MonotonicTime::ZERO) as u64);
    }
    let seconds = started.elapsed().as_secs_f64();
    progress.finish();
    let report = simulation.stop().ok()?;
    let [base, mast, fused] = series.map(|(_, series)| series);
    Ok(Outcome {
        filter: params.filter.name(),
        series: vec![fused, base, mast],
        report,
        seconds,
        has_truth: true,
        has_heading: arguments.axes == Axes::Nine,
    })
}
