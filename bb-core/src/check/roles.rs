//! Commands that arm or disarm the robot.

use super::text::{Text, equal};
use crate::declaration::Role;

/// Checks that no earlier command has the same role, if a robot may have only one such command.
#[track_caller]
pub const fn check_role(command: &str, role: Role, before: &[(&str, Role)]) {
    let mut index = 0;
    while index < before.len() {
        let (other, other_role) = before[index];
        let does = match (role, other_role) {
            (Role::Arming, Role::Arming) => " arms",
            (Role::Disarming, Role::Disarming) => " disarms",
            _ => "",
        };
        if !does.is_empty() {
            let text = Text::new("").name(command).push(does).push(" the robot, as ").name(other);
            panic!("{}", text.push(" does; a robot has one such command, leave one out").as_str())
        }
        index += 1;
    }
}

/// Checks that an arming command may start while the robot is disarmed, and a disarming one while it is not.
#[track_caller]
pub const fn check_reachable(command: &str, role: Role, allowed: &[&str]) {
    let (mut disarmed, mut other, mut index) = (false, false, 0);
    while index < allowed.len() {
        if equal(allowed[index], "disarmed") {
            disarmed = true;
        } else {
            other = true;
        }
        index += 1;
    }
    match role {
        Role::Arming if !disarmed => {
            let text = Text::new("").name(command).push(" arms the robot and can never start here; ");
            panic!("{}", text.push("add `disarmed` to its states").as_str())
        }
        Role::Disarming if !other => {
            let text = Text::new("").name(command).push(" disarms the robot and is of no use here; ");
            panic!("{}", text.push("add `idle` and `executing` to its states").as_str())
        }
        _ => {}
    }
}
