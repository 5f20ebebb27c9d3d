//! The units of fields of ROS messages, from their definitions.

use super::select::Path;

/// Units by the name of the field that holds the numbers.
const UNITS: [(&str, &str); 21] = [
    ("angular_velocity", "rad/s"),
    ("linear_acceleration", "m/s²"),
    ("magnetic_field", "T"),
    ("fluid_pressure", "Pa"),
    ("temperature", "°C"),
    ("range", "m"),
    ("ranges", "m"),
    ("latitude", "deg"),
    ("longitude", "deg"),
    ("altitude", "m"),
    ("voltage", "V"),
    ("current", "A"),
    ("charge", "A h"),
    ("capacity", "A h"),
    ("force", "N"),
    ("torque", "N m"),
    ("position", "m"),
    ("translation", "m"),
    ("field_of_view", "rad"),
    ("min_range", "m"),
    ("max_range", "m"),
];

/// The unit of the numbers at a path in a message of this type, if ROS defines it.
pub(super) fn of(schema: &str, path: &Path) -> Option<&'static str> {
    let package = schema.split('/').next().unwrap_or("");
    if !["sensor_msgs", "geometry_msgs", "nav_msgs", "tf2_msgs"].contains(&package) {
        return None;
    }
    let (last, before) = path.names();
    let kind = schema.rsplit('/').next().unwrap_or("");
    // The unit of a joint depends on the joint.
    if kind.starts_with("Joint") {
        return None;
    }
    let named = |name: Option<&str>| UNITS.iter().find(|(known, _)| Some(*known) == name).map(|(_, unit)| *unit);
    let velocity = |name: Option<&str>| match (name, kind.starts_with("Accel")) {
        (Some("linear"), false) => Some("m/s"),
        (Some("angular"), false) => Some("rad/s"),
        (Some("linear"), true) => Some("m/s²"),
        (Some("angular"), true) => Some("rad/s²"),
        _ => None,
    };
    // A single component is called `x`; the vector's name says what it is.
    let is_component = matches!(last, Some("x" | "y" | "z"));
    let name = if is_component { before } else { last };
    named(name).or_else(|| velocity(name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_those_of_the_definitions() {
        let unit = |schema: &str, path: &str| of(schema, &Path::parse(path).expect("it is one"));
        assert_eq!(unit("sensor_msgs/msg/Imu", "angular_velocity"), Some("rad/s"));
        assert_eq!(unit("sensor_msgs/msg/Imu", "angular_velocity.x"), Some("rad/s"));
        assert_eq!(unit("sensor_msgs/msg/Imu", "orientation"), None);
        assert_eq!(unit("nav_msgs/msg/Odometry", "twist.twist.linear"), Some("m/s"));
        assert_eq!(unit("geometry_msgs/msg/AccelStamped", "accel.linear"), Some("m/s²"));
        assert_eq!(unit("sensor_msgs/msg/JointState", "position[0]"), None);
        assert_eq!(unit("bb_msgs/msg/OvenStamped", "payload.temperature"), None);
    }
}
