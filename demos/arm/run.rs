//! Runs the script on virtual time or in real time, and prints its events.

use crate::expected::Outcome;
use crate::robot::{Ur5, ur5};
use crate::script::{self, Action};
use crate::timeline::{Line, TOPICS};
use crate::tip::Tip;
use crate::{Arguments, path};
use bb_core::kinematics::{Frames, Kinematics};
use bb_core::prelude::*;
use bb_core::{DynamicSubscription, Running};
use bb_estimators::simulation::SimulatedWorld;
use bb_mcap::{Recorder, RecorderOptions};
use std::error::Error;
use std::io::Write;
use std::ops::Deref;
use std::sync::Arc;

/// A robot on either clock.
enum Run {
    Virtual(Simulation<Ur5>),
    Real(Running<Ur5>),
}

impl Deref for Run {
    type Target = Live<Ur5>;
    fn deref(&self) -> &Live<Ur5> {
        match self {
            Self::Virtual(simulation) => simulation,
            Self::Real(running) => running,
        }
    }
}

impl Run {
    fn until(&mut self, time: MonotonicTime) {
        match self {
            Self::Virtual(simulation) => simulation.run_until(time),
            Self::Real(running) => std::thread::sleep(time.duration_since(running.clock().now())),
        }
    }
}

/// A run of the robot, with the record of its events.
struct Story<'a> {
    robot: Run,
    events: DynamicSubscription,
    tips: Subscription<Tip>,
    recorder: Option<Recorder>,
    truth: Truth,
    outcome: Outcome,
    out: &'a mut dyn Write,
}

pub(crate) fn run(arguments: &Arguments, out: &mut dyn Write) -> Result<Outcome, Box<dyn Error>> {
    let builder = Ur5::builder();
    let events = builder.subscribe_any(TOPICS, None, Overflow::default());
    let tips = builder.subscribe(ur5::estimator::base::tip);
    let recorder = match &arguments.record {
        Some(file) => {
            let all = builder.subscribe_any(Select::All, None, Overflow::DropOldest { capacity: 65_536 });
            if file.exists() {
                std::fs::remove_file(file)?;
            }
            Some(Recorder::new(file, all, RecorderOptions::of::<Ur5>())?)
        }
        None => None,
    };
    let robot = if arguments.real_time { Run::Real(builder.start()?) } else { Run::Virtual(builder.simulate()?) };
    let truth = Truth::new(&robot)?;
    writeln!(out, "{}", Line::header())?;
    let outcome = Outcome { is_real_time: arguments.real_time, ..Outcome::default() };
    let mut story = Story { robot, events, tips, recorder, truth, outcome, out };
    for (time, action) in script::STEPS {
        story.run_until(time)?;
        story.perform(time, action)?;
    }
    story.run_until(script::END)?;
    story.finish()
}

impl Story<'_> {
    /// Runs the robot until `time`, and prints its events.
    fn run_until(&mut self, time: MonotonicTime) -> Result<(), Box<dyn Error>> {
        loop {
            let now = self.robot.clock().now();
            if now >= time {
                return Ok(());
            }
            self.robot.until((now + script::PERIOD).min(time));
            if let Some(recorder) = &mut self.recorder {
                recorder.drain()?;
            }
            for line in self.events.drain().collect::<Vec<_>>().iter().filter_map(Line::of) {
                self.write(line)?;
            }
            self.outcome.joints.push(self.truth.positions(&self.robot)?);
            // The world knows where joints are, not where they were: on virtual time the last estimate is of just now.
            let now = self.robot.clock().now();
            if let Some(tip) = self.tips.drain().last().filter(|tip| tip.monotonic_time == now) {
                let error = self.truth.error(&tip)?;
                self.outcome.worst_error = self.outcome.worst_error.max(error);
                self.outcome.compared += 1;
            }
            // While it resumes, its state is still `held`.
            let resumes = self.outcome.lines.iter().any(|line| line.event == "resume started");
            if self.robot.state() == "held" && !resumes {
                self.outcome.speed_while_held = self.outcome.speed_while_held.max(self.truth.speed(&self.robot)?);
            }
        }
    }

    fn perform(&mut self, time: MonotonicTime, action: Action) -> Result<(), Box<dyn Error>> {
        self.write(action.line(time))?;
        let imu = ur5::sensor::base::shoulder_pan::shoulder::shoulder_lift::upper_arm::elbow::forearm::wrist_1::wrist::wrist_2::hand::wrist_3::tool::imu;
        match action {
            Action::Arm => drop(self.robot.command(ur5::command::arm, NoArguments)),
            Action::Follow => drop(self.robot.command(ur5::command::follow, NoArguments)),
            Action::Unplug => {
                self.outcome.speed_when_unplugged = self.truth.speed(&self.robot)?;
                self.truth.world.set_unplugged(imu.path(), true);
            }
            Action::Plug => self.truth.world.set_unplugged(imu.path(), false),
            Action::Disarm => {
                self.outcome.distance_from_end = self.truth.distance_from_end(&self.robot)?;
                drop(self.robot.command(ur5::command::disarm, NoArguments));
            }
        }
        Ok(())
    }

    fn write(&mut self, line: Line) -> std::io::Result<()> {
        writeln!(self.out, "{line}")?;
        self.outcome.lines.push(line);
        Ok(())
    }

    fn finish(self) -> Result<Outcome, Box<dyn Error>> {
        if let Some(mut recorder) = self.recorder {
            recorder.drain()?;
            recorder.finish()?;
        }
        Ok(self.outcome)
    }
}

/// True motion of the arm.
struct Truth {
    world: Arc<SimulatedWorld>,
    frames: Frames,
}

impl Truth {
    fn new(robot: &Live<Ur5>) -> Result<Self, Box<dyn Error>> {
        let world = robot.shared(|| SimulatedWorld::new(Ur5::TOPOLOGY));
        Ok(Self { world, frames: Frames::new(Kinematics::new(Ur5::TOPOLOGY)?) })
    }

    /// Returns the error of the estimated angular velocity of the tip at its own time, rad/s.
    fn error(&mut self, tip: &Stamped<Tip>) -> Result<f64, Box<dyn Error>> {
        let (mut positions, mut velocities, mut accelerations) = (Vec::new(), Vec::new(), Vec::new());
        for joint in path::joints() {
            let point = self.world.joint(&joint, tip.monotonic_time)?.point;
            positions.push(point.position);
            velocities.push(point.velocity);
            accelerations.push(point.acceleration);
        }
        self.frames.update_motion(&positions, &velocities, &accelerations)?;
        let tool = self.frames.kinematics().link("tool").ok_or("it is declared")?;
        let true_rate = self.frames.root_from_link(tool)?.rotation * self.frames.motion(tool)?.angular_velocity;
        Ok((tip.angular_velocity - true_rate).norm())
    }

    /// The time, s, and the positions of the joints, rad.
    fn positions(&self, robot: &Live<Ur5>) -> Result<(f64, Vec<f64>), Box<dyn Error>> {
        let now = robot.clock().now();
        let joints = path::joints();
        let positions = joints.iter().map(|joint| Ok(self.world.joint(joint, now)?.point.position));
        Ok((now.seconds_since(MonotonicTime::ZERO), positions.collect::<Result<_, Box<dyn Error>>>()?))
    }

    /// The largest speed of a joint, rad/s.
    fn speed(&self, robot: &Live<Ur5>) -> Result<f64, Box<dyn Error>> {
        let now = robot.clock().now();
        path::joints()
            .iter()
            .try_fold(0.0, |most: f64, joint| Ok(most.max(self.world.joint(joint, now)?.point.velocity.abs())))
    }

    /// The largest distance of a joint from the end of the path, rad.
    fn distance_from_end(&self, robot: &Live<Ur5>) -> Result<f64, Box<dyn Error>> {
        let now = robot.clock().now();
        path::end().try_fold(0.0, |most: f64, (joint, end)| {
            Ok(most.max((self.world.joint(joint, now)?.point.position - end).abs()))
        })
    }
}
