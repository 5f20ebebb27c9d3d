//! Journals that cannot be replayed, or not to their end.

use crate::journals::{Again, Way, again};
use crate::kit::*;
use bb_core::journal::{JournalLine, JournalReader};
use bb_mcap::{Recorder, RecorderOptions, Recording};
use std::io::{BufRead, BufReader};
use std::process::Stdio;

/// Gives what it did not give the first time, from its third message on.
fn throw_dice(count: &mut f64, number: f64) -> Replied {
    *count += 1.0;
    let differs = *count >= 3.0 && is_again();
    // The least bit of one number.
    Ok(Reply::emit(Number(if differs { f64::from_bits(number.to_bits() ^ 1) } else { number })))
}

/// A journal is that of the robot with the same declaration, in the same order and with the same budgets, and without a gap.
#[test]
fn a_journal_of_another_robot_or_with_lines_missing_is_refused_with_its_line() -> Result<(), Failure> {
    let mut builder = Plain::builder();
    let lines = journal(&mut builder);
    builder.simulate()?;
    let begin = entries(&lines).swap_remove(0);
    let Event::Begin { declaration, .. } = &begin.event else { return Err("it begins with the robot".into()) };
    let place = |fact: &str| declaration.iter().position(|other| other == fact).ok_or("it is declared");
    let (source, number) =
        (place("sensor/base/source publishes Number")?, place("sensor/base/number publishes Number")?);
    assert!(source < number, "as they are declared");
    let of = |change: &dyn Fn(&mut Vec<String>)| {
        let mut begin = begin.clone();
        if let Event::Begin { declaration, .. } = &mut begin.event {
            change(declaration);
        }
        begin
    };
    let second = |event| vec![begin.clone(), Entry { number: 2, time: at(0), event }];
    let gap = Entry { number: 3, time: at(0), event: Event::Arm { caller: String::new() } };
    let cases = [
        (
            vec![of(&|declaration| declaration[0] = "robot Night".into())],
            "line 1 of the journal cannot be replayed: the journal is of another robot: it says `robot Night`, and this robot has \
             `robot Plain`",
        ),
        (
            vec![of(&|declaration| declaration.swap(source, number))],
            "line 1 of the journal cannot be replayed: the journal is of another robot: it says `sensor/base/number publishes \
             Number`, and this robot has `sensor/base/source publishes Number`",
        ),
        (
            second(Event::Deliver { island: 1, entry: 0, message: 3 }),
            "line 2 of the journal cannot be replayed: no such message waits: it is of another robot, or lines are missing",
        ),
        (
            second(Event::Wake { island: 99 }),
            "line 2 of the journal cannot be replayed: the robot has no such island",
        ),
        (vec![gap], "line 3 of the journal cannot be replayed: it follows line 0; the lines between are missing"),
    ];
    for (lines, says) in cases {
        assert_refused(Plain::builder().replay()?.play(lines), says);
    }
    let mut other = Plain::builder();
    other.supervision().max_restarts = 1_000_000;
    let error = other.replay()?.play(vec![begin]).expect_err("panics would escalate later").to_string();
    assert!(error.contains("supervision: Supervision { max_restarts: 3,"), "{error}");
    Ok(())
}

#[test]
fn an_estimator_that_gives_something_else_is_named_at_its_first_difference() -> Result<(), Failure> {
    let thrown = || {
        let mut builder = Plain::builder();
        builder.options(ECHO).input = throw_dice;
        builder.options(POSITION).input = throw_dice;
        builder
    };
    let mut builder = thrown();
    let lines = journal(&mut builder);
    let mut simulation = builder.simulate()?;
    for millis in 1..=5 {
        simulation.publish(NUMBER, at(millis), Number(1.0));
        simulation.publish(ENCODER, at(millis), Number(2.0));
    }
    simulation.stop();
    let lines = entries(&lines);
    let outputs: Vec<_> =
        lines.iter().filter(|line| matches!(line.event, Event::Output { .. })).map(|line| line.number).collect();
    assert_eq!(outputs.len(), 15, "those of `apart` too");
    let builder = thrown();
    let numbers = builder.subscribe(ECHO);
    let mut replay = builder.replay()?;
    let error = once_more(|| replay.play(lines.clone())).expect_err("it gives something else");
    assert_eq!(error.line, outputs[6], "the third of the first of the three");
    // Nothing is played after it, and the report says so.
    let heard = numbers.drain().count();
    assert_eq!(replay.play(lines), Err(error.clone()));
    let report = replay.stop();
    assert_eq!(numbers.drain().count(), 0, "after {heard}");
    assert_eq!(told(&report), [format!("journal failed: {error}")]);
    let says = "`sensor/base/number/echo` emits another message than it did: the algorithm is not deterministic";
    assert_eq!(error.message, says);
    Ok(())
}

const FILE: &str = "BB_TESTS_KILLED_JOURNAL";

/// A robot that is killed while its journal is recorded.
#[test]
fn child() {
    let Ok(file) = std::env::var(FILE) else { return };
    let mut builder = Again::builder();
    builder.publish_journal();
    let journal = builder.subscribe_any(Select::Path("journal"), None, overflow());
    let mut options = RecorderOptions::of::<Again>();
    options.flush_messages = 50;
    let recorder = Recorder::new(file, journal, options).expect("it can be created").spawn().expect("a thread");
    let running = armed(builder);
    for round in 0_u32.. {
        running.publish(again::sensor::base::number, running.clock().now(), Number(f64::from(round % 100)));
        running.publish(again::sensor::base::pan::encoder, running.clock().now(), Number(1.0));
        if round.is_multiple_of(10) {
            running.set_parameter(again::param::gain, f64::from(round % 7)).expect("it is finite");
            let _ = running.command(again::command::drive, Way { steps: 3, tunes: true });
            println!("\nround {round}");
        }
        std::thread::sleep(Duration::from_micros(300));
    }
    drop(recorder);
}

#[test]
fn the_journal_of_a_robot_that_was_killed_is_replayed_up_to_where_it_breaks_off() -> Result<(), Failure> {
    for rounds in [100, 333, 871] {
        let file = std::env::temp_dir().join(format!("bb-killed-{}-{rounds}.mcap", std::process::id()));
        let _ = std::fs::remove_file(&file);
        let mut child = std::process::Command::new(std::env::current_exe()?)
            .args(["--exact", "bad_journals::child", "--nocapture"])
            .env(FILE, &file)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()?;
        let lines = BufReader::new(child.stdout.take().ok_or("it is piped")?).lines();
        let mut reached = lines
            .map_while(Result::ok)
            .filter_map(|line| line.strip_prefix("round ")?.parse::<u32>().ok())
            .skip_while(|round| *round < rounds);
        assert!(reached.next().is_some(), "it runs until it is killed");
        // The recorder may lag behind.
        let size = || std::fs::metadata(&file).map_or(0, |file| file.len());
        wait_until("much is recorded", || size() >= 30_000 + 20 * u64::from(rounds));
        // At any moment, in the middle of a line too.
        std::thread::sleep(Duration::from_micros(u64::from(rounds) * 37 % 5000));
        child.kill()?;
        child.wait()?;
        // What the file holds up to where it breaks off.
        let (reader, recording) = (JournalReader::<Again>::default(), Recording::open(&file)?);
        let lines = recording.messages::<JournalLine>("journal")?.map_while(Result::ok);
        let mut lines: Vec<_> = lines.map(|line| reader.entry(&line.payload)).collect::<Result<_, _>>()?;
        std::fs::remove_file(&file)?;
        lines.sort_by_key(|line| line.number);
        let whole = (1..).zip(&lines).take_while(|(number, line)| *number == line.number).count();
        assert!(whole > 50, "{whole} lines are left of {rounds} rounds");
        assert_eq!(whole, lines.len(), "none is missing in between");
        let Event::Begin { declaration, .. } = &lines[0].event else {
            return Err("it begins with the robot".into());
        };
        let mut publishers = declaration.iter().filter(|fact| fact.contains(" publishes "));
        let sum = publishers.position(|fact| fact.starts_with("sensor/base/number/sum "));
        let is_of_sum =
            |line: &&Entry| matches!(line.event, Event::Output { publisher, .. } if Some(publisher) == sum);
        let recorded = lines.iter().filter(is_of_sum).count();
        let builder = Again::builder();
        let sums = builder.subscribe_with(again::sensor::base::number::sum, overflow());
        let mut replay = builder.replay()?;
        // Another process does not know what was published at a path made at run time, nor which requests there are.
        let _progress = replay.bus().publisher::<Number>("progress")?;
        replay.play(lines)?;
        let report = replay.stop();
        // It may be cut in a turn, before the line that says how long the callbacks of that took.
        for fault in report.faults.iter().filter(|fault| fault.path == "journal") {
            let ending =
                "the journal is cut here: it does not say how long its callback took for `sensor/base/number/sum`";
            assert!(fault.message.ends_with(ending), "{fault}");
        }
        // The line of the last one may be missing, and not that of the message that led to it.
        let replayed = sums.drain().count();
        assert!(recorded > 0 && (recorded..=recorded + 1).contains(&replayed), "{replayed} of {recorded}");
    }
    Ok(())
}

#[test]
fn a_journal_that_is_cut_before_the_duration_of_a_callback_says_so() -> Result<(), Failure> {
    let mut builder = Again::builder();
    let lines = journal(&mut builder);
    let mut simulation = builder.simulate()?;
    for millis in 1..=5 {
        simulation.publish(again::sensor::base::number, at(millis), Number(1.0));
    }
    simulation.stop();
    let lines = entries(&lines);
    let durations: Vec<_> = lines
        .iter()
        .filter_map(|line| match &line.event {
            Event::Measured { cause, callbacks } if !callbacks.is_empty() => Some((line.number, *cause)),
            _ => None,
        })
        .collect();
    assert!(durations.len() > 4);
    for (line, cause) in durations {
        let mut replay = Again::builder().replay()?;
        replay.play(lines[..line as usize - 1].to_vec())?;
        let report = replay.stop();
        let expected = format!(
            "journal failed: line {cause} of the journal cannot be replayed: the journal is cut here: it does not say how \
             long its callback took for `sensor/base/number/sum`"
        );
        assert_eq!(told(&report), [expected]);
    }
    Ok(())
}
