//! The names of items in the expansion: each contains the path of its part, so that the expansion is readable.
//!
//! `sensor/base/imu` is `sensor_base_imu`. If two paths would give the same name, a number is appended to the second.
//!
//! Items beside the robot's type contain the line and the column of its name. So two robots with the same name in one
//! module collide only in items known to the user: their types and modules.

use super::part::Part;
use crate::diagnostics::Place;
use crate::model::{From, Publisher, PublisherId, Robot, Table};
use proc_macro2::{Ident, Span};
use quote::{ToTokens as _, format_ident};
use std::collections::{HashMap, HashSet};

/// The names of a robot's parts and publishers.
#[derive(Debug)]
pub(super) struct Naming {
    /// Names of the parts, by position; see [`Part::position`].
    parts: Vec<PartNames>,
    publishers: Table<PublisherId, PublisherNames>,
}

/// The names that a part has in the expansion.
#[derive(Debug)]
pub(super) struct PartNames {
    /// `sensor_base_imu`
    pub(super) name: Ident,
    /// `__Rover_2_11__sensor_base_imu`: its type, named after the first part with this type.
    pub(super) alias: Ident,
    /// `__Rover_2_11__given__sensor_base_imu`: its type as the user wrote it.
    pub(super) given: Ident,
    /// `__Rover_2_11__probed__sensor_base_imu`: how the type implements its trait, of the first part with this type.
    pub(super) probed: Ident,
    /// The number of that part.
    pub(super) first: usize,
    /// `__Rover_2_11__options__sensor_base_imu`: its options, named after the first part with this type.
    pub(super) options: Ident,
    /// `__Rover_2_11__given_options__sensor_base_imu`: the same, of the type as the user wrote it.
    pub(super) given_options: Ident,
    /// `__member__sensor_base_imu_tilt`: an estimator in its island.
    pub(super) member: Ident,
    /// Place at which the user wrote the type. Names are looked up as in the expansion.
    pub(super) span: Span,
}

/// The names that a publisher has in the expansion.
#[derive(Debug)]
pub(super) struct PublisherNames {
    /// `sensor_base_imu`
    pub(super) name: Ident,
    /// `__Rover_2_11__payload__sensor_base_imu_tilt`, named after the first publisher of this output of this type.
    pub(super) payload: Ident,
    /// `true` for the first publisher of this output of this type.
    pub(super) is_first: bool,
}

impl Naming {
    pub(super) fn of(robot: &Robot, robot_name: &Ident) -> Self {
        let (mut taken_by_parts, mut taken_by_publishers) = (HashSet::new(), HashSet::new());
        let call_site = Span::call_site();
        let prefix = prefix(robot_name);
        let item = |kind: &str, name: &Ident, span: Span| format_ident!("{prefix}__{kind}{name}", span = span);
        let mut probed = HashMap::new();
        let parts = Part::all(robot).enumerate().map(|(number, part)| {
            let name = fresh(part.path(robot), &mut taken_by_parts);
            let kind = &part.component(robot).kind;
            let span = Place::of(kind).start.resolved_at(call_site);
            let own = item("probed__", &name, call_site);
            let tokens = kind.to_token_stream().to_string();
            let own = (number, own, name.clone());
            let is_external = matches!(part, Part::Sensor(id) if robot.sensors[id].external.is_some());
            let (first, probed, named) = match is_external || tokens.contains('$') {
                // The path of an external input is no type, and `$crate` of two macros may be two crates.
                true => own,
                false => probed.entry((std::mem::discriminant(&part), tokens)).or_insert(own).clone(),
            };
            PartNames {
                probed,
                first,
                options: item("options__", &named, span),
                given_options: item("given_options__", &named, span),
                alias: item("", &named, span),
                given: item("given__", &name, span),
                member: format_ident!("__member__{name}"),
                name,
                span,
            }
        });
        let parts: Vec<PartNames> = parts.collect();
        let mut payloads = HashMap::new();
        let publishers = robot.publishers.map(|id| {
            let Publisher { path, from } = &robot.publishers[id];
            let name = fresh(path, &mut taken_by_publishers);
            let (part, output) = match *from {
                From::Sensor(id) => (Part::Sensor(id), None),
                From::Service(id) => (Part::Service(id), None),
                From::Estimator(id, output) => {
                    let output = output.and_then(|output| robot.estimators[id].outputs.get(output));
                    (Part::Estimator(id), output.map(|output| crate::names::text(&output.name)))
                }
            };
            let (mut payload, mut is_first) = (item("payload__", &name, call_site), false);
            let first = payloads.entry((parts[part.position(robot)].first, output)).or_insert_with(|| {
                is_first = true;
                payload.clone()
            });
            payload.clone_from(first);
            PublisherNames { payload, is_first, name }
        });
        Self { parts, publishers }
    }

    pub(super) fn part(&self, robot: &Robot, part: Part) -> &PartNames {
        &self.parts[part.position(robot)]
    }

    pub(super) fn publisher(&self, id: PublisherId) -> &PublisherNames {
        &self.publishers[id]
    }
}

/// `__Rover_2_11`: the prefix of a robot's items, and the module of its type.
pub(super) fn prefix(robot: &Ident) -> Ident {
    let place = robot.span().start();
    // Without the `r#` of a name that is a keyword.
    let name = crate::names::text(robot);
    format_ident!("__{name}_{}_{}", place.line, place.column + 1, span = Span::call_site())
}

fn fresh(path: &[String], taken: &mut HashSet<String>) -> Ident {
    let name = path.join("_");
    let numbered = (2..).map(|number| format!("{name}_{number}"));
    let free = std::iter::once(name.clone()).chain(numbered).find(|name| taken.insert(name.clone()));
    super::literal::ident(&free.unwrap_or(name))
}
