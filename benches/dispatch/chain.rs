//! A chain of sixteen estimators that pass on what they get, with an 80-byte payload, beside sixteen plain calls.

use super::{Line, in_turn};
use bb_core::prelude::*;
use std::hint::black_box;

/// 80 bytes, as an inertial sensor's reading with a temperature.
#[derive(Clone, Copy, Debug, Payload)]
pub(super) struct Inertial {
    values: [f64; 10],
}

impl Inertial {
    pub(super) fn new(first: f64) -> Self {
        Self { values: [first; 10] }
    }

    pub(super) fn first(&self) -> f64 {
        self.values[0]
    }
}

/// Passes on what it gets.
#[derive(Debug)]
pub(super) struct Pass;

impl Estimator for Pass {
    type Options = NoOptions;
    type Input = Inertial;
    type Output = Inertial;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_input(&mut self, message: &Stamped<Inertial>) -> Result<Reply<Inertial>, Fault> {
        Ok(Reply::emit(message.payload))
    }
}

robot! {
    robot Direct;
    link base { sensor imu: External<Inertial>(); }
}

robot! {
    robot Chain;
    link base {
        sensor imu: External<Inertial>();
        estimator e0: Pass() { input message: sensor::base::imu; }
        estimator e1: Pass() { input message: estimator::base::e0; }
        estimator e2: Pass() { input message: estimator::base::e1; }
        estimator e3: Pass() { input message: estimator::base::e2; }
        estimator e4: Pass() { input message: estimator::base::e3; }
        estimator e5: Pass() { input message: estimator::base::e4; }
        estimator e6: Pass() { input message: estimator::base::e5; }
        estimator e7: Pass() { input message: estimator::base::e6; }
        estimator e8: Pass() { input message: estimator::base::e7; }
        estimator e9: Pass() { input message: estimator::base::e8; }
        estimator e10: Pass() { input message: estimator::base::e9; }
        estimator e11: Pass() { input message: estimator::base::e10; }
        estimator e12: Pass() { input message: estimator::base::e11; }
        estimator e13: Pass() { input message: estimator::base::e12; }
        estimator e14: Pass() { input message: estimator::base::e13; }
        estimator e15: Pass() { input message: estimator::base::e14; }
    }
}

robot! {
    robot Budgeted;
    commands { stop: Arm; }
    link base {
        sensor imu: External<Inertial>();
        estimator e0: Pass() { input message: sensor::base::imu; latency_budget: 1 s; lost_after: 1 s; }
    }
}

/// One plain call: the same work, and a new message of it.
#[inline(never)]
fn pass(message: &Stamped<Inertial>) -> Stamped<Inertial> {
    black_box(message.stamp().message(message.payload))
}

pub(super) fn measure() -> Result<Vec<Line>, StartError> {
    const CALLS: u32 = 2_000;
    const HOPS: f64 = 16.0;
    let message = Stamped::new(MonotonicTime::ZERO, Inertial::new(1.0));
    let direct = Direct::builder().start()?;
    let running = Chain::builder().start()?;
    let budgeted = Budgeted::builder().start()?;
    let now = running.clock().now();
    let publish_direct = || direct.publish(direct::sensor::base::imu, now, black_box(message.payload));
    let publish_chain = || running.publish(chain::sensor::base::imu, now, black_box(message.payload));
    let publish_budgeted = || budgeted.publish(budgeted::sensor::base::imu, now, black_box(message.payload));
    let calls = || {
        let mut passed = black_box(message);
        for _ in 0..16 {
            passed = pass(&passed);
        }
        black_box(passed);
    };
    let (whole, none) = in_turn(CALLS, publish_chain, publish_direct);
    let (plain, nothing) = in_turn(CALLS, calls, || {
        black_box(black_box(message));
    });
    let (one, _) = in_turn(CALLS, publish_budgeted, publish_direct);
    let allocations = allocation_counter::measure(|| (0..1000).for_each(|_| publish_chain()));
    let report = running.stop();
    let last = report.estimator("estimator/base/e15").expect("it is declared");
    assert_eq!(last.emitted, last.inputs[0].received, "nothing was dropped");
    Ok(vec![
        Line::Beside { name: "hop", ours_ns: (whole - none) / HOPS, beside_ns: (plain - nothing) / HOPS },
        Line::Beside { name: "chain_16", ours_ns: whole, beside_ns: plain },
        Line::Beside { name: "hop_with_latency_budget", ours_ns: one - none, beside_ns: (plain - nothing) / HOPS },
        Line::Figure { name: "allocations", ours: allocations.count_total as f64, unit: "" },
    ])
}
