//! Transforms of an estimator's inputs across moving joints, at the times of their messages.

use crate::component::replacement::Replacement;
use crate::component::{Fault, InputTransform, InputTransforms};
use crate::declaration::EstimatorDeclaration;
use crate::joints::{Gap, LookupError, PlacedInput, Placement};
use crate::node::admission::Admission;
use crate::node::environment::{Environment, Missing, Mode};
use crate::node::shared::SharedNode;
use crate::node::turn::Turn;
use crate::time::MonotonicTime;
use bb_kinematics::__private::InputRoute;
use nalgebra::Isometry3;
use std::sync::Arc;

/// Time at which an input was measured, and its transform at that time.
type PlacedAt = (MonotonicTime, Isometry3<f64>);

/// The transforms of an estimator's inputs.
pub(super) struct Placing {
    declaration: &'static EstimatorDeclaration,
    shared: SharedNode,
    routes: Arc<[InputRoute]>,
    /// The last successful lookup of each route. The message of an input without a tolerance may be older than the history of the
    /// joints.
    placed: Box<[Option<PlacedAt>]>,
    inputs: Box<[InputTransform]>,
}

/// Reason for which a dispatch is dropped.
#[derive(Debug)]
pub(super) enum Unplaced {
    /// The transform of a required input is unknown.
    Gap {
        /// The number of the input.
        input: usize,
        /// The reason.
        error: LookupError,
    },
    /// The journal being replayed does not contain the transform of an input.
    Missing,
}

impl Placing {
    pub(super) fn new(
        number: usize,
        declaration: &'static EstimatorDeclaration,
        environment: &Environment,
    ) -> Self {
        let inputs = declaration.inputs.iter().map(|input| {
            let fixed = input.frame_from_input.map(|transform| transform.isometry());
            InputTransform::declared(input.name, input.driver, fixed)
        });
        let routes = environment.joints().routes().of(number);
        let placed = vec![None; routes.len()].into();
        Self { declaration, shared: environment.node(number), routes, placed, inputs: inputs.collect() }
    }

    /// Returns the reason for which `replacement` cannot take the place of the estimator: `robot!` has checked only the declared one.
    pub(super) fn fault_of(&self, replacement: &Replacement) -> Option<Fault> {
        let spans = self.routes.first().filter(|_| !replacement.handles_moving_joints())?;
        let input = self.declaration.inputs.get(spans.input).map_or("", |input| input.name);
        Some(Fault::permanent(format!(
            "its input `{input}` spans a moving joint, and its replacement takes fixed transforms only; set \
             `HANDLES_MOVING_JOINTS` in its `Estimator`"
        )))
    }

    /// Finds the transforms of the inputs for a dispatch on a message of the driving input. `admission` knows when the other inputs were
    /// measured.
    pub(super) fn place(
        &mut self,
        driver_time: MonotonicTime,
        admission: &Admission,
        turn: &Turn<'_>,
    ) -> Result<(), Unplaced> {
        for (route, placed) in self.routes.iter().zip(&mut self.placed) {
            let (Some(declared), Some(input)) =
                (self.declaration.inputs.get(route.input), self.inputs.get_mut(route.input))
            else {
                continue;
            };
            let time = if declared.driver { Some(driver_time) } else { admission.last(route.input) };
            // An input that is missing or too old has no transform. If it is required, the dispatch is dropped for that reason.
            let Some(time) = time.filter(|time| !declared.is_too_old(driver_time.nanos_since(*time))) else {
                input.set_absent();
                continue;
            };
            let Some(found) = find(&self.shared, route, placed, time, turn) else {
                let what = format!("where its input `{}` was", declared.name);
                turn.environment().replayed().miss(Missing { estimator: self.declaration.path, what });
                return Err(Unplaced::Missing);
            };
            let found = found.map_err(|gap| turn.environment().joints().error(gap));
            if let (Err(error), false) = (&found, declared.optional) {
                return Err(Unplaced::Gap { input: route.input, error: error.clone() });
            }
            input.set(found);
        }
        Ok(())
    }

    pub(super) fn transforms(&self, driver_time: MonotonicTime) -> InputTransforms<'_> {
        InputTransforms::new(&self.inputs).at(driver_time)
    }
}

/// Looks up a transform. A replay takes the transform from the journal and never asks the store, whose history may differ.
fn find(
    shared: &SharedNode,
    route: &InputRoute,
    placed: &mut Option<PlacedAt>,
    time: MonotonicTime,
    turn: &Turn<'_>,
) -> Option<Result<Isometry3<f64>, Gap>> {
    let environment = turn.environment();
    if environment.mode() == Mode::Replay {
        return shared.replayed_placement(route.input).map(|placement| placement.found());
    }
    let found = match (environment.joints().placed(route, time), *placed) {
        (Err(Gap::TooOld { .. }), Some((then, transform))) if then == time => Ok(transform),
        (found, _) => found,
    };
    if let Ok(transform) = found {
        *placed = Some((time, transform));
    }
    turn.keep_placed(PlacedInput {
        estimator: shared.number(),
        input: route.input,
        placement: Placement::of(&found),
    });
    Some(found)
}
