//! What `robot!` implements.

use super::{Builder, SensorDeclaration, Source, Startup};
use crate::node::{AnyNode, EstimatorDeclaration};
use crate::pubsub::AnyTopic;
use crate::topology::{GraphFormat, Topology, graph};
use std::sync::Arc;

/// A declared robot. `robot!` implements it for the type that it defines; users call [`Robot::builder`].
pub trait Robot: Sized + Send + Sync + 'static {
    /// Its name.
    const NAME: &'static str;
    /// Its links and joints.
    const TOPOLOGY: &'static Topology;
    /// Its sensors, in the order of their declaration.
    const SENSORS: &'static [SensorDeclaration];
    /// Its estimators, in the order of their declaration.
    const ESTIMATORS: &'static [EstimatorDeclaration];

    /// The options of all components.
    #[doc(hidden)]
    type Options: Send;
    /// The topics of all publishers.
    #[doc(hidden)]
    type Topics: Send + Sync;
    /// The topics and the running estimators.
    #[doc(hidden)]
    type Wiring: Send + Sync;

    /// The options as declared.
    #[doc(hidden)]
    fn options() -> Self::Options;
    #[doc(hidden)]
    fn topics() -> Self::Topics;
    /// Starts all estimators; what cannot start is in `startup`.
    #[doc(hidden)]
    fn wire(topics: Self::Topics, options: &Self::Options, startup: &Startup) -> Self::Wiring;
    /// Starts all sensors; what cannot start is in `startup`.
    #[doc(hidden)]
    fn sources(wiring: &Arc<Self::Wiring>, options: &Self::Options, startup: &Startup) -> Vec<Box<dyn Source>>;
    #[doc(hidden)]
    fn wired_topics(wiring: &Self::Wiring) -> &Self::Topics;
    #[doc(hidden)]
    fn all_topics(topics: &Self::Topics) -> Vec<&dyn AnyTopic>;
    #[doc(hidden)]
    fn all_nodes(wiring: &Self::Wiring) -> Vec<&dyn AnyNode>;

    /// Its links and joints as a URDF file.
    fn to_urdf() -> String {
        Self::TOPOLOGY.to_urdf(Self::NAME)
    }

    /// Its topology and dataflow as a picture, in Mermaid or DOT.
    fn graph(format: GraphFormat) -> String {
        graph(format, Self::TOPOLOGY, Self::SENSORS, Self::ESTIMATORS)
    }

    /// Assembles the robot: options may be changed and topics subscribed to before it starts.
    fn builder() -> Builder<Self> {
        Builder::new()
    }
}
