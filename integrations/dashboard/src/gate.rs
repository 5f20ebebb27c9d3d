//! Refuses requests that no page of ours sends: by another host name, as DNS rebinding makes a browser send them, and from the pages of
//! other sites, which may open a WebSocket to any address.

use axum::http::header::{HOST, HeaderName, HeaderValue, ORIGIN};
use axum::http::{HeaderMap, StatusCode};

const SEC_FETCH_SITE: HeaderName = HeaderName::from_static("sec-fetch-site");

/// The exact lists of hosts and origins.
#[derive(Debug)]
pub(crate) struct Gate {
    hosts: Vec<String>,
}

impl Gate {
    /// Accepts the names of the loopback device with this port, and further ones with theirs.
    pub(crate) fn new(port: u16, further: &[String]) -> Self {
        let own = ["127.0.0.1", "localhost", "[::1]"].map(|name| format!("{name}:{port}"));
        Self { hosts: own.into_iter().chain(further.iter().map(|host| host.to_ascii_lowercase())).collect() }
    }

    /// Returns whether it is a name with a port.
    pub(crate) fn is_host(host: &str) -> bool {
        let plain = |name: &str| {
            !name.is_empty()
                && name.chars().all(|letter| letter.is_ascii_alphanumeric() || "-._[]:".contains(letter))
        };
        host.rsplit_once(':').is_some_and(|(name, port)| plain(name) && port.parse::<u16>().is_ok())
    }

    /// Checks the headers of a request.
    ///
    /// # Errors
    /// The reason for which the request is refused.
    pub(crate) fn check(&self, headers: &HeaderMap) -> Result<(), (StatusCode, &'static str)> {
        let mut hosts = headers.get_all(HOST).iter();
        let (host, second) = (hosts.next(), hosts.next());
        if second.is_some() || !host.is_some_and(|host| self.knows(host, "")) {
            return Err((
                StatusCode::FORBIDDEN,
                "this host name is not one of the dashboard's; see its option `hosts`\n",
            ));
        }
        // Programs send no origin.
        if !headers
            .get_all(ORIGIN)
            .iter()
            .all(|origin| self.knows(origin, "http://") || self.knows(origin, "https://"))
        {
            return Err((StatusCode::FORBIDDEN, "pages of other sites may not use this dashboard\n"));
        }
        let site = headers.get(SEC_FETCH_SITE).map(HeaderValue::as_bytes);
        if !matches!(site, None | Some(b"same-origin" | b"none")) {
            return Err((StatusCode::FORBIDDEN, "pages of other sites may not use this dashboard\n"));
        }
        Ok(())
    }

    fn knows(&self, value: &HeaderValue, scheme: &str) -> bool {
        let Ok(value) = value.to_str() else { return false };
        let host = value.strip_prefix(scheme).map(str::to_ascii_lowercase);
        host.is_some_and(|host| self.hosts.contains(&host))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The status of a request with these headers; 0 if it may pass.
    fn status(headers: &[(HeaderName, &'static str)]) -> u16 {
        let gate = Gate::new(8912, &["rover.local:8912".to_owned(), "rover.example:443".to_owned()]);
        let mut map = HeaderMap::new();
        for (name, value) in headers {
            map.append(name, HeaderValue::from_static(value));
        }
        gate.check(&map).map_or_else(|(status, _)| status.as_u16(), |()| 0)
    }

    #[test]
    fn hosts_are_an_exact_list() {
        for host in ["127.0.0.1:8912", "localhost:8912", "[::1]:8912", "rover.local:8912", "ROVER.local:8912"] {
            assert_eq!(status(&[(HOST, host)]), 0, "{host}");
        }
        for host in
            ["evil.example:8912", "127.0.0.1", "127.0.0.1:80", "localhost", "127.0.0.1:8912.evil.example", ""]
        {
            assert_eq!(status(&[(HOST, host)]), 403, "{host}");
        }
        assert_eq!(status(&[]), 403);
        assert_eq!(status(&[(HOST, "localhost:8912"), (HOST, "evil.example")]), 403);
    }

    #[test]
    fn origins_are_those_of_the_hosts() {
        let host = (HOST, "localhost:8912");
        for origin in ["http://localhost:8912", "http://127.0.0.1:8912", "https://rover.example:443"] {
            assert_eq!(status(&[host.clone(), (ORIGIN, origin)]), 0, "{origin}");
        }
        for origin in
            ["http://localhost:8913", "http://evil.example", "null", "", "http://localhost:8912/", "file://"]
        {
            assert_eq!(status(&[host.clone(), (ORIGIN, origin)]), 403, "{origin}");
        }
        assert_eq!(status(&[host.clone(), (SEC_FETCH_SITE, "cross-site")]), 403);
        assert_eq!(status(&[host.clone(), (SEC_FETCH_SITE, "same-site")]), 403);
        assert_eq!(status(&[host.clone(), (SEC_FETCH_SITE, "same-origin")]), 0);
        assert_eq!(status(&[host, (SEC_FETCH_SITE, "none")]), 0);
    }
}
