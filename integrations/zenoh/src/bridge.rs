//! The bridge: a running robot as a node of ROS 2.

use crate::clients::Clients;
use crate::counts::{Counts, Ros2State};
use crate::error::Ros2Error;
use crate::inputs::Inputs;
use crate::node::RosNode;
use crate::options::Ros2Options;
use crate::outputs::Outputs;
use crate::services::Services;
use crate::session::Session;
use bb_core::component::StateReport;
use bb_core::event::Right;
use bb_core::{Bus, Fault, MonotonicTime, Reading, Service, ServiceContext};
use bb_ros2::Node;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};

/// Name of the thread that publishes.
const OUT: &str = "ros2 out";

/// A running robot as a node of ROS 2, until it is dropped.
///
/// ```no_run
/// use bb_core::prelude::*;
/// use bb_zenoh::{Ros2Bridge, Ros2Options};
/// # use bb_core::Options;
///
/// robot! { robot Rover; link base { sensor imu: External<Imu>(); } }
///
/// fn main() -> Result<(), Box<dyn std::error::Error>> {
///     let running = Rover::builder().start()?;
///     let node = Ros2Bridge::serve(&running, Ros2Options::defaults())?;
///     println!("{} at {}", node.node(), node.endpoints().join(" "));
///     // `Running::wait` waits for sensors and bridges of the robot, of which this one has none that run.
///     loop {
///         std::thread::park();
///     }
/// }
/// ```
///
/// Or as a line of the robot: `bridges { bridge ros2: Ros2Bridge(); }`.
///
/// Publishing in the robot does not wait for the network: a thread of the bridge reads a bounded queue, and messages that do not fit are
/// counted. Dropping the bridge waits for the messages in that queue, and for requests that have begun, at most for seconds.
#[derive(Debug)]
pub struct Ros2Bridge {
    // In this order: what others see of it ends first, and the session last.
    services: Services,
    inputs: Inputs,
    out: Out,
    counts: Arc<Counts>,
    node: Arc<RosNode>,
    /// Ends what was begun in the name of other nodes.
    bus: bb_core::component::Session,
    report: StateReport<Ros2State>,
}

impl Ros2Bridge {
    /// Makes a robot a node. A [`Running`](bb_core::Running) robot, a [`Simulation`](bb_core::Simulation) and their handles dereference to a
    /// [`Bus`]; other nodes have at most its rights.
    ///
    /// # Errors
    /// An option has an unusable value, an endpoint to listen on is in use, or nothing can be published or subscribed at one of the paths.
    pub fn serve(robot: &Bus, options: Ros2Options) -> Result<Self, Ros2Error> {
        let settings = options.session().map_err(Ros2Error::Options)?;
        let rights = options.node_rights().map_err(Ros2Error::Options)?;
        let description = robot.description();
        let node = match options.node.as_str() {
            "" => Node::of_robot(&options.namespace, description.robot)?,
            name => Node::new(&options.namespace, name)?,
        };
        let session = Session::open(&settings)?;
        let node = Arc::new(RosNode::declare(session, options.domain, node, options.hashes)?);
        let bus = robot.session("ros2", bb_core::event::Rights::ALL);
        let counts = Arc::<Counts>::default();
        let subscribed = options.subscribed();
        let inputs =
            Inputs::start(&bus.for_caller("ros2", [Right::Publish]), &node, &description, &subscribed, &counts)?;
        let outputs = Outputs::declare(
            &bus.for_caller("ros2", [Right::Read]),
            &node,
            &description,
            &options.published(),
            &subscribed,
            &counts,
        )?;
        let out = Out::start(outputs)?;
        let clients = Clients::watch(&bus.for_caller("ros2", rights), &node, options.domain)?;
        let services = Services::start(&node, clients, &description, &counts)?;
        Ok(Self { services, inputs, out, counts, node, bus, report: StateReport::default() })
    }

    /// The full name of the node: `/rover`.
    pub fn node(&self) -> String {
        self.node.node().full_name()
    }

    /// The endpoints at which the session is reached.
    pub fn endpoints(&self) -> Vec<String> {
        use zenoh::Wait;
        self.node.session().info().locators().wait().iter().map(ToString::to_string).collect()
    }

    /// The numbers of messages and requests so far.
    pub fn state(&self) -> Ros2State {
        self.counts.state()
    }
}

impl Drop for Ros2Bridge {
    fn drop(&mut self) {
        self.services.stop();
        self.inputs.stop();
        self.out.stop();
        self.bus.end();
    }
}

/// The thread that publishes, until it is dropped: also if the bridge fails to start after it.
#[derive(Debug)]
struct Out {
    is_over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Out {
    fn start(outputs: Outputs) -> Result<Self, Ros2Error> {
        let is_over = Arc::<AtomicBool>::default();
        let over = Arc::clone(&is_over);
        let thread = thread::Builder::new().name(OUT.into()).spawn(move || outputs.run(&over));
        Ok(Self { is_over, thread: Some(thread.map_err(Ros2Error::Thread)?) })
    }

    fn stop(&mut self) {
        self.is_over.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            // Its panic was printed.
            let _ = thread.join();
        }
    }
}

impl Drop for Out {
    fn drop(&mut self) {
        self.stop();
    }
}

impl Service for Ros2Bridge {
    type Options = Ros2Options;
    type Output = Ros2State;

    fn init(options: Ros2Options, context: &ServiceContext) -> Result<Self, Fault> {
        let mut bridge = Self::serve(&context.bus(), options).map_err(|error| Fault::new(error.to_string()))?;
        bridge.report = StateReport::new(context);
        Ok(bridge)
    }

    fn update(&mut self, _: MonotonicTime) -> Result<Reading<Ros2State>, Fault> {
        let state = self.state();
        Ok(self.report.update(state))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bb_core::prelude::*;

    /// Arguments.
    #[derive(Clone, Debug, Default, PartialEq, Payload)]
    struct Number {
        value: f64,
    }

    /// Does nothing.
    struct Rest;

    impl Command for Rest {
        type Options = NoOptions;
        type Arguments = Number;
        type Output = ();

        async fn run(_: NoOptions, _: Number, _: CommandContext) -> Result<Outcome<()>, Fault> {
            Ok(Outcome::done(()))
        }
    }

    robot! {
        robot Odd;
        commands { _1: Rest; }
        link base;
    }

    /// The type of the command's service has no valid name, which shows when the thread that publishes runs.
    #[test]
    fn a_bridge_that_fails_to_start_late_leaves_no_thread() {
        let robot = Odd::builder().simulate().expect("it starts");
        let options = Ros2Options { listen: "tcp/127.0.0.1:0".into(), ..bb_core::Options::defaults() };
        let error = Ros2Bridge::serve(&robot, options).map(|_| ()).expect_err("the name is invalid").to_string();
        assert!(error.contains("bb_msgs/srv/1"), "{error}");
        let threads = std::fs::read_dir("/proc/self/task").expect("it is Linux").flatten();
        let names = threads.filter_map(|thread| std::fs::read_to_string(thread.path().join("comm")).ok());
        assert_eq!(names.filter(|name| name.trim() == OUT).count(), 0);
    }
}
