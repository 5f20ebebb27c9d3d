//! Selects the numbers of a message to plot, and their panels.

use bb_eval::filters::near;
use bb_mcap::Value;
use std::fmt;

/// Longer lists are plotted only by index.
const MOST_ELEMENTS: usize = 16;

/// The path to a field: `pose.position`, `ranges[3]`.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Path(Vec<Step>);

#[derive(Clone, Debug, PartialEq)]
enum Step {
    Field(String),
    Index(usize),
}

/// Numbers that share a panel: the components of a vector, the elements of a list, or one field.
#[derive(Debug, PartialEq)]
pub(super) struct Group {
    pub(super) path: Path,
    pub(super) fields: Vec<Selected>,
}

#[derive(Debug, PartialEq)]
pub(super) struct Selected {
    pub(super) path: Path,
    /// Name of the field within the group.
    pub(super) label: String,
}

impl Path {
    pub(super) fn parse(text: &str) -> Result<Self, String> {
        let mut steps = Vec::new();
        for part in text.split('.').filter(|part| !part.is_empty()) {
            let mut parts = part.split('[');
            steps.extend(parts.next().filter(|name| !name.is_empty()).map(|name| Step::Field(name.to_owned())));
            for index in parts {
                let index = index.strip_suffix(']').and_then(|index| index.parse().ok());
                steps.push(Step::Index(
                    index.ok_or_else(|| format!("`{part}` is not an element; write ranges[3]"))?,
                ));
            }
        }
        Ok(Self(steps))
    }

    fn join(&self, step: Step) -> Self {
        Self(self.0.iter().cloned().chain([step]).collect())
    }

    /// The last name on the path, and the one before it.
    pub(super) fn names(&self) -> (Option<&str>, Option<&str>) {
        let mut names = self.0.iter().rev().filter_map(|step| match step {
            Step::Field(name) => Some(&**name),
            Step::Index(_) => None,
        });
        (names.next(), names.next())
    }

    /// The value there.
    pub(super) fn of<'a>(&self, value: &'a Value) -> Option<&'a Value> {
        self.0.iter().try_fold(value, |value, step| match (step, value) {
            (Step::Field(name), _) => value.field(name),
            (Step::Index(index), Value::List(values)) => values.get(*index),
            _ => None,
        })
    }
}

impl fmt::Display for Path {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (depth, step) in self.0.iter().enumerate() {
            match step {
                Step::Field(name) if depth > 0 => write!(f, ".{name}")?,
                Step::Field(name) => f.write_str(name)?,
                Step::Index(index) => write!(f, "[{index}]")?,
            }
        }
        Ok(())
    }
}

impl Group {
    /// Returns whether these are the components of a quaternion, in the order of ROS.
    pub(super) fn is_quaternion(&self) -> bool {
        self.fields.iter().map(|field| &*field.label).eq(["x", "y", "z", "w"])
    }

    /// The label of the axis.
    pub(super) fn axis(&self) -> String {
        let (last, _) = self.path.names();
        last.unwrap_or("value").to_owned()
    }
}

/// The numbers at and below a path, in a message; for a whole message, without header and covariances.
pub(super) fn groups(message: &Value, path: &Path) -> Result<Vec<Group>, String> {
    let mut at = message;
    let mut way = Path::default();
    for step in &path.0 {
        at = match (step, at) {
            (Step::Field(name), Value::Message(fields)) => at.field(name).ok_or_else(|| {
                let names: Vec<&str> = fields.iter().map(|(name, _)| &**name).collect();
                format!("no field `{}`; {}", way.join(step.clone()), near(name, &names))
            })?,
            (Step::Index(index), Value::List(values)) => {
                let length = values.len();
                values.get(*index).ok_or_else(|| format!("`{way}` has {length} elements, and no [{index}]"))?
            }
            (Step::Field(name), _) => return Err(format!("`{way}` is not a message, so it has no field `{name}`")),
            (Step::Index(_), _) => return Err(format!("`{way}` is not a list of numbers")),
        };
        way = way.join(step.clone());
    }
    let mut groups = Vec::new();
    if at.as_f64().is_some() {
        let field = Selected { path: path.clone(), label: path.0.last().map_or_else(String::new, label) };
        return Ok(vec![Group { path: path.clone(), fields: vec![field] }]);
    }
    collect(at, path, path.0.is_empty(), &mut groups);
    match groups.is_empty() {
        false => Ok(groups),
        true if path.0.is_empty() => Err("it holds no number to plot".into()),
        true => {
            Err(format!("`{path}` holds no number to plot; of a list of more than {MOST_ELEMENTS} name an element"))
        }
    }
}

fn collect(value: &Value, path: &Path, is_whole: bool, groups: &mut Vec<Group>) {
    let steps: Vec<(Step, &Value)> = match value {
        Value::Message(fields) => {
            fields.iter().map(|(name, value)| (Step::Field(name.to_string()), value)).collect()
        }
        Value::List(values) if values.len() <= MOST_ELEMENTS => {
            values.iter().enumerate().map(|(index, value)| (Step::Index(index), value)).collect()
        }
        _ => return,
    };
    let is_left_out = |step: &Step| match step {
        Step::Field(name) => {
            is_whole
                && (name == "header"
                    || name.contains("covariance")
                    || is_unknown(name, value)
                    || is_time_of_payload(name, value))
        }
        Step::Index(_) => false,
    };
    let numbers = steps.iter().filter(|(step, value)| value.as_f64().is_some() && !is_left_out(step));
    let mut components = Vec::new();
    for (step, _) in numbers {
        let selected = Selected { path: path.join(step.clone()), label: label(step) };
        match is_component(step) {
            true => components.push(selected),
            // A quantity of its own: latitude and altitude share no axis.
            false => groups.push(Group { path: selected.path.clone(), fields: vec![selected] }),
        }
    }
    if !components.is_empty() {
        groups.push(Group { path: path.clone(), fields: components });
    }
    for (step, value) in steps.into_iter().filter(|(step, value)| value.as_f64().is_none() && !is_left_out(step)) {
        collect(value, &path.join(step), is_whole, groups);
    }
}

/// Returns whether a number is a component of a vector, a quaternion or a list.
fn is_component(step: &Step) -> bool {
    match step {
        Step::Field(name) => ["x", "y", "z", "w"].contains(&&**name),
        Step::Index(_) => true,
    }
}

/// Returns whether a field is marked as unknown, in ROS by −1 as the first element of its covariance.
fn is_unknown(name: &str, message: &Value) -> bool {
    match message.field(&format!("{name}_covariance")) {
        Some(Value::List(values)) => values.first().and_then(Value::as_f64) == Some(-1.0),
        _ => false,
    }
}

/// Returns whether a field is a time in a message without a ROS definition: such times are the horizontal axis.
fn is_time_of_payload(name: &str, message: &Value) -> bool {
    ["monotonic_time", "wall_time"].contains(&name) && message.field("payload").is_some()
}

fn label(step: &Step) -> String {
    match step {
        Step::Field(name) => name.clone(),
        Step::Index(index) => format!("[{index}]"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(text: &str) -> Value {
        let crate::values::FromJson(value) = serde_json::from_str(text).expect("it is JSON");
        value
    }

    fn chosen(path: &str) -> Result<Vec<(String, Vec<String>)>, String> {
        let numbers = vec!["1"; 20].join(",");
        let imu = message(&format!(
            r#"{{"header":{{"stamp":{{"sec":1}}}},"rate":{{"x":1,"y":2}},"rate_covariance":[1,2],
                "pose":{{"position":{{"x":1}},"name":"a"}},"list":[1,2],"long":[{numbers}],
                "turn":{{"x":0}},"turn_covariance":[-1,0]}}"#
        ));
        let groups = groups(&imu, &Path::parse(path)?)?;
        let fields = |group: &Group| group.fields.iter().map(|field| field.path.to_string()).collect();
        Ok(groups.iter().map(|group| (group.axis(), fields(group))).collect())
    }

    fn of(axis: &str, fields: &[&str]) -> (String, Vec<String>) {
        (axis.to_owned(), fields.iter().map(|field| (*field).to_owned()).collect())
    }

    #[test]
    fn a_topic_has_a_panel_for_each_message_in_it() {
        assert_eq!(
            chosen("").expect("chosen"),
            [
                of("rate", &["rate.x", "rate.y"]),
                of("position", &["pose.position.x"]),
                of("list", &["list[0]", "list[1]"])
            ]
        );
        assert_eq!(chosen("pose").expect("chosen"), [of("position", &["pose.position.x"])]);
        assert_eq!(chosen("rate.y").expect("chosen"), [of("y", &["rate.y"])]);
        assert_eq!(chosen("long[19]").expect("chosen"), [of("long", &["long[19]"])]);
        // By name what is left out else.
        assert_eq!(
            chosen("rate_covariance").expect("chosen"),
            [of("rate_covariance", &["rate_covariance[0]", "rate_covariance[1]"])]
        );
    }

    #[test]
    fn of_a_payload_the_times_are_no_curves() {
        let own = message(r#"{"header":{"stamp":{"sec":1}},"monotonic_time":5,"wall_time":6,"payload":{"x":1}}"#);
        let paths = |path: &str| {
            let groups = groups(&own, &Path::parse(path).expect("is one")).expect("has some");
            groups.iter().map(|group| group.path.to_string()).collect::<Vec<_>>()
        };
        assert_eq!(paths(""), ["payload"]);
        assert_eq!(paths("wall_time"), ["wall_time"]);
        let fix = message(r#"{"status":{"status":0,"service":1},"latitude":48,"longitude":11,"altitude":500}"#);
        let fix = groups(&fix, &Path::default()).expect("has some");
        let axes: Vec<_> = fix.iter().map(Group::axis).collect();
        assert_eq!(axes, ["latitude", "longitude", "altitude", "status", "service"]);
        // What another has of that name is a number like any other.
        let other = message(r#"{"wall_time":6,"x":1}"#);
        assert_eq!(groups(&other, &Path::default()).expect("has some").len(), 2);
    }

    #[test]
    fn a_wrong_field_is_answered_with_those_there_are() {
        let fault = |path: &str| chosen(path).expect_err("it is wrong");
        assert_eq!(fault("rat.x"), "no field `rat`; did you mean `rate`?");
        assert_eq!(fault("rate.q"), "no field `rate.q`; there are x, y");
        assert_eq!(fault("rate.x.y"), "`rate.x` is not a message, so it has no field `y`");
        assert_eq!(fault("long[20]"), "`long` has 20 elements, and no [20]");
        assert_eq!(fault("long"), "`long` holds no number to plot; of a list of more than 16 name an element");
        assert_eq!(fault("list[a]"), "`list[a]` is not an element; write ranges[3]");
        assert_eq!(
            fault("pose.name"),
            "`pose.name` holds no number to plot; of a list of more than 16 name an element"
        );
    }
}
