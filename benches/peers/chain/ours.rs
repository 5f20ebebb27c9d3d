//! Our chain: a sensor, sixteen estimators and one that takes what comes of it. Counters and health are on.

use crate::Inertial;
use bb_core::SensorHandle;
use bb_core::prelude::*;
use std::hint::black_box;

/// Passes on what it gets.
struct Pass;

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

/// Takes what it gets.
struct Sink;

impl Estimator for Sink {
    type Options = NoOptions;
    type Input = Inertial;
    type Output = Inertial;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_input(&mut self, message: &Stamped<Inertial>) -> Result<Reply<Inertial>, Fault> {
        black_box(&message.payload);
        Ok(Reply::none())
    }
}

robot! {
    pub(crate) robot Chain;
    link base {
        sensor imu: External<Inertial>();
        estimator e0: Pass() { input message: sensor::base::imu; lost_after: 10 s; }
        estimator e1: Pass() { input message: estimator::base::e0; lost_after: 10 s; }
        estimator e2: Pass() { input message: estimator::base::e1; lost_after: 10 s; }
        estimator e3: Pass() { input message: estimator::base::e2; lost_after: 10 s; }
        estimator e4: Pass() { input message: estimator::base::e3; lost_after: 10 s; }
        estimator e5: Pass() { input message: estimator::base::e4; lost_after: 10 s; }
        estimator e6: Pass() { input message: estimator::base::e5; lost_after: 10 s; }
        estimator e7: Pass() { input message: estimator::base::e6; lost_after: 10 s; }
        estimator e8: Pass() { input message: estimator::base::e7; lost_after: 10 s; }
        estimator e9: Pass() { input message: estimator::base::e8; lost_after: 10 s; }
        estimator e10: Pass() { input message: estimator::base::e9; lost_after: 10 s; }
        estimator e11: Pass() { input message: estimator::base::e10; lost_after: 10 s; }
        estimator e12: Pass() { input message: estimator::base::e11; lost_after: 10 s; }
        estimator e13: Pass() { input message: estimator::base::e12; lost_after: 10 s; }
        estimator e14: Pass() { input message: estimator::base::e13; lost_after: 10 s; }
        estimator e15: Pass() { input message: estimator::base::e14; lost_after: 10 s; }
        estimator sink: Sink() { input message: estimator::base::e15; lost_after: 10 s; }
    }
}

// The same with every callback timed, as Copper times every task.
robot! {
    pub(crate) robot Timed;
    link base {
        sensor imu: External<Inertial>();
        estimator e0: Pass() { input message: sensor::base::imu; lost_after: 10 s; latency_budget: 1 s; }
        estimator e1: Pass() { input message: estimator::base::e0; lost_after: 10 s; latency_budget: 1 s; }
        estimator e2: Pass() { input message: estimator::base::e1; lost_after: 10 s; latency_budget: 1 s; }
        estimator e3: Pass() { input message: estimator::base::e2; lost_after: 10 s; latency_budget: 1 s; }
        estimator e4: Pass() { input message: estimator::base::e3; lost_after: 10 s; latency_budget: 1 s; }
        estimator e5: Pass() { input message: estimator::base::e4; lost_after: 10 s; latency_budget: 1 s; }
        estimator e6: Pass() { input message: estimator::base::e5; lost_after: 10 s; latency_budget: 1 s; }
        estimator e7: Pass() { input message: estimator::base::e6; lost_after: 10 s; latency_budget: 1 s; }
        estimator e8: Pass() { input message: estimator::base::e7; lost_after: 10 s; latency_budget: 1 s; }
        estimator e9: Pass() { input message: estimator::base::e8; lost_after: 10 s; latency_budget: 1 s; }
        estimator e10: Pass() { input message: estimator::base::e9; lost_after: 10 s; latency_budget: 1 s; }
        estimator e11: Pass() { input message: estimator::base::e10; lost_after: 10 s; latency_budget: 1 s; }
        estimator e12: Pass() { input message: estimator::base::e11; lost_after: 10 s; latency_budget: 1 s; }
        estimator e13: Pass() { input message: estimator::base::e12; lost_after: 10 s; latency_budget: 1 s; }
        estimator e14: Pass() { input message: estimator::base::e13; lost_after: 10 s; latency_budget: 1 s; }
        estimator e15: Pass() { input message: estimator::base::e14; lost_after: 10 s; latency_budget: 1 s; }
        estimator sink: Sink() { input message: estimator::base::e15; lost_after: 10 s; latency_budget: 1 s; }
    }
}

/// Chain of this runtime, of either kind, started.
pub(crate) struct Ours<R: Robot> {
    running: Running<R>,
    imu: SensorHandle<R, External<Inertial>>,
}

impl Ours<Chain> {
    pub(crate) fn start() -> Result<Self, StartError> {
        Ok(Self { running: Chain::builder().start()?, imu: chain::sensor::base::imu })
    }
}

impl Ours<Timed> {
    pub(crate) fn start_timed() -> Result<Self, StartError> {
        Ok(Self { running: Timed::builder().start()?, imu: timed::sensor::base::imu })
    }
}

impl<R: Robot> Ours<R> {
    /// Does what a sensor's driver does: reads the clock, and publishes.
    pub(crate) fn iterate(&mut self, reading: &Inertial) {
        self.running.publish(self.imu, self.running.clock().now(), black_box(*reading));
    }

    /// Stops the robot and returns the number of messages that the sink has taken.
    pub(crate) fn stop(self) -> u64 {
        self.running.stop().estimator("estimator/base/sink").map_or(0, |sink| sink.dispatched)
    }
}
