//! Code that makes hardware safe, and what happens when it goes wrong itself.

use crate::kit::*;

static MADE: AtomicU32 = AtomicU32::new(0);
static STOPPED: Mutex<Vec<u32>> = Mutex::new(Vec::new());

static TORQUE: AtomicBool = AtomicBool::new(false);

const HANGS_AT_DISARM: f64 = -2.0;
const PANICS_AT_DISARM: f64 = -3.0;

static HERE: Gate = Gate::new();

/// Stops its motor when the robot is disarmed. Each one made has its own.
fn lidar(context: &SensorContext) -> Done {
    let number = MADE.fetch_add(1, Ordering::SeqCst);
    context.on_disarm(move || {
        lock(&STOPPED).push(number);
        Ok(())
    });
    Ok(())
}

fn turn(_: f64) -> Done {
    TORQUE.store(true, Ordering::SeqCst);
    Ok(())
}

fn brake(last: f64) -> Done {
    assert!(last != PANICS_AT_DISARM, "no brake");
    if last == HANGS_AT_DISARM {
        HERE.pass("a brake");
    }
    TORQUE.store(false, Ordering::SeqCst);
    Ok(())
}

fn powered() -> Builder<Plain> {
    let mut builder = Plain::builder();
    builder.options(SOURCE).init = lidar;
    let motor = builder.options(SERVO);
    (motor.command, motor.disarm) = (turn, brake);
    builder
}

#[test]
fn a_restarted_sensor_is_made_safe_once() {
    let _alone = one_at_a_time();
    let mut builder = powered();
    builder.options(SOURCE).read = |_, _| Err(Fault::new("no echo"));
    builder.supervision().max_restarts = 1000;
    let mut simulation = builder.simulate().expect("it starts");
    simulation.run_until(at(3000));
    simulation.arm().expect("it may be armed");
    lock(&STOPPED).clear();
    assert_eq!(simulation.disarm(), Ok(()));
    let last = MADE.load(Ordering::SeqCst) - 1;
    assert!(last > 3, "it has broken");
    assert_eq!(*lock(&STOPPED), [last]);
}

/// One after the other, and by many threads at once: each gets the answer, the hardware is made safe once.
#[test]
fn a_robot_that_is_disarmed_twice_is_made_safe_once() {
    alone_within(60, || {
        let builder = powered();
        let changes = builder.subscribe(system::SafetyState);
        let running = builder.start().expect("it starts");
        let last = MADE.load(Ordering::SeqCst) - 1;
        let stopped = || std::mem::take(&mut *lock(&STOPPED));
        let changes = || changes.drain().map(|change| change.payload.to).collect::<Vec<_>>();
        let once = [Safety::Armed, Safety::Disarming, Safety::Disarmed];
        for many in [1, 2, 8] {
            running.arm().expect("it may be armed");
            running.actuate(SERVO, Number(1.0)).expect("it is armed");
            stopped();
            std::thread::scope(|scope| {
                let disarms: Vec<_> = (0..many).map(|_| scope.spawn(|| running.disarm())).collect();
                for disarm in disarms {
                    assert_eq!(disarm.join().expect("it does not panic"), Ok(()));
                }
            });
            assert!(!TORQUE.load(Ordering::SeqCst));
            assert_eq!((stopped(), changes()), (vec![last], once.to_vec()), "{many} at once");
            assert_eq!(running.disarm(), Ok(()));
            assert_eq!((stopped(), changes()), (vec![], vec![]), "it was disarmed");
        }
        // What could not be made safe, since its code panics, is not safe the second time either, until it is forced.
        let errors = running.subscribe(system::SafetyErrors);
        running.arm().expect("it may be armed");
        running.actuate(SERVO, Number(PANICS_AT_DISARM)).expect("it does as told");
        let says = "disarming failed: panicked: no brake";
        let all = format!("not everything could be made safe: `actuator/base/pan/servo`: {says}");
        assert_refused(running.disarm(), &all);
        assert_eq!(errors.try_recv().map(|error| error.payload.error.message).as_deref(), Some(says));
        assert!(running.safety() == Safety::Error && running.disarm().is_err());
        assert_eq!(running.safety(), Safety::Error);
        assert!(running.force_disarm().is_err(), "it still cannot");
        assert_eq!(running.safety(), Safety::Disarmed);
    });
}

#[test]
fn a_disarm_that_hangs_is_an_error_and_does_not_keep_the_robot_from_stopping() {
    alone_within(60, || {
        HERE.close("a brake");
        let running = armed(powered());
        running.actuate(SERVO, Number(HANGS_AT_DISARM)).expect("it does as told");
        let start = std::time::Instant::now();
        let expected = "not everything could be made safe: `actuator/base/pan/servo`: did not come back from disarming in time";
        assert_refused(running.disarm(), expected);
        assert!((5..15).contains(&start.elapsed().as_secs()));
        assert_eq!(running.safety(), Safety::Error);
        let start = std::time::Instant::now();
        let report = running.stop();
        assert!(start.elapsed() < Duration::from_secs(20));
        let late = "actuator/base/pan/servo failed: did not come back from its command, or from disarming, in time";
        assert_eq!(told(&report), [late]);
        HERE.open();
    });
}

#[test]
fn threads_that_arm_and_disarm_at_once_agree_in_the_end() {
    alone_within(60, || {
        let builder = powered();
        let changes = builder.subscribe_with(system::SafetyState, Overflow::DropOldest { capacity: 1 << 15 });
        let running = builder.start().expect("it starts");
        std::thread::scope(|scope| {
            for thread in 0..4 {
                let running = &running;
                scope.spawn(move || {
                    for round in 0..200 {
                        if (thread + round) % 2 == 0 {
                            let _ = running.arm();
                        } else {
                            let _ = running.disarm();
                        }
                    }
                });
            }
        });
        running.disarm().expect("all can be made safe");
        let mut safety = Safety::Disarmed;
        for change in changes.drain() {
            assert_eq!(change.from, safety);
            safety = change.to;
        }
        assert_eq!((safety, running.safety()), (Safety::Disarmed, Safety::Disarmed));
    });
}
