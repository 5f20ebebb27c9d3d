//! Parameters that are kept over restarts, and start-up values from the environment.

use crate::kit::*;
use bb_core::component::ParameterStore;

type Values = BTreeMap<String, ParameterValue>;

/// Keeps every set that it was told to store.
#[derive(Clone, Debug, Default)]
struct Memory(Arc<Mutex<State>>);

#[derive(Debug, Default)]
struct State {
    sets: Vec<Values>,
    /// Number of attempts that fail.
    fails: u32,
    panics: bool,
    attempts: u32,
    /// Code that runs before it stores something.
    before: Option<fn()>,
}

impl Memory {
    fn lock(&self) -> MutexGuard<'_, State> {
        lock(&self.0)
    }

    fn of(values: &[(&str, ParameterValue)]) -> Self {
        let memory = Self::default();
        memory.lock().sets.push(named(values));
        memory
    }

    fn last(&self) -> Values {
        self.lock().sets.last().cloned().unwrap_or_default()
    }
}

impl ParameterStore for Memory {
    fn load(&mut self) -> Result<Values, Fault> {
        Ok(self.last())
    }

    fn store(&mut self, values: &Values) -> Result<(), Fault> {
        let before = self.lock().before;
        before.into_iter().for_each(|before| before());
        let mut state = self.lock();
        state.attempts += 1;
        if state.fails > 0 {
            state.fails -= 1;
            if state.panics {
                drop(state);
                panic!("an index");
            }
            return Err(Fault::new("the disk is full"));
        }
        state.sets.push(values.clone());
        Ok(())
    }
}

robot! {
    robot Rig;
    parameters {
        gains { kp: f64 = 1.0, range: 0.0..=10.0; ki: f64 = 0.1; }
        limit: f64 = 0.5 m, range: 0 m..=2 m;
        name: String = "rig";
    }
    link base { sensor device: Source() { rate: 100 Hz; } }
}

fn kept(store: &Memory) -> Result<(Builder<Rig>, Vec<String>), Failure> {
    let mut builder = Rig::builder();
    let unused = builder.keep_parameters(store.clone())?;
    Ok((builder, unused.iter().map(ToString::to_string).collect()))
}

fn named(values: &[(&str, ParameterValue)]) -> Values {
    values.iter().map(|(path, value)| ((*path).to_owned(), value.clone())).collect()
}

#[test]
fn what_is_set_while_the_robot_runs_is_there_at_the_next_start() -> Result<(), Failure> {
    let memory = Memory::default();
    let (builder, unused) = kept(&memory)?;
    assert_eq!(unused, Vec::<String>::new());
    let simulation = builder.simulate()?;
    simulation.set_parameters([rig::param::gains::kp.to(4.5), rig::param::gains::ki.to(0.2)])?;
    assert!(simulation.set_parameters([rig::param::gains::kp.to(5.5), rig::param::limit.to(9.0)]).is_err());
    simulation.stop();
    // Only what was set, and no set in part.
    assert_eq!(memory.last(), named(&[("param/gains/ki", 0.2.into()), ("param/gains/kp", 4.5.into())]));
    assert!(memory.lock().sets.iter().all(|set| set.len() == 2));

    let simulation = kept(&memory)?.0.simulate()?;
    assert_eq!((simulation.parameter(rig::param::gains::kp), simulation.parameter(rig::param::limit)), (4.5, 0.5));
    simulation.stop();
    let stores = memory.lock().attempts;
    kept(&memory)?.0.replay()?.stop();
    assert_eq!(memory.lock().attempts, stores, "nothing has changed");
    Ok(())
}

#[test]
fn overrides_at_the_start_are_not_stored() -> Result<(), Failure> {
    let memory = Memory::of(&[("param/gains/kp", 4.5.into())]);
    let (mut builder, _) = kept(&memory)?;
    builder.set("param/gains/kp", "7.0")?;
    builder.set("param/limit", "1 m")?;
    let simulation = builder.simulate()?;
    assert_eq!(simulation.parameter(rig::param::gains::kp), 7.0);
    simulation.set_parameter(rig::param::gains::ki, 0.3)?;
    simulation.stop();
    assert_eq!(memory.last(), named(&[("param/gains/ki", 0.3.into()), ("param/gains/kp", 4.5.into())]));
    Ok(())
}

#[test]
fn stored_values_that_do_not_fit_are_named_and_stay_until_they_are_set() -> Result<(), Failure> {
    let stored: [(&str, ParameterValue); 4] = [
        ("param/gains/kp", 99.0.into()),
        ("param/gains/ki", 0.4.into()),
        ("param/name", 3.into()),
        ("param/old", true.into()),
    ];
    let memory = Memory::of(&stored);
    let (builder, unused) = kept(&memory)?;
    assert_eq!(
        unused,
        [
            "param/gains/kp is not set: expected a number in 0.0..=10.0, found `99.0`",
            "param/name is not set: expected a value of type `String`, found `3`",
            "param/old is not set: no such parameter is declared",
        ]
    );
    let simulation = builder.simulate()?;
    assert_eq!(simulation.parameter(rig::param::gains::ki), 0.4);
    simulation.set_parameter(rig::param::gains::kp, 2.0)?;
    simulation.stop();
    let mut expected = named(&stored);
    expected.insert("param/gains/kp".into(), 2.0.into());
    assert_eq!(memory.last(), expected);
    Ok(())
}

#[test]
fn a_store_that_fails_is_a_fault_and_is_tried_again() -> Result<(), Failure> {
    for (panics, message) in [(false, "the disk is full"), (true, "panicked: an index")] {
        let told = format!("the parameters are not stored: {message}");
        let failing = || {
            let memory = Memory::default();
            (memory.lock().fails, memory.lock().panics) = (1, panics);
            memory
        };

        let memory = failing();
        let running = kept(&memory)?.0.start()?;
        let faults = running.subscribe(system::Faults);
        running.set_parameter(rig::param::gains::kp, 2.0)?;
        let fault = faults.recv_timeout(PATIENCE).ok_or("it is reported")?;
        assert_eq!((fault.path, &fault.message), ("param", &told));
        running.stop();
        assert_eq!(memory.last(), named(&[("param/gains/kp", 2.0.into())]));

        let memory = failing();
        let simulation = kept(&memory)?.0.simulate()?;
        simulation.set_parameter(rig::param::gains::kp, 3.0)?;
        let report = simulation.stop();
        let faults: Vec<_> = report.faults.iter().map(|fault| (fault.path, &fault.message)).collect();
        assert_eq!(faults, [("param", &told)]);
        assert_eq!(memory.last(), named(&[("param/gains/kp", 3.0.into())]));
    }
    Ok(())
}

#[test]
fn what_a_component_sets_as_it_starts_is_stored() -> Result<(), Failure> {
    for is_virtual in [true, false] {
        let memory = Memory::default();
        let mut builder = kept(&memory)?.0;
        builder.options(rig::sensor::base::device).init =
            |context| Ok(context.bus().set_parameter("param/gains/ki", 0.25)?);
        let report = if is_virtual { builder.simulate()?.stop() } else { builder.start()?.stop() };
        report.ok()?;
        assert_eq!(memory.last(), named(&[("param/gains/ki", 0.25.into())]));
    }
    Ok(())
}

#[test]
fn whatever_is_accepted_while_the_robot_stops_is_stored() -> Result<(), Failure> {
    for round in 0..20_u64 {
        let memory = Memory::default();
        // The last set takes a moment to be durable.
        memory.lock().before = Some(|| std::thread::sleep(Duration::from_millis(3)));
        let running = kept(&memory)?.0.start()?;
        let live = running.live();
        let (begins, has_begun) = std::sync::mpsc::channel();
        let sets = std::thread::spawn(move || {
            let mut accepted = None;
            for number in 0_u32.. {
                let value = f64::from(number % 10_000) * 1e-3;
                if live.set_parameter(rig::param::gains::kp, value).is_err() {
                    break;
                }
                accepted = Some(value);
                let _ = begins.send(());
            }
            accepted
        });
        has_begun.recv()?;
        std::thread::sleep(Duration::from_micros(137 * round));
        running.stop().ok()?;
        let accepted = sets.join().map_err(|_| "it does not panic")?.ok_or("one at least")?;
        assert_eq!(memory.last(), named(&[("param/gains/kp", accepted.into())]), "round {round}");
    }
    Ok(())
}

static GATE: Gate = Gate::new();

#[test]
fn a_store_that_hangs_keeps_nobody_waiting() {
    within(60, || {
        let memory = Memory::default();
        memory.lock().before = Some(|| GATE.pass("store"));
        GATE.close("store");
        let running = kept(&memory).expect("nothing is stored").0.start().expect("it starts");
        running.set_parameter(rig::param::gains::kp, 2.0).expect("it is in range");
        GATE.wait_for(1);
        // Neither comes back if it waits for the store, which has 2 s as the robot stops.
        running.set_parameter(rig::param::gains::kp, 3.0).expect("it is in range");
        let report = running.stop();
        GATE.open();
        let faults: Vec<_> = report.faults.iter().map(|fault| (fault.path, fault.message.as_str())).collect();
        assert_eq!(faults, [("param", "the store of parameters did not return in time")]);
    });
}
