//! The text of message definitions: <https://docs.ros.org/en/rolling/Concepts/Basic/About-Interfaces.html>.

use super::{Count, DEEPEST, Field, Kind, Message, MessageDefinition};
use std::collections::HashMap;
use std::sync::Arc;

/// The definition of the type `name`; the texts of its component types follow it, each after a line of `=` and a line
/// `MSG: package/Name`.
pub(super) fn definition(name: &str, text: &str) -> Result<MessageDefinition, String> {
    let mut texts = vec![(short(name), Vec::new())];
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        let line = line.trim();
        if line.len() >= 3 && line.bytes().all(|byte| byte == b'=') {
            let head = lines.next().unwrap_or("").trim();
            let name = head.strip_prefix("MSG:").ok_or_else(|| format!("`MSG:` is missing in `{head}`"))?;
            texts.push((short(name.trim()), Vec::new()));
        } else if let Some((_, lines)) = texts.last_mut() {
            lines.push(line);
        }
    }
    // If two have the same name, the first is used.
    let names: HashMap<&str, usize> =
        texts.iter().enumerate().rev().map(|(index, (name, _))| (&**name, index)).collect();
    let mut messages = Vec::new();
    for (index, (name, lines)) in texts.iter().enumerate() {
        let fields = lines.iter().filter_map(|line| field(line, name, &names).transpose());
        let mut fields = fields.collect::<Result<Vec<_>, _>>().map_err(|fault| format!("{name}: {fault}"))?;
        let variants: Vec<_> = lines.iter().filter_map(|line| variant(line)).collect();
        // An enum as written in recordings of this project: its number is first, its constants are the names.
        if let Some(first) = fields.first_mut()
            && *first.name == *"kind"
            && (first.kind, first.count) == (Kind::U32, Count::One)
            && !variants.is_empty()
        {
            first.kind = Kind::Variant(index);
        }
        messages.push(Message { name: name.clone(), fields, variants });
    }
    depth_below(&messages, 0, 0, &mut vec![None; messages.len()])?;
    Ok(MessageDefinition { messages })
}

/// `sensor_msgs/Imu`, also for `sensor_msgs/msg/Imu`.
fn short(name: &str) -> String {
    name.replacen("/msg/", "/", 1)
}

/// The field declared on a line; `None` if it is empty, a comment or a constant.
fn field(line: &str, owner: &str, names: &HashMap<&str, usize>) -> Result<Option<Field>, String> {
    // A `#` in a string constant does not start a comment; but constants are not kept.
    let line = line.split('#').next().unwrap_or("").trim();
    let Some((kind, rest)) = line.split_once(char::is_whitespace) else {
        return if line.is_empty() { Ok(None) } else { Err(format!("a name is missing in `{line}`")) };
    };
    let rest = rest.trim_start();
    let end = rest.find(|c: char| c.is_whitespace() || c == '=').unwrap_or(rest.len());
    let (name, rest) = rest.split_at(end);
    if rest.trim_start().starts_with('=') {
        return Ok(None);
    }
    let (element, count) = match kind.split_once('[') {
        None => (kind, Count::One),
        Some((element, "]")) => (element, Count::Any),
        Some((element, bound)) => {
            let bound = bound.strip_suffix(']').ok_or_else(|| format!("`]` is missing in `{kind}`"))?;
            let length = bound.strip_prefix("<=").unwrap_or(bound).parse();
            let length = length.map_err(|_| format!("`{bound}` is not a length in `{kind}`"))?;
            (element, if bound.starts_with('<') { Count::Any } else { Count::Exactly(length) })
        }
    };
    Ok(Some(Field { name: name.into(), kind: element_kind(element, owner, names)?, count }))
}

/// The number and the name of a constant `uint32 NAME=3`.
fn variant(line: &str) -> Option<(u32, Arc<str>)> {
    let (name, number) = line.split('#').next()?.trim().strip_prefix("uint32 ")?.split_once('=')?;
    Some((number.trim().parse().ok()?, name.trim().into()))
}

fn element_kind(element: &str, owner: &str, names: &HashMap<&str, usize>) -> Result<Kind, String> {
    Ok(match element.split("<=").next().unwrap_or(element) {
        "bool" => Kind::Bool,
        "int8" => Kind::I8,
        "int16" => Kind::I16,
        "int32" => Kind::I32,
        "int64" => Kind::I64,
        "uint8" | "byte" | "char" => Kind::U8,
        "uint16" => Kind::U16,
        "uint32" => Kind::U32,
        "uint64" => Kind::U64,
        "float32" => Kind::F32,
        "float64" => Kind::F64,
        "string" => Kind::Text,
        "wstring" => return Err("`wstring` is not read, since writers disagree on its bytes".into()),
        name => Kind::Message(index(name, owner, names)?),
    })
}

/// A type without a package is in the package of the type that refers to it.
fn index(name: &str, owner: &str, names: &HashMap<&str, usize>) -> Result<usize, String> {
    let short = short(name);
    let full = match owner.split_once('/') {
        Some((package, _)) if !short.contains('/') => format!("{package}/{short}"),
        _ => short.clone(),
    };
    let is_named = |wanted: &str| names.get(wanted).copied();
    let found = is_named(&full).or_else(|| (short == "Header").then(|| is_named("std_msgs/Header"))?);
    found.ok_or_else(|| format!("{full} is not defined"))
}

/// The longest chain of nested messages below this one, which is at `depth`. `below` caches earlier results.
fn depth_below(
    messages: &[Message],
    index: usize,
    depth: usize,
    below: &mut [Option<usize>],
) -> Result<usize, String> {
    let deepest = match below[index] {
        Some(known) => known,
        None if depth > DEEPEST => DEEPEST,
        None => {
            let mut deepest = 0;
            for field in &messages[index].fields {
                if let Kind::Message(inner) = field.kind {
                    deepest = deepest.max(1 + depth_below(messages, inner, depth + 1, below)?);
                }
            }
            below[index] = Some(deepest);
            deepest
        }
    };
    match depth + deepest > DEEPEST {
        true => Err(format!("{} contains itself, or too many messages in one another", messages[index].name)),
        false => Ok(deepest),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fault(text: &str) -> String {
        definition("a/msg/A", text).expect_err("it is malformed")
    }

    #[test]
    fn fields_of_all_forms() {
        let text = "# a comment\n\
            uint8 KIND=3 # a constant\n\
            string NAME = \"a # b\"\n\
            float64 x 1.5 # with a default\n\
            string<=10[<=5] names\n\
            B[3] inner\n\
            Header header\n\
            a/msg/B other\n\
            ================================================================================\n\
            MSG: a/B\n\
            int8[] numbers\n\
            ===\n\
            MSG: std_msgs/Header\n\
            string frame_id\n";
        let MessageDefinition { messages } = definition("a/msg/A", text).expect("it is one");
        let fields: Vec<_> = messages[0].fields.iter().map(|f| (&*f.name, f.kind, f.count)).collect();
        assert_eq!(
            fields,
            [
                ("x", Kind::F64, Count::One),
                ("names", Kind::Text, Count::Any),
                ("inner", Kind::Message(1), Count::Exactly(3)),
                ("header", Kind::Message(2), Count::One),
                ("other", Kind::Message(1), Count::One),
            ]
        );
        assert_eq!(messages[1].fields, [Field { name: "numbers".into(), kind: Kind::I8, count: Count::Any }]);
    }

    /// Only the first field of an enum has names: other constants may be of any field.
    #[test]
    fn the_number_of_an_enum_has_names() {
        let names = |text: &str| {
            let MessageDefinition { messages } = definition("a/A", text).expect("it is one");
            (messages[0].fields[0].kind, messages[0].variants.len())
        };
        let constants = "uint32 OPEN=0\nuint32 HOLDING = 1 # something\n";
        assert_eq!(names(&format!("{constants}uint32 kind\n")), (Kind::Variant(0), 2));
        assert_eq!(names("uint32 kind\n"), (Kind::U32, 0));
        assert_eq!(names("int32 OPEN=0\nuint32 kind\n"), (Kind::U32, 0));
        assert_eq!(names(&format!("{constants}uint32[] kind\n")).0, Kind::U32);
        assert_eq!(names(&format!("{constants}uint32 status\n")).0, Kind::U32);
    }

    #[test]
    fn what_is_malformed_is_named() {
        assert_eq!(fault("float64"), "a/A: a name is missing in `float64`");
        assert_eq!(fault("float65 x"), "a/A: a/float65 is not defined");
        assert_eq!(fault("float64[3 x"), "a/A: `]` is missing in `float64[3`");
        assert_eq!(fault("float64[-3] x"), "a/A: `-3` is not a length in `float64[-3]`");
        assert_eq!(fault("wstring x"), "a/A: `wstring` is not read, since writers disagree on its bytes");
        assert_eq!(fault("===\nfloat64 x"), "`MSG:` is missing in `float64 x`");
        assert_eq!(fault("A again"), "a/A contains itself, or too many messages in one another");
    }

    /// Two types on each level that hold both of the next: as many ways as there are atoms.
    #[test]
    fn many_ways_to_the_bottom_take_no_time() {
        let level = |level: usize, name: &str| format!("===\nMSG: a/{name}{level}\nB{0} b\nC{0} c\n", level + 1);
        let levels = |most: usize| {
            let mut text = "B0 b\nC0 c\n".to_owned();
            for number in 0..most {
                text += &(level(number, "B") + &level(number, "C"));
            }
            text + &format!("===\nMSG: a/B{most}\nbool x\n===\nMSG: a/C{most}\nbool x\n")
        };
        assert!(definition("a/A", &levels(DEEPEST - 1)).is_ok());
        assert!(fault(&levels(DEEPEST)).contains("too many"));
        assert!(fault(&levels(10_000)).contains("too many"));
    }
}
