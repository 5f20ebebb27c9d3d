//! A run that begins late, at the first stamp of a recording: its simulated joints begin with it.

use bb_core::prelude::*;
use bb_estimators::simulation::SimulatedWorld;
use bb_estimators::{SimulatedActuator, SimulatedEncoder};

type Failure = Box<dyn std::error::Error>;

/// Plays two messages, the first of which was recorded at `first`.
#[derive(Debug)]
struct Recorded {
    first: f64,
    left: u8,
}

#[derive(Clone, Debug, Options)]
struct RecordedOptions {
    #[option(default = 0.0, unit = "s")]
    first: f64,
}

impl Recorded {
    fn first(&self) -> MonotonicTime {
        MonotonicTime::ZERO + Duration::from_secs_f64(self.first)
    }
}

impl Sensor for Recorded {
    type Options = RecordedOptions;
    type Output = BatteryState;

    fn init(options: RecordedOptions, _: &SensorContext) -> Result<Self, Fault> {
        Ok(Self { first: options.first, left: 2 })
    }

    fn starts_at(&self) -> Option<MonotonicTime> {
        Some(self.first())
    }

    fn read(&mut self, now: MonotonicTime) -> Result<Reading<BatteryState>, Fault> {
        self.left -= 1;
        let reading = Reading::now(BatteryState::default());
        Ok(if self.left > 0 {
            reading.next_at(now + Duration::from_secs(2))
        } else {
            reading.next_at(MonotonicTime::MAX)
        })
    }
}

robot! {
    robot Pendulum;

    link base {
        sensor battery: Recorded();
        joint swing: continuous {
            axis: y;
            limit: { velocity: 20 rad/s, effort: 5 N*m };
            actuator motor: SimulatedActuator(inertia = 0.01, initial = 0.5);
            sensor encoder: SimulatedEncoder() { rate: 100 Hz; }
            link rod {
                inertial: {
                    mass: 1 kg, origin: { xyz: [30 cm, 0 m, 0 m], rpy: [0 deg, 0 deg, 0 deg] },
                    inertia: { xx: 0.01 kg*m^2, yy: 0.01 kg*m^2, zz: 0.01 kg*m^2, xy: 0 kg*m^2, xz: 0 kg*m^2, yz: 0 kg*m^2 },
                };
            }
        }
    }
}

robot! {
    robot Turntable;

    link base {
        sensor battery: Recorded();
        joint turn: continuous {
            axis: z;
            limit: { velocity: 20 rad/s, effort: 5 N*m };
            actuator motor: SimulatedActuator(initial = 0.5);
            sensor encoder: SimulatedEncoder() { rate: 100 Hz; }
            link plate;
        }
    }
}

/// Measured positions by the time since the beginning of the run, and the true one at its end.
fn swing(first: f64) -> Result<(Vec<(i64, f64)>, f64), Failure> {
    let mut builder = Pendulum::builder();
    builder.options(pendulum::sensor::base::battery).first = first;
    let encoder = builder.subscribe(pendulum::sensor::base::swing::encoder);
    let mut simulation = builder.simulate()?;
    let start = simulation.clock().now();
    assert_eq!((start, simulation.clock().start()), (MonotonicTime::ZERO + Duration::from_secs_f64(first), start));
    simulation.run_for(Duration::from_secs(1));
    let measured = encoder.drain().map(|state| (state.monotonic_time.nanos_since(start), state.position)).collect();
    let world = simulation.shared(|| SimulatedWorld::new(Pendulum::TOPOLOGY));
    Ok((measured, world.joint("swing", simulation.clock().now())?.point.position))
}

/// Nothing brakes the arm and nobody commands it: it swings for ever, and had swung for fifty years at the first stamp.
#[test]
fn an_arm_swings_from_the_beginning_of_a_late_run() -> Result<(), Failure> {
    let early = swing(0.0)?;
    assert_eq!((early.0.len(), early.0[0]), (101, (0, 0.5)));
    assert!(early.0[20].1 > 0.6, "it falls: {:?}", early.0);
    for first in [100.0005, 1_000.0, 1.7e9] {
        assert_eq!(swing(first)?, early, "from {first} s on");
    }
    Ok(())
}

/// Before anything is read, the world may be asked, changed, or moved from a time before the run.
#[test]
fn the_world_of_a_late_run_may_be_changed_before_it_runs() -> Result<(), Failure> {
    let mut builder = Pendulum::builder();
    builder.options(pendulum::sensor::base::battery).first = 1.7e9;
    let mut simulation = builder.simulate()?;
    let world = simulation.shared(|| SimulatedWorld::new(Pendulum::TOPOLOGY));
    world.move_root(MonotonicTime::ZERO, |_| bb_core::nalgebra::Isometry3::identity());
    world.set_gravity(MonotonicTime::ZERO, bb_core::nalgebra::Vector3::zeros());
    assert_eq!(world.joint("swing", simulation.clock().now())?.point.position, 0.5);
    simulation.run_for(Duration::from_secs(1));
    assert_eq!(world.joint("swing", simulation.clock().now())?.point.position, 0.5, "nothing pulls");
    Ok(())
}

/// A joint without masses that is commanded in its first moment.
#[test]
fn a_joint_moves_at_once_in_a_late_run() -> Result<(), Failure> {
    let moved = |first: f64| -> Result<f64, Failure> {
        let mut builder = Turntable::builder();
        builder.options(turntable::sensor::base::battery).first = first;
        let mut simulation = builder.simulate()?;
        simulation.run_for(Duration::from_millis(1));
        assert_eq!(simulation.arm(), Ok(()));
        let motor = turntable::actuator::base::turn::motor;
        simulation.actuate(motor, VelocityCommand { velocity: 1.0, effort: None }.into())?;
        simulation.run_for(Duration::from_secs(1));
        let world = simulation.shared(|| SimulatedWorld::new(Turntable::TOPOLOGY));
        Ok(world.joint("turn", simulation.clock().now())?.point.position)
    };
    let early = moved(0.0)?;
    assert!(early > 1.0, "{early}");
    assert_eq!(moved(1.7e9)?, early);
    Ok(())
}
