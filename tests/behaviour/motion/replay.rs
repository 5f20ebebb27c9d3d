//! Motions in a replay.

use super::*;

#[test]
fn motions_and_their_reports_are_the_same_in_a_replay() -> Result<(), Failure> {
    let mut builder = simulated()?;
    let lines = journal(&mut builder);
    let mut simulation = builder.simulate()?;
    let selected = Select::AnyOf(&[Select::Below("actuator"), Select::Below("command")]);
    let all = simulation.subscribe_any(selected, None, overflow());
    simulation.run_until(at(10));
    assert_eq!(simulation.arm(), Ok(()));
    let execution = simulation.command(crane::command::go, targets(&[[1.2, 1.9]]))?;
    simulation.run_until(at(1000));
    execution.cancel();
    simulation.run_until(at(1500));
    let servo = crane::actuator::base::slew::boom::reach::trolley::jaw::servo;
    simulation.actuate(servo, move_to(9.0))?;
    simulation.run_until(at(2000));
    simulation.stop();
    let (mut first, lines) = (Published::new(), entries(&lines));
    collect(&all, &mut first);
    for path in ["actuator/base/slew/motor", "actuator/base/slew/motor/end_motion", "command/go/progress"] {
        assert!(first.contains_key(path), "nothing at {path}");
    }
    for lines in [read_back::<Crane>(&lines)?, lines] {
        let mut replay = Crane::builder().replay()?;
        let progress = replay.bus().publisher::<MotionProgress>("command/go/progress")?;
        let all = replay.subscribe_any(selected, None, overflow());
        replay.play(lines)?;
        replay.stop();
        drop(progress);
        let mut again = Published::new();
        collect(&all, &mut again);
        same(&first, &again);
    }
    Ok(())
}
