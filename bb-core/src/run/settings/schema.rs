//! The JSON Schema of a robot's settings: for editors, and for programs that write them.

use super::assign::{names, tables};
use crate::component::{OptionField, OptionsList, Setting, SettingKind};
use crate::declaration::RobotDeclaration;
use crate::declaration::schema::{number, parameter_schema, quantity, with_notes};
use crate::declaration::unit::si_unit;
use crate::message::codec::{Shape, to_json};
use crate::run::bound::bound_to;
use bb_message::__private::{Definitions, Sorted, document, member};

pub(crate) fn settings_schema(robot: &RobotDeclaration, mut options: OptionsList) -> String {
    let mut definitions = Definitions::default();
    let (mut root, names) = (Sorted::default(), names(robot, &mut options));
    for (number, path) in robot.component_paths().into_iter().enumerate() {
        let Some(options) = options.any(number) else { continue };
        for (index, field) in options.fields().iter().enumerate() {
            let Some(setting) = options.setting(index) else { continue };
            if bound_to(robot, number, field.name).is_none()
                && let Some(schema) = of_option(field, &*setting, &mut definitions)
            {
                insert(&mut root, &names, &format!("{path}/{}", field.name), schema);
            }
        }
    }
    for declared in robot.parameters {
        insert(&mut root, &names, declared.path, parameter_schema(declared));
    }
    document(&member("title", robot.name), &object(&root), definitions)
}

/// A setting, or a table of further ones.
enum Node {
    Setting(String),
    Table(Sorted<String, Node>),
}

/// Puts a schema in its place, the table that a file has for it.
fn insert(root: &mut Sorted<String, Node>, names: &Sorted<String, ()>, path: &str, schema: String) {
    let (above, last) = path.rsplit_once('/').unwrap_or(("", path));
    let mut table = root;
    for name in tables(names, above) {
        let node = table.get_or_insert(name.to_owned(), || Node::Table(Sorted::default()));
        let Node::Table(inner) = node else { return };
        table = inner;
    }
    table.insert(last.to_owned(), Node::Setting(schema));
}

fn object(table: &Sorted<String, Node>) -> String {
    let properties = table.iter().map(|(name, node)| {
        let schema = match node {
            Node::Setting(schema) => schema.clone(),
            Node::Table(inner) => format!("{{{}}}", object(inner)),
        };
        format!("{}:{schema}", to_json(name))
    });
    let properties: Vec<String> = properties.collect();
    let properties = properties.join(",");
    format!(r#""type":"object","properties":{{{properties}}},"additionalProperties":false"#)
}

fn of_option(field: &OptionField, setting: &dyn Setting, definitions: &mut Definitions) -> Option<String> {
    let range = field.range;
    let mut unit = String::new();
    let keywords = match setting.kind() {
        SettingKind::Code => return None,
        SettingKind::Text => member("type", "string"),
        SettingKind::Quantity => {
            unit = field.dimension.map_or(String::new(), |dimension| si_unit(dimension.exponents));
            quantity(&unit)
        }
        SettingKind::Value(Shape::F32 | Shape::F64) => number("number", range),
        SettingKind::Value(shape) if is_integer(shape) && range.is_some() => number("integer", range),
        SettingKind::Value(shape) => {
            let schema = definitions.schema(shape);
            schema.strip_prefix('{').and_then(|schema| schema.strip_suffix('}')).unwrap_or("").to_owned()
        }
    };
    Some(with_notes(keywords, field.doc, &unit, range, setting.value().as_deref()))
}

fn is_integer(shape: Shape) -> bool {
    use Shape::{I8, I16, I32, I64, U8, U16, U32, U64};
    matches!(shape, I8 | I16 | I32 | I64 | U8 | U16 | U32 | U64)
}
