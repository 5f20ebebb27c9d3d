//! Parameters: values that can be changed while the robot runs, in groups.

use super::Robot;
use super::table::ids;
use crate::names::text;
use crate::parse::{self, Literal, ParameterItem, ParameterKind, ParameterRange, Path, Value};
use proc_macro2::Ident;
use syn::Attribute;

ids! { ParameterId ParameterGroupId }

#[derive(Clone, Debug)]
pub(crate) struct Parameter {
    pub(crate) attributes: Vec<Attribute>,
    pub(crate) name: Ident,
    /// `param`, the groups, the name.
    pub(crate) path: Vec<String>,
    /// Group of the parameter; `None` in `parameters` itself.
    pub(crate) group: Option<ParameterGroupId>,
    pub(crate) kind: ParameterKind,
    /// Default value. In a verified robot it is of this kind, and so are the ends of the range.
    pub(crate) default: Literal,
    pub(crate) range: Option<ParameterRange>,
}

#[derive(Clone, Debug)]
pub(crate) struct ParameterGroup {
    pub(crate) attributes: Vec<Attribute>,
    pub(crate) name: Ident,
    pub(crate) path: Vec<String>,
    pub(crate) group: Option<ParameterGroupId>,
}

impl Parameter {
    /// The SI unit of its values; empty if it has none.
    pub(crate) fn unit(&self) -> String {
        self.default.dimension.unit()
    }
}

impl Robot {
    /// The parameter at a path.
    pub(crate) fn parameter(&self, path: &Path) -> Option<ParameterId> {
        self.parameter_paths.get(&path.text()).copied()
    }

    pub(super) fn add_parameters(&mut self, items: Vec<ParameterItem>) {
        self.add_group_items(items, None, &["param".to_owned()]);
    }

    fn add_group_items(&mut self, items: Vec<ParameterItem>, group: Option<ParameterGroupId>, above: &[String]) {
        for item in items {
            match item {
                ParameterItem::Group { attributes, name, items } => {
                    let path = below(above, &name);
                    let id =
                        self.parameter_groups.push(ParameterGroup { attributes, name, path: path.clone(), group });
                    self.add_group_items(items, Some(id), &path);
                }
                ParameterItem::Parameter(parameter) => {
                    let parse::Parameter { attributes, name, kind, default, range } = parameter;
                    let (default, path) = (of_kind(default, kind), below(above, &name));
                    let range = range.map(|ParameterRange { word, start, end }| ParameterRange {
                        word,
                        start: of_kind(start, kind),
                        end: of_kind(end, kind),
                    });
                    self.parameter_paths.entry(path.join("::")).or_insert(self.parameters.next_id());
                    self.parameters.push(Parameter { attributes, name, path, group, kind, default, range });
                }
            }
        }
    }
}

fn below(above: &[String], name: &Ident) -> Vec<String> {
    above.iter().cloned().chain([text(name)]).collect()
}

/// `3` is a valid float too.
fn of_kind(mut literal: Literal, kind: ParameterKind) -> Literal {
    if let (Value::Integer(integer), ParameterKind::Number) = (&literal.value, kind) {
        literal.value = Value::Number(*integer as f64);
    }
    literal
}
