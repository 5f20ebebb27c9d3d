//! What optional features do: real-time priorities of workers, and signals that stop a robot.

use bb_core::prelude::*;
use std::process::{Command as Process, Stdio};

/// A number.
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
struct Number(f64);

/// Passes on.
#[derive(Debug)]
struct Pass;

impl Estimator for Pass {
    type Options = NoOptions;
    type Input = Number;
    type Output = Number;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_input(&mut self, number: &Stamped<Number>) -> Result<Reply<Number>, Fault> {
        Ok(Reply::emit(number.payload))
    }
}

robot! {
    robot Urgent;
    link base {
        sensor numbers: External<Number>();
        estimator pass: Pass() { input number: numbers; runs_on: worker, priority: 80; }
    }
}

#[test]
fn a_worker_has_its_priority_or_the_error_says_why_not() -> Result<(), Box<dyn std::error::Error>> {
    let running = match Urgent::builder().start() {
        Ok(running) => running,
        Err(error) => {
            let error = error.to_string();
            assert!(error.contains("estimator/base/pass") && error.contains("priority 80"), "{error}");
            println!("priorities cannot be raised here: {error}");
            return Ok(());
        }
    };
    let passed = running.subscribe(urgent::estimator::base::pass);
    running.publish(urgent::sensor::base::numbers, running.clock().now(), Number(1.0));
    let message = passed.recv_timeout(Duration::from_secs(20)).ok_or("nothing came")?;
    assert_eq!(message.payload, Number(1.0));
    // Without the right to raise it, the worker runs as any other, and says so.
    if let Err(fault) = running.stop().ok() {
        let said = format!("{fault:?}");
        assert!(said.contains("estimator/base/pass") && said.contains("priority 80"), "{said}");
    }
    Ok(())
}

robot! {
    robot Stoppable;
    commands { arm: Arm; disarm: Disarm; }
    link base { sensor numbers: External<Number>() { estimator pass: Pass(); } }
}

/// This test runs itself as another process, which gets the signal.
#[test]
fn a_signal_disarms_and_stops() -> Result<(), Box<dyn std::error::Error>> {
    const NAME: &str = "processes::features::a_signal_disarms_and_stops";
    if std::env::var_os("BB_TEST_SIGNAL").is_some() {
        let mut running = Stoppable::builder().start()?;
        running.stop_on_signals()?;
        running.arm().expect("it may be armed");
        println!("it is {}", running.safety());
        running.wait();
        println!("it is {}", running.stop().safety);
        return Ok(());
    }
    let mut child = Process::new(std::env::current_exe()?)
        .args([NAME, "--exact", "--nocapture"])
        .env("BB_TEST_SIGNAL", "1")
        .stdout(Stdio::piped())
        .spawn()?;
    let mut lines = std::io::BufRead::lines(std::io::BufReader::new(child.stdout.take().ok_or("no output")?));
    assert!(lines.by_ref().any(|line| line.is_ok_and(|line| line.ends_with("it is armed"))), "it is armed");
    Process::new("kill").args(["-TERM", &child.id().to_string()]).status()?;
    assert!(lines.any(|line| line.is_ok_and(|line| line.ends_with("it is disarmed"))), "it is disarmed");
    assert!(child.wait()?.success());
    Ok(())
}
