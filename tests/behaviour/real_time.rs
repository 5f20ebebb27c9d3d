//! Real time: a thread per sensor. Nothing here asserts how late a thread was.

use crate::kit::*;
use std::time::Instant;

static WAITING: Mutex<Option<SensorContext>> = Mutex::new(None);

/// Waits for its device.
fn wait(_: u32, _: MonotonicTime) -> Read {
    let context = lock(&WAITING).clone().ok_or("it was not made")?;
    while !context.is_stopping() {
        std::thread::sleep(Duration::from_millis(1));
    }
    Ok(Reading::nothing())
}

fn install(context: &SensorContext) -> Done {
    *lock(&WAITING) = Some(context.clone());
    Ok(())
}

robot! {
    robot Live;
    link base {
        sensor numbers: Counter(count = 20) { rate: 200 Hz; estimator scaled: Scale(); }
        sensor waiting: Source(init = install, read = wait);
        sensor rare: Counter(count = 2) { rate: 0.001 Hz; }
    }
}

#[test]
fn sensors_run_on_threads_of_their_own_and_stop_on_request() {
    let builder = Live::builder();
    let scaled = builder.subscribe(live::sensor::base::numbers::scaled);
    let running = builder.start().expect("it starts");
    let numbers: Vec<_> = (0..20).filter_map(|_| scaled.recv_timeout(Duration::from_secs(10))).collect();
    assert_eq!(numbers.len(), 20);
    assert!(numbers.is_sorted_by_key(|number| number.monotonic_time));
    assert!(numbers.iter().all(|number| number.wall_time.as_unix_nanos() > 1_600_000_000_000_000_000));
    // One sensor waits for its device, another sleeps for a quarter of an hour: neither keeps the robot from stopping.
    let stopped = Instant::now();
    let report = running.stop();
    assert!(stopped.elapsed() < PATIENCE);
    assert_eq!(report.topic("sensor/base/rare").map(|topic| topic.published), Some(1));
    assert!(report.ok().is_ok());
}

/// Wants to be called every two milliseconds, and counts its calls.
pub(crate) struct Checking {
    context: ActuatorContext,
    next: MonotonicTime,
    /// Time of the first command that arrived while a call was overdue.
    overdue_since: Option<MonotonicTime>,
}

static CHECKED: AtomicU64 = AtomicU64::new(0);

impl Actuator for Checking {
    type Options = NoOptions;
    type Command = Number;

    fn init(_: NoOptions, context: &ActuatorContext) -> Result<Self, Fault> {
        Ok(Self { context: context.clone(), next: context.clock().now(), overdue_since: None })
    }

    fn handle_command(&mut self, command: &Stamped<Number>) -> Result<(), Fault> {
        let now = command.monotonic_time;
        if now < self.next {
            return Ok(());
        }
        // However late the thread is that keeps time. A call for which it was late already when it asked comes 10 µs after that.
        if now < *self.overdue_since.get_or_insert(now) + Duration::from_micros(20) {
            return Ok(());
        }
        Err(Fault::new("a call is overdue"))
    }

    fn next_update(&self) -> Option<MonotonicTime> {
        Some(self.next)
    }

    fn update(&mut self, now: MonotonicTime) -> Result<(), Fault> {
        assert!(now >= self.next && self.context.clock().now() >= self.next, "not before it wants");
        self.next = now + Duration::from_millis(2);
        self.overdue_since = None;
        CHECKED.fetch_add(1, Ordering::SeqCst);
        Ok(())
    }

    fn disarm(&mut self) -> Result<(), Fault> {
        Ok(())
    }
}

robot! {
    robot Streamed;
    link base {
        joint pan: continuous { axis: z; actuator servo: Checking(); sensor encoder: External<Number>(); link head {} }
    }
}

/// Commands come so fast that the actuator's lock is hardly ever free.
#[test]
fn a_stream_of_commands_does_not_starve_the_updates_of_an_actuator() {
    within(60, || {
        let running = armed(Streamed::builder());
        let servo = streamed::actuator::base::pan::servo;
        let mut commands = 0_u64;
        for _ in 0..50 {
            let before = CHECKED.load(Ordering::SeqCst);
            while CHECKED.load(Ordering::SeqCst) == before {
                running.actuate(servo, Number(1.0)).expect("it is armed");
                commands += 1;
            }
        }
        let report = running.stop();
        let counts = report.actuator(servo.path()).expect("it is declared");
        assert_eq!(counts.commands, commands, "none was lost meanwhile");
        assert!(commands > 100, "{commands} commands are no stream");
        report.ok().expect("nothing is wrong");
    });
}
