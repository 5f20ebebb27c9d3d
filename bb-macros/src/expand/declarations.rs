//! Declarations as constant data: sensors, and estimators with their inputs.

use super::islands::Islands;
use super::literal::{nanos, option, transform};
use super::part::Part;
use super::table::array;
use super::topology::{self, root_from};
use super::types::Types;
use super::{control, path_text};
use crate::model::{ActuatorId, EstimatorId, Health, Home, Id as _, Mount, Robot, Sensor, Service, Timing};
use crate::verify::Verified;
use proc_macro2::TokenStream;
use quote::quote;

/// `static __SENSORS`, `__ESTIMATORS` and `__TOPOLOGY`.
pub(super) fn declarations(verified: &Verified<'_>, types: &Types<'_>, islands: &Islands) -> TokenStream {
    let robot = verified.robot;
    let sensors = robot.sensors.iter().map(|sensor| sensor_declaration(robot, sensor)).collect();
    let estimators = robot.estimators.ids().map(|id| estimator_declaration(verified, islands, id)).collect();
    let actuators = robot.actuators.ids().map(|id| actuator_declaration(types, id)).collect();
    let services = robot.services.iter().map(service_declaration).collect();
    let arrays = [
        array("__SENSORS", quote!(__private::SensorDeclaration), sensors),
        array("__ESTIMATORS", quote!(__private::EstimatorDeclaration), estimators),
        array("__ACTUATORS", quote!(__private::ActuatorDeclaration), actuators),
        array("__SERVICES", quote!(__private::SensorDeclaration), services),
        control::categories(robot),
        control::commands(robot),
        control::parameters(robot),
    ];
    let topology = topology::topology(verified);
    quote! {
        #(#arrays)*
        static __TOPOLOGY: __private::Topology = #topology;
    }
}

fn sensor_declaration(robot: &Robot, sensor: &Sensor) -> TokenStream {
    let path = path_text(&robot.publishers[sensor.publisher].path);
    let frame = robot.frame_name(sensor.mount);
    let period = period(sensor.period_s);
    let root = root_from(robot, sensor.mount);
    let supervisor = supervisor(robot, sensor.mount);
    quote!(__private::SensorDeclaration {
        path: #path,
        frame: __private::Frame::new(#frame),
        period_nanos: #period,
        root_from_frame: #root,
        supervisor: #supervisor,
    })
}

fn estimator_declaration(verified: &Verified<'_>, islands: &Islands, id: EstimatorId) -> TokenStream {
    let robot = verified.robot;
    let estimator = &robot.estimators[id];
    let mount = robot.mount_of_estimator(id);
    let (path, frame) = (path_text(&estimator.path), robot.frame_name(mount));
    let island = islands.of[id];
    let supervisor = supervisor(robot, mount);
    let sync_tolerance_s = estimator.timing.sync_tolerance_s;
    let health = health(&estimator.health, estimator.timing);
    let worker = worker(robot, id);
    let nested = match estimator.home {
        Home::Sensor(sensor) => Some(nested_input(robot, &robot.sensors[sensor])),
        Home::Link(_) => None,
    };
    let several = estimator.inputs.len() > 1;
    let declared =
        estimator.inputs.iter().zip(&verified.sources[id]).enumerate().map(|(index, (input, source))| {
            let name = crate::names::text(&input.name);
            let path = path_text(&robot.publishers[*source].path);
            let driver = input.driver.is_some() || !several;
            let optional = input.optional.is_some();
            let within_s = input.within.as_ref().map(|within| within.value);
            let tolerance = option(within_s.or(sync_tolerance_s).map(|tolerance_s| {
                let tolerance = nanos(tolerance_s);
                quote!(#tolerance)
            }));
            // The driver can only be compared with the clock.
            let stale = option(within_s.filter(|_| driver).map(|limit_s| {
                let limit = nanos(limit_s);
                quote!(#limit)
            }));
            let route = robot.route(robot.mount_of(*source), mount);
            let frame_from_input = option(route.moving.is_empty().then(|| transform(route.transform)));
            input_declaration(index, &name, &path, driver, optional, [&tolerance, &stale], &frame_from_input)
        });
    let inputs = nested.into_iter().chain(declared);
    let outputs = estimator.publishers.iter().map(|publisher| path_text(&robot.publishers[*publisher].path));
    let names = match &*estimator.outputs {
        [] => vec!["out".to_owned()],
        outputs => outputs.iter().map(|output| crate::names::text(&output.name)).collect(),
    };
    quote!(__private::EstimatorDeclaration {
        path: #path,
        frame: __private::Frame::new(#frame),
        inputs: &[#(#inputs),*],
        outputs: &[#(#outputs),*],
        output_names: &[#(#names),*],
        island: #island,
        supervisor: #supervisor,
        health: #health,
        worker: #worker,
    })
}

/// The number of the supervisor for components mounted there: the robot's, then the links', then the joints'.
pub(super) fn supervisor(robot: &Robot, mount: Mount) -> usize {
    match mount {
        Mount::Robot => 0,
        Mount::Link(link) => 1 + link.number(),
        Mount::Joint(joint) => 1 + robot.links.len() + joint.number(),
    }
}

fn period(period_s: Option<f64>) -> TokenStream {
    option(period_s.map(|period_s| {
        let period = nanos(period_s).max(1);
        quote!(#period)
    }))
}

fn actuator_declaration(types: &Types<'_>, id: ActuatorId) -> TokenStream {
    let robot = types.model();
    let actuator = &robot.actuators[id];
    let path = path_text(&actuator.path);
    let joint = &robot.joints[actuator.joint].label;
    let motions = ["begin_motion", "end_motion"].map(|report| format!("{path}/{report}"));
    let supervisor = supervisor(robot, Mount::Joint(actuator.joint));
    let kind = types.part(Part::Actuator(id));
    quote!(__private::ActuatorDeclaration {
        path: #path,
        joint: #joint,
        motions: [#(#motions),*],
        supervisor: #supervisor,
        new_topic: __private::ActuatorNode::<#kind>::new_topic,
    })
}

fn service_declaration(service: &Service) -> TokenStream {
    let (path, period) = (path_text(&service.path), period(service.period_s));
    quote!(__private::SensorDeclaration {
        path: #path,
        frame: __private::Frame::NONE,
        period_nanos: #period,
        root_from_frame: __private::None,
        supervisor: 0,
    })
}

fn health(health: &Health, timing: Timing) -> TokenStream {
    // In full: a setting that is not expanded does not compile.
    let Timing { sync_tolerance_s, latency_budget_s, lost_after_s, recover_after } = timing;
    let is_declared = timing != Timing { sync_tolerance_s, ..Timing::DEFAULT };
    if !is_declared && health.on_degraded.or(health.on_lost).or(health.on_recovered).is_none() {
        return quote!(__private::HealthDeclaration::NONE);
    }
    let [budget, lost] = [latency_budget_s, lost_after_s].map(|time| {
        option(time.map(|time| {
            let time = nanos(time);
            quote!(#time)
        }))
    });
    let [degraded, lost_command, recovered] = [health.on_degraded, health.on_lost, health.on_recovered]
        .map(|command| option(command.map(|command| quote!(#command))));
    quote!(__private::HealthDeclaration {
        latency_budget_nanos: #budget,
        lost_after_nanos: #lost,
        recover_after: #recover_after,
        on_degraded: #degraded,
        on_lost: #lost_command,
        on_recovered: #recovered,
    })
}

/// An `Option<WorkerDeclaration>`.
pub(super) fn worker(robot: &Robot, id: EstimatorId) -> TokenStream {
    let worker = robot.estimators[id].worker.as_ref();
    option(worker.map(|worker| {
        let priority = option(worker.priority.map(|priority| quote!(#priority)));
        let core = option(worker.core.map(|core| {
            let core = core as usize;
            quote!(#core)
        }));
        quote!(__private::WorkerDeclaration { priority: #priority, core: #core })
    }))
}

/// The only input of a nested estimator: its sensor.
fn nested_input(robot: &Robot, sensor: &Sensor) -> TokenStream {
    let name = crate::names::text(&sensor.name);
    let path = path_text(&robot.publishers[sensor.publisher].path);
    quote!(__private::InputDeclaration::nested(#name, #path))
}

fn input_declaration(
    index: usize,
    name: &str,
    source: &str,
    driver: bool,
    optional: bool,
    [tolerance, stale]: [&TokenStream; 2],
    frame_from_input: &TokenStream,
) -> TokenStream {
    quote!(__private::InputDeclaration {
        index: #index,
        name: #name,
        source: #source,
        driver: #driver,
        optional: #optional,
        tolerance_nanos: #tolerance,
        stale_after_nanos: #stale,
        frame_from_input: #frame_from_input,
    })
}
