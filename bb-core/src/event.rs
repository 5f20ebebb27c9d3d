//! Events that the runtime publishes on its own topics.

mod arming;
mod command;
mod fault;
mod health;
mod parameter;
mod rights;
mod safety;

pub use arming::{ArmError, DisarmError};
pub use command::{CategoryDeclaration, CommandEvent, CommandPhase, Refusal, RefusalReason, StateTransition};
pub use fault::ComponentFault;
pub use health::{HealthReason, HealthState, HealthTransition};
pub use parameter::{ParameterChange, ParameterValue};
pub use rights::{Forbidden, Right, Rights};
pub use safety::{HardwareError, HardwareErrorKind, Quantity, Safety, SafetyError, SafetyTransition};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::codec::{Field, decode, encode};
    use crate::time::MonotonicTime;

    fn bytes_of<T: Field>(value: &T) -> Vec<u8> {
        let mut bytes = Vec::new();
        encode(value, &mut bytes);
        bytes
    }

    #[test]
    fn events_are_read_back() {
        let refusal = Refusal {
            command: "stop",
            reason: RefusalReason::Busy,
            state: "idle",
            category: CategoryDeclaration { name: "motion", concurrency: 1 },
        };
        let health = HealthTransition {
            estimator: "estimator/base/pose",
            source: "sensor/base/imu",
            from: HealthState::Lost,
            to: HealthState::Degraded,
            reason: HealthReason::Recovered,
            time: MonotonicTime::from_nanos(5),
        };
        for phase in [
            CommandPhase::Started,
            CommandPhase::Failed("no".into()),
            CommandPhase::TimedOut,
            CommandPhase::Refused(refusal),
        ] {
            let event = CommandEvent {
                command: "stop",
                execution: 7,
                phase,
                caller: "program".into(),
                health: Some(health),
            };
            assert_eq!(decode::<CommandEvent>(&bytes_of(&event)), Ok(event));
        }
        for value in [1.5.into(), 7i64.into(), true.into(), ParameterValue::Text("a".into())] {
            let to = ParameterValue::Integer(1);
            let change = ParameterChange { path: "param/a", from: value, to, caller: "page 1".into() };
            assert_eq!(decode::<ParameterChange>(&bytes_of(&change)), Ok(change));
        }
    }
}
