//! The end of a run: what comes later changes nothing, and nobody waits for it.

use crate::kit::*;

/// Needs a while to be made safe.
fn brake(context: &SensorContext) -> Done {
    context.on_disarm(|| {
        std::thread::sleep(Duration::from_millis(900));
        Ok(())
    });
    Ok(())
}

robot! {
    robot Braking;
    commands { idle: Task; }
    link base {
        sensor number: External<Number>() { estimator echo: Echo() { lost_after: 500 ms; on_lost: idle; } }
        sensor brake: Source(init = brake) { rate: 10 Hz; }
    }
}

#[test]
fn an_estimator_is_not_lost_because_the_robot_stops() {
    let running = Braking::builder().start().expect("it starts");
    let health = running.subscribe(system::Health);
    // Its only message, right before the stop, which takes longer than `lost_after`.
    running.publish(braking::sensor::base::number, running.clock().now(), Number(1.0));
    let report = running.stop();
    assert_eq!(changes_of(&health), []);
    let refused: u64 = report.commands.iter().map(|command| command.refused).sum();
    assert_eq!(refused, 0);
}

fn ending() -> Builder<Plain> {
    let mut builder = Plain::builder();
    builder.options(SOURCE).terminate = |_| panic!("the port does not close");
    builder.options(ECHO).end = || Some(Number(-1.0));
    builder
}

#[test]
fn an_estimator_that_panics_at_its_end_is_stopped_all_the_same() -> Result<(), StartError> {
    let mut builder = Plain::builder();
    builder.options(ECHO).end = || panic!("it holds nothing");
    let report = builder.simulate()?.stop();
    let [fault] = &told(&report)[..] else { panic!("{report}") };
    assert!(fault.ends_with("failed: panicked: it holds nothing"), "{fault}");
    assert_eq!(report.estimators.iter().map(|estimator| estimator.restarts).sum::<u64>(), 0);
    Ok(())
}

/// The fault of a journal that ended before what a publisher did.
const UNFINISHED: &str =
    "journal failed: a publisher did not come back: what followed from its message may be missing";

/// All that may be asked of a robot, over and over, until it says that it has stopped; and ten times more.
fn ask_for_everything(live: &Live<Plain>, own: &bb_core::pubsub::Publisher<Number>) {
    let mut left = 10;
    for round in 0.. {
        let number = Number(f64::from(round));
        live.publish(NUMBER, live.clock().now(), number);
        own.publish(number);
        let _ = live.command(TASK, NoArguments);
        let _ = live.set_parameter(plain::param::gain, f64::from(round));
        let _ = live.bus().set_parameter("param/gain", f64::from(round));
        let _ = live.arm();
        let _ = live.disarm();
        let _ = live.force_disarm();
        if live.cast(ECHO, number).is_err() {
            left -= 1;
        }
        if left == 0 {
            return;
        }
    }
}

#[test]
fn what_comes_after_the_end_is_neither_published_nor_counted() {
    within(120, || {
        let mut round = 0;
        while round < 8 {
            let run = same_again(ending, |builder| {
                let running = builder.start()?;
                let live = running.live();
                let callers: Vec<_> = (0..3)
                    .map(|number| {
                        let live = running.live();
                        let own = live.bus().publisher(&format!("own/{number}")).expect("it runs");
                        std::thread::spawn(move || ask_for_everything(&live, &own))
                    })
                    .collect();
                std::thread::sleep(Duration::from_millis(2 + 3 * round));
                let report = running.stop();
                callers.into_iter().for_each(|caller| caller.join().expect("it does not panic"));
                assert_eq!(live.report(), report, "it is the last one");
                assert_eq!(report.safety, Safety::Disarmed, "a forced disarming does not reopen a stop");
                let unfinished = report.faults.iter().any(|fault| fault.to_string() == UNFINISHED);
                if unfinished { Err(UNFINISHED.into()) } else { Ok(report) }
            });
            let (heard, report) = match run {
                Ok(run) => run,
                // One of the callers had no core for so long that the journal ended without it.
                Err(error) if error.to_string() == UNFINISHED => continue,
                Err(error) => panic!("{error}"),
            };
            let closed = "sensor/base/source failed: panicked: the port does not close";
            assert!(report.faults.iter().any(|fault| fault.to_string() == closed), "{:?}", report.faults);
            for topic in report.topics.iter().filter(|topic| topic.path != "journal") {
                assert_eq!(topic.published, heard.get(topic.path).map_or(0, Vec::len) as u64, "{}", topic.path);
            }
            round += 1;
        }
    });
}
