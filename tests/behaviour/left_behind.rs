//! Code that hangs when the robot stops is left behind and reported; nobody waits for it for longer than the robot says.

use crate::kit::*;

/// Gate at which all of it hangs.
static HERE: Gate = Gate::new();

/// Number of times that something was made safe.
static DISARMED: AtomicU32 = AtomicU32::new(0);

/// Value that hangs when it is dropped.
#[derive(Debug)]
struct Dropping;

impl Drop for Dropping {
    fn drop(&mut self) {
        HERE.pass("here");
    }
}

fn disarm(_: f64) -> Done {
    DISARMED.fetch_add(1, Ordering::SeqCst);
    Ok(())
}

/// Registers a disarm callback that owns what hangs when it is dropped.
fn own(context: &SensorContext) -> Done {
    let owned = Dropping;
    context.on_disarm(move || {
        let _ = &owned;
        disarm(0.0)
    });
    Ok(())
}

robot! {
    robot Sticky;
    link base {
        sensor owner: Source(init = own) { rate: 10 Hz; }
        joint pan: continuous {
            axis: z;
            actuator clinging: Servo(disarm = disarm, terminate = |_| HERE.pass("here"));
            sensor a: External<Number>();
            link head {}
        }
        joint tilt: continuous {
            axis: y;
            actuator heavy: Servo(disarm = disarm, dropped = || HERE.pass("here"));
            sensor b: External<Number>();
            link eye {}
        }
    }
}

#[test]
fn a_robot_of_which_everything_hangs_as_it_closes_is_back_and_says_what_it_left() {
    within(60, || {
        let mut builder = Sticky::builder();
        builder.journal(|line| {
            if matches!(line.event, Event::Stop { .. }) {
                HERE.pass("here");
            }
        });
        let running = armed(builder);
        // Both are woken by the end.
        let (tell, told) = mpsc::channel();
        let mut first = running.subscribe(sticky::sensor::base::pan::a);
        let mut second = running.subscribe(sticky::sensor::base::tilt::b);
        when_woken(&mut first, || HERE.pass("here"));
        when_woken(&mut second, move || {
            let _ = tell.send(());
        });
        HERE.close("here");
        let start = std::time::Instant::now();
        let report = running.stop();
        assert!(start.elapsed() < Duration::from_secs(8), "{:?}", start.elapsed());
        assert_eq!(told.recv_timeout(Duration::from_secs(20)), Ok(()), "the other one's waker hangs");
        HERE.open();
        assert_eq!((DISARMED.load(Ordering::SeqCst), report.safety), (3, Safety::Disarmed));
        // While it stops, the thread that keeps time reports what hangs as it does while the robot runs.
        let faults = report.faults.iter().filter(|fault| !fault.message.starts_with("hangs: "));
        let faults: Vec<_> = faults.map(ToString::to_string).collect();
        let starts = [
            "actuator/base/pan/clinging failed: did not return when the robot stopped; its code was entered ",
            "actuator/base/tilt/heavy failed: did not return when the robot stopped; its code was entered ",
            "journal failed: its sink did not take the last lines in time: it ends before the run",
            "pool failed: wakers and values that were dropped that have not returned: 2",
        ];
        assert_eq!(faults.len(), starts.len(), "{faults:?}");
        for (fault, start) in faults.iter().zip(starts) {
            assert!(fault.starts_with(start), "{faults:?}");
        }
    });
}
