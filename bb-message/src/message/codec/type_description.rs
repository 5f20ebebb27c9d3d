//! A shape as a type description of ROS 2, and the hash by which ROS 2 distinguishes types of the same name (REP 2016).

use super::definitions::{Count, Definition, Element, MessageField, definitions, definitions_of};
use super::ros::ServiceEventInfo;
use super::sha256::sha256;
use super::{Field, Shape};
use std::fmt::Write;

/// The hash of a type with the given name and shape: `RIHS01_` and 64 hexadecimal digits. For a ROS message, it is
/// the hash that ROS 2 has used since Iron.
///
/// ```
/// use bb_core::message::codec::{ros::Time, type_hash};
/// use bb_core::Field;
///
/// assert_eq!(
///     type_hash("builtin_interfaces/Time", Time::SHAPE),
///     "RIHS01_b106235e25a4c5ed35098aa0a61a3ee9c9b18d197f398b0e4206cea9acf9c197"
/// );
/// ```
pub fn type_hash(name: &str, shape: Shape) -> String {
    hash(&type_description(name, shape))
}

/// The hash of a service with the given name and the shapes of its request and its response.
///
/// ```
/// use bb_core::message::codec::service_hash;
/// use bb_core::{Field, Payload};
///
/// #[derive(Clone, Debug, Payload)]
/// struct Request;
///
/// #[derive(Clone, Debug, Payload)]
/// struct Response {
///     success: bool,
///     message: String,
/// }
///
/// assert_eq!(
///     service_hash("std_srvs/srv/Trigger", Request::SHAPE, Response::SHAPE),
///     "RIHS01_eeff2cd6fa5ad9d27cdf4dec64818317839b62f212a91e6b5304b634b2062c5f"
/// );
/// ```
pub fn service_hash(name: &str, request: Shape, response: Shape) -> String {
    hash(&service_description(name, request, response))
}

fn hash(description: &str) -> String {
    let mut hash = "RIHS01_".to_owned();
    for byte in sha256(description.as_bytes()) {
        // Writing to a string cannot fail.
        let _ = write!(hash, "{byte:02x}");
    }
    hash
}

/// The `type_description_interfaces/msg/TypeDescription` of a type, as the JSON that [`type_hash`] hashes: without the
/// default values of the fields, and with the spaces that REP 2016 requires.
pub fn type_description(name: &str, shape: Shape) -> String {
    let mut definitions = definitions(name, shape).into_iter();
    definitions.next().map_or(String::new(), |main| description(&main, definitions))
}

/// The `TypeDescription` of a service, whose fields are its request, its response and an event that may have both.
fn service_description(name: &str, request: Shape, response: Shape) -> String {
    const INFO: &str = "service_msgs/ServiceEventInfo";
    let part = |part: &str| format!("{name}_{part}");
    let field = |name: &str, of: &str, count| MessageField {
        name: name.to_owned(),
        element: Element::Message(of.to_owned()),
        count,
    };
    let (asked, answered, event) = (part("Request"), part("Response"), part("Event"));
    let parts = [(asked.as_str(), request), (answered.as_str(), response), (INFO, ServiceEventInfo::SHAPE)];
    let mut referenced = definitions_of(&parts);
    let fields = vec![
        field("info", INFO, Count::One),
        field("request", &asked, Count::AtMostOne),
        field("response", &answered, Count::AtMostOne),
    ];
    referenced.push(Definition { name: event.clone(), constants: Vec::new(), fields });
    let fields = vec![
        field("request_message", &asked, Count::One),
        field("response_message", &answered, Count::One),
        field("event_message", &event, Count::One),
    ];
    description(&Definition { name: name.to_owned(), constants: Vec::new(), fields }, referenced)
}

fn description(main: &Definition, definitions: impl IntoIterator<Item = Definition>) -> String {
    let main = individual(main);
    let (mut names, mut referenced) = (Vec::new(), Vec::new());
    for definition in definitions {
        let name = type_name(&definition.name);
        let index = names.partition_point(|other| *other <= name);
        referenced.insert(index, individual(&definition));
        names.insert(index, name);
    }
    let referenced = referenced.join(", ");
    format!(r#"{{"type_description": {main}, "referenced_type_descriptions": [{referenced}]}}"#)
}

/// `sensor_msgs/Imu` to `sensor_msgs/msg/Imu`; that of a service has its kind already.
pub(super) fn type_name(name: &str) -> String {
    match name.split_once('/') {
        Some((_, kind)) if kind.contains('/') => name.to_owned(),
        Some((package, kind)) => format!("{package}/msg/{kind}"),
        None => name.to_owned(),
    }
}

// All names consist of letters, digits, underscores and slashes, so nothing needs an escape.

fn individual(definition: &Definition) -> String {
    let fields: Vec<String> = definition.fields.iter().map(field).collect();
    format!(r#"{{"type_name": "{}", "fields": [{}]}}"#, type_name(&definition.name), fields.join(", "))
}

fn field(field: &MessageField) -> String {
    let (id, nested) = match &field.element {
        Element::Primitive(primitive) => (primitive.id, String::new()),
        Element::Message(name) => (1, type_name(name)),
    };
    // `FIELD_TYPE_…_ARRAY`, `…_BOUNDED_SEQUENCE` and `…_UNBOUNDED_SEQUENCE` follow in blocks of 48.
    let (block, capacity) = match field.count {
        Count::One => (0, 0),
        Count::Exactly(length) => (1, length),
        Count::AtMostOne => (2, 1),
        Count::Any => (3, 0),
    };
    format!(
        r#"{{"name": "{}", "type": {{"type_id": {}, "capacity": {capacity}, "string_capacity": 0, "nested_type_name": "{nested}"}}}}"#,
        field.name,
        id + 48 * block,
    )
}
