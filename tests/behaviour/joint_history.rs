//! Transforms of messages that are older than the history of a joint, or ahead of the clock.

use crate::joints::{CAMERA, LIFT, Pixel, Reach, SHOULDER, reach};
use crate::kit::*;
use bb_core::component::InputTransforms;

/// Inputs from the base, and from beyond the joint: the newest of both, however old.
#[derive(Clone, Copy, Debug, Inputs)]
pub(crate) struct Kept<'a> {
    #[allow(dead_code, reason = "it only drives")]
    pub(crate) imu: Input<'a, Pixel>,
    #[allow(dead_code, reason = "it is placed, and not looked at")]
    pub(crate) camera: Input<'a, Pixel>,
}

/// Says where its camera was when that saw something last.
#[derive(Default)]
pub(crate) struct Keeper {
    camera_x: f64,
}

impl Estimator for Keeper {
    type Options = NoOptions;
    type Input = Kept<'static>;
    type Output = Pixel;
    const HANDLES_MOVING_JOINTS: bool = true;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self::default())
    }

    fn handle_transforms(&mut self, transforms: &InputTransforms<'_>) -> Result<(), Fault> {
        self.camera_x = transforms.frame_from_input("camera")?.translation.vector.x;
        Ok(())
    }

    fn handle_input(&mut self, _: Kept<'_>) -> Result<Reply<Pixel>, Fault> {
        Ok(Reply::emit(Pixel(self.camera_x)))
    }
}

#[test]
fn a_message_that_is_older_than_the_history_of_a_joint_stays_where_it_was_seen() {
    let mut builder = Reach::builder();
    builder.joints().history = Duration::from_millis(100);
    let keeper = builder.subscribe(reach::estimator::base::keeper);
    let mut simulation = builder.simulate().expect("it starts");
    for millis in 1..=1000 {
        let position = 0.3 + millis as f64 * 1e-3;
        simulation.publish(SHOULDER, at(millis), joint(0.0));
        simulation.publish(LIFT, at(millis), joint(position));
        if millis == 1 {
            simulation.publish(CAMERA, at(1), Pixel(1.0));
        }
        if millis % 50 == 2 {
            simulation.publish(reach::sensor::base::imu, at(millis), Pixel(0.0));
        }
    }
    let heard: Vec<_> = keeper.drain().map(|pixel| pixel.0).collect();
    assert_eq!(heard, [0.301; 20]);
    // One that was never placed while the joints were known is not placed later.
    simulation.publish(CAMERA, at(800), Pixel(1.0));
    simulation.publish(reach::sensor::base::imu, at(1001), Pixel(0.0));
    assert_eq!(keeper.drain().count(), 0);
    let report = simulation.report();
    let keeper = report.estimator("estimator/base/keeper").expect("it is declared");
    assert_eq!(keeper.inputs[1].dropped(DropReason::NoTransform), 1);
}

/// A message that is stamped ahead of the clock is asked for where nobody knows yet, and those that follow are older:
/// for a second at most, since one that is further ahead is refused.
#[test]
fn an_input_ahead_of_the_clock_costs_a_second_at_most() {
    use DropReason::{ClockSkew, NoTransform, OutOfOrder};
    for (ahead, resumes) in [(900, 1_000), (1_000, 1_100), (1_001, 200)] {
        let mut simulation = Reach::builder().simulate().expect("it starts");
        let seen = simulation.subscribe(reach::estimator::base::keeper);
        let health = simulation.subscribe(system::Health);
        for millis in (0..1500).step_by(10) {
            simulation.publish(SHOULDER, at(millis), joint(0.0));
            simulation.publish(LIFT, at(millis), joint(0.1));
            let stamp = if millis == 200 { millis + ahead } else { millis };
            simulation.live().publish(CAMERA, at(stamp), Pixel(1.0));
            simulation.publish(reach::sensor::base::imu, at(millis), Pixel(0.0));
        }
        let times: Vec<_> = seen.drain().map(|seen| seen.monotonic_time).collect();
        let expected = (0..200).chain(resumes..1500).step_by(10).map(at);
        assert!(times.iter().copied().eq(expected), "{ahead} ms ahead: {times:?}");
        let of_keeper = health.drain().filter(|change| change.estimator == "estimator/base/keeper");
        let changes: Vec<_> = of_keeper.map(|change| (change.time, change.to)).collect();
        let report = simulation.stop();
        let keeper = report.estimator("estimator/base/keeper").expect("it is declared");
        let camera = &keeper.inputs[1];
        let (skew, missing) = (camera.dropped(ClockSkew), camera.dropped(NoTransform));
        if resumes == 200 {
            assert_eq!((skew, missing, camera.dropped(OutOfOrder), changes), (1, 0, 0, vec![]));
        } else {
            // The joint may be asked for 100 ms beyond what is known of it.
            assert_eq!((skew, missing), (0, (resumes - 200) as u64 / 10));
            assert_eq!(camera.dropped(OutOfOrder), ahead as u64 / 10 - 1);
            assert_eq!(changes, [(at(200), HealthState::Degraded), (at(resumes), HealthState::Healthy)]);
        }
    }
}
