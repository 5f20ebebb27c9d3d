//! Runs the script on virtual time or in real time, and prints its events.

use crate::rover::{Rover, rover};
use crate::script::{self, Action};
use crate::timeline::{Kind, Line, TOPICS};
use bb_core::prelude::*;
use bb_core::{Builder, DynamicSubscription};
use std::error::Error;
use std::io::Write;

/// A run of the robot, with the events so far.
struct Story<'a> {
    events: DynamicSubscription,
    poses: Subscription<Pose>,
    /// The next line, if it was received but is not written yet.
    next: Option<Line>,
    lines: Vec<Line>,
    out: &'a mut dyn Write,
}

pub(crate) fn on_virtual_time(builder: Builder<Rover>, out: &mut dyn Write) -> Result<Vec<Line>, Box<dyn Error>> {
    let mut story = Story::new(&builder, out)?;
    let mut simulation = builder.simulate()?;
    for (time, action) in script::steps() {
        simulation.run_until(time);
        story.write_until(time)?;
        story.perform(&simulation, time, action)?;
    }
    simulation.run_until(script::END);
    story.finish()
}

pub(crate) fn in_real_time(builder: Builder<Rover>, out: &mut dyn Write) -> Result<Vec<Line>, Box<dyn Error>> {
    let mut story = Story::new(&builder, out)?;
    let running = builder.start()?;
    for (time, action) in script::steps() {
        story.wait_until(&running, time)?;
        story.perform(&running, time, action)?;
    }
    story.wait_until(&running, script::END)?;
    story.finish()
}

impl<'a> Story<'a> {
    fn new(builder: &Builder<Rover>, out: &'a mut dyn Write) -> std::io::Result<Self> {
        let events = builder.subscribe_any(TOPICS, None, Overflow::default());
        let poses = builder.subscribe_with(rover::estimator::base::pose, Overflow::KeepLatest);
        writeln!(out, "{}", Line::header())?;
        Ok(Self { events, poses, next: None, lines: Vec::new(), out })
    }

    /// Performs an action of the script. The result of a command is read from its topic.
    fn perform(&mut self, robot: &Live<Rover>, time: MonotonicTime, action: Action) -> std::io::Result<()> {
        let (kind, event, detail) = match action {
            Action::Hardware(event, detail) => (Kind::Hardware, event, detail),
            Action::Arm => (Kind::Operator, "arm!", ""),
            Action::Drive => (Kind::Operator, "drive!", ""),
            Action::Disarm => (Kind::Operator, "disarm!", ""),
        };
        self.write(Line::new(time, kind, event, detail))?;
        match action {
            Action::Hardware(..) => {}
            Action::Arm => drop(robot.command(rover::command::arm, NoArguments)),
            Action::Drive => drop(robot.command(rover::command::drive, NoArguments)),
            Action::Disarm => drop(robot.command(rover::command::disarm, NoArguments)),
        }
        Ok(())
    }

    /// Writes the events before `time`.
    fn write_until(&mut self, time: MonotonicTime) -> std::io::Result<()> {
        loop {
            if self.next.is_none() {
                self.next = self.events.try_recv().and_then(|message| Line::of(&message));
            }
            match self.next.take_if(|line| line.time < time) {
                Some(line) => self.write(line)?,
                None => return Ok(()),
            }
        }
    }

    /// Writes the events as they happen, until `time`.
    fn wait_until(&mut self, robot: &Live<Rover>, time: MonotonicTime) -> std::io::Result<()> {
        loop {
            self.write_until(time)?;
            let left = time.duration_since(robot.clock().now());
            if left.is_zero() {
                return Ok(());
            }
            match self.next {
                Some(_) => std::thread::sleep(left),
                None => self.next = self.events.recv_timeout(left).and_then(|message| Line::of(&message)),
            }
        }
    }

    fn finish(mut self) -> Result<Vec<Line>, Box<dyn Error>> {
        self.write_until(MonotonicTime::MAX)?;
        if let Some(pose) = self.poses.try_recv() {
            let (x, y) = (pose.position.x, pose.position.y);
            let yaw_deg = pose.world_from_body.euler_angles().2.to_degrees();
            writeln!(self.out, "\nWhere it believes to be: x {x:.2} m, y {y:.2} m, yaw {yaw_deg:.1} deg.")?;
        }
        Ok(self.lines)
    }

    fn write(&mut self, line: Line) -> std::io::Result<()> {
        writeln!(self.out, "{line}")?;
        self.lines.push(line);
        Ok(())
    }
}
