//! There is exactly one root link, and every joint has exactly one child link.
//!
//! Right: `link base { joint mount: fixed { link mast { } } }`
//! Wrong: `link base { joint mount: fixed { } }`, `link base { } link other { }`

use crate::diagnostics::Diagnostics;
use crate::model::Robot;

pub(super) fn check(robot: &Robot, diagnostics: &mut Diagnostics) {
    let mut roots = robot.links.iter().filter(|link| link.joint.is_none());
    match (roots.next(), &robot.name) {
        (Some(root), _) => {
            // A link that seems to be a root may be the child of an unread item.
            for extra in roots.filter(|_| robot.complete) {
                let (root, name) = (&root.name, &extra.name);
                diagnostics.error(
                    name,
                    format!("`{name}` is a second root beside `{root}`; put it into a joint of another link"),
                );
            }
        }
        (None, Some(name)) if robot.complete => {
            diagnostics.error(name, format!("`{name}` has no link; declare its root, as in `link base {{ }}`"));
        }
        (None, _) => {}
    }
    for joint in &robot.joints {
        let name = &joint.name;
        for extra in joint.children.iter().skip(1).map(|child| &robot.links[*child]) {
            diagnostics.error(
                &extra.name,
                format!("`{}` is a second link of the joint `{name}`, which carries one", extra.name),
            );
        }
        if joint.children.is_empty() && robot.complete {
            let message = format!("the joint `{name}` carries no link; declare it, as in `link {name}_link {{ }}`");
            diagnostics.error(name, message);
        }
    }
}
