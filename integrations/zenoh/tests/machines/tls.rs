//! Rights by certificates, by the templates in `access/`: who has none of the authority's, or one that is over, gets no session, and who has
//! one does what its name may.

use crate::kit::{PATIENCE, changed, connected, folder, free_address};
use bb_core::Options;
use bb_core::message::codec::encode;
use bb_core::nalgebra::Vector3;
use bb_core::prelude::*;
use bb_zenoh::{Ros2Bridge, Ros2Options};
use rcgen::{
    BasicConstraints, CertificateParams, DistinguishedName, DnType, ExtendedKeyUsagePurpose, IsCa, Issuer, KeyPair,
    date_time_ymd,
};
use std::path::{Path, PathBuf};
use std::time::Instant;
use zenoh::Wait;

robot! {
    robot Rover;
    link base {
        sensor imu: External<Imu>();
        sensor target: External<Twist>();
    }
}

/// Time for which somebody who may not tries.
const TRIES: Duration = Duration::from_secs(3);

/// An authority that signs certificates.
struct Authority {
    issuer: Issuer<'static, KeyPair>,
    pem: String,
}

impl Authority {
    fn new(name: &str) -> Self {
        let mut params = CertificateParams::default();
        params.distinguished_name = named(Some(name));
        params.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
        let key = KeyPair::generate().expect("it is made");
        let pem = params.self_signed(&key).expect("it is signed").pem();
        Self { issuer: Issuer::new(params, key), pem }
    }

    /// Writes `FILE.pem` and `FILE.key` of somebody with that name.
    fn sign(&self, folder: &Path, file: &str, name: Option<&str>, last_year: i32) {
        let mut params = CertificateParams::new(["127.0.0.1".to_owned()]).expect("it is an address");
        params.distinguished_name = named(name);
        params.extended_key_usages = vec![ExtendedKeyUsagePurpose::ServerAuth, ExtendedKeyUsagePurpose::ClientAuth];
        params.not_after = date_time_ymd(last_year, 1, 1);
        let key = KeyPair::generate().expect("it is made");
        let certificate = params.signed_by(&key, &self.issuer).expect("it is signed");
        std::fs::write(folder.join(file).with_extension("pem"), certificate.pem()).expect("it is written");
        std::fs::write(folder.join(file).with_extension("key"), key.serialize_pem()).expect("it is written");
    }
}

fn named(name: Option<&str>) -> DistinguishedName {
    let mut names = DistinguishedName::new();
    names.push(DnType::OrganizationName, "robots");
    if let Some(name) = name {
        names.push(DnType::CommonName, name);
    }
    names
}

/// Rights that a client with a certificate turns out to have.
#[derive(Debug, PartialEq)]
struct Done {
    has_session: bool,
    reads: bool,
    writes: bool,
    calls: bool,
}

const NOTHING: Done = Done { has_session: false, reads: false, writes: false, calls: false };

#[test]
fn a_certificate_says_who_reads_and_who_writes() {
    let folder = folder("tls");
    let (ours, foreign) = (Authority::new("our authority"), Authority::new("another authority"));
    std::fs::write(folder.join("ca.pem"), &ours.pem).expect("it is written");
    for (authority, file, name, last_year) in [
        (&ours, "robot", Some("robot"), 2100),
        (&ours, "operator", Some("operator"), 2100),
        (&ours, "visitor", Some("visitor"), 2100),
        (&ours, "unknown", Some("unknown"), 2100),
        (&ours, "nameless", None, 2100),
        (&ours, "expired", Some("operator"), 2020),
        (&foreign, "stranger", Some("operator"), 2100),
    ] {
        authority.sign(&folder, file, name, last_year);
    }
    let here = folder.to_str().expect("it is text");
    let endpoint = format!("tls/{}", free_address());
    let config = changed("tls-robot.json5", &folder, "robot.json5", &[("/etc/robot", here)]);
    let robot = Rover::builder().start().expect("it starts");
    let options = Ros2Options {
        listen: endpoint.clone(),
        config: config.to_str().expect("it is text").to_owned(),
        subscribe: "sensor/base/target".into(),
        ..Ros2Options::defaults()
    };
    let bridge = Ros2Bridge::serve(&robot, options).unwrap_or_else(|error| panic!("{error}"));
    let publisher = robot.publisher("sensor/base/imu").expect("it may");

    let twist = Stamped::new(
        MonotonicTime::ZERO,
        Twist { linear: Vector3::zeros(), angular: Vector3::zeros(), covariance: None },
    );
    let mut target = Vec::new();
    encode(&Twist::to_ros(&twist), &mut target);
    let (schema, hash) = (Stamped::<Twist>::LAYOUTS.ros_schema(), Stamped::<Twist>::LAYOUTS.ros_type_hash());
    let schema = schema.expect("ROS has one");
    let (package, message) = schema.name.split_once("/msg/").expect("it is the name of a message");
    let target_key =
        format!("0/sensor/base/target/{package}::msg::dds_::{message}_/{}", hash.expect("ROS has one"));

    let can = |config: PathBuf| {
        let is_operator = config.ends_with("operator.json5");
        let session = connected(vec![endpoint.clone()], Some(config));
        let messages = session.declare_subscriber("0/sensor/base/imu/**").wait().expect("it is declared");
        let (begun, before) = (Instant::now(), bridge.state().received);
        let mut done = NOTHING;
        // Who may do all need not try for longer, and is not in a hurry.
        let longest = if is_operator { PATIENCE } else { TRIES };
        while begun.elapsed() < longest
            && done != (Done { has_session: true, reads: true, writes: true, calls: true })
        {
            publisher.publish(Imu::new(Vector3::zeros(), Vector3::zeros()));
            session.put(&target_key, target.clone()).wait().expect("it is put");
            let replies = session
                .get("0/rover/disarm/std_srvs::srv::dds_::Trigger_/TypeHashNotSupported")
                .payload([0, 1, 0, 0, 0]);
            let replies = replies.timeout(Duration::from_millis(300)).wait().expect("it is asked");
            done.calls |= replies.recv().is_ok_and(|reply| reply.result().is_ok());
            std::thread::sleep(Duration::from_millis(20));
            done.reads |= messages.try_recv().ok().flatten().is_some();
            done.writes |= bridge.state().received > before;
            done.has_session |= session.info().routers_zid().wait().next().is_some();
        }
        done
    };
    let client = |file: &str| {
        let changes = [("/etc/robot/operator", format!("{here}/{file}")), ("/etc/robot", here.to_owned())];
        let changes = changes.each_ref().map(|(from, to)| (*from, to.as_str()));
        changed("tls-client.json5", &folder, &format!("{file}.json5"), &changes)
    };
    let anonymous = [
        ("connect_certificate: \"/etc/robot/operator.pem\",", ""),
        ("connect_private_key: \"/etc/robot/operator.key\",", ""),
        ("enable_mtls: true,", "enable_mtls: false,"),
        ("/etc/robot", here),
    ];
    let anonymous = changed("tls-client.json5", &folder, "anonymous.json5", &anonymous);

    let all = Done { has_session: true, reads: true, writes: true, calls: true };
    assert_eq!(can(client("operator")), all, "an operator");
    assert_eq!(can(anonymous), NOTHING, "somebody without a certificate");
    assert_eq!(can(client("stranger")), NOTHING, "a stranger with the name of an operator");
    assert_eq!(can(client("expired")), NOTHING, "an operator whose certificate is over");
    assert_eq!(can(client("visitor")), Done { writes: false, calls: false, ..all }, "a visitor");
    for file in ["unknown", "nameless"] {
        let done = can(client(file));
        assert!(!done.reads && !done.writes && !done.calls, "{file}: {done:?}");
    }
    assert_eq!(can(client("operator")), all, "an operator again");
    std::fs::remove_dir_all(&folder).expect("it is removed");
}
