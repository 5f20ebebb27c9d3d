//! The bridge: estimates and status texts for the flight controller.

mod gps_input;
mod kind;
mod odometry;
mod options;
mod source;
mod text;

pub use options::MavlinkSenderOptions;

use crate::link::{Identity, Link};
use bb_core::time::Clock;
use bb_core::{Fault, MonotonicTime, Overflow, Payload, Reading, Service, ServiceContext, Subscription};
use bb_estimators::navigation::state_estimator::FlightEvents;
use kind::Kind;
use mavlink::dialects::common::MavMessage;
use source::{Estimate, Source};
use std::sync::Arc;
use std::time::Duration;

/// Time for which an update without a rate waits.
const WAIT: Duration = Duration::from_millis(50);

/// Counts of a [`MavlinkSender`] since its start; published with each change.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Payload)]
pub struct MavlinkSent {
    /// Estimates sent.
    pub estimates: u64,
    /// Estimates that were too old to be sent.
    pub stale: u64,
    /// Estimates with a value that is not finite or not on the Earth.
    pub refused: u64,
    /// Status texts sent, each in one or several messages.
    pub texts: u64,
    /// Messages without a known receiver.
    pub unheard: u64,
}

/// Sends the newest estimate as `GPS_INPUT` or `ODOMETRY`, status texts as `STATUSTEXT`, and heartbeats.
///
/// With a `rate`, it checks at that rate, and sends the newest estimate if it has not been sent yet. Without one, it
/// sends each estimate as it is emitted, at the rate of the estimator's output. If there is no estimate, or it is too
/// old, none is sent.
///
/// `GPS_INPUT` takes the [`FlightEstimate`](bb_estimators::navigation::state_estimator::FlightEstimate) of the state estimator;
/// `ODOMETRY` takes that, or [`Odometry`](bb_core::payload::Odometry) of any estimator.
#[derive(Debug)]
pub struct MavlinkSender {
    link: Link,
    identity: Arc<Identity>,
    source: Source,
    texts: Option<Subscription<FlightEvents>>,
    kind: Kind,
    max_age_s: f64,
    clock: Clock,
    /// `true` if it has a rate, and so must not wait.
    is_paced: bool,
    sent: MavlinkSent,
    /// Number of the last text that was sent in several messages.
    text_id: u16,
}

impl Service for MavlinkSender {
    type Options = MavlinkSenderOptions;
    type Output = MavlinkSent;

    fn init(options: MavlinkSenderOptions, context: &ServiceContext) -> Result<Self, Fault> {
        let kind = options.kind()?;
        let bus = context.bus();
        let source = Source::subscribe(&bus, &options.source, kind.takes_odometry())?;
        let texts = match options.texts.as_str() {
            "" => None,
            path => Some(bus.subscribe(path, Overflow::default())?.matched()?),
        };
        let link = Link::open(&options.link)?;
        Ok(Self {
            identity: link.identity(options.system_id, options.component_id),
            link,
            source,
            texts,
            kind,
            max_age_s: options.max_age.as_secs_f64(),
            clock: context.clock().clone(),
            is_paced: context.period_s().is_some() || context.clock().is_virtual(),
            sent: MavlinkSent::default(),
            text_id: 0,
        })
    }

    fn update(&mut self, _: MonotonicTime) -> Result<Reading<MavlinkSent>, Fault> {
        // Heartbeats depend on it even when there is nothing to send.
        self.link.check()?;
        let before = self.sent;
        let newest = if self.is_paced { self.source.newest() } else { self.source.wait(WAIT) };
        self.send_texts()?;
        if let Some(estimate) = newest {
            self.send_estimate(&estimate)?;
        }
        Ok(if self.sent == before { Reading::nothing() } else { Reading::now(self.sent) })
    }
}

impl MavlinkSender {
    fn send_estimate(&mut self, estimate: &Estimate) -> Result<(), Fault> {
        let time = estimate.time();
        let age_s = self.clock.now().seconds_since(time);
        if age_s > self.max_age_s {
            self.sent.stale += 1;
            return Ok(());
        }
        let wall = self.clock.wall_at(time);
        match self.kind.message(estimate, wall) {
            Some(message) => {
                self.send(&message)?;
                self.sent.estimates += 1;
            }
            None => self.sent.refused += 1,
        }
        Ok(())
    }

    fn send_texts(&mut self) -> Result<(), Fault> {
        let Some(texts) = &self.texts else { return Ok(()) };
        let messages: Vec<_> = texts.drain().collect();
        let events = messages.iter().flat_map(|message| &message.payload.events);
        for event in events {
            let Some(text) = &event.status_text else { continue };
            let severity = text::severity(event);
            let chunks = text::chunks(severity, text, &mut self.text_id);
            for chunk in chunks {
                self.send(&MavMessage::STATUSTEXT(chunk))?;
            }
            self.sent.texts += 1;
        }
        Ok(())
    }

    fn send(&mut self, message: &MavMessage) -> Result<(), Fault> {
        let is_heard = self.link.send(&self.identity, message)?;
        self.sent.unheard += u64::from(!is_heard);
        Ok(())
    }
}
