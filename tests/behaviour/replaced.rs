//! Estimators that others take the place of: what stays, what is refused, and what a replay says to it.

use crate::joints::{Pixel, Spot, Spotter};
use crate::kit::*;
use bb_core::component::InputTransforms;

/// Options of an estimator that counts its messages and fails at the one of this number, with a gain that its journal shows.
fn ramp<const FAILS_AT: u32>(gain: f64) -> EchoOptions {
    EchoOptions {
        gain,
        init: |context| {
            context.request(Request::Timer(7, Duration::from_millis(15)));
            Ok(())
        },
        input: |count, _| {
            *count += 1.0;
            if *count == f64::from(FAILS_AT) { Err(Fault::new("told to")) } else { Ok(Reply::emit(Number(*count))) }
        },
        info: |_, info| {
            assert_eq!(info, Info::Timer(7));
            Ok(Reply::emit(Number(-1.0)).and(Request::Continue(3)))
        },
        go_on: |_, step| Ok(Reply::emit(Number(-f64::from(step)))),
        ..EchoOptions::defaults()
    }
}

/// Emits where the driver was, as [`Spotter`] does, one metre higher.
#[derive(Default)]
struct Above(Spotter, MonotonicTime);

impl Estimator for Above {
    type Options = NoOptions;
    type Input = Pixel;
    type Output = Spot;
    const HANDLES_MOVING_JOINTS: bool = true;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self::default())
    }

    fn handle_transforms(&mut self, transforms: &InputTransforms<'_>) -> Result<(), Fault> {
        self.1 = transforms.driver_time();
        self.0.handle_transforms(transforms)
    }

    fn handle_input(&mut self, pixel: &Stamped<Pixel>) -> Result<Reply<Spot>, Fault> {
        assert_eq!(self.1, pixel.monotonic_time);
        let spot = self.0.handle_input(pixel)?.into_output();
        Ok(spot.map(|spot| Spot { at: spot.at + bb_core::nalgebra::Vector3::z(), ..spot }).into())
    }
}

stateless! {
    /// Estimator that knows of fixed transforms only.
    Fixed: Pixel => Spot, |_pixel: &Stamped<Pixel>| Ok(Reply::none());
}

robot! {
    robot Bench;

    parameters { factor: f64 = 2.0, range: 0.0..=1000000.0; }
    controllers { controller idle: Pulse() { rate: 10 Hz; } }

    link base {
        sensor count: Counter(count = 6) {
            rate: 100 Hz;
            estimator scaled: Scale(factor = param::factor) { lost_after: 20 ms; recover_after: 2; }
            estimator asked: Echo();
        }
        estimator last: Scale(factor = 10.0) { input number: sensor::base::count::scaled; }
    }
}

const SCALED: &str = "sensor/base/count/scaled";

fn replaced(options: EchoOptions) -> Result<Builder<Bench>, Failure> {
    let mut builder = Bench::builder();
    builder.replace_estimator::<Echo>(SCALED, options)?;
    Ok(builder)
}

#[test]
fn a_replacement_keeps_path_frame_inputs_and_those_downstream() -> Result<(), Failure> {
    let builder = replaced(ramp::<0>(1.0))?;
    let scaled = builder.subscribe(bench::sensor::base::count::scaled);
    let last = builder.subscribe(bench::estimator::base::last);
    let mut simulation = builder.simulate()?;
    simulation.run_until(at(25));
    let scaled: Vec<_> = scaled.drain().collect();
    // Its timer and what it continues with too.
    let seen: Vec<_> = scaled.iter().map(|number| (number.monotonic_time, number.0)).collect();
    assert_eq!(seen, [(at(0), 1.0), (at(10), 2.0), (at(15), -1.0), (at(15), -3.0), (at(20), 3.0)]);
    assert!(scaled.iter().all(|number| number.frame.name() == "base"));
    let last: Vec<_> = last.drain().map(|number| number.0).collect();
    assert_eq!(last, [10.0, 20.0, -10.0, -30.0, 30.0]);

    // The declared options belong to the declared one.
    simulation.set_parameter(bench::param::factor, 3.0)?;
    simulation.run_until(at(35));
    let report = simulation.stop();
    let counts = report.estimator(SCALED).ok_or("it is declared")?;
    assert_eq!((counts.inputs[0].received, counts.restarts), (4, 0));
    Ok(())
}

#[test]
fn a_replacement_has_the_health_and_the_supervision_of_what_is_declared() -> Result<(), Failure> {
    let builder = replaced(ramp::<3>(1.0))?;
    let numbers = builder.subscribe(bench::sensor::base::count::scaled);
    let health = builder.subscribe(system::Health);
    let mut simulation = builder.simulate()?;
    simulation.run_until(at(100));
    let mut seen = timed(&numbers);
    seen.retain(|(_, number)| *number > 0.0);
    // It fails at 20 ms and is created again at 30 ms with the same options, so it counts from one until it fails again.
    assert_eq!(seen, [(0, 1.0), (10, 2.0), (30, 1.0), (40, 2.0)]);
    let health: Vec<_> = health.drain().map(|change| change.payload.to_string()).collect();
    let expected = [
        "0.020000000 s: sensor/base/count/scaled healthy -> degraded (restarted; sensor/base/count/scaled)",
        "0.040000000 s: sensor/base/count/scaled degraded -> healthy (recovered; sensor/base/count)",
        "0.050000000 s: sensor/base/count/scaled healthy -> degraded (restarted; sensor/base/count/scaled)",
        "0.060000000 s: sensor/base/count/scaled degraded -> lost (lost; sensor/base/count)",
    ];
    assert_eq!(health, expected);
    Ok(())
}

#[test]
fn requests_to_a_replaced_estimator_are_refused_and_do_not_fail_it() -> Result<(), Failure> {
    let mut builder = Bench::builder();
    builder.replace_estimator::<Scale>("sensor/base/count/asked", ScaleOptions { factor: 5.0 })?;
    let asked_numbers = builder.subscribe(bench::sensor::base::count::asked);
    let mut simulation = builder.simulate()?;
    let refused = "sensor/base/count/asked is replaced, and its replacement takes no requests";
    let asked = bench::sensor::base::count::asked;
    assert_refused(simulation.call(asked, Ask), refused);
    assert_refused(simulation.cast(asked, Number(1.0)), refused);
    simulation.run_until(at(15));
    assert_eq!(numbers(&asked_numbers), [0.0, 5.0]);
    simulation.stop().ok()?;
    Ok(())
}

#[test]
fn a_replacement_that_does_not_fit_keeps_the_robot_from_starting() -> Result<(), Failure> {
    let mut builder = Bench::builder();
    let error = builder.replace_estimator::<Echo>("sensor/base/count/scald", EchoOptions::defaults());
    assert_refused(error, "no estimator is at `sensor/base/count/scald`; did you mean `sensor/base/count/scaled`?");
    assert!(builder.replace_estimator::<Echo>("sensor/base/count", EchoOptions::defaults()).is_err());
    assert!(builder.replace_sensor::<Counter>(SCALED, CounterOptions::defaults()).is_err());

    builder.replace_estimator::<Fixed>(SCALED, NoOptions)?;
    let says = "sensor/base/count/scaled cannot start: its replacement takes `behaviour::joints::Pixel` and emits \
         `behaviour::joints::Spot`, and what is declared takes `behaviour::components::Number` and emits \
         `behaviour::components::Number`";
    assert_refused(builder.simulate(), says);

    let mut builder = Bench::builder();
    builder.replace_estimator::<Scale>("sensor/base/count/asked", ScaleOptions { factor: 1e4 })?;
    let says = "sensor/base/count/asked cannot start: option `factor` is 10000, but must be in -1e3..=1e3";
    assert_refused(builder.simulate(), says);
    Ok(())
}

#[test]
fn options_of_replaced_components_are_ignored() -> Result<(), Failure> {
    let desk = || {
        let mut builder = Plain::builder();
        builder.options(SOURCE).gain = -1.0;
        builder
    };
    let says = "sensor/base/source cannot start: option `gain` is -1, but must be in 0.0..=1e6";
    assert_refused(desk().simulate(), says);
    let mut builder = desk();
    builder.replace_sensor::<Counter>("sensor/base/source", CounterOptions::defaults())?;
    builder.simulate()?.stop().ok()?;

    // A parameter that is out of range for them only: as the declared one's gain it is refused.
    let simulation = Bench::builder().simulate()?;
    assert!(simulation.set_parameter(bench::param::factor, 2000.0).is_err());
    drop(simulation);
    let simulation = replaced(EchoOptions::defaults())?.simulate()?;
    assert_eq!(simulation.set_parameter(bench::param::factor, 2000.0), Ok(()));
    simulation.stop().ok()?;

    // Also before the start.
    let mut builder = Bench::builder();
    assert!(builder.set_parameter(bench::param::factor, 2000.0).is_err());
    builder.replace_estimator::<Echo>(SCALED, EchoOptions::defaults())?;
    builder.set_parameter(bench::param::factor, 2000.0)?;
    builder.set("param/factor", "3000.0")?;
    assert_eq!(builder.simulate()?.parameter(bench::param::factor), 3000.0);
    Ok(())
}

/// `robot!` checks that the declared estimator handles moving joints; of a replacement, the start does.
#[test]
fn a_replacement_across_moving_joints_has_to_handle_them() -> Result<(), Failure> {
    use crate::joints::{CAMERA, LIFT, Reach, SHOULDER, reach};
    let mut builder = Reach::builder();
    builder.replace_estimator::<Fixed>("estimator/base/spot", NoOptions)?;
    let says = "estimator/base/spot cannot start: its input `camera` spans a moving joint, and its replacement takes fixed \
         transforms only; set `HANDLES_MOVING_JOINTS` in its `Estimator`";
    assert_refused(builder.simulate(), says);

    let mut builder = Reach::builder();
    builder.replace_estimator::<Above>("estimator/base/spot", NoOptions)?;
    let spots = builder.subscribe(reach::estimator::base::spot);
    let mut simulation = builder.simulate()?;
    simulation.publish(CAMERA, at(1), Pixel(1.0));
    simulation.publish(SHOULDER, at(2), joint(0.0));
    simulation.publish(LIFT, at(2), joint(1.5));
    simulation.publish(CAMERA, at(3), Pixel(1.0));
    let spots: Vec<_> = spots.drain().collect();
    assert_eq!(spots.len(), 1, "the joints were unknown at first");
    assert!((spots[0].at.z - 1.0).abs() < 1e-12 && (spots[0].at.norm() - 1.5_f64.hypot(1.0)).abs() < 1e-12);
    Ok(())
}

/// A replay creates the estimators again, so it needs the same replacements with the same options.
#[test]
fn a_journal_is_replayed_with_the_same_replacements_only() -> Result<(), Failure> {
    let builder = || replaced(ramp::<4>(0.5)).expect("it is declared");
    same_again(builder, |builder| {
        let mut simulation = builder.simulate()?;
        simulation.run_until(at(100));
        Ok(simulation.stop())
    })?;
    let mut first = builder();
    let lines = journal(&mut first);
    first.simulate()?;
    let entries = entries(&lines);
    let refused = |builder: Builder<Bench>| builder.replay().map(|mut replay| replay.play(entries.clone()));
    let error = refused(Bench::builder())?.expect_err("the algorithm is another").to_string();
    assert!(error.contains("replacement of sensor/base/count/scaled"), "{error}");
    let error = refused(replaced(ramp::<4>(0.25))?)?.expect_err("another gain").to_string();
    assert!(error.contains("gain: 0.5"), "{error}");
    Ok(())
}
