//! Two robots in two processes, over a bad link: delay, a cut, a freeze, and clocks that differ by 10 s and 100 ppm.
//!
//! The mast publishes 50 beats a second, and the rover takes them as readings of a remote sensor. The link between them delays each way by
//! 5 ± 3 ms; it is frozen for a moment, then closed for a while, and frozen for a while; at last the mast is killed and started again. The
//! program prints what the rover sees, and fails if anything of this is not so: each stamp is right to within `clock_within`, nothing older
//! than `within` is taken, each beat is accounted for, the rover notices each cut and recovers by itself, the mast is not armed when the
//! rover is, and a replay of the rover's journal, which needs no network, gives the same bits.

mod relay;
mod robots;

use bb_core::journal::Entry;
use bb_core::prelude::*;
use relay::{DELAY_MS, JITTER_MS, LinkState, Relay};
use robots::{Beat, Mast, Rover, Seen, date_ns, mast, rover};
use std::error::Error;
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::process::{Child, Command as Process, ExitCode, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

/// Argument, before the port, with which this program is the mast.
const MAST: &str = "--mast";
/// The rover's settings, s.
const CLOCK_WITHIN: f64 = 0.015;
const WITHIN: f64 = 0.150;
/// Longest time from the cut until the rover has noticed it, and from the join until it is healthy. What the machine is busy with comes
/// on top of 0.5 s and 2 s.
const NOTICED_S: f64 = 2.0;
const JOINED_S: f64 = 6.0;

pub(crate) fn main() -> ExitCode {
    let mut arguments = std::env::args().skip_while(|argument| argument != MAST).skip(1);
    let result = match arguments.next() {
        Some(port) => be_mast(&port).map(|()| true),
        None => be_rover(),
    };
    match result {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Runs the mast until it is killed.
fn be_mast(port: &str) -> Result<(), Box<dyn Error>> {
    let mut builder = Mast::builder();
    builder.options(mast::bridge::net).listen = format!("tcp/127.0.0.1:{port}");
    builder.start()?.wait();
    Ok(())
}

/// The process of the mast, which ends with this one.
struct MastProcess(Child);

impl Drop for MastProcess {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Prints what happens, and notes what should not have.
struct Story {
    begun: Instant,
    wrong: Vec<String>,
}

impl Story {
    fn tell(&self, what: impl std::fmt::Display) {
        println!("{:7.2} s  {what}", self.begun.elapsed().as_secs_f64());
    }

    fn expect(&mut self, is_so: bool, what: impl std::fmt::Display) {
        if !is_so {
            self.tell(format_args!("WRONG: {what}"));
            self.wrong.push(what.to_string());
        }
    }
}

/// A reading as the rover took it, with the date at which it was handed over.
struct TakenBeat {
    beat: Stamped<Beat>,
    age_s: f64,
}

fn be_rover() -> Result<bool, Box<dyn Error>> {
    // Free at this moment; the mast takes it.
    let address: SocketAddr = TcpListener::bind("127.0.0.1:0")?.local_addr()?;
    let program = std::env::current_exe()?;
    let start_mast = || -> std::io::Result<MastProcess> {
        let port = address.port().to_string();
        let mast = MastProcess(Process::new(&program).arg(MAST).arg(port).stdin(Stdio::null()).spawn()?);
        while TcpStream::connect(address).is_err() {
            std::thread::sleep(Duration::from_millis(50));
        }
        Ok(mast)
    };
    let mast = start_mast()?;
    let relay = Relay::start(address)?;

    let mut story = Story { begun: Instant::now(), wrong: Vec::new() };
    let mut builder = Rover::builder();
    builder.options(rover::sensor::base::beacon).connect = format!("tcp/127.0.0.1:{}", relay.port());
    let journal: Arc<Mutex<Vec<Entry>>> = Arc::default();
    let sink = Arc::clone(&journal);
    builder.journal(move |entry| sink.lock().unwrap_or_else(PoisonError::into_inner).push(entry));
    let taken: Arc<Mutex<Vec<TakenBeat>>> = Arc::default();
    let outputs = builder.subscribe_with(rover::estimator::base::judge, Overflow::DropOldest { capacity: 100_000 });
    let beats = builder.subscribe_with(rover::sensor::base::beacon, Overflow::DropOldest { capacity: 100_000 });
    let health = builder.subscribe(system::Health);
    let faults = builder.subscribe(system::Faults);
    let robot = builder.start()?;
    let listener = {
        let taken = Arc::clone(&taken);
        std::thread::spawn(move || {
            while let Some(beat) = beats.recv() {
                let age_s = (date_ns() - beat.date_ns) as f64 * 1e-9;
                taken.lock().unwrap_or_else(PoisonError::into_inner).push(TakenBeat { beat, age_s });
            }
        })
    };

    let is_healthy = |state: HealthState| move |transition: &HealthTransition| transition.to == state;
    let wait = |story: &mut Story, state: HealthState, longest_s: f64| {
        let begun = Instant::now();
        while begun.elapsed().as_secs_f64() < longest_s {
            for fault in faults.drain() {
                story.tell(format_args!("fault: {}", fault.message));
            }
            if let Some(transition) = health.drain().find(|message| is_healthy(state)(&message.payload)) {
                story
                    .tell(format_args!("{} is {:?}: {:?}", transition.estimator, transition.to, transition.reason));
                return Some(begun.elapsed().as_secs_f64());
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        None
    };

    story.tell(format_args!(
        "the link delays each way by {DELAY_MS} ± {JITTER_MS} ms; the mast's clock is 10 s ahead and gains 100 ppm"
    ));
    let first = Instant::now();
    while taken.lock().unwrap_or_else(PoisonError::into_inner).is_empty() && first.elapsed().as_secs() < 20 {
        std::thread::sleep(Duration::from_millis(5));
    }
    story.tell("the first beat was taken");
    std::thread::sleep(Duration::from_secs(3));
    robot.arm()?;
    story.tell("the rover is armed");
    std::thread::sleep(Duration::from_secs(1));

    relay.set(LinkState::Frozen);
    story.tell("the link is frozen for a moment: what is held up arrives, too late");
    std::thread::sleep(Duration::from_millis(400));
    relay.set(LinkState::Open);
    std::thread::sleep(Duration::from_secs(2));

    for (cut, name) in [(LinkState::Closed, "closed"), (LinkState::Frozen, "frozen")] {
        health.drain().for_each(drop);
        relay.set(cut);
        story.tell(format_args!("the link is {name}"));
        let noticed = wait(&mut story, HealthState::Lost, NOTICED_S);
        story.expect(noticed.is_some(), format_args!("the rover has not noticed that the link is {name}"));
        std::thread::sleep(Duration::from_millis(2000));
        relay.set(LinkState::Open);
        story.tell("the link is open again");
        let joined = wait(&mut story, HealthState::Healthy, JOINED_S);
        story.expect(joined.is_some(), format_args!("the rover has not recovered after the link was {name}"));
        std::thread::sleep(Duration::from_secs(1));
    }

    health.drain().for_each(drop);
    drop(mast);
    story.tell("the mast is killed");
    let noticed = wait(&mut story, HealthState::Lost, NOTICED_S);
    story.expect(noticed.is_some(), "the rover has not noticed that the mast is gone");
    std::thread::sleep(Duration::from_secs(1));
    let _mast = start_mast()?;
    story.tell("the mast is started again, and its clock from zero");
    let joined = wait(&mut story, HealthState::Healthy, JOINED_S);
    story.expect(joined.is_some(), "the rover has not recovered after the mast was started again");
    std::thread::sleep(Duration::from_secs(2));

    let is_armed = robot.safety() == Safety::Armed;
    story.expect(is_armed, "the rover is not armed any more");
    let report = robot.stop();
    listener.join().map_err(|_| "the listener has failed")?;
    let taken = std::mem::take(&mut *taken.lock().unwrap_or_else(PoisonError::into_inner));
    let outputs: Vec<_> = outputs.drain().collect();
    judge(&mut story, &report, &taken, &outputs);

    // Entries are taken by the replay; nothing of it knows of a network.
    let entries = std::mem::take(&mut *journal.lock().unwrap_or_else(PoisonError::into_inner));
    let builder = Rover::builder();
    let again = builder.subscribe_with(rover::estimator::base::judge, Overflow::DropOldest { capacity: 100_000 });
    let mut replay = builder.replay()?;
    replay.play(entries)?;
    replay.stop();
    let again: Vec<_> = again.drain().collect();
    story.expect(
        !outputs.is_empty() && again == outputs,
        format_args!("the replay gives {} of {}", again.len(), outputs.len()),
    );
    story.tell(format_args!("the replay, without a network, gives the same {} outputs", again.len()));

    if story.wrong.is_empty() {
        println!("\nAll of this was expected.");
    }
    for wrong in &story.wrong {
        println!("\nnot expected: {wrong}");
    }
    Ok(story.wrong.is_empty())
}

/// Compares what the rover took with the truth.
fn judge(story: &mut Story, report: &bb_core::Report, taken: &[TakenBeat], outputs: &[Stamped<Seen>]) {
    let worst = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0_f64, |worst, value| worst.max(value.abs()));
    let error_s = worst(&mut outputs.iter().map(|seen| seen.error_s));
    story.tell(format_args!("{} beats taken, the worst stamp off by {:.2} ms", taken.len(), error_s * 1e3));
    story.expect(error_s <= CLOCK_WITHIN, "a stamp is off by more than `clock_within`");
    let age_s = worst(&mut taken.iter().map(|taken| taken.age_s));
    story.tell(format_args!("the oldest was {:.0} ms old when it was handed over", age_s * 1e3));
    // What the listening thread waits for the processor is not the sensor's.
    story.expect(age_s <= WITHIN + 0.5, "a beat was older than `within`");
    story.expect(!outputs.iter().any(|seen| seen.is_armed), "the mast is armed");

    let Some(beacon) = report.source("sensor/base/beacon") else {
        return story.expect(false, "there is no report");
    };
    let count = |name: &str| beacon.count(name);
    let (received, lost, stale, unsure) = (count("received"), count("lost"), count("stale"), count("unsure"));
    story.tell(format_args!(
        "{received} received, {lost} lost, {stale} stale, {unsure} before the clock was known; {} refused, {} repeated",
        count("refused"),
        count("repeated"),
    ));
    story.expect(received == taken.len() as u64, "not each reading was handed over");
    story.expect(count("refused") + count("repeated") == 0, "messages were refused or came twice");
    // A mast that is started again counts from its own beginning.
    let runs: Vec<&[TakenBeat]> = taken.chunk_by(|one, next| one.beat.number < next.beat.number).collect();
    story.expect(runs.len() == 2, format_args!("there were {} runs of the mast, not two", runs.len()));
    let numbers = |run: &[TakenBeat]| Some(run.last()?.beat.number - run.first()?.beat.number + 1);
    let span: u64 = runs.iter().filter_map(|run| numbers(run)).sum();
    story.expect(stale > 0, "what was held up was taken");
    story.expect(lost > 0, "no beat was lost, though the link was cut");
    let counted = received + lost + stale + unsure;
    // Those of a run before its first reading came while the clock was not known, if at all; what came after its last one was stale.
    let most = stale + runs.iter().filter_map(|run| Some(run.last()?.beat.number)).sum::<u64>();
    story
        .expect((span..=most).contains(&counted), format_args!("{counted} are accounted for, of {span} to {most}"));
}
