//! Commands that hang, however many, do not keep others from making the robot safe.

use crate::components::{Echo, Number, Replied, within};
use crate::gate::{Gate, Place, Stuck};
use bb_core::ArmError;
use bb_core::event::RefusalReason;
use bb_core::prelude::*;

static FROM_HEALTH: Gate = Gate::new();

static CANCELLED: Gate = Gate::new();

/// Gate at which commands hang that a change of health starts.
pub(crate) struct HealthGate;

impl Place for HealthGate {
    const GATE: &'static Gate = &FROM_HEALTH;
    const NAME: &'static str = "here";
}

/// Gate at which commands hang that are cancelled.
pub(crate) struct CancelledGate;

impl Place for CancelledGate {
    const GATE: &'static Gate = &CANCELLED;
    const NAME: &'static str = "here";
}

static WAITING: Gate = Gate::new();

/// Gate at which more commands hang than there are threads.
pub(crate) struct QueueGate;

impl Place for QueueGate {
    const GATE: &'static Gate = &WAITING;
    const NAME: &'static str = "here";
}

/// Reports a divergence at each 1 that it gets.
fn fickle(_: &mut f64, number: f64) -> Replied {
    let reply = Reply::none();
    Ok(if number == 1.0 { reply.diverged("a 1 came") } else { reply })
}

robot! {
    robot Ill;
    commands {
        category many { concurrency: 1000; }
        disarm: Disarm;
        stuck: Stuck<HealthGate> { category: many; allowed_states: [idle, executing]; }
    }
    link base {
        sensor number: External<Number>() { estimator fickle: Echo(input = fickle) { recover_after: 1; on_degraded: stuck; } }
    }
}

#[test]
fn health_commands_that_hang_keep_none_that_disarms_from_running() {
    within(60, || {
        FROM_HEALTH.close("here");
        let running = Ill::builder().start().expect("it starts");
        running.arm().expect("it may be armed");
        for _ in 0..80 {
            for number in [1.0, 0.0] {
                running.publish(ill::sensor::base::number, running.clock().now(), Number(number));
            }
        }
        FROM_HEALTH.wait_for(64);
        let disarms = running.command(ill::command::disarm, NoArguments).expect("it is armed");
        assert_eq!(disarms.wait_timeout(Duration::from_secs(20)), Some(Ok(())));
        assert_eq!(running.safety(), Safety::Disarmed);
        FROM_HEALTH.open();
        running.stop();
    });
}

#[test]
fn a_cancelled_command_that_never_began_is_gone_though_others_hang_in_every_thread() {
    within(120, || {
        WAITING.close("here");
        let running = Full::builder().start().expect("it starts");
        running.arm().expect("it may be armed");
        (0..560).for_each(|_| drop(running.command(full::command::stuck, NoArguments).expect("it starts")));
        WAITING.wait_for(512);
        assert_eq!(running.disarm(), Ok(()));
        let Err(ArmError::Lingering(inside)) = running.arm() else { panic!("512 threads are in their code") };
        assert_eq!(inside.len(), 512);
        WAITING.open();
        assert_eq!(running.arm(), Ok(()));
    });
}

robot! {
    robot Full;
    commands {
        category many { concurrency: 1000; }
        stuck: Stuck<QueueGate> { allowed_states: [idle, executing]; category: many; }
    }
    link base { sensor number: External<Number>(); }
}

#[test]
fn a_command_that_hangs_is_not_started_for_ever_however_often_it_is_cancelled() {
    within(60, || {
        CANCELLED.close("here");
        let running = Crowded::builder().start().expect("it starts");
        running.arm().expect("it may be armed");
        let start = || running.command(crowded::command::errand, NoArguments);
        let mut started = 0;
        let refusal = loop {
            match start() {
                Ok(execution) => {
                    CANCELLED.wait_for(started + 1);
                    execution.cancel();
                }
                Err(refusal) => break refusal,
            }
            started += 1;
            assert!(started <= 256, "nobody refuses it");
        };
        assert_eq!((started, refusal.reason), (256, RefusalReason::Hanging));
        let disarms = running.command(crowded::command::disarm, NoArguments).expect("it is armed");
        assert_eq!(disarms.wait_timeout(Duration::from_secs(20)), Some(Ok(())));
        CANCELLED.open();
        running.arm().expect("they have returned");
        assert!(start().is_ok());
        running.stop();
    });
}

robot! {
    robot Crowded;
    commands {
        disarm: Disarm;
        errand: Stuck<CancelledGate> { allowed_states: [idle, executing]; }
    }
    link base { sensor number: External<Number>(); }
}
