//! A node on the wire: tokens, publishers, subscriptions and services.

use crate::counts::Repetitions;
use crate::session::{Session, SessionError};
use bb_ros2::{Address, Attachment, Endpoint, EndpointKind, Gid, Node, Qos, Token, TypeError, TypeHash};
use std::fmt::Display;
use std::sync::Arc;
use std::sync::mpsc::{SyncSender, TrySendError};
use std::time::{Duration, SystemTime, UNIX_EPOCH};
use zenoh::Wait;
use zenoh::bytes::ZBytes;
use zenoh::key_expr::keyexpr;
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::{Publisher, Subscriber};
use zenoh::qos::CongestionControl;
use zenoh::query::{Query, Queryable};
use zenoh::sample::Locality;
use zenoh_ext::{AdvancedPublisher, AdvancedPublisherBuilderExt, CacheConfig, MissDetectionConfig};

/// Time between two signs of a latched topic by which its subscriptions see that they have missed the last message.
const HEARTBEAT: Duration = Duration::from_millis(500);

/// Bytes of a request, at most, as of a client of Foxglove: far more than one needs.
const MOST_BYTES: usize = 64 * 1024;

/// A node of ROS 2 in a session, seen by others until it is dropped.
#[derive(Debug)]
pub(crate) struct RosNode {
    session: Session,
    domain: u32,
    node: Node,
    number: u64,
    /// Keys and tokens have the hashes of types, which Humble does not know.
    has_hashes: bool,
    /// Requests that could not be answered.
    unanswered: Arc<Repetitions>,
    _token: LivelinessToken,
}

impl RosNode {
    /// # Errors
    /// The session is closed.
    pub(crate) fn declare(
        session: Session,
        domain: u32,
        node: Node,
        has_hashes: bool,
    ) -> Result<Self, SessionError> {
        let number = session.next_number();
        let token = Token {
            domain,
            session: session.zid().to_string(),
            node_id: number,
            id: number,
            enclave: "/".to_owned(),
            node: node.clone(),
            endpoint: None,
        };
        let token = declare_token(&session, &token.to_string())?;
        Ok(Self { session, domain, node, number, has_hashes, unanswered: Arc::default(), _token: token })
    }

    /// The names of the node.
    pub(crate) fn node(&self) -> &Node {
        &self.node
    }

    /// The session that it is in.
    pub(crate) fn session(&self) -> &Session {
        &self.session
    }

    /// The address as others know it.
    fn announced(&self, address: &Address) -> Address {
        let type_hash = if self.has_hashes { address.type_hash } else { TypeHash::Unsupported };
        Address { type_hash, ..address.clone() }
    }

    /// Declares what others know an endpoint by.
    fn endpoint(
        &self,
        kind: EndpointKind,
        address: &Address,
        qos: Qos,
    ) -> Result<(LivelinessToken, Gid), SessionError> {
        let token = Token {
            domain: self.domain,
            session: self.session.zid().to_string(),
            node_id: self.number,
            id: self.session.next_number(),
            enclave: "/".to_owned(),
            node: self.node.clone(),
            endpoint: Some(Endpoint { kind, address: self.announced(address), qos, backends: None }),
        };
        let token = token.to_string();
        Ok((declare_token(&self.session, &token)?, Gid::of(&token)))
    }

    /// A publisher; with [`Qos::LATCHED`], those who come late get its last message.
    ///
    /// # Errors
    /// The session is closed.
    pub(crate) fn publisher(&self, address: &Address, qos: Qos) -> Result<RosPublisher, SessionError> {
        let key = self.announced(address).key(self.domain);
        let failed = SessionError::of(format!("declaring the publisher of {}", address.name));
        // What is put must arrive: with `Drop`, and with `express`, zenoh loses messages without a word.
        let plain = self.session.declare_publisher(key).congestion_control(CongestionControl::Block).express(false);
        let wire = if qos == Qos::LATCHED {
            let latched = plain
                .sample_miss_detection(MissDetectionConfig::default().heartbeat(HEARTBEAT))
                .cache(CacheConfig::default().max_samples(1))
                .publisher_detection();
            Wire::Latched(Box::new(latched.wait().map_err(failed)?))
        } else {
            Wire::Plain(plain.wait().map_err(failed)?)
        };
        let (token, gid) = self.endpoint(EndpointKind::Publisher, address, qos)?;
        Ok(RosPublisher { wire, name: address.name.clone(), sent: 0, gid, _token: token })
    }

    /// A subscription to what others publish. `receive` gets the bytes of each message on zenoh's thread, and must not wait; `refuse`, the
    /// hash of one whose type is another.
    ///
    /// # Errors
    /// The session is closed.
    pub(crate) fn subscription(
        &self,
        address: &Address,
        receive: impl Fn(Vec<u8>) + Send + Sync + 'static,
        refuse: impl Fn(&str) + Send + Sync + 'static,
    ) -> Result<RosSubscription, SessionError> {
        let hash = address.type_hash.to_string();
        let subscriber = self.session.declare_subscriber(address.key_of_any_hash(self.domain));
        let subscriber = subscriber.allowed_origin(Locality::Remote).callback(move |sample| {
            match other_hash(sample.key_expr(), &hash) {
                None => receive(sample.payload().to_bytes().into_owned()),
                Some(other) => refuse(other),
            }
        });
        let subscriber = subscriber
            .wait()
            .map_err(SessionError::of(format!("declaring the subscription to {}", address.name)))?;
        let (token, _) = self.endpoint(EndpointKind::Subscription, address, Qos::reliable(10))?;
        Ok(RosSubscription { _subscriber: subscriber, _token: token })
    }

    /// A service. `answer` gets each request on zenoh's thread, and must not wait; refused requests go to `refusals`.
    ///
    /// # Errors
    /// The session is closed.
    pub(crate) fn service(
        &self,
        address: &Address,
        refusals: &SyncSender<Refusal>,
        answer: impl Fn(Request) + Send + Sync + 'static,
    ) -> Result<RosService, SessionError> {
        let (hash, name) = (address.type_hash.to_string(), address.name.clone());
        let (refusals, unanswered) = (refusals.clone(), Arc::clone(&self.unanswered));
        let queryable = self.session.declare_queryable(address.key_of_any_hash(self.domain)).complete(true);
        let queryable = queryable.callback(move |query| {
            let (request, size) = Request::take(query, &unanswered, &refusals);
            // A client that waits learns why it does in vain.
            match other_hash(request.query.key_expr(), &hash).map(str::to_owned) {
                _ if size > MOST_BYTES => {
                    request.refuse(format!("a request to {name} has {size} bytes: send at most {MOST_BYTES}"));
                }
                None => answer(request),
                Some(other) => request.refuse(format!("the type of the service is {hash}, not {other}")),
            }
        });
        let queryable =
            queryable.wait().map_err(SessionError::of(format!("declaring the service {}", address.name)))?;
        let (token, _) = self.endpoint(EndpointKind::Service, address, Qos::reliable(10))?;
        Ok(RosService { _queryable: queryable, _token: token })
    }
}

/// An address by the texts of its type.
pub(crate) fn address(name: String, type_name: &str, type_hash: &str) -> Result<Address, TypeError> {
    Ok(Address { name, type_name: type_name.parse()?, type_hash: type_hash.parse()? })
}

fn declare_token(session: &Session, token: &str) -> Result<LivelinessToken, SessionError> {
    let declared = session.liveliness().declare_token(token.to_owned()).wait();
    declared.map_err(SessionError::of(format!("declaring the token {token}")))
}

/// The hash at the end of a key, if it is another than ours; the key if it has wildcards, as of one who asks for all that there is: each service
/// would take that for a request. Humble has none.
fn other_hash<'a>(key: &'a keyexpr, ours: &str) -> Option<&'a str> {
    let (_, theirs) = key.as_str().rsplit_once('/').filter(|_| !key.is_wild()).unwrap_or(("", key));
    (theirs != ours && theirs != TypeHash::Unsupported.to_string()).then_some(theirs)
}

/// The time now as attachments have it, in nanoseconds since the Unix epoch.
fn wall_ns() -> i64 {
    SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .map_or(0, |since| i64::try_from(since.as_nanos()).unwrap_or(i64::MAX))
}

/// A publisher.
pub(crate) struct RosPublisher {
    wire: Wire,
    name: String,
    sent: i64,
    gid: Gid,
    _token: LivelinessToken,
}

enum Wire {
    Plain(Publisher<'static>),
    Latched(Box<AdvancedPublisher<'static>>),
}

impl RosPublisher {
    /// Puts a message in CDR. Waits while a subscriber does not keep up, at most until zenoh closes its link.
    ///
    /// # Errors
    /// The session is closed.
    pub(crate) fn put(&mut self, message: Vec<u8>) -> Result<(), SessionError> {
        self.sent += 1;
        let attachment = Attachment { sequence: self.sent, time_ns: wall_ns(), gid: self.gid }.to_bytes();
        let put = match &self.wire {
            Wire::Plain(publisher) => publisher.put(message).attachment(attachment.as_slice()).wait(),
            Wire::Latched(publisher) => publisher.put(message).attachment(attachment.as_slice()).wait(),
        };
        put.map_err(SessionError::of(format!("publishing at {}", self.name)))
    }
}

/// A subscription, until it is dropped.
#[derive(Debug)]
pub(crate) struct RosSubscription {
    _subscriber: Subscriber<()>,
    _token: LivelinessToken,
}

/// A service, until it is dropped.
#[derive(Debug)]
pub(crate) struct RosService {
    _queryable: Queryable<()>,
    _token: LivelinessToken,
}

/// A request to a service, which a client waits for.
#[derive(Debug)]
pub(crate) struct Request {
    /// Without its contents.
    query: Query,
    bytes: Vec<u8>,
    attachment: Option<Attachment>,
    unanswered: Arc<Repetitions>,
    refusals: SyncSender<Refusal>,
}

/// A request that is refused, and the reason.
#[derive(Debug)]
pub(crate) struct Refusal(Request, String);

impl Refusal {
    /// Tells the client, and waits for the network.
    pub(crate) fn tell(self) {
        let Self(request, why) = self;
        request.replied(request.query.reply_err(why).wait());
    }
}

impl Request {
    /// Takes the contents out of a query, whose buffers may be those of more than it, and returns the number of bytes that came. What is too
    /// long is not kept.
    fn take(mut query: Query, unanswered: &Arc<Repetitions>, refusals: &SyncSender<Refusal>) -> (Self, usize) {
        let payload = query.payload_mut().map(std::mem::take).unwrap_or_default();
        let attachment = query.attachment_mut().map(std::mem::take);
        let more = query.key_expr().as_str().len() + query.parameters().as_str().len();
        let size = payload.len() + attachment.as_ref().map_or(0, ZBytes::len) + more;
        let is_kept = size <= MOST_BYTES;
        let request = Self {
            query,
            bytes: if is_kept { payload.to_bytes().into_owned() } else { Vec::new() },
            attachment: attachment
                .filter(|_| is_kept)
                .and_then(|bytes| Attachment::from_bytes(&bytes.to_bytes()).ok()),
            unanswered: Arc::clone(unanswered),
            refusals: refusals.clone(),
        };
        (request, size)
    }

    /// The request in CDR.
    pub(crate) fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// The client, if it says who it is.
    pub(crate) fn client(&self) -> Option<Gid> {
        self.attachment.map(|attachment| attachment.gid)
    }

    /// Answers. A client of ROS finds its request by the number; one that gave none gets none.
    pub(crate) fn answer(&self, response: Vec<u8>) {
        let attachment = self.attachment.map(|asked| Attachment { time_ns: wall_ns(), ..asked }.to_bytes());
        let mut reply = self.query.reply(self.query.key_expr().clone(), response);
        if let Some(attachment) = attachment {
            reply = reply.attachment(attachment.as_slice());
        }
        self.replied(reply.wait());
    }

    /// Refuses it without waiting: zenoh's threads, which receive for all clients, must not wait for one that does not read. Only the end of a
    /// request that comes while too many wait to be refused is sent by the calling thread.
    pub(crate) fn refuse(self, why: impl Into<String>) {
        let refusals = self.refusals.clone();
        if let Err(TrySendError::Full(Refusal(request, _))) = refusals.try_send(Refusal(self, why.into())) {
            request.unanswered("too many are to be told that they are refused");
        }
    }

    fn replied(&self, result: zenoh::Result<()>) {
        if let Err(error) = result {
            self.unanswered(error);
        }
    }

    fn unanswered(&self, error: impl Display) {
        if let Some(times) = self.unanswered.add() {
            tracing::warn!(%error, times, service = %self.query.key_expr(), "a client was not answered");
        }
    }
}
