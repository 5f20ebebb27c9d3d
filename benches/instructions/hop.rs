//! Messages through a chain of sixteen estimators that pass on what they get, with an 80-byte payload, on virtual time.

use bb_core::prelude::*;
use bb_core::{Robot, SensorHandle};
use std::error::Error;
use std::hint::black_box;

/// 80 bytes, as an inertial sensor's reading with a temperature.
#[derive(Clone, Copy, Debug, Payload)]
pub(crate) struct Inertial {
    values: [f64; 10],
}

/// Passes on what it gets.
#[derive(Debug)]
pub(crate) struct Pass;

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

// The same with every callback measured.
robot! {
    robot Measured;
    link base {
        sensor imu: External<Inertial>();
        estimator e0: Pass() { input message: sensor::base::imu; latency_budget: 1 s; }
        estimator e1: Pass() { input message: estimator::base::e0; latency_budget: 1 s; }
        estimator e2: Pass() { input message: estimator::base::e1; latency_budget: 1 s; }
        estimator e3: Pass() { input message: estimator::base::e2; latency_budget: 1 s; }
        estimator e4: Pass() { input message: estimator::base::e3; latency_budget: 1 s; }
        estimator e5: Pass() { input message: estimator::base::e4; latency_budget: 1 s; }
        estimator e6: Pass() { input message: estimator::base::e5; latency_budget: 1 s; }
        estimator e7: Pass() { input message: estimator::base::e6; latency_budget: 1 s; }
        estimator e8: Pass() { input message: estimator::base::e7; latency_budget: 1 s; }
        estimator e9: Pass() { input message: estimator::base::e8; latency_budget: 1 s; }
        estimator e10: Pass() { input message: estimator::base::e9; latency_budget: 1 s; }
        estimator e11: Pass() { input message: estimator::base::e10; latency_budget: 1 s; }
        estimator e12: Pass() { input message: estimator::base::e11; latency_budget: 1 s; }
        estimator e13: Pass() { input message: estimator::base::e12; latency_budget: 1 s; }
        estimator e14: Pass() { input message: estimator::base::e13; latency_budget: 1 s; }
        estimator e15: Pass() { input message: estimator::base::e14; latency_budget: 1 s; }
    }
}

/// Publishes so many readings that nobody takes.
pub(crate) fn direct(messages: usize) -> Result<(), Box<dyn Error>> {
    publish(Direct::builder().simulate()?, direct::sensor::base::imu, messages)
}

/// Sends so many through the chain.
pub(crate) fn chain(messages: usize) -> Result<(), Box<dyn Error>> {
    publish(Chain::builder().simulate()?, chain::sensor::base::imu, messages)
}

/// Sends so many through the chain whose callbacks are measured.
pub(crate) fn measured(messages: usize) -> Result<(), Box<dyn Error>> {
    publish(Measured::builder().simulate()?, measured::sensor::base::imu, messages)
}

/// Publishes so many at a path of its own, with a journal.
pub(crate) fn journaled(messages: usize) -> Result<(), Box<dyn Error>> {
    let mut builder = Direct::builder();
    builder.journal(|entry| drop(black_box(entry)));
    let simulation = builder.simulate()?;
    let publisher = simulation.publisher::<Inertial>("own/imu")?;
    for _ in 0..messages {
        publisher.publish(black_box(Inertial { values: [1.0; 10] }));
    }
    Ok(())
}

fn publish<R: Robot>(
    simulation: bb_core::Simulation<R>,
    imu: SensorHandle<R, External<Inertial>>,
    messages: usize,
) -> Result<(), Box<dyn Error>> {
    let reading = Inertial { values: [1.0; 10] };
    let live = simulation.live();
    for _ in 0..messages {
        live.publish(imu, live.clock().now(), black_box(reading));
    }
    let report = simulation.stop();
    let is_whole = report.estimators.iter().all(|estimator| estimator.emitted == messages as u64);
    if is_whole { Ok(()) } else { Err("a message did not get through the chain".into()) }
}
