//! Order of what happens at one instant, or in the middle of something else: it is the same again from the journal.

use crate::kit::*;

const PANICS: f64 = -2.0;
const DIVERGES: f64 = -1.0;
const IS_SLOW: f64 = 1000.0;

/// Estimator whose first run is slow, and that panics at 3.
fn slow(_: &mut f64, number: f64) -> Replied {
    assert!(number != 3.0, "it is three");
    if !is_again() {
        std::thread::sleep(Duration::from_millis(2));
    }
    Ok(Reply::emit(Number(number)))
}

/// Command that enters a state after a millisecond.
fn enter(context: CommandContext, state: &'static str) -> Doing {
    Box::pin(async move {
        context.sleep(Duration::from_millis(1)).await;
        Ok(Outcome::done(()).next_state(state))
    })
}

/// Estimator that emits its input, and then the number of inputs since it was created.
fn echo(count: &mut f64, number: f64) -> Replied {
    *count += 1.0;
    if number == IS_SLOW && !is_again() {
        std::thread::sleep(Duration::from_millis(20));
    }
    assert!(number != PANICS, "told to");
    let reply = Reply::emit(Number(number)).and(Request::Continue(1));
    Ok(if number == DIVERGES { reply.diverged("told to") } else { reply })
}

fn how_many(count: &mut f64, _: u32) -> Replied {
    Ok(Reply::emit(Number(1000.0 + *count)))
}

robot! {
    robot Cascade;
    states { fast; crawling; }
    commands {
        arm: Arm;
        crawl: Task(run = |context| enter(context, "crawling")) { cancel: all; allowed_states: [idle, executing, fast, crawling]; }
        hurry: Task(run = |context| enter(context, "fast")) { cancel: all; allowed_states: [idle, executing, fast, crawling]; }
    }
    link base {
        joint shoulder: fixed {
            link arm {
                sensor number: External<Number>() {
                    estimator echo: Echo(input = echo, go_on = how_many) { on_degraded: crawl; on_recovered: hurry; }
                }
                estimator below: Echo(input = slow) { input number: sensor::base::shoulder::arm::number::echo; runs_on: worker; }
            }
        }
    }
}

robot! {
    robot Budgeted;
    link base {
        sensor number: External<Number>() {
            estimator first: Echo(input = echo, go_on = how_many) { latency_budget: 10 ms; recover_after: 2; }
            estimator second: Echo(input = echo, go_on = how_many) { latency_budget: 60 s; recover_after: 2; }
            estimator third: Echo(input = slow) { latency_budget: 10 ms; }
        }
        estimator apart: Echo(input = echo, go_on = how_many) { input number: sensor::base::number::first; latency_budget: 60 s; runs_on: worker; }
        estimator late: Echo(input = echo, go_on = how_many) { input number: sensor::base::number::third; latency_budget: 10 ms; recover_after: 2; }
    }
}

fn cascade(max_restarts: u32) -> impl Fn() -> Builder<Cascade> {
    move || {
        let mut builder = Cascade::builder();
        builder.supervision().max_restarts = max_restarts as usize;
        builder
    }
}

#[test]
fn an_estimator_that_is_given_up_as_its_command_starts() -> Result<(), Failure> {
    let (heard, report) = same_again(cascade(0), |builder| {
        let mut simulation = armed_simulation(builder);
        simulation.publish(cascade::sensor::base::shoulder::arm::number, at(10), Number(PANICS));
        simulation.run_for(Duration::from_millis(100));
        Ok(simulation.stop())
    })?;
    assert_eq!((report.safety, heard["safety/error"].len()), (Safety::Error, 1));
    assert!(report.estimators.iter().any(|estimator| estimator.transitions > 0), "its health has changed");
    Ok(())
}

#[test]
fn changes_of_health_at_one_instant_start_their_commands_in_order() -> Result<(), Failure> {
    let (heard, report) = same_again(cascade(3), |builder| {
        let mut simulation = armed_simulation(builder);
        simulation.run_until(at(10));
        let live = simulation.live();
        for number in [DIVERGES, 1.0, DIVERGES] {
            live.publish(cascade::sensor::base::shoulder::arm::number, at(10), Number(number));
        }
        simulation.run_for(Duration::from_millis(100));
        Ok(simulation.stop())
    })?;
    assert_eq!(heard["health"].len(), 3, "{:?}", heard["health"]);
    assert_eq!((heard["command/crawl"].len(), heard["command/hurry"].len()), (4, 2), "the first two are cancelled");
    let states = &heard["state_machine"];
    assert!(states.iter().any(|change| change.contains("crawling")), "{states:?}");
    assert_eq!(report.safety, Safety::Disarmed);
    Ok(())
}

#[test]
fn a_panic_downstream_that_restarts_what_is_upstream_in_the_middle_of_its_work() -> Result<(), Failure> {
    let (_, report) = same_again(cascade(1), |builder| {
        let mut simulation = builder.simulate()?;
        for (round, number) in [3.0, 1.0, 3.0, 1.0, 2.0, 3.0, 4.0].into_iter().enumerate() {
            let time = at(50 * (round as i64 + 1));
            simulation.publish(cascade::sensor::base::shoulder::arm::number, time, Number(number));
        }
        simulation.run_for(Duration::from_millis(100));
        Ok(simulation.stop())
    })?;
    assert!(report.estimators.iter().all(|estimator| estimator.restarts > 0), "both are restarted: {report}");
    Ok(())
}

#[test]
fn one_of_several_callbacks_of_a_message_that_overruns() -> Result<(), Failure> {
    let overrunning = ["sensor/base/number/first", "estimator/base/late"];
    let (heard, _) = same_again(Budgeted::builder, |builder| {
        let running = builder.start()?;
        let overrun_twice = |path: &&str| running.report().estimator(path).is_some_and(|now| now.transitions >= 4);
        let mut round = 0;
        // On a busy machine, what is published waits for a thread, and any number overruns.
        wait_until("both overrun, recover and do so again", || {
            let number = if round % 6 == 3 { IS_SLOW } else { 10.0 };
            running.publish(budgeted::sensor::base::number, running.clock().now(), Number(number));
            round += 1;
            overrunning.iter().all(overrun_twice)
        });
        Ok(running.stop())
    })?;
    let of_second = |text: &&String| text.contains("number/second") && text.contains("latency overrun");
    assert_eq!(heard["health"].iter().filter(of_second).count(), 0, "it has a minute");
    Ok(())
}
