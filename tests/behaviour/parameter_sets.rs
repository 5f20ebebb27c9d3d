//! Parameters that are set at once: all of them, or none.

use crate::kit::*;
use crate::parameters::{BOUND, BOUND_OPTIONS, BoundOptions, Tuned, tuned};
use bb_core::event::ParameterChange;

/// Sets two parameters of which the second may be refused.
fn set_both(context: CommandContext) -> Doing {
    Box::pin(async move {
        context.set_parameters([("param/gain", 7.0.into()), ("param/count", 7.into())])?;
        context.bus().set_parameters([("param/count", 8.into()), ("param/gain", 1e8.into())])?;
        Ok(Outcome::done(()))
    })
}

fn values(live: &Live<Tuned>) -> (f64, i64, String) {
    (live.parameter(tuned::param::gain), live.parameter(tuned::param::count), live.parameter(tuned::param::name))
}

fn changes(all: &DynamicSubscription) -> Vec<(&'static str, ParameterValue, ParameterValue)> {
    let changes = all.drain().filter_map(|change| {
        change.downcast::<ParameterChange>().map(|change| (change.path, change.from.clone(), change.to.clone()))
    });
    changes.collect()
}

#[test]
fn a_set_that_is_refused_in_the_middle_changes_nothing() -> Result<(), Failure> {
    let simulation = Tuned::builder().simulate()?;
    let all = simulation.subscribe_any(Select::Below("param"), None, Overflow::default());
    let gain = |gain: f64| ("param/gain", gain.into());
    let (name, count) = (("param/name", "two".to_owned().into()), ("param/count", 2.into()));
    let refuses = "param/gain is not set: sensor/base/number/bound would refuse it: option `gain` is 100000000, but must be in \
                   0.0..=1e6";
    let wrong_type = "param/count is not set: expected a value of type `i64`, found `2.5`";
    let unknown = "param/cuont is not set: no such parameter is declared; did you mean `param/count`?";
    let out_of_range = "param/gain is not set: expected a number in 0.0..=1000000000.0, found `-1.0`";
    // The option `gain` of the estimator is at most 1e6.
    let refused: [(Vec<(&str, ParameterValue)>, &str); 6] = [
        (vec![gain(2.0), ("param/count", 2.5.into())], wrong_type),
        (vec![gain(2.0), ("param/cuont", 2.into())], unknown),
        (vec![gain(2.0), name.clone(), gain(3.0)], "param/gain is not set: it is set twice at once"),
        (vec![name.clone(), gain(-1.0)], out_of_range),
        (vec![count, gain(1e8)], refuses),
        (vec![name, gain(1e8)], refuses),
    ];
    for (set, message) in refused {
        assert_refused(simulation.set_parameters(set), message);
        assert_eq!(values(&simulation), (1.0, 1, "one".to_owned()));
    }
    assert_eq!(changes(&all), []);
    assert_eq!(simulation.call(BOUND, Which)?, BOUND_OPTIONS);
    assert_eq!(simulation.set_parameters::<&str>([]), Ok(()));

    simulation.set_parameters([
        tuned::param::count.to(2),
        tuned::param::name.to("two"),
        tuned::param::gain.to(2.0),
    ])?;
    assert_eq!(values(&simulation), (2.0, 2, "two".to_owned()));
    assert_eq!(simulation.call(BOUND, Which)?, BoundOptions { gain: 2.0, count: 2, ..BOUND_OPTIONS });
    let told = changes(&all);
    let paths: Vec<_> = told.iter().map(|(path, ..)| *path).collect();
    let expected = (vec!["param/count", "param/name", "param/gain"], ParameterValue::Integer(1));
    assert_eq!((paths, told[0].1.clone()), expected);
    Ok(())
}

#[test]
fn a_command_sets_all_or_none() -> Result<(), Failure> {
    let mut builder = Tuned::builder();
    builder.options(tuned::command::tune).run = set_both;
    let mut simulation = builder.simulate()?;
    let execution = simulation.command(tuned::command::tune, NoArguments)?;
    simulation.run_for(Duration::from_millis(10));
    assert!(execution.try_result().is_some_and(|result| result.is_err()));
    assert_eq!(values(&simulation), (7.0, 7, "one".to_owned()));
    Ok(())
}

/// Sets from several threads, each with equal values: nobody ever sees different ones.
#[test]
fn a_set_is_seen_as_a_whole() {
    within(60, || {
        let running = Tuned::builder().start().expect("it starts");
        let is_over = AtomicBool::new(false);
        std::thread::scope(|scope| {
            let setters: Vec<_> = (0..3)
                .map(|thread| {
                    let running = &running;
                    scope.spawn(move || {
                        for round in 0..500 {
                            let value = (thread * 80 + round % 80) as i64;
                            let set = [tuned::param::count.to(value), tuned::param::gain.to(value as f64)];
                            running.set_parameters(set).expect("they are in range");
                        }
                    })
                })
                .collect();
            let reader = scope.spawn(|| {
                let mut seen = 0_u32;
                while seen == 0 || !is_over.load(Ordering::SeqCst) {
                    if let Ok(bound) = running.call(BOUND, Which) {
                        assert_eq!(bound.gain, f64::from(bound.count));
                        seen += 1;
                    }
                }
            });
            for setter in setters {
                setter.join().expect("no set is refused");
            }
            is_over.store(true, Ordering::SeqCst);
            reader.join().expect("no set is seen in part");
        });
        let (gain, count, _) = values(&running);
        assert_eq!(gain, count as f64);
        running.stop();
    });
}

#[test]
fn a_set_is_one_entry_of_the_journal_and_the_same_in_a_replay() -> Result<(), Failure> {
    let mut builder = Tuned::builder();
    let lines = journal(&mut builder);
    let mut simulation = builder.simulate()?;
    let all = simulation.subscribe_any(Select::Below("param"), None, Overflow::default());
    simulation.run_for(Duration::from_millis(10));
    simulation.set_parameters([tuned::param::count.to(2), tuned::param::gain.to(2.0)])?;
    assert!(simulation.set_parameters([tuned::param::count.to(3), tuned::param::gain.to(1e8)]).is_err());
    simulation.set_parameter(tuned::param::gain, 4.0)?;
    simulation.run_for(Duration::from_millis(10));
    simulation.stop();
    let first = changes(&all);
    assert_eq!(first.len(), 3);

    let lines = entries(&lines);
    let sizes = lines.iter().filter_map(|line| match &line.event {
        Event::Parameters { changes, .. } => Some(changes.len()),
        _ => None,
    });
    assert_eq!(sizes.collect::<Vec<_>>(), [2, 1]);
    let mut replay = Tuned::builder().replay()?;
    let all = replay.subscribe_any(Select::Below("param"), None, Overflow::default());
    replay.play(read_back::<Tuned>(&lines)?)?;
    assert_eq!(values(&replay), (4.0, 2, "one".to_owned()));
    assert_eq!(changes(&all), first);
    replay.stop();
    Ok(())
}

/// A parameter may have each end of its range and not the next number beyond it, alone or among others.
#[test]
fn the_ends_of_a_range_belong_to_it() -> Result<(), Failure> {
    let simulation = Tuned::builder().simulate()?;
    let values = || (simulation.parameter(tuned::param::share), simulation.parameter(tuned::param::level));
    for (share, level) in [(-0.5, -3), (0.75, 4)] {
        simulation.set_parameters([("param/share", share.into()), ("param/level", level.into())])?;
        assert_eq!(values(), (share, level));
        let beyond: f64 = share.signum() * share.abs().next_up();
        for wrong in [beyond, f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert!(simulation.set_parameter(tuned::param::share, wrong).is_err(), "{wrong}");
            let set = [("param/level", 0.into()), ("param/share", wrong.into())];
            assert!(simulation.set_parameters(set).is_err(), "{wrong}");
        }
        for wrong in [level + level.signum(), i64::MIN, i64::MAX] {
            assert!(simulation.set_parameter(tuned::param::level, wrong).is_err(), "{wrong}");
            let set = [("param/share", 0.0.into()), ("param/level", wrong.into())];
            assert!(simulation.set_parameters(set).is_err(), "{wrong}");
        }
        assert_eq!(values(), (share, level), "nothing of it was set");
    }
    Ok(())
}

/// Options that take a while to copy.
#[derive(Debug, Options)]
pub(crate) struct SlowOptions {
    /// Factor.
    #[option(default = 1.0, range = 0.0..=10.0)]
    gain: f64,
}

impl Clone for SlowOptions {
    fn clone(&self) -> Self {
        std::thread::sleep(Duration::from_millis(5));
        Self { gain: self.gain }
    }
}

/// Gains that a sensor received, in order, and whether one out of range was refused.
static TUNED: Mutex<(Vec<f64>, Option<bool>)> = Mutex::new((Vec::new(), None));

/// Tunes the sensor itself as it starts.
fn tune_itself(context: &SensorContext) -> Done {
    let refused = context.bus().set_parameter("param/gain", 50.0).is_err();
    context.bus().set_parameter("param/gain", 5.0)?;
    *lock(&TUNED) = (Vec::new(), Some(refused));
    Ok(())
}

fn tuned_to(gain: f64) -> Done {
    lock(&TUNED).0.push(gain);
    Ok(())
}

robot! {
    robot SelfTuned;
    parameters { gain: f64 = 1.0; other: f64 = 0.0; }
    link base {
        sensor device: Source(init = tune_itself, gain = param::gain, tune = Some(tuned_to)) {
            rate: 100 Hz;
            estimator slow: Known<SlowOptions>(gain = param::gain);
        }
    }
}

#[test]
fn what_a_sensor_sets_as_it_starts_reaches_its_own_options() {
    let _alone = one_at_a_time();
    let mut simulation = SelfTuned::builder().simulate().expect("it starts");
    simulation.run_for(Duration::from_millis(50));
    assert_eq!(*lock(&TUNED), (vec![5.0], Some(true)));
    simulation.stop().ok().expect("nothing is wrong");
}

#[test]
fn a_set_does_not_wait_for_an_end_of_sets_of_other_parameters() {
    alone_within(60, || {
        let running = SelfTuned::builder().start().expect("it starts");
        let is_over = AtomicBool::new(false);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                for number in 0_u32.. {
                    if is_over.load(Ordering::SeqCst) {
                        break;
                    }
                    running.set_parameter(self_tuned::param::other, f64::from(number)).expect("it is in range");
                    // Another one before the options are checked.
                    std::thread::sleep(Duration::from_millis(1));
                }
            });
            for round in 0..10 {
                running.set_parameter(self_tuned::param::gain, f64::from(round)).expect("it is in range");
            }
            is_over.store(true, Ordering::SeqCst);
        });
        running.stop();
    });
}
