//! A robot with everything in use: every run on virtual time is the same, however long, and a week takes no more memory
//! than an hour.

#[path = "behaviour/components.rs"]
#[expect(dead_code, reason = "other robots are made of the rest")]
mod components;

use bb_core::prelude::*;
use components::{Counter, Move, Number, Scale, Snapshot, Target, at};

/// Ticks, sets timers, fails and diverges now and then.
#[derive(Debug)]
struct Lively(u32, f64);

/// Options of [`Lively`].
#[derive(Clone, Debug, Options)]
struct LivelyOptions {
    #[option(default = 1.0, range = 0.0..=1e6)]
    gain: f64,
}

impl Estimator for Lively {
    type Options = LivelyOptions;
    type Input = Number;
    type Output = Number;

    fn init(options: LivelyOptions, context: &Context) -> Result<Self, Fault> {
        context.request(Request::Tick(Duration::from_millis(30)));
        context.request(Request::Continue(2));
        Ok(Self(0, options.gain))
    }

    fn handle_input(&mut self, number: &Stamped<Number>) -> Result<Reply<Number>, Fault> {
        self.0 += 1;
        let reply = Reply::emit(Number(number.0 * self.1));
        match self.0 % 97 {
            96 => Err(Fault::new("now and then")),
            13 => Ok(reply.diverged("a little")),
            n => Ok(reply.and(Request::Timer(n % 5, Duration::from_millis(u64::from(n % 7))))),
        }
    }

    fn handle_info(&mut self, info: Info) -> Result<Reply<Number>, Fault> {
        Ok(Reply::emit(Number(if info == Info::Tick { -1.0 } else { -2.0 })))
    }

    fn handle_continue(&mut self, step: u32) -> Result<Reply<Number>, Fault> {
        let reply = Reply::emit(Number(-3.0));
        Ok(if step > 0 { reply.and(Request::Continue(step - 1)) } else { reply })
    }

    fn handle_options(&mut self, options: LivelyOptions, _: &Context) -> Result<(), Fault> {
        self.1 = options.gain;
        Ok(())
    }
}

robot! {
    robot Whole;

    parameters { gain: f64 = 1.0; }
    states { careful; }

    commands {
        category motion { concurrency: 3; }
        arm: Arm;
        go: Move { category: motion; allowed_states: [idle, executing, careful]; timeout: 40 ms; }
        react: Move { category: motion; allowed_states: [idle, executing, careful]; cancel: [motion]; }
    }

    link base {
        sensor a: Counter(count = 4000000000) { rate: 100 Hz; estimator lively: Lively(gain = param::gain) {
            lost_after: 50 ms;
            recover_after: 3;
            on_degraded: react;
            on_recovered: go;
        } }
        sensor b: Counter(count = 4000000000) { rate: 70 Hz; estimator scaled: Scale(); }
        sensor c: Counter(count = 4000000000) { rate: 33 Hz; }
        estimator fused: Snapshot() {
            input driver: sensor::base::a::lively, driver;
            input second: sensor::base::b::scaled;
            input third: sensor::base::c, optional, within: 20 ms;
            sync_tolerance: 14.3 ms;
            runs_on: worker;
        }
    }
}

#[test]
fn every_run_of_everything_is_the_same() -> Result<(), Box<dyn std::error::Error>> {
    let run = || -> Result<_, Box<dyn std::error::Error>> {
        let mut builder = Whole::builder();
        builder.supervision().max_restarts = 10;
        let roomy = Overflow::DropOldest { capacity: 1 << 16 };
        let all = builder.subscribe_any(Select::All, None, roomy);
        let mut simulation = builder.simulate()?;
        simulation.command(whole::command::arm, NoArguments)?;
        for round in 0..60_u32 {
            simulation.run_for(Duration::from_millis(u64::from(round % 11) * 13));
            simulation.set_parameter(whole::param::gain, f64::from(round))?;
            let target = Target { millis: u64::from(round % 6) * 10, does: None };
            let _ = simulation.command(whole::command::go, target);
            if round % 9 == 0 {
                simulation.step();
            }
        }
        let messages: Vec<_> = all.drain().map(|message| format!("{message:?}")).collect();
        Ok((messages, simulation.stop()))
    };
    let (first, second) = (run()?, run()?);
    assert!(first.0.len() > 1000);
    assert_eq!(first.0, second.0);
    assert_eq!(first.1, second.1);
    Ok(())
}

/// Returns this process's memory in bytes, if the system reports it.
fn memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmRSS:"))?;
    line.split_whitespace().nth(1)?.parse::<u64>().ok().map(|kilobytes| kilobytes * 1024)
}

#[test]
fn a_week_takes_no_more_memory_than_an_hour() -> Result<(), Box<dyn std::error::Error>> {
    // Without a subscriber the robot prints each of 600,000 faults, and the test harness keeps in memory what is printed.
    let _ = tracing::subscriber::set_global_default(tracing::subscriber::NoSubscriber::new());
    let mut builder = Whole::builder();
    builder.supervision().max_restarts = usize::MAX;
    let mut simulation = builder.simulate()?;
    simulation.arm().expect("it may be armed");
    simulation.run_until(at(3_600_000));
    let after_an_hour = memory();
    simulation.run_until(at(7 * 24 * 3_600_000));
    let (Some(hour), Some(week)) = (after_an_hour, memory()) else {
        println!("the system does not say how much memory this process has: nothing was measured");
        return Ok(());
    };
    assert!(week < hour + 4_000_000, "{hour} bytes after an hour, {week} after a week");
    Ok(())
}
