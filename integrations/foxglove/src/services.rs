//! The commands of the robot as services, with JSON for arguments and results.

use crate::parameters::caller;
use bb_core::Bus;
use bb_core::event::Right;
use bb_core::message::codec::json_schema;
use foxglove::Schema;
use foxglove::websocket::service::{Request, Service, ServiceSchema};

const JSON: &str = "json";
/// The schema of what has no arguments, or no result.
const NOTHING: &str = r#"{"type":"object","properties":{}}"#;

/// The services for which a bus has the rights.
pub(crate) fn services(bus: &Bus) -> Vec<Service> {
    let rights = bus.rights();
    let mut services = Vec::new();
    if rights.contains(Right::Commands) {
        for command in bus.commands() {
            let (path, bus) = (command.path, bus.clone());
            let arguments =
                if command.argument_shape().is_some() { command.argument_schema() } else { NOTHING.to_owned() };
            let run = move |request: Request| {
                let bus = of(&bus, &request);
                async move {
                    let arguments = std::str::from_utf8(request.payload()).map_err(|error| error.to_string())?;
                    let arguments = arguments.trim().to_owned();
                    // To start it waits for the robot, not for its end.
                    let started = waited(move || bus.start_command(path, &arguments)).await?;
                    started.await.map_err(|error| error.to_string())
                }
            };
            services.push(builder(path, arguments, json_schema(command.output)).async_handler_fn(run));
        }
    }
    if rights.contains(Right::Arm) {
        let action = |name: &str, action: fn(&Bus) -> Result<(), String>| {
            let bus = bus.clone();
            let run = move |request: Request| {
                let bus = of(&bus, &request);
                async move { waited(move || action(&bus)).await.map(|()| "{}") }
            };
            builder(name, NOTHING.to_owned(), NOTHING.to_owned()).async_handler_fn(run)
        };
        services.push(action("arm", |bus| bus.arm().map_err(|error| error.to_string())));
        services.push(action("disarm", |bus| bus.disarm().map_err(|error| error.to_string())));
    }
    services
}

fn builder(name: &str, request: String, response: String) -> foxglove::websocket::service::ServiceBuilder {
    let schema =
        |part: &str, schema: String| Schema::new(format!("{name} {part}"), "jsonschema", schema.into_bytes());
    let schema = ServiceSchema::new(name)
        .with_request(JSON, schema("arguments", request))
        .with_response(JSON, schema("result", response));
    Service::builder(format!("/{name}"), schema)
}

/// The bus in the name of the client.
fn of(bus: &Bus, request: &Request) -> Bus {
    bus.for_caller(caller(request.client_id()), bus.rights())
}

/// Runs what waits on a thread for that.
async fn waited<T: Send + 'static, E: ToString + Send + 'static>(
    call: impl FnOnce() -> Result<T, E> + Send + 'static,
) -> Result<T, String> {
    let result = tokio::task::spawn_blocking(call).await.map_err(|error| error.to_string())?;
    result.map_err(|error| error.to_string())
}
