//! The address of the other side.

use std::fmt;
use std::str::FromStr;

/// The address of the other side, in the notation of the crate `mavlink` and most ground stations.
///
/// ```
/// use bb_mavlink::Address;
///
/// let address: Address = "udpin:0.0.0.0:14550".parse()?;
/// assert_eq!(address, Address::UdpIn { local: "0.0.0.0:14550".into() });
/// assert_eq!(address.to_string(), "udpin:0.0.0.0:14550");
/// # Ok::<(), bb_mavlink::AddressError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Address {
    /// `udpin:HOST:PORT`: listens there, and answers the sender of the newest frame from a system and component that a driver listens
    /// to, or from any if there are no drivers.
    UdpIn {
        /// Address of this machine, and port.
        local: String,
    },
    /// `udpout:HOST:PORT`: sends there, and receives only from that peer, which learns our address from our
    /// heartbeats.
    UdpOut {
        /// Host and port of the peer.
        remote: String,
    },
    /// `serial:DEVICE:BAUD`. Needs the feature `serial`.
    Serial {
        /// Device file, such as `/dev/serial/by-id/usb-…`.
        port: String,
        /// Symbols a second.
        baud: u32,
    },
}

/// Reason for which a string is not an [`Address`].
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the link `{text}` {reason}; write `udpin:HOST:PORT`, `udpout:HOST:PORT` or `serial:DEVICE:BAUD`")]
pub struct AddressError {
    text: String,
    reason: &'static str,
}

impl FromStr for Address {
    type Err = AddressError;

    fn from_str(text: &str) -> Result<Self, AddressError> {
        let malformed = |reason| AddressError { text: text.to_owned(), reason };
        let (scheme, rest) = text.split_once(':').ok_or_else(|| malformed("names no kind of connection"))?;
        match scheme {
            "udpin" => Ok(Self::UdpIn { local: socket(rest).map_err(malformed)? }),
            "udpout" => Ok(Self::UdpOut { remote: socket(rest).map_err(malformed)? }),
            "serial" => {
                // A device may have colons in its name.
                let (port, baud) = rest.rsplit_once(':').ok_or_else(|| malformed("has no baud rate"))?;
                let baud = baud.parse().ok().filter(|baud| *baud > 0);
                match (port, baud) {
                    ("", _) => Err(malformed("names no device")),
                    (_, None) => Err(malformed("has no baud rate that is a positive number")),
                    (port, Some(baud)) => Ok(Self::Serial { port: port.to_owned(), baud }),
                }
            }
            _ => Err(malformed("has an unknown kind of connection")),
        }
    }
}

/// Checks a `HOST:PORT`, whose host may be an IPv6 address in brackets.
fn socket(text: &str) -> Result<String, &'static str> {
    let (host, port) = text.rsplit_once(':').ok_or("has no port")?;
    if host.is_empty() {
        return Err("names no host");
    }
    if port.parse::<u16>().is_err() {
        return Err("has a port that is not a number up to 65535");
    }
    Ok(text.to_owned())
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::UdpIn { local } => write!(f, "udpin:{local}"),
            Self::UdpOut { remote } => write!(f, "udpout:{remote}"),
            Self::Serial { port, baud } => write!(f, "serial:{port}:{baud}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bb_tests::laws;
    use proptest::prelude::*;

    #[test]
    fn addresses_are_read_and_written() {
        for text in ["udpin:0.0.0.0:14550", "udpout:[::1]:0", "serial:/dev/ttyACM0:57600", "serial:COM3:115200"] {
            assert_eq!(text.parse::<Address>().map(|address| address.to_string()), Ok(text.to_owned()));
        }
    }

    #[test]
    fn each_mistake_has_its_message() {
        let rows = [
            ("", "names no kind of connection"),
            ("14550", "names no kind of connection"),
            ("tcp:127.0.0.1:5760", "has an unknown kind of connection"),
            ("udpin:14550", "has no port"),
            ("udpin::14550", "names no host"),
            ("udpout:127.0.0.1:70000", "has a port that is not a number up to 65535"),
            ("serial:/dev/ttyACM0", "has no baud rate"),
            ("serial:/dev/ttyACM0:0", "has no baud rate that is a positive number"),
            ("serial::57600", "names no device"),
        ];
        for (text, reason) in rows {
            let expected = format!(
                "the link `{text}` {reason}; write `udpin:HOST:PORT`, `udpout:HOST:PORT` or `serial:DEVICE:BAUD`"
            );
            assert_eq!(text.parse::<Address>().map_err(|error| error.to_string()), Err(expected));
        }
    }

    laws! {
        #[test]
        fn what_is_written_is_read_alike(text in "(udpin|udpout|serial)?:?[a-z/.:0-9]{0,20}") {
            if let Ok(address) = text.parse::<Address>() {
                prop_assert_eq!(address.to_string().parse(), Ok(address));
            }
        }
    }
}
