//! Checks that the position of an actuated joint is known.

use super::text::Text;

/// Checks that one of the publishers at the joint reports its position.
#[track_caller]
pub const fn check_position(actuator: &str, joint: &str, tell: &[bool]) {
    let mut index = 0;
    while index < tell.len() {
        if tell[index] {
            return;
        }
        index += 1;
    }
    let text =
        Text::new("").name(actuator).push(" moves the joint ").name(joint).push(", and no sensor there tells its ");
    let text = text.push("position; declare one that publishes a `JointState` in this joint, or write ");
    panic!("{}", text.push("`#[payload(joint_position)]` on the payload of the one that does").as_str())
}
