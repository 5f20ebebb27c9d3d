//! The commands of the robot as services, with JSON for arguments and results.

use bb_core::component::{DisarmQueue, DynamicExecution};
use bb_core::event::Right;
use bb_core::message::codec::json_schema;
use bb_core::{Bus, Role};
use foxglove::Schema;
use foxglove::websocket::service::{Request, Service, ServiceSchema};
use std::sync::Arc;
use tokio::sync::{Semaphore, oneshot};

const JSON: &str = "json";
/// The schema of what has no arguments, or no result.
const NOTHING: &str = r#"{"type":"object","properties":{}}"#;
/// Calls of a client at once, those to disarm apart: less than the 32 that Foxglove's server lets through.
pub(crate) const MOST_CALLS: usize = 24;

/// Effect of a service.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Action {
    Arm,
    Disarm,
    Command(&'static str),
}

/// A call that has begun: the execution if it is one of a command, or the reason of a refusal.
pub(crate) type Begun = Result<Option<DynamicExecution>, String>;

/// Calls to disarm: the bus of the client, the arguments, and the place of the answer.
pub(crate) type Disarms = DisarmQueue<(Bus, Action, String, oneshot::Sender<Begun>)>;

/// The services for which a client has the rights. Everybody may disarm.
pub(crate) fn services(bus: &Bus, disarms: &Arc<Disarms>) -> Vec<Service> {
    let places = Arc::new(Semaphore::new(MOST_CALLS));
    let service = |name: &str, [arguments, result]: [String; 2], action: Action, disarms: Option<&Arc<Disarms>>| {
        let of = |part: &str, text: String| Schema::new(format!("{name} {part}"), "jsonschema", text.into_bytes());
        let schema = ServiceSchema::new(name)
            .with_request(JSON, of("arguments", arguments))
            .with_response(JSON, of("result", result));
        let (bus, places, disarms) = (bus.clone(), Arc::clone(&places), disarms.cloned());
        Service::builder(format!("/{name}"), schema).async_handler_fn(move |request: Request| {
            call(request, bus.clone(), action, Arc::clone(&places), disarms.clone())
        })
    };
    let nothing = || [NOTHING; 2].map(str::to_owned);
    let mut services = vec![service("disarm", nothing(), Action::Disarm, Some(disarms))];
    if bus.rights().contains(Right::Arm) {
        services.push(service("arm", nothing(), Action::Arm, None));
    }
    if bus.rights().contains(Right::Commands) {
        services.extend(bus.commands().into_iter().map(|command| {
            let arguments = command.argument_shape().map_or(NOTHING.to_owned(), |_| command.argument_schema());
            let schemas = [arguments, json_schema(command.output)];
            let disarms = (command.role == Role::Disarming).then_some(disarms);
            service(command.path, schemas, Action::Command(command.path), disarms)
        }));
    }
    services
}

async fn call(
    request: Request,
    bus: Bus,
    action: Action,
    places: Arc<Semaphore>,
    disarms: Option<Arc<Disarms>>,
) -> Result<String, String> {
    let arguments = std::str::from_utf8(request.payload()).map_err(|error| error.to_string())?.trim().to_owned();
    let mut place = None;
    let (answer, answered) = oneshot::channel();
    let is_taken = match disarms {
        Some(disarms) => disarms.put((bus, action, arguments, answer)).is_ok(),
        None => {
            place = places.try_acquire().ok();
            if place.is_some() {
                // The client may have left.
                tokio::task::spawn_blocking(move || _ = answer.send(begin(&bus, action, &arguments)));
            }
            place.is_some()
        }
    };
    if !is_taken {
        return Err("too many requests wait for the robot".to_owned());
    }
    let ended = match answered.await.map_err(|_| "the bridge ends")?? {
        Some(execution) => execution.await.map_err(|error| error.to_string()),
        None => Ok("{}".to_owned()),
    };
    drop(place);
    ended
}

/// Waits for the robot, but not for the end of a command.
fn begin(bus: &Bus, action: Action, arguments: &str) -> Begun {
    match action {
        Action::Arm => bus.arm().map(|()| None).map_err(|error| error.to_string()),
        Action::Disarm => bus.disarm().map(|()| None).map_err(|error| error.to_string()),
        Action::Command(path) => bus.start_command(path, arguments).map(Some).map_err(|error| error.to_string()),
    }
}

/// The queue of all clients: the robot is disarmed once for all who ask, and commands that disarm have arguments of their own.
pub(crate) fn disarms() -> std::io::Result<Arc<Disarms>> {
    let (queue, _) = Disarms::start("foxglove disarm", |asked| {
        let mut disarmed: Option<Result<(), String>> = None;
        for (bus, action, arguments, answer) in asked {
            let begun = match &disarmed {
                Some(result) if action == Action::Disarm => result.clone().map(|()| None),
                _ => begin(&bus, action, &arguments),
            };
            if action == Action::Disarm {
                disarmed = Some(begun.as_ref().map(|_| ()).map_err(Clone::clone));
            }
            let _ = answer.send(begun);
        }
    })?;
    Ok(Arc::new(queue))
}
