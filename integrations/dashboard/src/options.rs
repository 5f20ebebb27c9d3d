//! The settings of a dashboard.

use crate::gate::Gate;
use bb_core::event::{Right, Rights};
use bb_core::{Fault, Options};
use std::net::{IpAddr, SocketAddr};

/// Options of [`Dashboard`](crate::Dashboard).
#[derive(Clone, Debug, Options)]
pub struct DashboardOptions {
    /// Port; 0 lets the system choose one.
    #[option(default = 8912)]
    pub port: u16,
    /// Address to listen on. Another than that of the loopback device needs `read = "token"` and the `hosts` by which it is reached; there is
    /// no encryption, so that a proxy or `ssh -L` is the better way.
    #[option(default = "127.0.0.1")]
    pub address: String,
    /// Further names and ports by which browsers reach it, separated by spaces: `rover.local:8912`. Requests by any other name are refused.
    #[option(default = "")]
    pub hosts: String,
    /// Readers: `open` for all who reach the address, `token` for those with the token.
    #[option(default = "open")]
    pub read: String,
    /// Rights of those with the token, separated by spaces, of `parameters`, `commands`, `arm`, `actuators` and `publish`: messages for sensors
    /// declared as `External` and for external inputs, which estimators take for measurements.
    #[option(default = "parameters commands arm actuators")]
    pub rights: String,
    /// Folder with the files of the meshes that links declare, for the 3D view: STL, at most 16 MiB each. They are read when it starts;
    /// `package://rover/meshes/body.stl` is `meshes/body.stl` there, or else `body.stl`.
    #[option(default = "")]
    pub meshes: String,
    /// Prints the address with its token to the standard error when the bridge starts.
    #[option(default = true)]
    pub print: bool,
}

/// The options, checked.
#[derive(Clone, Debug)]
pub(crate) struct Settings {
    pub(crate) address: SocketAddr,
    pub(crate) hosts: Vec<String>,
    pub(crate) reads_need_token: bool,
    pub(crate) rights: Rights,
}

impl DashboardOptions {
    pub(crate) fn settings(&self) -> Result<Settings, Fault> {
        let ip: IpAddr = self.address.parse().map_err(|_| {
            Fault::new(format!("`address` is `{}`: expected an IP address, such as 127.0.0.1", self.address))
        })?;
        let reads_need_token = match self.read.as_str() {
            "open" => false,
            "token" => true,
            other => return Err(Fault::new(format!("`read` is `{other}`: expected `open` or `token`"))),
        };
        let hosts: Vec<String> = self.hosts.split_whitespace().map(str::to_owned).collect();
        if let Some(host) = hosts.iter().find(|host| !Gate::is_host(host)) {
            return Err(Fault::new(format!(
                "`hosts` has `{host}`: expected a name with its port, such as rover.local:8912"
            )));
        }
        if !ip.is_loopback() && (!reads_need_token || hosts.is_empty()) {
            let message = format!(
                "`address` is {ip}, which other machines reach: set `read = \"token\"` and the `hosts` by which they do"
            );
            return Err(Fault::new(message));
        }
        Ok(Settings {
            address: SocketAddr::new(ip, self.port),
            hosts,
            reads_need_token,
            rights: self.writer_rights()?,
        })
    }

    fn writer_rights(&self) -> Result<Rights, Fault> {
        Rights::parse(
            &self.rights,
            &[Right::Parameters, Right::Commands, Right::Arm, Right::Actuators, Right::Publish],
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(change: impl FnOnce(&mut DashboardOptions)) -> String {
        let mut options = DashboardOptions::defaults();
        change(&mut options);
        options.settings().expect_err("it is refused").to_string()
    }

    #[test]
    fn what_would_expose_the_robot_is_refused() {
        let open = refused(|options| options.address = "0.0.0.0".into());
        assert!(open.contains("set `read = \"token\"` and the `hosts`"), "{open}");
        refused(|options| {
            options.address = "0.0.0.0".into();
            options.read = "token".into();
        });
        let rights = refused(|options| options.rights = "commands read".into());
        let expected = "`rights` has `read`: expected `parameters`, `commands`, `arm`, `actuators`, `publish`";
        assert_eq!(rights, expected);
        assert!(refused(|options| options.read = "all".into()).contains("expected `open` or `token`"));
        assert!(refused(|options| options.hosts = "rover.local".into()).contains("with its port"));
        assert!(refused(|options| options.address = "localhost".into()).contains("an IP address"));
    }

    #[test]
    fn rights_are_those_listed_and_to_read() {
        let options = DashboardOptions { rights: "arm".into(), ..DashboardOptions::defaults() };
        let rights = options.settings().expect("they are valid").rights;
        let has = Right::ALL.map(|right| rights.contains(right));
        assert_eq!(has, Right::ALL.map(|right| matches!(right, Right::Read | Right::Arm)));
    }
}
