//! The options of the bridge.

use crate::session::{Mode, SessionSettings, list};
use bb_core::event::{Right, Rights};
use bb_core::{Fault, Options};

/// The endpoint at which nodes of ROS expect a router.
const ROUTER: &str = "tcp/127.0.0.1:7447";

/// Options of [`Ros2Bridge`](crate::Ros2Bridge). Lists are separated by spaces.
#[derive(Clone, Debug, Options)]
pub struct Ros2Options {
    /// Namespace of the node: `/`, or one such as `/site`.
    #[option(default = "/")]
    pub namespace: String,
    /// Name of the node; empty for that of the robot in small letters.
    #[option(default = "")]
    pub node: String,
    /// `ROS_DOMAIN_ID`.
    #[option(default = 0)]
    pub domain: u32,
    /// `true` for hashes of types in keys and tokens, as ROS writes them since Iron. Nodes of Humble have none, and hear only what has none.
    #[option(default = true)]
    pub hashes: bool,
    /// Paths that are published, each with all below it. Empty for all that ROS has a message for; a path that is named is published even if it
    /// has none, with a type of `bb_msgs`.
    #[option(default = "")]
    pub publish: String,
    /// Paths of inputs that other nodes publish to: sensors declared as `External`, `external` inputs of estimators, and paths with a known
    /// payload. Every program that reaches the session can then publish there, as a sensor would, so there are none by default.
    #[option(default = "")]
    pub subscribe: String,
    /// Rights of other nodes, of `parameters`, `commands`, `arm` and `actuators`. All may disarm.
    #[option(default = "parameters commands")]
    pub rights: String,
    /// Endpoints of zenoh to connect to, such as that of a router: `tcp/192.168.1.2:7447`. A client takes the first that answers.
    #[option(default = "")]
    pub connect: String,
    /// Endpoints to listen on. Empty for the loopback device, where nodes of ROS look for a router; or for none, if it connects to one.
    #[option(default = "")]
    pub listen: String,
    /// `router`, so that nodes that know the robot alone hear each other, `client` of a router, or `peer`. Empty for a router, or for a client if
    /// it connects to one and listens nowhere.
    #[option(default = "")]
    pub mode: String,
    /// A file of zenoh's configuration, in JSON5, that goes before all else: certificates, users and rights.
    #[option(default = "")]
    pub config: String,
}

impl Ros2Options {
    /// The settings of its session.
    pub(crate) fn session(&self) -> Result<SessionSettings, Fault> {
        let connect = list(&self.connect);
        let has_router = !connect.is_empty();
        let listen = match list(&self.listen) {
            listen if listen.is_empty() && !has_router => vec![ROUTER.to_owned()],
            listen => listen,
        };
        let mode = match self.mode.as_str() {
            "" if listen.is_empty() => Mode::Client,
            "" | "router" => Mode::Router,
            "client" => Mode::Client,
            "peer" => Mode::Peer,
            other => return Err(Fault::new(format!("`mode` is `{other}`: expected `router`, `client` or `peer`"))),
        };
        let file = (!self.config.is_empty()).then(|| self.config.clone().into());
        Ok(SessionSettings { mode, listen, connect, file })
    }

    /// The rights of other nodes, with those that the bridge needs itself.
    pub(crate) fn node_rights(&self) -> Result<Rights, Fault> {
        Rights::parse(&self.rights, &[Right::Parameters, Right::Commands, Right::Arm, Right::Actuators])
    }

    /// The paths to publish; none for all that ROS has a message for.
    pub(crate) fn published(&self) -> Vec<String> {
        list(&self.publish)
    }

    /// The paths of the inputs.
    pub(crate) fn subscribed(&self) -> Vec<String> {
        list(&self.subscribe)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(change: impl FnOnce(&mut Ros2Options)) -> Result<SessionSettings, String> {
        let mut options = Ros2Options::defaults();
        change(&mut options);
        options.session().map_err(|error| error.to_string())
    }

    #[test]
    fn it_is_a_router_on_the_loopback_device_unless_it_connects_to_one() {
        let alone = settings(|_| ()).expect("they are valid");
        assert_eq!((alone.mode, alone.listen), (Mode::Router, vec![ROUTER.to_owned()]));
        let connected = settings(|options| options.connect = "tcp/192.0.2.1:7447".into()).expect("they are valid");
        assert_eq!((connected.mode, connected.listen.len(), connected.connect.len()), (Mode::Client, 0, 1));
        let both = settings(|options| {
            options.connect = "tcp/192.0.2.1:7447".into();
            options.listen = "tcp/127.0.0.1:0".into();
        });
        assert_eq!(both.map(|both| (both.mode, both.listen.len())), Ok((Mode::Router, 1)));
        let wrong = settings(|options| options.mode = "bridge".into());
        assert_eq!(wrong, Err("`mode` is `bridge`: expected `router`, `client` or `peer`".to_owned()));
    }

    #[test]
    fn other_nodes_neither_arm_nor_publish_unless_they_may() {
        let rights = Ros2Options::defaults().node_rights().expect("they are valid");
        let given = Right::ALL.into_iter().filter(|right| rights.contains(*right)).map(Right::name);
        assert_eq!(given.collect::<Vec<_>>(), ["read", "parameters", "commands"]);
        let options = Ros2Options { rights: "arm publish".into(), ..Ros2Options::defaults() };
        let error = options.node_rights().expect_err("a topic is named by `subscribe`").to_string();
        assert_eq!(error, "`rights` has `publish`: expected `parameters`, `commands`, `arm`, `actuators`");
    }
}
