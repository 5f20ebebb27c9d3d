//! The page's files, and requests that are refused before they are routed.

use crate::client::request;
use crate::protocol::options;
use crate::robot::Cart;
use bb_dashboard::{Dashboard, DashboardOptions};
use std::error::Error;

const FILES: [&str; 6] = ["/", "/style.css", "/app.js", "/views.js", "/plot.js", "/icon.svg"];

#[test]
fn the_page_is_small_and_its_files_forbid_what_it_does_not_need() -> Result<(), Box<dyn Error>> {
    let simulation = Cart::builder().simulate()?;
    let dashboard = Dashboard::serve(&simulation, options())?;
    let (address, port) = (dashboard.address(), dashboard.address().port());
    let mut bytes = 0;
    for path in FILES {
        let (head, body) = request(address, &format!("GET {path} HTTP/1.1\nHost: 127.0.0.1:{port}"))?;
        assert!(head.starts_with("HTTP/1.1 200 OK"), "{path}: {head}");
        for line in [
            "content-security-policy: default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; \
             img-src 'self'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'",
            "x-content-type-options: nosniff",
            "referrer-policy: no-referrer",
            "cache-control: no-store",
            "cross-origin-resource-policy: same-origin",
            "cross-origin-opener-policy: same-origin",
        ] {
            assert!(head.lines().any(|other| other == line), "{path} has no `{line}`: {head}");
        }
        // The page takes nothing from elsewhere, and nothing in it needs what its policy forbids.
        assert!(!body.contains("https://") && !body.contains("innerHTML") && !body.contains("eval("), "{path}");
        bytes += head.len() + body.len();
    }
    assert!(bytes < 1_000_000, "{bytes} bytes");
    Ok(())
}

#[test]
fn other_hosts_and_the_pages_of_other_sites_are_refused() -> Result<(), Box<dyn Error>> {
    let simulation = Cart::builder().simulate()?;
    let dashboard =
        Dashboard::serve(&simulation, DashboardOptions { hosts: "rover.local:80".into(), ..options() })?;
    let (address, port) = (dashboard.address(), dashboard.address().port());
    let upgrade = "Upgrade: websocket\nConnection: Upgrade\nSec-WebSocket-Version: 13\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==";
    let status = |path: &str, headers: &str| -> Result<String, Box<dyn Error>> {
        let (head, _) = request(address, &format!("GET {path} HTTP/1.1\n{headers}"))?;
        Ok(head.split(' ').nth(1).unwrap_or_default().to_owned())
    };
    let host = format!("Host: localhost:{port}");
    for path in FILES.into_iter().chain(["/ws", "/nothing"]) {
        for headers in [
            format!("Host: evil.example:{port}"),
            "Host: localhost".to_owned(),
            format!("{host}\nOrigin: http://evil.example"),
            format!("{host}\nOrigin: http://localhost:{}", port ^ 1),
            format!("{host}\nOrigin: null"),
            format!("{host}\nSec-Fetch-Site: cross-site"),
            format!("Host: evil.example:{port}\nOrigin: http://localhost:{port}\n{upgrade}"),
            format!("{host}\nOrigin: http://evil.example:{port}\n{upgrade}"),
        ] {
            assert_eq!(status(path, &headers)?, "403", "{path}: {headers}");
        }
    }
    assert_eq!(status("/", "Host: rover.local:80\nOrigin: http://rover.local:80")?, "200");
    assert_eq!(status("/nothing", &host)?, "404");
    let own = format!("{host}\nOrigin: http://localhost:{port}\nSec-Fetch-Site: same-origin");
    assert_eq!(status("/app.js", &own)?, "200");
    Ok(())
}
