//! Cost of a fix that comes late: at 400 Hz, with 320 samples and 16 states of history, in time and by up to 500 ms.
//!
//! `cargo bench -p bb-benches --bench late` prints the time of one, the smallest and the median of 2,000.

use bb_core::nalgebra::{UnitQuaternion, Vector3};
use bb_estimators::navigation::{
    EskfFilter, EskfParams, Fused, GnssPosition, History, ImuMean, Refusal, Replayed, Start, Stream,
};
use std::error::Error;
use std::time::Instant;

#[derive(Clone)]
struct Rover {
    filter: EskfFilter,
    gnss: Stream,
}

impl Replayed for Rover {
    type Filter = EskfFilter;
    type Measurement = GnssPosition;

    fn filter(&self) -> &EskfFilter {
        &self.filter
    }

    fn filter_mut(&mut self) -> &mut EskfFilter {
        &mut self.filter
    }

    fn update(&mut self, fix: &GnssPosition) -> Result<Fused, Refusal> {
        self.filter.update(&mut self.gnss, fix)
    }
}

const PERIOD_NS: i64 = 2_500_000;
const FIXES: i64 = 2_000;
/// Number of samples between two fixes.
const SAMPLES: i64 = 80;

fn main() -> Result<(), Box<dyn Error>> {
    println!("{:>10}  {:>12}  {:>12}", "late, ms", "smallest, µs", "median, µs");
    for late_ms in [0, 100, 500] {
        let mut filter = EskfFilter::new(EskfParams::default())?;
        let (origin, rest, level) = (Vector3::zeros(), Vector3::zeros(), UnitQuaternion::identity());
        filter.start(&Start::at(0, (origin, 5.0), (rest, 0.1), (level, 0.05)))?;
        let mut past = History::<Rover, 320, 64, 16>::new(Rover { filter, gnss: Stream::default() }, 0)?;
        let mut times = Vec::new();
        for step in 1..=(FIXES + 5) * SAMPLES {
            let time_ns = step * PERIOD_NS;
            let (angular_velocity, specific_force) = (Vector3::zeros(), Vector3::new(0.0, 0.0, 9.80665));
            past.propagate(&ImuMean { time_ns, angular_velocity, specific_force })?;
            if step % SAMPLES == 0 && step > 5 * SAMPLES {
                let fix = GnssPosition::new(Vector3::zeros(), 1.0, 2.0);
                let began = Instant::now();
                past.update(time_ns - late_ms * 1_000_000, &fix)?;
                times.push(began.elapsed().as_secs_f64() * 1e6);
            }
        }
        times.sort_by(f64::total_cmp);
        println!("{late_ms:10}  {:12.1}  {:12.1}", times[0], times[times.len() / 2]);
    }
    Ok(())
}
