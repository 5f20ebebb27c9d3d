//! Subscriptions with a highest rate, on virtual time and in real time. Unit tests have their laws, and `tests/stress.rs` their replays.

use super::{Talker, talker};
use crate::kit::*;
use bb_core::Delivery;

/// Delivers at most ten messages a second of each path.
fn slowly(overflow: Overflow) -> Delivery {
    overflow.at_most_every(Duration::from_millis(100))
}

/// Repeats what it is delivered until it has seen the last number.
fn watch(context: CommandContext) -> Doing {
    Box::pin(async move {
        let bus = context.bus();
        let mut numbers = bus.subscribe::<Number>("sensor/base/numbers", slowly(Overflow::KeepLatest))?;
        let seen = bus.publisher("watch/seen")?;
        while let Some(number) = numbers.recv_async().await {
            seen.publish(number.payload);
            if number.0 == 449.0 {
                break;
            }
        }
        Ok(Outcome::done(()))
    })
}

/// A robot that counts to 449, and repeats it at its command.
fn sampled() -> Builder<Talker> {
    let mut builder = Talker::builder();
    builder.options(talker::sensor::base::numbers).count = 450;
    builder.options(talker::command::watch).run = watch;
    builder
}

fn number(message: &DynamicMessage) -> f64 {
    message.downcast::<Number>().map_or(f64::NAN, |number| number.0)
}

#[test]
fn a_command_is_woken_at_the_rate_on_virtual_time() -> Result<(), Failure> {
    let builder = sampled();
    let seen = builder.subscribe_any(Select::Path("watch/seen"), None, Overflow::default());
    let mut simulation = builder.simulate()?;
    simulation.command(talker::command::arm, NoArguments)?;
    let watch = simulation.command(talker::command::watch, NoArguments);
    assert!(watch.is_err(), "it is armed when the simulation runs");
    simulation.run_for(Duration::ZERO);
    let watch = simulation.command(talker::command::watch, NoArguments)?;
    simulation.run_for(Duration::from_secs(1));
    let millis = |message: &DynamicMessage| message.stamp().monotonic_time.as_nanos() / 1_000_000;
    let seen: Vec<_> = seen.drain().map(|message| (millis(&message), number(&message))).collect();
    // The first number was published before.
    assert_eq!(seen, [(1, 1.0), (101, 100.0), (201, 200.0), (301, 300.0), (401, 400.0), (501, 449.0)]);
    assert!(watch.try_result().is_some_and(|result| result.is_ok()));
    Ok(())
}

#[test]
fn a_display_is_delivered_no_more_than_its_rate_in_real_time_and_the_last_at_the_end() -> Result<(), Failure> {
    let builder = sampled();
    let display = builder.subscribe_with(talker::sensor::base::numbers, slowly(Overflow::default()));
    let mut running = builder.start()?;
    let begin = running.clock().now();
    // A thread that waits is woken when the time of a message comes: the last number is delivered while the robot runs.
    let mut got = vec![];
    while got.last() != Some(&449.0) {
        got.push(display.recv_timeout(Duration::from_secs(20)).ok_or("it is published")?.0);
    }
    let periods = running.clock().now().duration_since(begin).as_secs_f64() / 0.1;
    assert!(got.len() as f64 <= periods + 2.0 && got.len() >= 3, "{got:?} in {periods} periods");
    running.wait();
    running.stop();
    assert_eq!(display.drain().count(), 0);
    Ok(())
}
