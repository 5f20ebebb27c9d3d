//! Carries out commands, within the limits of the joint.

use super::limits::NotLimited;
use super::telling::Change;
use super::{Inner, State};
use crate::component::{Accepts, AcceptsJson, Actuator, ActuatorError, Caller};
use crate::event::Safety;
use crate::fault::{Fault, caught, guarded};
use crate::journal::{Event, Recorded};
use crate::message::codec::{from_json, to_json};
use crate::message::{Finite, Frame, Payload, Stamped};
use crate::pubsub::{DynamicMessage, Wakers};

impl<A: Actuator> Accepts<A::Command> for Inner<A> {
    fn accept(&self, command: A::Command, caller: &Caller) -> Result<A::Command, ActuatorError> {
        if !command.is_finite() {
            return Err(ActuatorError::NonFinite);
        }
        if let Some(journal) = self.environment.journal() {
            journal.wait_for_room();
        }
        let mut wakers = Wakers::default();
        let done = self.alone(|state| self.carry_out(state, command, caller, &mut wakers));
        self.control.count_waker_panics(wakers.run());
        done.unwrap_or(Err(ActuatorError::Inside))
    }

    fn stop_motion_of(&self, caller: &Caller) {
        let stop = match caught(|| Ok(A::Command::stop_command())) {
            Ok(Some(stop)) => stop,
            Ok(None) => return,
            Err(failed) => {
                let message = format!("its command to stop {}", failed.fault);
                self.control.note_fault(self.declaration.path, message);
                return;
            }
        };
        let mut wakers = Wakers::default();
        self.alone(|state| {
            if state.moved_by.is_of_same(caller) {
                // Disarming has already stopped it, and a failing actuator is made safe.
                let _ = self.carry_out(state, stop, &Caller::PROGRAM, &mut wakers);
            }
        });
        self.control.count_waker_panics(wakers.run());
    }
}

impl<A: Actuator> AcceptsJson for Inner<A> {
    fn accept_json(&self, command: &str, caller: &Caller) -> Result<String, Fault> {
        let command = from_json::<A::Command>(command)?;
        Ok(to_json(&self.accept(command, caller)?))
    }
}

impl<A: Actuator> Inner<A> {
    fn carry_out(
        &self,
        state: &mut State<A>,
        mut command: A::Command,
        caller: &Caller,
        wakers: &mut Wakers,
    ) -> Result<A::Command, ActuatorError> {
        self.obey(state);
        // This lock is also taken by disarming: nothing moves after disarming has returned.
        let safety = self.control.safety_now();
        if safety != Safety::Armed {
            return Err(ActuatorError::NotArmed(safety));
        }
        // Held while the actuator's own code runs: it acts in the caller's name.
        let Ok(_permit) = caller.permit() else { return Err(ActuatorError::Cancelled) };
        let clock = self.environment.clock();
        let now = clock.now();
        self.restart_if_due(state, now);
        // A stream of commands must not starve it.
        if state.alarm.is_some_and(|alarm| alarm <= now) {
            self.update_if_due(state, now);
        }
        if !state.slot.is_running() {
            return Err(ActuatorError::Stopped);
        }
        self.limit(state, &mut command)?;
        let message = self.environment.stamp(now, Frame::new(self.declaration.joint)).message(command);
        let at_motor = self.at_motor(state, &message)?;
        let Some(actuator) = state.slot.running() else { return Err(ActuatorError::Stopped) };
        state.may_move = true;
        let handled = {
            let _entered = self.occupied.enter(clock);
            caught(|| actuator.handle_command(at_motor.as_ref().unwrap_or(&message)))
        };
        if let Err(failed) = handled {
            let text = failed.fault.to_string();
            self.fail(state, &failed, now);
            return Err(ActuatorError::Failed(text));
        }
        state.moved_by = caller.clone();
        self.counts.carried_out();
        let published = guarded(|| {
            if let Some(journal) = self.environment.journal() {
                let message = Recorded::Message(DynamicMessage::new(self.declaration.path, &message));
                journal.write(now, clock.wall_offset_nanos(), Event::Actuated { actuator: self.number, message });
            }
            // Under the lock, so that messages keep the order in which commands are carried out.
            self.topic.publish_deferred(&message, wakers);
        });
        if let Err(fault) = published {
            // The actuator has moved: neither it nor the sender fails.
            self.tell_control(state, Change::MessageFailed(format!("its message {fault}")));
        }
        Ok(message.payload)
    }

    /// The command to the motor, if the actuator speaks of that and there is a transmission between it and the joint.
    fn at_motor(
        &self,
        state: &mut State<A>,
        message: &Stamped<A::Command>,
    ) -> Result<Option<Stamped<A::Command>>, ActuatorError> {
        let Some(gear) = self.context.gear() else { return Ok(None) };
        let converted = {
            let _entered = self.occupied.enter(self.environment.clock());
            caught(|| Ok(message.payload.command_at_motor(self.declaration.joint, gear)))
        };
        match converted {
            Ok(Some(command)) => Ok(Some(message.stamp().message(command))),
            Ok(None) => Err(ActuatorError::NotConverted(format!(
                "`{}` does not define `JointCommand::at_motor`",
                A::Command::NAME
            ))),
            Err(failed) => {
                let message = failed.fault.to_string();
                self.tell_control(state, Change::MessageFailed(format!("the conversion of its command {message}")));
                Err(ActuatorError::NotConverted(message))
            }
        }
    }

    /// Applies the limits of the joint to a command.
    fn limit(&self, state: &mut State<A>, command: &mut A::Command) -> Result<(), ActuatorError> {
        let (component, joint) = (self.declaration.path, self.declaration.joint);
        let limited = {
            let _entered = self.occupied.enter(self.environment.clock());
            self.counts.limit(command, &self.context, self.environment.joints())
        };
        match limited {
            Ok(exceeded) => {
                for quantity in exceeded {
                    self.log(state, move || {
                        let quantity = quantity.name();
                        tracing::warn!(
                            component,
                            joint,
                            quantity,
                            "a command exceeded a limit and was clamped to it"
                        );
                    });
                }
                Ok(())
            }
            Err(NotLimited::OutOfBounds { out, is_first }) => {
                if is_first {
                    self.log(state, move || {
                        tracing::warn!(component, joint, reason = %out, "a command was refused");
                    });
                }
                Err(out.into())
            }
            Err(NotLimited::Failed(fault)) => {
                let message = fault.to_string();
                self.tell_control(state, Change::MessageFailed(format!("the limit of its command {message}")));
                Err(ActuatorError::NotLimited(message))
            }
        }
    }
}
