//! The page's files, and requests that are refused before they are routed.

use crate::client::{Client, request, token};
use crate::protocol::options;
use crate::robot::Cart;
use crate::robot::shaped::Shaped;
use bb_dashboard::{Dashboard, DashboardOptions};
use serde_json::json;
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
        // A cookie would be sent for the pages of other sites too.
        assert!(!head.to_ascii_lowercase().contains("set-cookie"), "{path}: {head}");
        // The page takes nothing from elsewhere, and nothing in it needs what its policy forbids.
        assert!(!body.contains("https://") && !body.contains("innerHTML") && !body.contains("eval("), "{path}");
        bytes += head.len() + body.len();
    }
    assert!(bytes < 1_000_000, "{bytes} bytes");
    Ok(())
}

/// Meshes that the robot names are served from the folder, to all who may read; nothing else of it is.
#[test]
fn meshes_come_from_the_named_folder_alone() -> Result<(), Box<dyn Error>> {
    let simulation = Shaped::builder().simulate()?;
    let meshes = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/live/meshes").to_owned();
    let dashboard = Dashboard::serve(&simulation, DashboardOptions { meshes: meshes.clone(), ..options() })?;
    let get = |dashboard: &Dashboard, path: &str, header: &str| {
        let address = dashboard.address();
        request(address, &format!("GET {path} HTTP/1.1\nHost: 127.0.0.1:{}{header}", address.port()))
    };
    let welcome = Client::reading(&dashboard)?.welcome;
    assert_eq!(welcome["meshes"], json!({"package://shaped/dish.stl": "/mesh/0"}));
    let (head, body) = get(&dashboard, "/mesh/0", "")?;
    assert!(head.starts_with("HTTP/1.1 200 OK") && head.contains("content-type: model/stl"), "{head}");
    assert_eq!(body, std::fs::read_to_string(format!("{meshes}/dish.stl"))?);
    for path in ["/mesh/1", "/mesh/", "/mesh/dish.stl", "/mesh/-1", "/mesh/..%2fmain.rs", "/mesh/0/../../main.rs"] {
        let (head, _) = get(&dashboard, path, "")?;
        assert!(head.starts_with("HTTP/1.1 4"), "{path}: {head}");
    }
    let read = "token".to_owned();
    let closed = Dashboard::serve(&simulation, DashboardOptions { meshes, read, ..options() })?;
    for (header, status) in [
        (String::new(), "401"),
        ("\nAuthorization: Bearer 0".to_owned(), "401"),
        (format!("\nAuthorization: Bearer {}", token(&closed)), "200"),
    ] {
        let (head, _) = get(&closed, "/mesh/0", &header)?;
        assert_eq!(head.split(' ').nth(1), Some(status), "{head}");
    }
    let wrong = Dashboard::serve(&simulation, DashboardOptions { meshes: "/no/such/folder".into(), ..options() });
    assert!(wrong.unwrap_err().to_string().ends_with("expected a folder with the files of meshes"));
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
