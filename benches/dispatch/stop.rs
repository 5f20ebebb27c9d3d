//! Time that `stop` takes, and time until the motor has been made safe: of a robot that is idle, and of one in which a sensor, an
//! estimator, an estimator on a worker, a command and a disarm callback hang.

use super::Line;
use super::chain::{Inertial, Pass};
use bb_core::prelude::*;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError, mpsc};
use std::time::Instant;

/// `true` if everything that can hang does.
static HANGS: AtomicBool = AtomicBool::new(false);
/// Number of threads that hang.
static HANGING: AtomicUsize = AtomicUsize::new(0);
/// Time at which the motor was first made safe.
static SAFE: Mutex<Option<Instant>> = Mutex::new(None);

fn hang() {
    HANGING.fetch_add(1, Ordering::SeqCst);
    while HANGS.load(Ordering::SeqCst) {
        std::thread::sleep(Duration::from_millis(1));
    }
    HANGING.fetch_sub(1, Ordering::SeqCst);
}

/// A device that does not answer, neither when it is read nor when it is to be made safe.
#[derive(Debug)]
pub(super) struct Lidar;

impl Sensor for Lidar {
    type Options = NoOptions;
    type Output = Inertial;

    fn init(_: NoOptions, context: &SensorContext) -> Result<Self, Fault> {
        context.on_disarm(|| {
            hang();
            Ok(())
        });
        Ok(Self)
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Inertial>, Fault> {
        hang();
        Ok(Reading::nothing())
    }
}

/// Computes for ever.
#[derive(Debug)]
pub(super) struct Diverging;

impl Estimator for Diverging {
    type Options = NoOptions;
    type Input = Inertial;
    type Output = Inertial;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_input(&mut self, _: &Stamped<Inertial>) -> Result<Reply<Inertial>, Fault> {
        hang();
        Ok(Reply::none())
    }
}

/// Blocks its thread.
#[derive(Debug)]
pub(super) struct Block;

impl Command for Block {
    type Options = NoOptions;
    type Arguments = NoArguments;
    type Output = ();

    async fn run(_: NoOptions, _: NoArguments, _: CommandContext) -> Result<Outcome<()>, Fault> {
        hang();
        Ok(Outcome::done(()))
    }
}

/// Notes when it was made safe.
#[derive(Debug)]
pub(super) struct Motor;

impl Actuator for Motor {
    type Options = NoOptions;
    type Command = Inertial;

    fn init(_: NoOptions, _: &ActuatorContext) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_command(&mut self, _: &Stamped<Inertial>) -> Result<(), Fault> {
        Ok(())
    }

    fn disarm(&mut self) -> Result<(), Fault> {
        SAFE.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert_with(Instant::now);
        Ok(())
    }
}

robot! {
    robot Stuck;
    commands { block: Block { allowed_states: [idle, executing]; } }
    link base {
        sensor lidar: Lidar() { rate: 100 Hz; }
        sensor camera: External<Inertial>() {
            estimator diverging: Diverging();
        }
        sensor imu: External<Inertial>() {
            estimator on_worker: Diverging() { runs_on: worker; }
            estimator pass: Pass();
        }
        joint wheel: continuous {
            axis: y;
            actuator motor: Motor();
            sensor encoder: External<JointState>();
            link rim;
        }
    }
}

pub(super) fn measure() -> Result<Vec<Line>, Box<dyn std::error::Error>> {
    let [safe_ms, stopped_ms] = stop(false)?;
    let [stuck_safe_ms, stuck_stopped_ms] = stop(true)?;
    let figure = |name, ours| Line::Figure { name, ours, unit: "ms" };
    Ok(vec![
        figure("stop_idle_until_safe", safe_ms),
        figure("stop_idle_until_return", stopped_ms),
        figure("stop_hung_until_safe", stuck_safe_ms),
        figure("stop_hung_until_return", stuck_stopped_ms),
    ])
}

/// Milliseconds from the call of `stop` until the motor is safe, and until it returns; infinity: not within a minute.
fn stop(hangs: bool) -> Result<[f64; 2], Box<dyn std::error::Error>> {
    HANGS.store(hangs, Ordering::SeqCst);
    let running = Stuck::builder().start()?;
    running.arm().expect("it may be armed");
    if hangs {
        running.command(stuck::command::block, NoArguments)?;
        for sensor in [stuck::sensor::base::camera, stuck::sensor::base::imu] {
            // Each may keep the thread that publishes.
            let live = running.live();
            std::thread::spawn(move || live.publish(sensor, live.clock().now(), Inertial::new(1.0)));
        }
        // The sensor, both estimators and the command.
        let patience = Instant::now() + Duration::from_secs(10);
        while HANGING.load(Ordering::SeqCst) < 4 {
            if Instant::now() > patience {
                return Err("not all that is to hang does".into());
            }
            std::thread::sleep(Duration::from_millis(1));
        }
    }
    *SAFE.lock().unwrap_or_else(PoisonError::into_inner) = None;
    let (stopped, wait) = mpsc::channel();
    let start = Instant::now();
    std::thread::spawn(move || {
        drop(running.stop());
        // Nobody waits for it after a minute.
        let _ = stopped.send(Instant::now());
    });
    let until_return = wait.recv_timeout(Duration::from_secs(60)).ok();
    let until_safe = *SAFE.lock().unwrap_or_else(PoisonError::into_inner);
    HANGS.store(false, Ordering::SeqCst);
    Ok([until_safe, until_return]
        .map(|end| end.map_or(f64::INFINITY, |end| end.saturating_duration_since(start).as_secs_f64() * 1e3)))
}
