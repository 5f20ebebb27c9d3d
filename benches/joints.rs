//! Cost of the states of joints: a look-up of a transform through seven moving joints, beside the multiplication alone, and a message with
//! the states of joints.
//!
//! `cargo bench -p bb-benches --bench joints` prints one JSON object.

use bb_core::kinematics::Kinematics;
use bb_core::prelude::*;
use std::error::Error;
use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

robot! {
    robot Panda;
    topology: urdf("../tests/urdf/panda.urdf");
    sensors {
        sensor bus: External<JointStates>();
        sensor gauge: External<JointSnapshot>();
    }
    joint panda_joint1 { sensor encoder: External<JointState>(); }
}

const MILLISECOND: Duration = Duration::from_millis(1);

fn main() -> Result<(), Box<dyn Error>> {
    let mut simulation = Panda::builder().simulate()?;
    let names: Arc<[String]> = (1..=7).map(|joint| format!("panda_joint{joint}")).collect();
    let states = |step: usize| {
        let position = |joint: usize| ((step * 7 + joint) as f64 * 0.1).sin();
        let positions: Vec<f64> = (0..7).map(position).collect();
        JointStates { names: Arc::clone(&names), positions, velocities: vec![0.0; 7], efforts: vec![0.0; 7] }
    };
    let at = |step: usize| MonotonicTime::ZERO + MILLISECOND * step as u32;
    for step in 0..1000 {
        simulation.publish(panda::sensor::bus, at(step), states(step));
    }
    let joints = simulation.joints();
    let handle = joints.between("panda_link0", "panda_hand_tcp")?;
    let kinematics = Kinematics::new(Panda::TOPOLOGY)?;
    let link = |name: &str| kinematics.link(name).ok_or("no such link");
    let chain = kinematics.chain(link("panda_link0")?, link("panda_hand_tcp")?)?;
    let position = kinematics.neutral();

    let half = MILLISECOND / 2;
    let chain_ns = fastest(1000, |_| drop(black_box(chain.transform(black_box(&position)))));
    let newest_ns = fastest(1000, |_| drop(black_box(handle.at(black_box(at(999))))));
    let recent_ns = fastest(1000, |_| drop(black_box(handle.at(black_box(at(998) + half)))));
    let history_ns = fastest(998, |step| drop(black_box(handle.at(black_box(at(step + 1) + half)))));
    assert!(handle.at(at(998) + half).is_ok() && handle.at(at(1) + half).is_ok(), "they are known");

    // Stamps go on, so that each is kept.
    let mut step = 1000;
    let live = simulation.live();
    simulation.run_until(at(1_000_000));
    let message = states(0);
    let several_ns = fastest(1000, |_| {
        step += 1;
        live.publish(panda::sensor::bus, at(step), black_box(message.clone()));
    });
    let cloned_ns = fastest(1000, |_| drop(black_box(message.clone())));
    let encoder = panda::sensor::panda_link0::panda_joint1::encoder;
    let one = JointState { position: 0.1, velocity: Some(0.0), effort: Some(0.0) };
    let one_ns = fastest(1000, |_| {
        step += 1;
        live.publish(encoder, at(step), black_box(one));
    });
    // A message that tells of no joint.
    let plain = JointSnapshot::default();
    let plain_ns = fastest(1000, |_| {
        step += 1;
        live.publish(panda::sensor::gauge, at(step), black_box(plain.clone()));
    });
    println!(
        "{{\"joints\": {}, \"chain_ns\": {chain_ns:.1}, \"newest_ns\": {newest_ns:.1}, \"recent_ns\": {recent_ns:.1}, \
         \"history_ns\": {history_ns:.1}, \"seven_states_ns\": {:.1}, \"one_state_ns\": {one_ns:.1}, \
         \"other_message_ns\": {plain_ns:.1}}}",
        handle.moving_joints(),
        several_ns - cloned_ns
    );
    Ok(())
}

/// Nanoseconds a call: the fastest of some rounds.
fn fastest(calls: usize, mut call: impl FnMut(usize)) -> f64 {
    let rounds = (0..200).map(|_| {
        let start = Instant::now();
        (0..calls).for_each(&mut call);
        start.elapsed().as_secs_f64() * 1e9 / calls as f64
    });
    rounds.fold(f64::INFINITY, f64::min)
}
