//! Messages of ROS 1 as those of ROS 2: the same fields in another encoding.
//!
//! ROS 1 writes fields without padding (<https://wiki.ros.org/msg>), has times as primitive types, and a sequence number
//! in its header.

use super::{Count, Field, Kind, MessageDefinition};
use crate::file::full_name;
use bb_core::message::Schema;
use std::fmt::Write;

/// A message type of ROS 1, and the one of ROS 2 that its messages are converted to.
#[derive(Clone, Debug)]
pub struct Ros1Definition {
    schema: Schema,
    definition: MessageDefinition,
}

const HEADER: &str = "std_msgs/Header";
const TIME: &str = "builtin_interfaces/Time";
const DURATION: &str = "builtin_interfaces/Duration";

impl Ros1Definition {
    /// Parses the definition of a type, `sensor_msgs/Imu`, as bags of ROS 1 contain it.
    ///
    /// # Errors
    /// The line that is wrong; or a type that is not defined, or contains itself.
    pub fn parse(name: &str, text: &str) -> Result<Self, String> {
        // The message of transforms moved to another package.
        let ros2 = if name == "tf/tfMessage" { "tf2_msgs/TFMessage" } else { name };
        let text = translate(name, text);
        let definition = MessageDefinition::parse(ros2, &text)?;
        Ok(Self { schema: Schema { name: full_name(ros2), text }, definition })
    }

    /// The type in ROS 2.
    pub fn schema(&self) -> &Schema {
        &self.schema
    }

    /// Appends a message in the encoding of ROS 2, CDR.
    ///
    /// # Errors
    /// The field that is wrong, and what was expected there.
    pub fn convert(&self, data: &[u8], out: &mut Vec<u8>) -> Result<(), String> {
        // Little-endian.
        out.extend([0, 1, 0, 0]);
        let mut converter = Converter { definition: &self.definition, data, start: out.len(), out };
        converter.message(0)?;
        match converter.data.len() {
            0 => Ok(()),
            left => Err(format!("{left} bytes follow the last field")),
        }
    }
}

/// The definition with ROS 2's names of types.
fn translate(name: &str, text: &str) -> String {
    let mut out = String::new();
    let mut owner = name.to_owned();
    let mut is_head = false;
    for line in text.lines().map(str::trim) {
        if let Some(name) = line.strip_prefix("MSG:").filter(|_| is_head) {
            owner = name.trim().to_owned();
        }
        is_head = line.len() >= 3 && line.bytes().all(|byte| byte == b'=');
        let translated = if is_head || line.starts_with("MSG:") { line.to_owned() } else { field(line, &owner) };
        if !translated.is_empty() {
            out += &translated;
            out.push('\n');
        }
    }
    for (name, fields) in [(TIME, "int32 sec\nuint32 nanosec"), (DURATION, "int32 sec\nuint32 nanosec")] {
        if out.contains(name) {
            // Writing to a string does not fail.
            let _ = writeln!(out, "{}\nMSG: {name}\n{fields}", "=".repeat(80));
        }
    }
    out
}

/// A line of a definition; empty for comments and for what ROS 2 has no place for.
fn field(line: &str, owner: &str) -> String {
    let code = line.split('#').next().unwrap_or("").trim();
    let Some((kind, rest)) = code.split_once(char::is_whitespace) else { return String::new() };
    let rest = rest.trim();
    if rest.contains('=') {
        // Constants; those of text have no quotes in ROS 1.
        return if kind == "string" { String::new() } else { code.to_owned() };
    }
    if owner == HEADER && rest == "seq" {
        return String::new();
    }
    let (element, list) = kind.split_at(kind.find('[').unwrap_or(kind.len()));
    let element = match element {
        "time" => TIME,
        "duration" => DURATION,
        "Header" => HEADER,
        "char" => "uint8",
        "byte" => "int8",
        other => other,
    };
    // `D`, `K`, `R` and `P` of a camera's information: names of fields are in lower case.
    format!("{element}{list} {}", rest.to_ascii_lowercase())
}

struct Converter<'a> {
    definition: &'a MessageDefinition,
    /// Rest of the message.
    data: &'a [u8],
    /// Start of the alignment of CDR.
    start: usize,
    out: &'a mut Vec<u8>,
}

impl<'a> Converter<'a> {
    fn message(&mut self, index: usize) -> Result<(), String> {
        let definition = self.definition;
        let message = &definition.messages[index];
        if message.name == HEADER {
            self.take(4).map_err(|fault| format!("seq: {fault}"))?;
        }
        for field in &message.fields {
            self.field(field).map_err(|fault| format!("{}: {fault}", field.name))?;
        }
        if message.fields.is_empty() {
            // The content of a struct without fields.
            self.out.push(0);
        }
        Ok(())
    }

    fn field(&mut self, field: &Field) -> Result<(), String> {
        let length = match field.count {
            Count::One => return self.one(field.kind),
            Count::Exactly(length) => length,
            Count::Any => self.length()?,
        };
        if let Some(size) = size(field.kind) {
            let bytes = length.checked_mul(size).ok_or("a list that is too long")?;
            let bytes = self.take(bytes)?;
            if length > 0 {
                self.align(size);
            }
            self.out.extend(bytes);
            return Ok(());
        }
        for _ in 0..length {
            let before = self.data.len();
            self.one(field.kind)?;
            if self.data.len() == before {
                return Err("a list of empty messages".into());
            }
        }
        Ok(())
    }

    fn one(&mut self, kind: Kind) -> Result<(), String> {
        match (kind, size(kind)) {
            (_, Some(size)) => {
                let bytes = self.take(size)?;
                self.align(size);
                self.out.extend(bytes);
                Ok(())
            }
            (Kind::Message(index), None) => self.message(index),
            (_, None) => {
                let length = self.number()?;
                let text = self.take(length as usize)?;
                // CDR counts and writes the zero at the end.
                let length = length.checked_add(1).ok_or("a text that is too long")?;
                self.align(4);
                self.out.extend(length.to_le_bytes());
                self.out.extend(text);
                self.out.push(0);
                Ok(())
            }
        }
    }

    fn length(&mut self) -> Result<usize, String> {
        let length = self.number()?;
        self.align(4);
        self.out.extend(length.to_le_bytes());
        Ok(length as usize)
    }

    fn number(&mut self) -> Result<u32, String> {
        let bytes = self.take(4)?;
        Ok(bytes.iter().rev().fold(0, |number, byte| number << 8 | u32::from(*byte)))
    }

    fn take(&mut self, count: usize) -> Result<&'a [u8], String> {
        let split = self.data.split_at_checked(count);
        let (taken, left) =
            split.ok_or_else(|| format!("needs {count} bytes, and {} are left", self.data.len()))?;
        self.data = left;
        Ok(taken)
    }

    fn align(&mut self, size: usize) {
        let length = self.out.len() - self.start;
        self.out.resize(self.start + length.next_multiple_of(size), 0);
    }
}

/// The bytes of a number, the same in both encodings.
fn size(kind: Kind) -> Option<usize> {
    Some(match kind {
        Kind::Bool | Kind::I8 | Kind::U8 => 1,
        Kind::I16 | Kind::U16 => 2,
        Kind::I32 | Kind::U32 | Kind::F32 | Kind::Variant(_) => 4,
        Kind::I64 | Kind::U64 | Kind::F64 => 8,
        Kind::Text | Kind::Message(_) => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Value;

    const TEXT: &str = "Header header\nuint8 KIND=2 # a constant\nstring NAME=free text\nbyte small\nfloat64[2] K\n\
        string[] names\nduration wait\n\
        ===\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n";

    fn bytes() -> Vec<u8> {
        let mut bytes = Vec::new();
        bytes.extend(7_u32.to_le_bytes());
        bytes.extend(1_600_000_000_u32.to_le_bytes());
        bytes.extend(5_u32.to_le_bytes());
        bytes.extend(3_u32.to_le_bytes());
        bytes.extend(b"imu");
        bytes.push(0xff);
        bytes.extend(1.5_f64.to_le_bytes());
        bytes.extend((-2.5_f64).to_le_bytes());
        bytes.extend(2_u32.to_le_bytes());
        for name in ["a", "bcd"] {
            bytes.extend(u32::try_from(name.len()).expect("fits").to_le_bytes());
            bytes.extend(name.as_bytes());
        }
        bytes.extend((-1_i32).to_le_bytes());
        bytes.extend(250_u32.to_le_bytes());
        bytes
    }

    #[test]
    fn fields_keep_their_values() {
        let definition = Ros1Definition::parse("a/A", TEXT).expect("it is one");
        let schema = definition.schema();
        assert_eq!(schema.name, "a/msg/A");
        let mut out = Vec::new();
        definition.convert(&bytes(), &mut out).expect("it is a message");
        let read = MessageDefinition::parse(&schema.name, &schema.text).expect("it is one").read(&out);
        let message = read.expect("it is a message");
        let stamp = message.field("header").and_then(|header| header.field("stamp")).expect("is there");
        assert_eq!(stamp.field("sec"), Some(&Value::Signed(1_600_000_000)));
        assert_eq!(stamp.field("nanosec"), Some(&Value::Unsigned(5)));
        assert_eq!(
            message.field("header").and_then(|header| header.field("frame_id")),
            Some(&Value::Text("imu".into()))
        );
        assert_eq!(message.field("small"), Some(&Value::Signed(-1)));
        assert_eq!(message.field("k"), Some(&Value::List(vec![Value::F64(1.5), Value::F64(-2.5)])));
        let names = vec![Value::Text("a".into()), Value::Text("bcd".into())];
        assert_eq!(message.field("names"), Some(&Value::List(names)));
        assert_eq!(message.field("wait").and_then(|wait| wait.field("sec")), Some(&Value::Signed(-1)));
    }

    #[test]
    fn a_cut_message_names_the_field() {
        let definition = Ros1Definition::parse("a/A", TEXT).expect("it is one");
        let whole = bytes();
        for length in 0..whole.len() {
            assert!(definition.convert(&whole[..length], &mut Vec::new()).is_err(), "{length}");
        }
        let fault = definition.convert(&whole[..20], &mut Vec::new()).expect_err("it is cut");
        assert_eq!(fault, "k: needs 16 bytes, and 0 are left");
        let longer = [&whole[..], &[0]].concat();
        let fault = definition.convert(&longer, &mut Vec::new()).expect_err("it is longer");
        assert_eq!(fault, "1 bytes follow the last field");
    }
}
