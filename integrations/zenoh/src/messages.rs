//! Messages and services of ROS 2 that are no payloads of robots.

use bb_core::message::codec::encode;
use bb_core::message::codec::ros::{Byte, Header, Time};
use bb_core::{Field, Payload};

/// A message in CDR.
pub(crate) fn bytes_of<T: Field>(message: &T) -> Vec<u8> {
    let mut bytes = Vec::new();
    encode(message, &mut bytes);
    bytes
}

/// `rosgraph_msgs/msg/Clock`
#[derive(Clone, Debug, PartialEq, Payload)]
#[payload(name = "rosgraph_msgs/Clock")]
pub(crate) struct Clock {
    pub(crate) clock: Time,
}

/// `diagnostic_msgs/msg/KeyValue`
#[derive(Clone, Debug, PartialEq, Payload)]
#[payload(name = "diagnostic_msgs/KeyValue")]
pub(crate) struct KeyValue {
    pub(crate) key: String,
    pub(crate) value: String,
}

/// `diagnostic_msgs/msg/DiagnosticStatus`
#[derive(Clone, Debug, PartialEq, Payload)]
#[payload(name = "diagnostic_msgs/DiagnosticStatus")]
pub(crate) struct DiagnosticStatus {
    /// Level: 0 for all is well, 1 for a warning, 2 for an error.
    pub(crate) level: Byte,
    pub(crate) name: String,
    pub(crate) message: String,
    pub(crate) hardware_id: String,
    pub(crate) values: Vec<KeyValue>,
}

/// `diagnostic_msgs/msg/DiagnosticArray`
#[derive(Clone, Debug, PartialEq, Payload)]
#[payload(name = "diagnostic_msgs/DiagnosticArray")]
pub(crate) struct DiagnosticArray {
    pub(crate) header: Header,
    pub(crate) status: Vec<DiagnosticStatus>,
}

/// `rcl_interfaces/msg/ParameterValue`
#[derive(Clone, Debug, Default, PartialEq, Payload)]
#[payload(name = "rcl_interfaces/ParameterValue")]
pub(crate) struct Value {
    /// One of `rcl_interfaces/msg/ParameterType`.
    pub(crate) r#type: u8,
    pub(crate) bool_value: bool,
    pub(crate) integer_value: i64,
    pub(crate) double_value: f64,
    pub(crate) string_value: String,
    pub(crate) byte_array_value: Vec<Byte>,
    pub(crate) bool_array_value: Vec<bool>,
    pub(crate) integer_array_value: Vec<i64>,
    pub(crate) double_array_value: Vec<f64>,
    pub(crate) string_array_value: Vec<String>,
}

/// `rcl_interfaces/msg/Parameter`
#[derive(Clone, Debug, PartialEq, Payload)]
#[payload(name = "rcl_interfaces/Parameter")]
pub(crate) struct Parameter {
    pub(crate) name: String,
    pub(crate) value: Value,
}

/// `rcl_interfaces/msg/ParameterEvent`
#[derive(Clone, Debug, PartialEq, Payload)]
#[payload(name = "rcl_interfaces/ParameterEvent")]
pub(crate) struct ParameterEvent {
    pub(crate) stamp: Time,
    pub(crate) node: String,
    pub(crate) new_parameters: Vec<Parameter>,
    pub(crate) changed_parameters: Vec<Parameter>,
    pub(crate) deleted_parameters: Vec<Parameter>,
}

/// `rcl_interfaces/msg/FloatingPointRange`
#[derive(Clone, Debug, PartialEq, Payload)]
#[payload(name = "rcl_interfaces/FloatingPointRange")]
pub(crate) struct FloatRange {
    pub(crate) from_value: f64,
    pub(crate) to_value: f64,
    /// Step; 0 for all between.
    pub(crate) step: f64,
}

/// `rcl_interfaces/msg/IntegerRange`
#[derive(Clone, Debug, PartialEq, Payload)]
#[payload(name = "rcl_interfaces/IntegerRange")]
pub(crate) struct IntegerRange {
    pub(crate) from_value: i64,
    pub(crate) to_value: i64,
    /// Step; 1 for all between.
    pub(crate) step: u64,
}

/// `rcl_interfaces/msg/ParameterDescriptor`
#[derive(Clone, Debug, Default, PartialEq, Payload)]
#[payload(name = "rcl_interfaces/ParameterDescriptor")]
pub(crate) struct Descriptor {
    pub(crate) name: String,
    pub(crate) r#type: u8,
    pub(crate) description: String,
    pub(crate) additional_constraints: String,
    pub(crate) read_only: bool,
    pub(crate) dynamic_typing: bool,
    pub(crate) floating_point_range: Option<FloatRange>,
    pub(crate) integer_range: Option<IntegerRange>,
}

/// `rcl_interfaces/msg/SetParametersResult`
#[derive(Clone, Debug, PartialEq, Payload)]
#[payload(name = "rcl_interfaces/SetParametersResult")]
pub(crate) struct SetResult {
    pub(crate) successful: bool,
    pub(crate) reason: String,
}

/// `rcl_interfaces/msg/ListParametersResult`
#[derive(Clone, Debug, PartialEq, Payload)]
#[payload(name = "rcl_interfaces/ListParametersResult")]
pub(crate) struct ListResult {
    pub(crate) names: Vec<String>,
    pub(crate) prefixes: Vec<String>,
}

/// The request of `GetParameters`, `GetParameterTypes` and `DescribeParameters`.
#[derive(Clone, Debug, PartialEq, Payload)]
pub(crate) struct Names {
    pub(crate) names: Vec<String>,
}

/// The response of `GetParameters`.
#[derive(Clone, Debug, PartialEq, Payload)]
pub(crate) struct Values {
    pub(crate) values: Vec<Value>,
}

/// The response of `GetParameterTypes`.
#[derive(Clone, Debug, PartialEq, Payload)]
pub(crate) struct Types {
    pub(crate) types: Vec<u8>,
}

/// The response of `DescribeParameters`.
#[derive(Clone, Debug, PartialEq, Payload)]
pub(crate) struct Descriptors {
    pub(crate) descriptors: Vec<Descriptor>,
}

/// The request of `ListParameters`.
#[derive(Clone, Debug, PartialEq, Payload)]
pub(crate) struct Below {
    pub(crate) prefixes: Vec<String>,
    /// Most names of a path below a prefix; 0 for any.
    pub(crate) depth: u64,
}

/// The response of `ListParameters`.
#[derive(Clone, Debug, PartialEq, Payload)]
pub(crate) struct Listed {
    pub(crate) result: ListResult,
}

/// The request of `SetParameters` and `SetParametersAtomically`.
#[derive(Clone, Debug, PartialEq, Payload)]
pub(crate) struct Parameters {
    pub(crate) parameters: Vec<Parameter>,
}

/// The response of `SetParameters`.
#[derive(Clone, Debug, PartialEq, Payload)]
pub(crate) struct SetResults {
    pub(crate) results: Vec<SetResult>,
}

/// The response of `SetParametersAtomically`.
#[derive(Clone, Debug, PartialEq, Payload)]
pub(crate) struct SetAll {
    pub(crate) result: SetResult,
}

/// The request of `std_srvs/srv/Trigger`.
#[derive(Clone, Debug, PartialEq, Payload)]
pub(crate) struct Nothing {}

/// The response of `std_srvs/srv/Trigger`, and of every command.
#[derive(Clone, Debug, PartialEq, Payload)]
pub(crate) struct Outcome {
    pub(crate) success: bool,
    pub(crate) message: String,
}

#[cfg(test)]
mod tests {
    use super::*;
    use bb_core::message::codec::{Shape, service_hash, type_hash};

    fn of_message<T: Field>() -> (String, String) {
        let Shape::Struct(shape) = T::SHAPE else { panic!("it is a struct") };
        (shape.name.to_owned(), type_hash(shape.name, T::SHAPE))
    }

    /// Hashes from the packages' `msg/*.json` and `srv/*.json` in ROS 2 Kilted; `check` compares with those that are installed.
    #[test]
    fn hashes_are_those_of_ros() {
        let message = |(name, hash): (String, String), expected: &str| {
            assert_eq!(hash, format!("RIHS01_{expected}"), "{name}")
        };
        message(of_message::<Clock>(), "692f7a66e93a3c83e71765d033b60349ba68023a8c689a79e48078bcb5c58564");
        message(
            of_message::<DiagnosticArray>(),
            "5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e",
        );
        message(of_message::<ParameterEvent>(), "043e627780fcad87a22d225bc2a037361dba713fca6a6b9f4b869a5aa0393204");
        for (name, request, response, expected) in [
            (
                "std_srvs/srv/Trigger",
                Nothing::SHAPE,
                Outcome::SHAPE,
                "eeff2cd6fa5ad9d27cdf4dec64818317839b62f212a91e6b5304b634b2062c5f",
            ),
            (
                "rcl_interfaces/srv/GetParameters",
                Names::SHAPE,
                Values::SHAPE,
                "bf9803d5c74cf989a5de3e0c2e99444599a627c7ff75f97b8c05b01003675cbc",
            ),
            (
                "rcl_interfaces/srv/GetParameterTypes",
                Names::SHAPE,
                Types::SHAPE,
                "da199c878688b3e530bdfe3ca8f74cb9fa0c303101e980a9e8f260e25e1c80ca",
            ),
            (
                "rcl_interfaces/srv/DescribeParameters",
                Names::SHAPE,
                Descriptors::SHAPE,
                "845b484d71eb0673dae682f2e3ba3c4851a65a3dcfb97bddd82c5b57e91e4cff",
            ),
            (
                "rcl_interfaces/srv/ListParameters",
                Below::SHAPE,
                Listed::SHAPE,
                "3e6062bfbb27bfb8730d4cef2558221f51a11646d78e7bb30a1e83afac3aad9d",
            ),
            (
                "rcl_interfaces/srv/SetParameters",
                Parameters::SHAPE,
                SetResults::SHAPE,
                "56eed9a67e169f9cb6c1f987bc88f868c14a8fc9f743a263bc734c154015d7e0",
            ),
            (
                "rcl_interfaces/srv/SetParametersAtomically",
                Parameters::SHAPE,
                SetAll::SHAPE,
                "0e192ef259c07fc3c07a13191d27002222e65e00ccec653ca05e856f79285fcd",
            ),
        ] {
            assert_eq!(service_hash(name, request, response), format!("RIHS01_{expected}"), "{name}");
            // A renamed field is another service.
            assert_ne!(service_hash(name, request, Clock::SHAPE), format!("RIHS01_{expected}"), "{name}");
        }
    }
}
