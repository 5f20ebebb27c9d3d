//! The names of definitions: readers distinguish types by them, so one name must have one definition.

use crate::error::RecordingErrorKind;
use crate::file::full_name;
use bb_core::message::Schema;
use std::collections::HashMap;

/// All definitions of a recording, by name, each with the path that has it.
#[derive(Debug, Default)]
pub(super) struct Names {
    known: HashMap<String, (String, String)>,
}

impl Names {
    /// Adds a definition and all those it refers to.
    ///
    /// # Errors
    /// One of the names has another definition already.
    pub(super) fn take(&mut self, path: &str, schema: &Schema) -> Result<(), RecordingErrorKind> {
        let (main, rest) = schema.text.split_once(SEPARATOR).unwrap_or((&schema.text, ""));
        let named = rest.split(SEPARATOR).filter_map(|part| {
            let (head, text) = part.trim_start_matches(['=', '\n']).split_once('\n')?;
            Some((head.strip_prefix("MSG: ")?, text))
        });
        for (name, text) in [(&*schema.name, main)].into_iter().chain(named) {
            let name = full_name(name);
            match self.known.get(&name) {
                Some((known, _)) if known == text => {}
                Some((_, first)) => {
                    let (first, second) = (first.clone(), path.to_owned());
                    return Err(RecordingErrorKind::SameName { name, first, second });
                }
                None => _ = self.known.insert(name, (text.to_owned(), path.to_owned())),
            }
        }
        Ok(())
    }
}

/// The beginning of the line between two definitions.
const SEPARATOR: &str = "================";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_has_one_definition() {
        let line = "=".repeat(80);
        let schema = |name: &str, text: String| Schema { name: name.to_owned(), text };
        let mut names = Names::default();
        let one = schema("bb_msgs/msg/A", format!("bb_msgs/Mode mode\n{line}\nMSG: bb_msgs/Mode\nuint32 kind\n"));
        assert!(names.take("a", &one).is_ok());
        assert!(names.take("b", &one).is_ok());
        let other = schema("bb_msgs/msg/B", format!("bb_msgs/Mode mode\n{line}\nMSG: bb_msgs/Mode\nuint8 kind\n"));
        let said = names.take("b", &other).expect_err("it has another `Mode`").to_string();
        assert!(said.starts_with("`a` and `b` publish different types"), "{said}");
        assert!(said.contains("`bb_msgs/msg/Mode`"), "{said}");
    }
}
