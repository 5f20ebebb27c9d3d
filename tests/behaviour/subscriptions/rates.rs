//! Subscriptions with a highest rate. Unit tests have their laws, and `tests/stress.rs` has them in real time and in replays.

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
