//! Optional features: real-time priorities of workers, and signals that stop a robot. Beside them a process in which no thread
//! can be started.

use bb_core::prelude::*;
use std::process::{Command as Process, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, PoisonError};

/// A number.
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
struct Number(f64);

/// Passes on.
#[derive(Debug)]
struct Pass;

impl Estimator for Pass {
    type Options = NoOptions;
    type Input = Number;
    type Output = Number;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_input(&mut self, number: &Stamped<Number>) -> Result<Reply<Number>, Fault> {
        Ok(Reply::emit(number.payload))
    }
}

robot! {
    robot Urgent;
    link base {
        sensor numbers: External<Number>();
        estimator pass: Pass() { input number: numbers; runs_on: worker, priority: 80; }
    }
}

#[test]
fn a_worker_has_its_priority_or_the_error_says_why_not() -> Result<(), Box<dyn std::error::Error>> {
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
    link base { sensor numbers: External<Number>() { estimator pass: Pass(); } }
}

/// Does not return once it is armed.
#[derive(Debug)]
struct Hangs(SensorContext);

impl Sensor for Hangs {
    type Options = NoOptions;
    type Output = Number;

    fn init(_: NoOptions, context: &SensorContext) -> Result<Self, Fault> {
        Ok(Self(context.clone()))
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Number>, Fault> {
        if self.0.bus().safety() != Safety::Disarmed {
            println!("it hangs");
            loop {
                std::thread::park();
            }
        }
        Ok(Reading::nothing())
    }
}

/// Takes its time to become safe, and says so.
#[derive(Debug)]
struct Motor;

impl Actuator for Motor {
    type Options = NoOptions;
    type Command = Number;

    fn init(_: NoOptions, _: &ActuatorContext) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_command(&mut self, _: &Stamped<Number>) -> Result<(), Fault> {
        Ok(())
    }

    fn disarm(&mut self) -> Result<(), Fault> {
        std::thread::sleep(Duration::from_millis(700));
        println!("the motor is safe");
        Ok(())
    }
}

robot! {
    robot Stuck;
    link base {
        sensor device: Hangs() { rate: 100 Hz; }
        joint wheel: continuous { axis: z; sensor encoder: External<JointState>(); actuator motor: Motor(); link rim { } }
    }
}

/// Runs `test` of this binary in another process, whose lines are returned as they come.
fn child(test: &str) -> Result<(std::process::Child, impl Iterator<Item = String>), Box<dyn std::error::Error>> {
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

fn run_stuck() -> Result<(), Box<dyn std::error::Error>> {
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
fn after_a_signal_a_driver_that_hangs_keeps_neither_wait_nor_the_report() -> Result<(), Box<dyn std::error::Error>>
{
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
fn a_second_signal_ends_the_process_once_the_robot_is_safe() -> Result<(), Box<dyn std::error::Error>> {
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

/// This test runs itself as another process, which gets the signal.
#[test]
fn a_signal_disarms_and_stops() -> Result<(), Box<dyn std::error::Error>> {
    const NAME: &str = "processes::features::a_signal_disarms_and_stops";
    if std::env::var_os("BB_TEST_SIGNAL").is_some() {
        let mut running = Stoppable::builder().start()?;
        running.stop_on_signals()?;
        running.arm().expect("it may be armed");
        println!("it is {}", running.safety());
        running.wait();
        println!("it is {}", running.stop().safety);
        return Ok(());
    }
    let (mut child, mut lines) = child(NAME)?;
    assert!(lines.by_ref().any(|line| line.ends_with("it is armed")), "it is armed");
    signal(&child, "-TERM")?;
    assert!(lines.any(|line| line.ends_with("it is disarmed")), "it is disarmed");
    assert!(child.wait()?.success());
    Ok(())
}

/// Times at which the devices were safe.
static SAFE: Mutex<Vec<std::time::Instant>> = Mutex::new(Vec::new());
static DEVICES: AtomicU32 = AtomicU32::new(0);

/// Takes its time to become safe; the first one hangs.
#[derive(Debug)]
struct Device;

impl Sensor for Device {
    type Options = NoOptions;
    type Output = Number;

    fn init(_: NoOptions, context: &SensorContext) -> Result<Self, Fault> {
        let is_first = DEVICES.fetch_add(1, Ordering::SeqCst) == 0;
        context.on_disarm(move || {
            if is_first {
                loop {
                    std::thread::park();
                }
            }
            std::thread::sleep(Duration::from_millis(400));
            SAFE.lock().unwrap_or_else(PoisonError::into_inner).push(std::time::Instant::now());
            Ok(())
        });
        Ok(Self)
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Number>, Fault> {
        Ok(Reading::finished())
    }
}

robot! {
    robot Crowded;
    link base {
        sensor a: Device() { rate: 1 Hz; }
        sensor b: Device() { rate: 1 Hz; }
        sensor c: Device() { rate: 1 Hz; }
        sensor d: Device() { rate: 1 Hz; }
        sensor e: Device() { rate: 1 Hz; }
    }
}

#[cfg(target_os = "linux")]
#[test]
fn where_no_thread_can_be_started_all_are_made_safe_at_once() -> Result<(), Box<dyn std::error::Error>> {
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
fn await_started_threads() -> Result<(), Box<dyn std::error::Error>> {
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
fn stop_without_threads() -> Result<(), Box<dyn std::error::Error>> {
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
    while SAFE.lock().unwrap_or_else(PoisonError::into_inner).len() < 4 {
        assert!(start.elapsed() < Duration::from_millis(1500), "one after the other takes 1.6 s");
        std::thread::sleep(Duration::from_millis(1));
    }
    // The one that hangs would keep it for five seconds.
    std::mem::forget(running);
    Ok(())
}
