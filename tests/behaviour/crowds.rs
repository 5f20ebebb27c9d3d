//! Commands that hang, however many, do not keep others from running and from making the robot safe.

use crate::kit::*;

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
        stuck: Task { category: many; allowed_states: [idle, executing]; }
        react: Task(run = |context| after(context, 1)) { category: many; allowed_states: [idle, executing]; }
    }
    link base {
        sensor number: External<Number>() {
            estimator fickle: Echo(init = tick::<10>, input = fickle, info = |_, _| Ok(Reply::emit(Number(0.0)))) {
                recover_after: 1;
                on_degraded: react;
            }
        }
    }
}

/// A robot whose commands hang.
fn stuck(at: fn(CommandContext) -> Doing) -> Running<Ill> {
    let mut builder = Ill::builder();
    builder.options(ill::command::stuck).run = at;
    armed(builder)
}

#[test]
fn health_commands_that_hang_keep_none_that_disarms_from_running() {
    static HERE: Gate = Gate::new();
    within(60, || {
        HERE.close("here");
        let mut builder = Ill::builder();
        builder.options(ill::command::react).run = |_| HERE.stuck("here");
        let running = armed(builder);
        for _ in 0..80 {
            for number in [1.0, 0.0] {
                running.publish(ill::sensor::base::number, running.clock().now(), Number(number));
            }
        }
        HERE.wait_for(64);
        let disarms = running.command(ill::command::disarm, NoArguments).expect("it is armed");
        assert_eq!(disarms.wait_timeout(PATIENCE), Some(Ok(())));
        assert_eq!(running.safety(), Safety::Disarmed);
        HERE.open();
        running.stop();
    });
}

#[test]
fn a_cancelled_command_that_never_began_is_gone_though_others_hang_in_every_thread() {
    static HERE: Gate = Gate::new();
    within(120, || {
        HERE.close("here");
        let running = stuck(|_| HERE.stuck("here"));
        (0..560).for_each(|_| drop(running.command(ill::command::stuck, NoArguments).expect("it starts")));
        HERE.wait_for(512);
        assert_eq!(running.disarm(), Ok(()));
        let Err(ArmError::Lingering(inside)) = running.arm() else { panic!("512 threads are in their code") };
        assert_eq!(inside.len(), 512);
        HERE.open();
        assert_eq!(running.arm(), Ok(()));
    });
}

#[test]
fn a_command_that_hangs_is_not_started_for_ever_however_often_it_is_cancelled() {
    static HERE: Gate = Gate::new();
    within(60, || {
        HERE.close("here");
        let running = stuck(|_| HERE.stuck("here"));
        let start = || running.command(ill::command::stuck, NoArguments);
        for started in 1..=256 {
            let execution = start().expect("nobody refuses it yet");
            HERE.wait_for(started);
            execution.cancel();
        }
        let refusal = start().map(drop).expect_err("256 hang");
        assert_eq!(refusal.reason, RefusalReason::Hanging);
        let disarms = running.command(ill::command::disarm, NoArguments).expect("it is armed");
        assert_eq!(disarms.wait_timeout(PATIENCE), Some(Ok(())));
        HERE.open();
        running.arm().expect("they have returned");
        assert!(start().is_ok());
        running.stop();
    });
}

#[test]
fn commands_that_hang_keep_neither_ticks_nor_health_commands_from_running_and_are_reported() -> Result<(), Failure>
{
    static HERE: Gate = Gate::new();
    HERE.close("here");
    let running = stuck(|_| HERE.stuck("here"));
    let faults = running.subscribe(system::Faults);
    for _ in 0..520 {
        drop(running.command(ill::command::stuck, NoArguments)?);
    }
    let message = fault_of(&faults, "pool");
    assert!(message.starts_with("512 commands have not returned"), "{message}");
    let ticks = running.subscribe(ill::sensor::base::number::fickle);
    (0..3).for_each(|_| assert!(ticks.recv_timeout(PATIENCE).is_some(), "it ticks"));
    running.publish(ill::sensor::base::number, running.clock().now(), Number(1.0));
    wait_until("`on_degraded` has run", || {
        running.report().commands.iter().any(|command| command.name == "react" && command.succeeded > 0)
    });
    HERE.open();
    assert_eq!(running.stop().safety, Safety::Disarmed);
    Ok(())
}
