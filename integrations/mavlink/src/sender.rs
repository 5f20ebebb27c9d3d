//! The bridge: estimates and status texts for the flight controller.

mod gps_input;
mod kind;
mod odometry;
mod options;
mod source;
mod source_set;
mod text;

pub use options::MavlinkSenderOptions;

use crate::link::{Identity, Link, Peer};
use bb_core::time::Clock;
use bb_core::{Fault, MonotonicTime, Overflow, Payload, Reading, Service, ServiceContext, Subscription};
use bb_estimators::navigation::state_estimator::FlightEvents;
use kind::Kind;
use mavlink::MessageData;
use mavlink::dialects::ardupilotmega::{COMMAND_ACK_DATA, MavMessage};
use source::{Estimate, Source};
use source_set::{AUTOPILOT, Answer, SourceSet};
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
    /// Set of sources that the flight controller has acknowledged last; 0 before.
    pub source_set: u8,
    /// Sets of sources that it has refused.
    pub source_sets_refused: u64,
}

/// Sends the newest estimate as `GPS_INPUT` or `ODOMETRY`, status texts as `STATUSTEXT`, and heartbeats.
///
/// With a `rate`, it checks at that rate, and sends the newest estimate if it has not been sent yet. Without one, it
/// sends each estimate as it is emitted, at the rate of the estimator's output. If there is no estimate, or it is too
/// old, none is sent.
///
/// With `source_set`, it switches ArduPilot's filter to that set of sources once there are estimates, to `fallback_source_set` while
/// the estimator's fallback is engaged, and back.
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
    source_set: Option<SourceSet>,
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
        let MavlinkSenderOptions { system_id, source_set: estimates, fallback_source_set: fallback, .. } = options;
        let source_set = (estimates > 0).then(|| {
            let autopilot = Peer { system_id, component_id: AUTOPILOT };
            SourceSet::new(link.listen(autopilot, &[COMMAND_ACK_DATA::ID], 8), system_id, estimates, fallback)
        });
        Ok(Self {
            identity: link.identity(options.system_id, options.component_id),
            link,
            source,
            texts,
            kind,
            source_set,
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
        self.switch()?;
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
                self.source_set.iter_mut().for_each(SourceSet::estimate);
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
            self.source_set.iter_mut().for_each(|sets| sets.event(event));
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

    /// Takes answers to the command that switches sources, and sends it if it is due.
    fn switch(&mut self) -> Result<(), Fault> {
        let Some(sets) = &mut self.source_set else { return Ok(()) };
        match sets.answer()? {
            Some(Answer::Acknowledged(set)) => self.sent.source_set = set,
            Some(Answer::Refused(set)) => {
                tracing::warn!(set, "the flight controller refuses this set of sources");
                self.sent.source_sets_refused += 1;
            }
            None => {}
        }
        match sets.command(self.clock.now()) {
            Some(command) => self.send(&command),
            None => Ok(()),
        }
    }

    fn send(&mut self, message: &MavMessage) -> Result<(), Fault> {
        let is_heard = self.link.send(&self.identity, message)?;
        self.sent.unheard += u64::from(!is_heard);
        Ok(())
    }
}
