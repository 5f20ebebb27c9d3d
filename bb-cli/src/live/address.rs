//! The address of a dashboard, as it prints it.

use std::fmt;
use std::str::FromStr;

/// Host and port, and the token if there is one.
#[derive(Clone, PartialEq, Eq)]
pub(super) struct Address {
    /// `127.0.0.1:8912`
    pub(super) host: String,
    pub(super) token: Option<String>,
}

impl Default for Address {
    fn default() -> Self {
        Self { host: "127.0.0.1:8912".to_owned(), token: None }
    }
}

impl FromStr for Address {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let expected = || format!("expected an address such as http://127.0.0.1:8912/#token=…, found `{text}`");
        if text.starts_with("https://") {
            return Err("`bb` does not speak https: use an address of this machine, as by `ssh -L`".to_owned());
        }
        let rest = text.strip_prefix("http://").unwrap_or(text);
        let (rest, token) = match rest.split_once("#token=") {
            Some((rest, token)) => (rest, Some(token.to_owned())),
            None => (rest, None),
        };
        let host = rest.trim_end_matches('/');
        let (name, port) = host.rsplit_once(':').unwrap_or((host, "8912"));
        let is_plain = |letter: char| letter.is_ascii_alphanumeric() || "-._[]:".contains(letter);
        if name.is_empty() || !name.chars().all(is_plain) || port.parse::<u16>().is_err() {
            return Err(expected());
        }
        if token.as_ref().is_some_and(|token| token.is_empty()) {
            return Err(expected());
        }
        Ok(Self { host: format!("{name}:{port}"), token })
    }
}

impl fmt::Debug for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Without the token, which must not end up in a log.
        f.debug_tuple("Address").field(&self.host).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_those_that_a_dashboard_prints_and_shorter_ones() {
        let of = |host: &str, token: Option<&str>| {
            Ok(Address { host: host.to_owned(), token: token.map(str::to_owned) })
        };
        assert_eq!("http://127.0.0.1:8912/#token=ab".parse::<Address>(), of("127.0.0.1:8912", Some("ab")));
        assert_eq!("http://[::1]:80/".parse::<Address>(), of("[::1]:80", None));
        assert_eq!("rover.local".parse::<Address>(), of("rover.local:8912", None));
        for wrong in
            ["", "http://", "a b:1", "rover:port", "http://rover:1/path", "rover:1#token=", "https://rover:1"]
        {
            assert!(wrong.parse::<Address>().is_err(), "{wrong}");
        }
        assert!(!format!("{:?}", "a:1#token=secret".parse::<Address>()).contains("secret"));
    }
}
