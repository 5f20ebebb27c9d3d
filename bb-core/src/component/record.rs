//! Requests to estimators as a journal holds them.

use crate::journal::{Request, RequestKind};
use crate::message::Field;
use crate::message::codec::{Reader, Writer};

/// The form of requests of type `Q` in a journal, see [`HandleCall::RECORD`](super::HandleCall::RECORD).
#[derive(Debug)]
pub struct RequestCodec<Q> {
    encode: fn(&Q) -> Vec<u8>,
    decode: fn(&[u8]) -> Option<Q>,
}

impl<Q> Clone for RequestCodec<Q> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<Q> Copy for RequestCodec<Q> {}

impl<Q: Field> RequestCodec<Q> {
    /// Creates a codec of bytes in the layout of payloads.
    pub const fn bytes() -> Self {
        Self {
            encode: |request| {
                let mut bytes = Vec::new();
                request.write(&mut Writer::new(&mut bytes));
                bytes
            },
            decode: |bytes| Q::read(&mut Reader::new(bytes)).ok(),
        }
    }
}

impl<Q> RequestCodec<Q> {
    /// The request as a journal holds it.
    pub(crate) fn record(kind: RequestKind, codec: Option<Self>, request: &Q) -> Request {
        let bytes = codec.map(|codec| (codec.encode)(request));
        Request { kind, name: std::any::type_name::<Q>().to_owned(), bytes }
    }

    pub(crate) fn decode(self, bytes: &[u8]) -> Option<Q> {
        (self.decode)(bytes)
    }
}
