//! The settings of a bridge.

use bb_core::event::{Right, Rights};
use bb_core::{Fault, Options};

/// Options of [`Foxglove`](crate::Foxglove). Lists are separated by spaces.
#[derive(Clone, Debug, Options)]
pub struct FoxgloveOptions {
    /// Port on the loopback device, the only one it listens on; 0 lets the system choose.
    #[option(default = 8765)]
    pub port: u16,
    /// Origins of the pages that may connect, such as `http://localhost:8080` for a viewer served there. Programs, which have no origin,
    /// always may. Default: Foxglove in the browser.
    #[option(default = "https://app.foxglove.dev")]
    pub origins: String,
    /// Rights of all clients besides reading topics and disarming: `parameters`, `commands`, `arm`. Default: none.
    #[option(default = "")]
    pub rights: String,
}

impl FoxgloveOptions {
    pub(crate) fn client_rights(&self) -> Result<Rights, Fault> {
        Rights::parse(&self.rights, &[Right::Parameters, Right::Commands, Right::Arm])
    }

    pub(crate) fn page_origins(&self) -> Result<Vec<String>, Fault> {
        let origins: Vec<String> = self.origins.split_whitespace().map(str::to_ascii_lowercase).collect();
        match origins.iter().find(|origin| !origin.contains("://") || origin.ends_with('/')) {
            Some(wrong) => Err(Fault::new(format!(
                "`origins` has `{wrong}`: expected a scheme and a host, such as https://app.foxglove.dev"
            ))),
            None => Ok(origins),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clients_only_read_unless_they_may_more() {
        let of =
            |rights: &str| FoxgloveOptions { rights: rights.into(), ..FoxgloveOptions::defaults() }.client_rights();
        let named = |rights: Rights| {
            Right::ALL.into_iter().filter(|right| rights.contains(*right)).map(Right::name).collect::<Vec<_>>()
        };
        assert_eq!(named(FoxgloveOptions::defaults().client_rights().expect("they are valid")), ["read"]);
        assert_eq!(named(of("arm parameters").expect("they are valid")), ["read", "parameters", "arm"]);
        for wrong in ["publish", "actuators", "read", "all"] {
            let said = of(wrong).expect_err("it is refused").to_string();
            assert_eq!(said, format!("`rights` has `{wrong}`: expected `parameters`, `commands`, `arm`"));
        }
    }

    #[test]
    fn origins_have_a_scheme_and_no_path() {
        let of = |origins: &str| {
            FoxgloveOptions { origins: origins.into(), ..FoxgloveOptions::defaults() }.page_origins()
        };
        assert_eq!(
            of("http://localhost:8080 HTTPS://Viewer.example").map_err(|error| error.to_string()),
            Ok(vec!["http://localhost:8080".into(), "https://viewer.example".into()])
        );
        assert_eq!(of("").map(|origins| origins.len()).ok(), Some(0));
        for wrong in ["localhost", "*", "https://app.foxglove.dev/view/"] {
            assert!(of(wrong).is_err(), "{wrong}");
        }
    }
}
