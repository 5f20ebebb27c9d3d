//! Latency budgets in real time: what they charge an estimator with, and what is measured without one.

use crate::kit::*;

/// Time that a copy for a subscriber takes.
const COPYING: Duration = Duration::from_millis(60);

/// Time that dropping a message takes.
const DROPPING: Duration = Duration::from_millis(40);

/// A payload whose copies take long, and whose messages are dropped slowly.
#[derive(Debug, Payload)]
pub(crate) struct Large {
    x: f64,
}

impl Clone for Large {
    fn clone(&self) -> Self {
        std::thread::sleep(COPYING);
        Self { x: self.x }
    }
}

impl Drop for Large {
    fn drop(&mut self) {
        std::thread::sleep(DROPPING);
    }
}

stateless! {
    /// Emits a message of its own for each.
    Forward: Large => Large, |large: &Stamped<Large>| Ok(Reply::emit(Large { x: large.x }));
}

robot! {
    robot Copying;
    link base {
        sensor camera: External<Large>() {
            estimator first: Forward() { latency_budget: 1 s; }
        }
        estimator second: Forward() { input message: sensor::base::camera::first; latency_budget: 1 s; }
        // Runs after `second`, whose output is dropped in between.
        estimator third: Forward() { input message: sensor::base::camera::first; latency_budget: 1 s; }
    }
}

#[test]
fn copies_and_drops_of_messages_are_charged_to_no_estimator() -> Result<(), Failure> {
    let running = Copying::builder().start()?;
    let copies = running.subscribe(copying::sensor::base::camera::first);
    // The first at the scale of the system's clock perhaps, the last by the processor's counter.
    for x in 0..5 {
        running.publish(copying::sensor::base::camera, running.clock().now(), Large { x: f64::from(x) });
        assert!(copies.recv_timeout(Duration::from_secs(10)).is_some());
        std::thread::sleep(Duration::from_millis(60));
    }
    let report = running.stop();
    for path in ["sensor/base/camera/first", "estimator/base/second", "estimator/base/third"] {
        let latency = report.estimator(path).ok_or("it is declared")?.latency;
        assert_eq!(latency.count, 5, "{path}");
        // The median, since the machine may give the thread no core now and then.
        assert!(latency.median < DROPPING / 2, "{path}: {latency:?}");
    }
    Ok(())
}

#[test]
fn without_a_budget_one_of_64_callbacks_is_measured() -> Result<(), Failure> {
    let mut simulation = Plain::builder().simulate()?;
    for number in 1..=640 {
        simulation.publish(NUMBER, at(number), Number(1.0));
    }
    let report = simulation.stop();
    let echo = report.estimator("sensor/base/number/echo").ok_or("it is declared")?;
    assert_eq!((echo.emitted, echo.latency.count), (640, 10));
    Ok(())
}
