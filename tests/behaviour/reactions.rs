//! Reactions: a condition on a field of a topic starts a command.

use crate::kit::*;
use bb_core::component::{ReactionEvent, ReactionState};
use bb_core::event::CommandEvent;

robot! {
    robot Drone;
    parameters { battery { low: f64 = 11 V, range: 5 V..=15 V; hot: f64 = 330 K; } }
    commands {
        land: Task(run = |context| after(context, 500)) { allowed_states: [idle, executing]; cancel: all; }
        go: Move { allowed_states: [idle, executing]; }
    }
    sensors { sensor battery: External<BatteryState>(); }
    controllers {
        controller low: Reaction(
            when = sensor::battery.voltage, below = param::battery::low, for = 2 s, run = command::land, cooldown = 3 s,
        );
        controller hot: Reaction(
            when = sensor::battery.temperature, below = 250 K, above = param::battery::hot, run = command::land, stale_after = 1500 ms,
        ) { rate: 5 Hz; }
    }
    link base;
}

/// Events at a controller or at its command, by the second.
type Happened = Vec<(i64, String)>;

/// Flies: `(decisecond, voltage)` for each message.
struct Flight {
    simulation: Simulation<Drone>,
    states: Subscription<ReactionState>,
    commands: Subscription<CommandEvent>,
}

impl Flight {
    fn new() -> Result<Self, Failure> {
        Self::of(Drone::builder().simulate()?, true)
    }

    fn of(simulation: Simulation<Drone>, is_armed: bool) -> Result<Self, Failure> {
        if is_armed {
            simulation.arm()?;
        }
        let states = simulation.subscribe(drone::controller::low);
        let commands = simulation.subscribe(drone::command::land);
        Ok(Self { simulation, states, commands })
    }

    fn measure(&mut self, deciseconds: i64, battery: BatteryState) {
        self.simulation.run_until(at(100 * deciseconds));
        self.simulation.publish(drone::sensor::battery, at(100 * deciseconds), battery);
        self.simulation.run_for(Duration::from_millis(20));
    }

    fn voltage(&mut self, deciseconds: i64, voltage: f64) {
        self.measure(deciseconds, volts(voltage));
    }

    /// Measures a voltage each half second from a decisecond to another.
    fn voltages(&mut self, from: i64, to: i64, voltage: f64) {
        (from..=to).step_by(5).for_each(|time| self.voltage(time, voltage));
    }

    /// The states of the controller in order, by decisecond.
    fn states(&self) -> Happened {
        let states = self.states.drain().map(|state| (deciseconds(&state), of_state(&state)));
        states.collect()
    }

    fn count(&self, name: &str) -> u64 {
        count(&self.simulation.report(), "controller/low", name)
    }
}

fn deciseconds<T>(message: &Stamped<T>) -> i64 {
    message.monotonic_time.as_nanos() / 100_000_000
}

fn of_state(state: &ReactionState) -> String {
    match &state.event {
        ReactionEvent::Fulfilled => "fulfilled".into(),
        ReactionEvent::NotFulfilled => "not fulfilled".into(),
        ReactionEvent::Started => "started".into(),
        ReactionEvent::Refused(why) => why.clone(),
        other => format!("{other:?}"),
    }
}

fn count(report: &Report, path: &str, name: &str) -> u64 {
    report.source(path).map_or(0, |source| source.count(name))
}

fn volts(voltage: f64) -> BatteryState {
    BatteryState { voltage, ..Default::default() }
}

const REFUSED: &str = "`land` is refused: it is not allowed in the state `disarmed`";

/// Replays from what a file holds have the same events, with the same caller.
#[test]
fn a_command_starts_when_the_condition_has_held_by_the_stamps() -> Result<(), Failure> {
    type Case<'a> = (&'a str, bool, &'a [(i64, i64, f64)], &'a str, [u64; 2]);
    let disarmed = format!("fulfilled at 10; {REFUSED} at 30; {REFUSED} at 60");
    // Messages from a decisecond to another, each half second, and what happens at which.
    const LOW: f64 = 10.0;
    const OK: f64 = 12.0;
    const CHATTER: &str = "fulfilled at 10; not fulfilled at 28; fulfilled at 30; started at 50";
    const SILENCE: &str = "fulfilled at 10; not fulfilled at 40; fulfilled at 41; started at 61";
    const RECOVERED: &str = "fulfilled at 10; started at 30; not fulfilled at 40; fulfilled at 70; started at 90";
    const AGAIN: &str = "fulfilled at 10; started at 30; started at 70";
    let cases: [Case<'_>; 10] = [
        ("never low", true, &[(10, 60, OK)], "", [0, 0]),
        ("at the bound", true, &[(10, 60, 11.0)], "", [0, 0]),
        ("once after `for`", true, &[(10, 35, LOW)], "fulfilled at 10; started at 30", [0, 0]),
        ("again after the end, 0.5 s later, and the cooldown of 3 s", true, &[(10, 70, LOW)], AGAIN, [0, 0]),
        ("chatter", true, &[(10, 25, LOW), (28, 28, OK), (30, 50, LOW)], CHATTER, [0, 0]),
        ("NaN", true, &[(10, 25, LOW), (28, 28, f64::NAN), (29, 29, f64::NAN), (30, 50, LOW)], CHATTER, [2, 0]),
        ("silence", true, &[(10, 20, LOW), (41, 61, LOW)], SILENCE, [0, 1]),
        ("silence from the start", true, &[(45, 50, OK)], "", [0, 1]),
        ("disarmed: refused, and tried again after the cooldown", false, &[(10, 65, LOW)], &disarmed, [0, 0]),
        ("recovered within the cooldown", true, &[(10, 35, LOW), (40, 65, OK), (70, 90, LOW)], RECOVERED, [0, 0]),
    ];
    for (name, is_armed, messages, expected, [not_numbers, silences]) in cases {
        same_from_file(Drone::builder, |builder| {
            let mut flight = Flight::of(builder.simulate()?, is_armed)?;
            messages.iter().for_each(|(from, to, voltage)| flight.voltages(*from, *to, *voltage));
            let states: Vec<_> =
                flight.states().into_iter().map(|(time, event)| format!("{event} at {time}")).collect();
            assert_eq!(states.join("; "), expected, "{name}");
            assert_eq!([flight.count("not a number"), flight.count("silent")], [not_numbers, silences], "{name}");
            let (started, refused) = (expected.matches("started").count(), expected.matches(REFUSED).count());
            let counts = flight.simulation.report().commands.swap_remove(0);
            assert_eq!((counts.started, counts.refused), (started as u64, refused as u64), "{name}");
            assert!(flight.commands.drain().all(|event| event.caller == "controller/low"), "{name}");
            Ok(flight.simulation.stop())
        })?;
    }
    Ok(())
}

#[test]
fn messages_that_come_late_or_twice_neither_start_nor_end_anything() -> Result<(), Failure> {
    let mut flight = Flight::new()?;
    flight.voltage(10, 10.0);
    for (now, stamp, voltage) in [(15, 15, 10.0), (20, 12, 12.0), (21, 15, 12.0), (25, 25, 10.0)] {
        flight.simulation.run_until(at(100 * now));
        flight.simulation.publish(drone::sensor::battery, at(100 * stamp), volts(voltage));
    }
    flight.voltage(30, 10.0);
    assert_eq!(flight.states(), [(10, "fulfilled".into()), (30, "started".into())]);
    Ok(())
}

/// A driver hands in at once what it had kept.
#[test]
fn a_silence_between_two_stamps_ends_the_condition_before_the_next_begins() -> Result<(), Failure> {
    let mut flight = Flight::new()?;
    for (stamp, voltage) in [(10, 10.0), (20, 10.0), (41, 10.0), (61, 10.0)] {
        flight.simulation.publish(drone::sensor::battery, at(100 * stamp), volts(voltage));
    }
    flight.simulation.run_for(Duration::from_millis(20));
    let states: Vec<_> = flight.states().into_iter().map(|(_, state)| state).collect();
    assert_eq!(states, ["fulfilled", "not fulfilled", "fulfilled", "started"]);
    assert_eq!(flight.count("silent"), 1);
    Ok(())
}

/// The newest 16,384 messages wait for a reaction with a rate.
#[test]
fn messages_that_a_reaction_has_no_room_for_are_counted() -> Result<(), Failure> {
    let mut flight = Flight::new()?;
    flight.simulation.run_until(at(110));
    let battery = BatteryState { voltage: 12.0, temperature: Some(300.0), ..Default::default() };
    for number in 0..16_384 + 5 {
        let stamp = at(110).plus_nanos(number);
        flight.simulation.publish(drone::sensor::battery, stamp, battery.clone());
    }
    flight.simulation.run_until(at(210));
    assert_eq!(count(&flight.simulation.report(), "controller/hot", "lost"), 5);
    Ok(())
}

#[test]
fn options_that_make_no_sense_are_counted_and_the_old_ones_stay() -> Result<(), Failure> {
    let mut flight = Flight::new()?;
    let states = flight.simulation.subscribe(drone::controller::hot);
    flight.simulation.set_parameter(drone::param::battery::hot, 200.0)?;
    flight.measure(10, BatteryState { voltage: 12.0, temperature: Some(240.0), ..Default::default() });
    flight.simulation.set_parameter(drone::param::battery::hot, 245.0)?;
    flight.simulation.run_until(at(2000));
    assert_eq!(count(&flight.simulation.report(), "controller/hot", "refused options"), 2);
    let states: Vec<_> = states.drain().map(|state| (of_state(&state), state.value)).collect();
    assert_eq!(states, [("started".to_owned(), Some(240.0))], "with `above = 330 K`, 240 K fulfils it by `below`");
    Ok(())
}

#[test]
fn an_optional_field_outside_of_two_bounds_at_the_rate_of_the_controller() -> Result<(), Failure> {
    let mut flight = Flight::new()?;
    let states = flight.simulation.subscribe(drone::controller::hot);
    for (time, temperature) in
        [(11, Some(300.0)), (21, None), (31, Some(240.0)), (41, Some(340.0)), (51, Some(300.0))]
    {
        flight.measure(time, BatteryState { voltage: 12.0, temperature, ..Default::default() });
    }
    flight.simulation.run_until(at(6000));
    let states: Vec<_> = states.drain().map(|state| (deciseconds(&state), of_state(&state), state.value)).collect();
    // At 5 Hz; the command takes 0.5 s, and the cooldown is 1 s: at 4.2 s it has not passed.
    let expected = [(32, "started".to_owned(), Some(240.0)), (52, "not fulfilled".to_owned(), Some(300.0))];
    assert_eq!(states, expected);
    assert_eq!(count(&flight.simulation.report(), "controller/hot", "not a number"), 1);
    Ok(())
}

/// Both reactions start `land`, which cancels all commands, itself too.
#[test]
fn reactions_with_one_command_do_not_cancel_each_other() -> Result<(), Failure> {
    let mut flight = Flight::new()?;
    for time in 10..210 {
        flight.measure(time, BatteryState { voltage: 10.0, temperature: Some(340.0), ..Default::default() });
    }
    let events: Vec<_> = flight.commands.drain().map(|event| (event.caller.clone(), event.phase.clone())).collect();
    let started =
        |by: &str| events.iter().filter(|(caller, phase)| caller == by && *phase == CommandPhase::Started).count();
    assert!(started("controller/low") >= 3 && started("controller/hot") >= 5, "{events:#?}");
    assert!(events.iter().all(|(_, phase)| *phase != CommandPhase::Cancelled), "{events:#?}");
    Ok(())
}

#[test]
fn the_command_cancels_what_runs_and_a_bound_follows_its_parameter() -> Result<(), Failure> {
    let mut flight = Flight::new()?;
    let going = flight.simulation.command(drone::command::go, Target { millis: 60_000, does: None })?;
    flight.voltages(10, 20, 10.0);
    flight.simulation.set_parameter(drone::param::battery::low, 9.0)?;
    flight.voltages(25, 40, 10.0);
    let expected = [(10, "fulfilled".into()), (20, "not fulfilled".into())];
    assert_eq!(flight.states(), expected, "the new bound starts `for` again");
    flight.simulation.set_parameter(drone::param::battery::low, 10.5)?;
    flight.voltages(45, 65, 10.0);
    assert_eq!(flight.states(), [(45, "fulfilled".into()), (65, "started".into())]);
    assert_eq!(going.try_result(), Some(Err(CommandError::Cancelled)));
    Ok(())
}

#[test]
fn events_of_a_command_name_its_caller() -> Result<(), Failure> {
    let mut simulation = armed_simulation(Drone::builder());
    let events = simulation.subscribe(drone::command::land);
    simulation.command(drone::command::land, NoArguments)?;
    simulation.run_for(Duration::from_secs(1));
    simulation.bus().for_caller("page", [Right::Commands]).start_command("command/land", "")?;
    simulation.run_for(Duration::from_secs(1));
    let events: Vec<_> = events.drain().map(|event| (event.caller.clone(), event.phase.clone())).collect();
    let (started, succeeded) = (CommandPhase::Started, CommandPhase::Succeeded);
    let expected = ["program", "page"]
        .map(|caller| [started.clone(), succeeded.clone()].map(|phase| (caller.to_owned(), phase)));
    assert_eq!(events, expected.concat());
    Ok(())
}

#[test]
fn in_real_time_it_reacts_to_a_message_at_once() {
    let running = armed(Drone::builder());
    let states = running.subscribe(drone::controller::low);
    for (voltage, event) in [(10.0, ReactionEvent::Fulfilled), (12.0, ReactionEvent::NotFulfilled)] {
        running.publish(drone::sensor::battery, running.clock().now(), volts(voltage));
        assert_eq!(states.recv_timeout(PATIENCE).map(|state| state.payload.event), Some(event), "{voltage} V");
    }
    running.stop().ok().expect("nothing is wrong");
}

/// Declarations of reactions that cannot be refused at compile time are refused when the robot starts.
#[test]
fn options_that_can_never_work_keep_the_robot_from_starting() {
    use bb_core::component::ReactionOptions;
    type Change = fn(&mut ReactionOptions);
    let cases: [(Change, &str); 3] = [
        (|options| options.above = 9.0, "`below` is 11, but must be less than `above`, 9"),
        (|options| options.run = Default::default(), "no command is at ``"),
        (|options| options.when = Default::default(), "nothing is published at ``"),
    ];
    for (change, message) in cases {
        let mut builder = Drone::builder();
        change(builder.options(drone::controller::low));
        assert_refused(builder.simulate(), &format!("controller/low cannot start: {message}"));
    }
}
