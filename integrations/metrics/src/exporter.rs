//! The handle for users: a running robot, and its counts as text.

use crate::collector::Counts;
use crate::server::{ServeError, Server};
use bb_core::{Live, Robot};
use prometheus_client::encoding::text::encode;
use prometheus_client::registry::Registry;
use std::fmt;
use std::marker::PhantomData;
use std::net::ToSocketAddrs;

/// The counts of a running robot. They stay readable after the robot has stopped.
pub struct Exporter<R: Robot> {
    registry: Registry,
    robot: PhantomData<fn() -> R>,
}

impl<R: Robot> Exporter<R> {
    /// `live` comes from `live()` of the running robot.
    pub fn new(live: Live<R>) -> Self {
        let labels = [("robot".into(), R::NAME.into())];
        let mut registry = Registry::with_prefix_and_labels("bb", labels.into_iter());
        registry.register_collector(Box::new(Counts(live)));
        Self { registry, robot: PhantomData }
    }

    /// All counts as they are now, in the text format of OpenMetrics 1.0.
    pub fn render(&self) -> String {
        let mut text = String::new();
        // Writing to a string cannot fail. A truncated text would lack its `# EOF`, and be refused by its reader.
        let _ = encode(&mut text, &self.registry);
        text
    }

    /// Answers `GET /metrics` at `address`, `"127.0.0.1:9464"` say, on a thread of its own, until the server is
    /// dropped. With port 0 the system chooses one; [`Server::address`] tells which.
    ///
    /// There is no encryption and no password: everyone who reaches the address can read the counts. At the loopback device, requests by another
    /// host name than its own are refused, so that pages of other sites cannot read them in a browser.
    ///
    /// # Errors
    /// The address cannot be resolved or is taken.
    pub fn serve(self, address: impl ToSocketAddrs + fmt::Display) -> Result<Server, ServeError> {
        Server::start(address, Box::new(move || self.render()))
    }
}

impl<R: Robot> fmt::Debug for Exporter<R> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Exporter").field(&R::NAME).finish()
    }
}
