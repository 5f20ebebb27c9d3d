//! Optional features: real-time priorities of workers, and signals that stop a robot. Beside them a process in which no thread
//! can be started.

use super::components::{Done, Echo, Failure, Number, Read, Servo, Source, lock};
use bb_core::prelude::*;
use std::process::{Command as Process, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, OnceLock};

robot! {
    robot Urgent;
    link base {
        sensor numbers: External<Number>();
        estimator pass: Echo() { input number: numbers; runs_on: worker, priority: 80; }
    }
}

#[test]
fn a_worker_has_its_priority_or_the_error_says_why_not() -> Result<(), Failure> {
    let running = match Urgent::builder().start() {
        Ok(running) => running,
        Err(error) => {
            let error = error.to_string();
            assert!(error.contains("estimator/base/pass") && error.contains("priority 80"), "{error}");
            println!("priorities cannot be raised here: {error}");
            return Ok(());
        }
    };
    let passed = running.subscribe(urgent::estimator::base::pass);
    running.publish(urgent::sensor::base::numbers, running.clock().now(), Number(1.0));
    let message = passed.recv_timeout(Duration::from_secs(20)).ok_or("nothing came")?;
    assert_eq!(message.payload, Number(1.0));
    // Without the right to raise it, the worker runs as any other, and says so.
    if let Err(fault) = running.stop().ok() {
        let said = format!("{fault:?}");
        assert!(said.contains("estimator/base/pass") && said.contains("priority 80"), "{said}");
    }
    Ok(())
}

robot! {
    robot Stoppable;
    commands { arm: Arm; disarm: Disarm; }
    link base { sensor numbers: External<Number>() { estimator pass: Echo(); } }
}

/// Keeps the bus for `hang`.
fn keep_bus(context: &SensorContext) -> Done {
    BUS.get_or_init(|| context.bus());
    Ok(())
}

static BUS: OnceLock<bb_core::Bus> = OnceLock::new();

/// Blocks once the robot is armed.
fn hang(_: u32, _: MonotonicTime) -> Read {
    if BUS.get().is_some_and(|bus| bus.safety() != Safety::Disarmed) {
        println!("it hangs");
        park();
    }
    Ok(Reading::nothing())
}

fn park() -> ! {
    loop {
        std::thread::park();
    }
}

/// Takes its time to become safe, and says so.
fn slow(_: f64) -> Done {
    std::thread::sleep(Duration::from_millis(700));
    println!("the motor is safe");
    Ok(())
}

robot! {
    robot Stuck;
    link base {
        sensor device: Source(init = keep_bus, read = hang) { rate: 100 Hz; }
        joint wheel: continuous { axis: z; sensor encoder: External<Number>(); actuator motor: Servo(disarm = slow); link rim { } }
    }
}

/// Runs `test` of this binary in another process, whose lines are returned as they come.
fn child(test: &str) -> Result<(std::process::Child, impl Iterator<Item = String>), Failure> {
    let mut child = Process::new(std::env::current_exe()?)
        .args([test, "--exact", "--nocapture"])
        .env("BB_TEST_SIGNAL", "1")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()?;
    let lines = std::io::BufRead::lines(std::io::BufReader::new(child.stdout.take().ok_or("no output")?));
    Ok((child, lines.map_while(Result::ok)))
}

/// Sends a signal by its name.
fn signal(child: &std::process::Child, name: &str) -> std::io::Result<()> {
    Process::new("kill").args([name, &child.id().to_string()]).status().map(drop)
}

fn run_stuck() -> Result<(), Failure> {
    let mut running = Stuck::builder().start()?;
    running.stop_on_signals()?;
    running.arm()?;
    running.wait();
    println!("wait has returned");
    let report = running.stop();
    println!(
        "it is {} with {:?}",
        report.safety,
        report.faults.iter().map(|fault| fault.to_string()).collect::<Vec<_>>()
    );
    Ok(())
}

#[test]
fn after_a_signal_a_driver_that_hangs_keeps_neither_wait_nor_the_report() -> Result<(), Failure> {
    const NAME: &str = "processes::features::after_a_signal_a_driver_that_hangs_keeps_neither_wait_nor_the_report";
    if std::env::var_os("BB_TEST_SIGNAL").is_some() {
        return run_stuck();
    }
    let (mut child, mut lines) = child(NAME)?;
    assert!(lines.by_ref().any(|line| line.ends_with("it hangs")), "it is armed");
    let start = std::time::Instant::now();
    // Twice at once, as some parents do: that is one signal.
    signal(&child, "-INT")?;
    signal(&child, "-INT")?;
    assert!(lines.by_ref().any(|line| line.ends_with("the motor is safe")), "disarmed first");
    assert!(lines.by_ref().any(|line| line.ends_with("wait has returned")), "wait returns");
    let waited = start.elapsed();
    assert!((4.9..6.0).contains(&waited.as_secs_f64()), "{waited:?}");
    let report = lines.by_ref().find(|line| line.starts_with("it is disarmed")).ok_or("no report")?;
    assert!(report.contains("sensor/base/device failed: did not come back from its read"), "{report}");
    assert!(child.wait()?.success());
    let stopped = start.elapsed() - waited;
    assert!(stopped.as_secs_f64() < 2.0, "stop has waited again: {stopped:?}");
    Ok(())
}

#[cfg(unix)]
#[test]
fn a_second_signal_ends_the_process_once_the_robot_is_safe() -> Result<(), Failure> {
    use std::os::unix::process::ExitStatusExt as _;
    const NAME: &str = "processes::features::a_second_signal_ends_the_process_once_the_robot_is_safe";
    const SIGTERM: i32 = 15;
    if std::env::var_os("BB_TEST_SIGNAL").is_some() {
        return run_stuck();
    }
    let (mut child, mut lines) = child(NAME)?;
    assert!(lines.by_ref().any(|line| line.ends_with("it hangs")), "it is armed");
    let start = std::time::Instant::now();
    signal(&child, "-INT")?;
    std::thread::sleep(Duration::from_millis(550));
    signal(&child, "-TERM")?;
    assert_eq!(child.wait()?.signal(), Some(SIGTERM));
    let ended = start.elapsed();
    assert!((0.69..4.0).contains(&ended.as_secs_f64()), "{ended:?}");
    let said: Vec<_> = lines.collect();
    assert!(said.iter().any(|line| line == "the motor is safe"), "{said:?}");
    assert!(!said.iter().any(|line| line == "wait has returned"), "{said:?}");
    Ok(())
}

/// A signal disarms and stops. The test runs itself as another process, which gets the signal.
#[test]
fn a_signal_disarms_and_stops() -> Result<(), Failure> {
    const NAME: &str = "processes::features::a_signal_disarms_and_stops";
    if std::env::var_os("BB_TEST_SIGNAL").is_some() {
        let mut running = Stoppable::builder().start()?;
        running.stop_on_signals()?;
        running.arm().expect("it may be armed");
        println!("it is {}", running.safety());
        running.wait();
        let live = running.live();
        println!("it is {}", running.stop().safety);
        // A handle that is left keeps no thread.
        while cfg!(target_os = "linux") && threads("disarm")? > 0 {
            std::thread::sleep(Duration::from_millis(1));
        }
        drop(live);
        return Ok(());
    }
    let (mut child, mut lines) = child(NAME)?;
    assert!(lines.by_ref().any(|line| line.ends_with("it is armed")), "it is armed");
    signal(&child, "-TERM")?;
    assert!(lines.any(|line| line.ends_with("it is disarmed")), "it is disarmed");
    assert!(child.wait()?.success());
    Ok(())
}

/// The number of threads of this process with that name.
fn threads(name: &str) -> Result<usize, Failure> {
    let tasks = std::fs::read_dir("/proc/self/task")?;
    // One that has ended meanwhile has no name.
    let names = tasks.filter_map(|task| std::fs::read_to_string(task.ok()?.path().join("comm")).ok());
    Ok(names.filter(|found| found.trim_end() == name).count())
}

#[test]
fn one_signal_stops_all_robots_of_a_process_and_is_not_for_later_ones() -> Result<(), Failure> {
    const NAME: &str = "processes::features::one_signal_stops_all_robots_of_a_process_and_is_not_for_later_ones";
    if std::env::var_os("BB_TEST_SIGNAL").is_some() {
        for robots in [2, 1] {
            let running = (0..robots).map(|_| -> Result<_, Failure> {
                let running = Stoppable::builder().start()?;
                running.stop_on_signals()?;
                running.arm()?;
                Ok(running)
            });
            let running = running.collect::<Result<Vec<_>, _>>()?;
            println!("{robots} armed");
            for mut running in running {
                running.wait();
                println!("one is {}", running.stop().safety);
            }
        }
        return Ok(());
    }
    let (mut child, mut lines) = child(NAME)?;
    for robots in [2, 1] {
        let armed = format!("{robots} armed");
        assert!(lines.by_ref().any(|line| line.ends_with(&armed)), "{armed}");
        // Not the same signal as the one before.
        std::thread::sleep(Duration::from_millis(550));
        signal(&child, "-TERM")?;
        let said: Vec<_> = lines.by_ref().take(robots).collect();
        assert_eq!(said, vec!["one is disarmed"; robots]);
    }
    assert!(child.wait()?.success());
    Ok(())
}

/// A second signal ends a simulation that hangs: on virtual time, a disarm callback runs on the thread that stops the robot.
#[cfg(unix)]
#[test]
fn a_second_signal_ends_a_simulation_that_hangs() -> Result<(), Failure> {
    use std::os::unix::process::ExitStatusExt as _;
    const NAME: &str = "processes::features::a_second_signal_ends_a_simulation_that_hangs";
    const SIGTERM: i32 = 15;
    if std::env::var_os("BB_TEST_SIGNAL").is_some() {
        let mut builder = Stuck::builder();
        builder.options(stuck::sensor::base::device).read = |_, _| Ok(Reading::nothing());
        builder.options(stuck::actuator::base::wheel::motor).disarm = |_| {
            println!("it hangs");
            park();
        };
        let simulation = builder.simulate()?;
        simulation.stop_on_signals()?;
        simulation.arm()?;
        println!("it is armed");
        park();
    }
    let (mut child, mut lines) = child(NAME)?;
    assert!(lines.by_ref().any(|line| line.ends_with("it is armed")), "it is armed");
    signal(&child, "-INT")?;
    assert!(lines.by_ref().any(|line| line.ends_with("it hangs")), "it is being made safe");
    std::thread::sleep(Duration::from_millis(550));
    signal(&child, "-TERM")?;
    assert_eq!(child.wait()?.signal(), Some(SIGTERM));
    Ok(())
}

/// Times at which the devices were safe.
static SAFE: Mutex<Vec<std::time::Instant>> = Mutex::new(Vec::new());
static DEVICES: AtomicU32 = AtomicU32::new(0);

/// Registers a device that takes its time to become safe; the first one hangs.
fn device(context: &SensorContext) -> Done {
    let is_first = DEVICES.fetch_add(1, Ordering::SeqCst) == 0;
    context.on_disarm(move || {
        if is_first {
            park();
        }
        std::thread::sleep(Duration::from_millis(400));
        lock(&SAFE).push(std::time::Instant::now());
        Ok(())
    });
    Ok(())
}

robot! {
    robot Crowded;
    link base {
        sensor a: Source(init = device) { rate: 1 Hz; }
        sensor b: Source(init = device) { rate: 1 Hz; }
        sensor c: Source(init = device) { rate: 1 Hz; }
        sensor d: Source(init = device) { rate: 1 Hz; }
        sensor e: Source(init = device) { rate: 1 Hz; }
    }
}

#[cfg(target_os = "linux")]
#[test]
fn where_no_thread_can_be_started_all_are_made_safe_at_once() -> Result<(), Failure> {
    use std::io::Write as _;
    const NAME: &str = "processes::features::where_no_thread_can_be_started_all_are_made_safe_at_once";
    if std::env::var_os("BB_TEST_SIGNAL").is_some() {
        return stop_without_threads();
    }
    let (mut child, mut lines) = child(NAME)?;
    assert!(lines.by_ref().any(|line| line.ends_with("it runs")), "it starts");
    let status = std::fs::read_to_string(format!("/proc/{}/status", child.id()))?;
    let size = status.lines().find_map(|line| line.strip_prefix("VmSize:")).ok_or("no size")?;
    let kilobytes: u64 = size.trim().trim_end_matches(" kB").parse()?;
    // Less than the stack of a thread.
    let limit = format!("--as={}", (kilobytes + 1024) * 1024);
    assert!(Process::new("prlimit").args(["--pid", &child.id().to_string(), &limit]).status()?.success());
    writeln!(child.stdin.take().ok_or("no input")?, "go on")?;
    let said: Vec<_> = lines.collect();
    assert!(child.wait()?.success(), "{said:?}");
    Ok(())
}

/// Waits until all other threads sleep: one that has only just been started still allocates its signal stack, and the limit would
/// end it.
#[cfg(target_os = "linux")]
fn await_started_threads() -> Result<(), Failure> {
    let own = std::fs::read_link("/proc/thread-self")?;
    let sleeps = |entry: std::io::Result<std::fs::DirEntry>| {
        let path = entry?.path();
        let stat = std::fs::read_to_string(path.join("stat"))?;
        let state = stat.rsplit(')').next().unwrap_or("").trim_start();
        Ok::<_, std::io::Error>(path.file_name() == own.file_name() || state.starts_with('S'))
    };
    // A thread may sleep while it starts, but not at ten looks in a row.
    let mut looks = 0;
    while looks < 10 {
        // One that ends meanwhile has no state: look again.
        let all = std::fs::read_dir("/proc/self/task")?.all(|entry| sleeps(entry).unwrap_or(false));
        looks = if all { looks + 1 } else { 0 };
        std::thread::sleep(Duration::from_millis(1));
    }
    Ok(())
}

#[cfg(target_os = "linux")]
fn stop_without_threads() -> Result<(), Failure> {
    let running = Crowded::builder().start()?;
    await_started_threads()?;
    println!("it runs");
    std::io::stdin().read_line(&mut String::new())?;
    // The stacks of threads that have ended may be used again.
    let is_full = (0..100).any(|_| std::thread::Builder::new().spawn(std::thread::park).is_err());
    assert!(is_full, "threads can be started");
    let start = std::time::Instant::now();
    running.request_stop();
    let returned = start.elapsed();
    assert!(returned < Duration::from_millis(200), "the caller was kept for {returned:?}");
    while lock(&SAFE).len() < 4 {
        assert!(start.elapsed() < Duration::from_millis(1500), "one after the other takes 1.6 s");
        std::thread::sleep(Duration::from_millis(1));
    }
    // The one that hangs would keep it for five seconds.
    std::mem::forget(running);
    Ok(())
}
