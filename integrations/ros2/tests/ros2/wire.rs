//! Texts and bytes for zenoh, compared with those of `rmw_zenoh_cpp`.

use bb_ros2::*;
use bb_tests::laws;
use proptest::prelude::*;
use serde_json::Value;
use std::time::Duration;

/// Three nodes with 120 publishers and subscriptions and 20 services and clients of random names, types and quality of service, as `rclpy`
/// made them over `rmw_zenoh_cpp`, with the ids that it gave.
const RECORDED: &str = include_str!("tokens_kilted_0.6.7.json");

fn recorded() -> (Vec<String>, Vec<Value>) {
    let recorded: Value = serde_json::from_str(RECORDED).expect("it is JSON");
    let list = |name: &str| recorded[name].as_array().expect("it is a list").clone();
    let nodes = list("nodes").iter().map(|node| text(node).to_owned()).collect();
    (nodes, list("endpoints"))
}

fn text(value: &Value) -> &str {
    value.as_str().expect("it is a text")
}

/// The quality of service that the node asked for; none is recorded for services, whose one is that of ROS.
fn asked_for(qos: &Value) -> Qos {
    if qos.is_null() {
        return Qos::reliable(10);
    }
    let number = |name: &str| text(&qos[name]).parse().expect("it is a number");
    let time = |name: &str| Some(Duration::from_nanos(number(name))).filter(|time| !time.is_zero());
    Qos {
        reliability: match text(&qos["reliability"]) {
            "RELIABLE" => Reliability::Reliable,
            _ => Reliability::BestEffort,
        },
        durability: match text(&qos["durability"]) {
            "VOLATILE" => Durability::Volatile,
            _ => Durability::TransientLocal,
        },
        history: match text(&qos["history"]) {
            "KEEP_LAST" => History::KeepLast,
            _ => History::KeepAll,
        },
        depth: number("depth"),
        deadline: time("deadline"),
        lifespan: time("lifespan"),
        liveliness: match text(&qos["liveliness"]) {
            "MANUAL_BY_TOPIC" => Liveliness::ManualByTopic,
            _ => Liveliness::Automatic,
        },
        lease: time("liveliness_lease_duration"),
    }
}

#[test]
fn tokens_and_ids_are_those_of_ros() {
    let (nodes, endpoints) = recorded();
    assert_eq!((nodes.len(), endpoints.len()), (3, 140));
    for node in &nodes {
        let token: Token = node.parse().expect("ROS has written it");
        assert_eq!((&token.to_string(), token.endpoint), (node, None));
    }
    let mut ids = 0;
    for recorded in &endpoints {
        let written = text(&recorded["token"]);
        let read: Token = written.parse().expect("ROS has written it");
        let node = Node::new(text(&recorded["namespace"]), text(&recorded["node"])).expect("ROS has it");
        // What was asked for, without what ROS chose: the numbers of the session, and the hash.
        let address = Address {
            name: text(&recorded["name"]).to_owned(),
            type_name: text(&recorded["type"]).parse().expect("ROS has it"),
            type_hash: read.endpoint.as_ref().expect("it is one").address.type_hash,
        };
        let kind = match text(&recorded["kind"]) {
            "MP" => EndpointKind::Publisher,
            "MS" => EndpointKind::Subscription,
            "SS" => EndpointKind::Service,
            _ => EndpointKind::Client,
        };
        let qos = asked_for(&recorded["qos"]);
        let asked = Token {
            enclave: "/".to_owned(),
            node,
            endpoint: Some(Endpoint { kind, address, qos, backends: None }),
            domain: 0,
            ..read.clone()
        };
        assert_eq!(asked.to_string(), written);
        assert_eq!(read, asked);
        for id in recorded["gid"].as_array().into_iter().flatten() {
            assert_eq!(Gid::of(written).to_string(), text(id));
            ids += 1;
        }
    }
    assert_eq!(ids, 120);
}

const HUMBLE: &str =
    "@ros2_lv/0/aa/0/5/MP/%/%/talker/%chatter/std_msgs::msg::dds_::Int32_/TypeHashNotSupported/1:2:1,10:,:,:,,";

#[test]
fn tokens_of_other_releases_are_read() {
    let humble: Token = HUMBLE.parse().expect("Humble writes it");
    let endpoint = humble.endpoint.clone().expect("it is a publisher");
    assert_eq!((endpoint.address.type_hash, endpoint.qos), (TypeHash::Unsupported, Qos::reliable(10)));
    assert_eq!(endpoint.address.key(3), "3/chatter/std_msgs::msg::dds_::Int32_/TypeHashNotSupported");
    let rolling: Token = format!("{HUMBLE}/backends:cuda,cpu%x").parse().expect("Rolling writes it");
    assert_eq!(
        rolling.endpoint.as_ref().expect("it is a publisher").backends.as_deref(),
        Some("backends:cuda,cpu/x")
    );
    assert!(rolling.to_string().ends_with("/backends:cuda,cpu%x"));
    // Written as `rmw/types.h` defaults to: nothing but what differs.
    assert_eq!(humble.to_string(), HUMBLE.replace("/1:2:1,10:", "/::,10:"));
    assert_eq!(
        "1:2:1,10:0,0:60,3000:1,0,0".parse(),
        Ok(Qos { lifespan: Some(Duration::new(60, 3000)), ..Qos::reliable(10) })
    );
}

#[test]
fn what_is_wrong_with_a_token_is_said() {
    let refused = |from: &str, to: &str| {
        assert!(HUMBLE.contains(from), "{from}");
        let token = HUMBLE.replacen(from, to, 1);
        let error = token.parse::<Token>().expect_err(&token).to_string();
        assert!(error.contains(&token), "{error}");
        error.replace(&token, "…")
    };
    for (from, to, expected) in [
        ("@ros2_lv", "@ros2", "`…` is no token: it does not begin with `@ros2_lv`"),
        ("/%/%", "/%/", "`…` is no token: a chunk of it is empty"),
        ("/0/aa", "/x/aa", "`…` is no token: one of its numbers is not a number, or too large"),
        ("/0/aa", "/4294967296/aa", "`…` is no token: the domain is too large"),
        ("/aa/", "/é/", "`…` is no token: the session is no hexadecimal number"),
        ("/5/MP", "/99999999999999999999/MP", "`…` is no token: one of its numbers is not a number, or too large"),
        ("MP", "MX", "`…` is no token: it is of no known kind"),
        ("/1:2:1,10:,:,:,,", "", "`…` is no token: an endpoint has 13 or 14 chunks"),
        (",,", ",,/a/b", "`…` is no token: an endpoint has 13 or 14 chunks"),
        (
            "talker",
            "talk-er",
            "in the token `…`: `talk-er` is no name of a node: `-` is not allowed, only letters, digits and `_` between slashes",
        ),
        ("%chatter", "%chat%%ter", "in the token `…`: `/chat//ter` is no name of a topic: a part of it is empty"),
        ("::msg::dds_::", "/msg/", "`…` is no token: an endpoint has 13 or 14 chunks"),
        (
            "::dds_::",
            "::",
            "in the token `…`: `std_msgs::msg::Int32_` is no type in DDS's form, such as `sensor_msgs::msg::dds_::Imu_`",
        ),
        ("TypeHashNot", "TypeHash", "in the token `…`: `TypeHashSupported` is no hash of a type"),
        (
            "1:2:1,10",
            "9:2:1,10",
            "in the token `…`: `9:2:1,10:,:,:,,` is no quality of service: one of its policies is not known",
        ),
        ("1,10", "1,-1", "in the token `…`: `1:2:1,-1:,:,:,,` is no quality of service: its depth is no number"),
        (
            ":,:,:",
            ":,1000000000:,:",
            "in the token `…`: `1:2:1,10:,1000000000:,:,,` is no quality of service: its deadline is no time",
        ),
        (
            ",,",
            ",",
            "in the token `…`: `1:2:1,10:,:,:,` is no quality of service: a part of it has too many or too few commas",
        ),
        (
            "1:2:",
            "1:",
            "in the token `…`: `1:1,10:,:,:,,` is no quality of service: it does not have six parts between colons",
        ),
    ] {
        assert_eq!(refused(from, to), expected);
    }
}

#[test]
fn attachments_are_those_of_ros() {
    let gid = Gid(std::array::from_fn(|index| index as u8 + 0xa0));
    let attachment = Attachment { sequence: 258, time_ns: -1, gid };
    let mut bytes = vec![2, 1, 0, 0, 0, 0, 0, 0];
    bytes.extend([0xff; 8]);
    bytes.push(16);
    bytes.extend(gid.0);
    assert_eq!(attachment.to_bytes().as_slice(), bytes);
    assert_eq!(Attachment::from_bytes(&bytes), Ok(attachment));
    let labelled = labelled(attachment);
    assert_eq!(labelled.len(), 16 + 8 + 17 + 8 + 11 + 17);
    assert_eq!(Attachment::from_bytes(&labelled), Ok(attachment));
    let refused = |bytes: &[u8]| Attachment::from_bytes(bytes).expect_err("no attachment").to_string();
    assert_eq!(refused(&[]), "an attachment of 0 bytes: it is neither one of 33 bytes, nor labelled");
    bytes[16] = 15;
    assert_eq!(refused(&bytes), "an attachment of 33 bytes: its id does not have 16 bytes");
    bytes[16] = 17;
    assert_eq!(refused(&bytes), "an attachment of 33 bytes: it ends within the id");
    assert_eq!(refused(&labelled[..76]), "an attachment of 76 bytes: it ends within the id");
    assert_eq!(refused(&labelled[..40]), "an attachment of 40 bytes: it is neither one of 33 bytes, nor labelled");
    assert_eq!(refused(&[&labelled[..], &[0]].concat()), "an attachment of 78 bytes: it goes on after the id");
}

/// Attachment of Jazzy up to `rmw_zenoh_cpp` 0.2.3.
fn labelled(Attachment { sequence, time_ns, gid }: Attachment) -> Vec<u8> {
    let mut bytes = b"\x0fsequence_number".to_vec();
    bytes.extend(sequence.to_le_bytes());
    bytes.extend(b"\x10source_timestamp");
    bytes.extend(time_ns.to_le_bytes());
    bytes.extend(b"\x0asource_gid\x10");
    bytes.extend(gid.0);
    bytes
}

fn qos() -> impl Strategy<Value = Qos> {
    let time = || {
        // With the numbers that tokens leave out.
        let seconds = prop_oneof![Just(0), Just(9_223_372_036), any::<u64>()];
        let nanos = prop_oneof![Just(0), Just(854_775_807), 0..1_000_000_000u32];
        let is_time = |time: &Duration| !time.is_zero() && *time != Duration::new(9_223_372_036, 854_775_807);
        proptest::option::of(
            (seconds, nanos)
                .prop_map(|(seconds, nanos)| Duration::new(seconds, nanos))
                .prop_filter("a time", is_time),
        )
    };
    let policies = (
        proptest::sample::select(Reliability::ALL),
        proptest::sample::select(Durability::ALL),
        proptest::sample::select(History::ALL),
        proptest::sample::select(Liveliness::ALL),
    );
    let depth = prop_oneof![Just(42), any::<u64>()];
    (policies, depth, time(), time(), time()).prop_map(|(policies, depth, deadline, lifespan, lease)| {
        let (reliability, durability, history, liveliness) = policies;
        Qos { reliability, durability, history, depth, deadline, lifespan, liveliness, lease }
    })
}

/// Exchanges, removes or inserts one letter or chunk.
fn changed(token: &str, (place, with, how): (prop::sample::Index, String, u8)) -> String {
    let mut letters: Vec<String> = match how & 1 {
        0 => token.chars().map(String::from).collect(),
        _ => token.split_inclusive(['/', ':', ',', '%']).map(String::from).collect(),
    };
    if letters.is_empty() {
        return with;
    }
    let place = place.index(letters.len());
    match how >> 1 {
        0 => letters[place] = with,
        1 => _ = letters.remove(place),
        2 => letters.insert(place, with),
        _ => letters.truncate(place),
    }
    letters.concat()
}

laws! {
    #[test]
    fn quality_of_service_is_read_back(qos in qos()) {
        prop_assert_eq!(qos.to_string().parse(), Ok(qos));
    }

    /// A token that is read is written as one that reads the same.
    #[test]
    fn changed_tokens_are_read_or_refused(
        which in any::<prop::sample::Index>(),
        changes in proptest::collection::vec((any::<prop::sample::Index>(), "[/:,%0-9A-Za-z_é@-]{0,4}", 0..8u8), 0..4),
    ) {
        let (nodes, endpoints) = recorded();
        let which = which.index(nodes.len() + endpoints.len() + 1);
        let token = match which.checked_sub(nodes.len()) {
            None => nodes[which].clone(),
            Some(which) => endpoints.get(which).map_or_else(|| HUMBLE.to_owned(), |of| text(&of["token"]).to_owned()),
        };
        let token = changes.into_iter().fold(token, |token, change| changed(&token, change));
        if let Ok(read) = token.parse::<Token>() {
            prop_assert_eq!(read.to_string().parse::<Token>(), Ok(read));
        }
    }

    #[test]
    fn changed_attachments_are_read_or_refused(
        (sequence, time_ns, gid) in (any::<i64>(), any::<i64>(), any::<[u8; 16]>()),
        is_labelled in any::<bool>(),
        changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..3),
        length in proptest::option::of(0..100usize),
    ) {
        let attachment = Attachment { sequence, time_ns, gid: Gid(gid) };
        let mut bytes = if is_labelled { labelled(attachment) } else { attachment.to_bytes().to_vec() };
        let whole = bytes.clone();
        for (place, byte) in changes {
            *place.get_mut(&mut bytes) = byte;
        }
        if let Some(length) = length {
            bytes.resize(length, 0);
        }
        let read = Attachment::from_bytes(&bytes);
        if bytes == whole {
            prop_assert_eq!(read, Ok(attachment));
        } else if let Ok(read) = read {
            prop_assert_eq!(Attachment::from_bytes(&read.to_bytes()), Ok(read));
        }
    }
}

#[test]
fn names_are_those_that_ros_accepts() {
    for (namespace, name, expected) in [
        ("/", "rover", Ok("/rover")),
        ("/cell/left", "arm_2", Ok("/cell/left/arm_2")),
        ("/a", "_hidden", Ok("/a/_hidden")),
        ("", "rover", Err("`` is no name of a namespace: it does not begin with a slash")),
        ("/a/", "rover", Err("`/a/` is no name of a namespace: a part of it is empty")),
        ("/2a", "rover", Err("`/2a` is no name of a namespace: `2a` begins with a digit")),
        ("/", "", Err("`` is no name of a node: a part of it is empty")),
        ("/", "9lives", Err("`9lives` is no name of a node: `9lives` begins with a digit")),
        (
            "/",
            "a/b",
            Err("`a/b` is no name of a node: a node is named without slashes; its namespace is given apart"),
        ),
        (
            "/",
            "é",
            Err("`é` is no name of a node: `é` is not allowed, only letters, digits and `_` between slashes"),
        ),
    ] {
        let node = Node::new(namespace, name).map(|node| node.full_name()).map_err(|error| error.to_string());
        assert_eq!(node.as_deref().map_err(String::as_str), expected);
    }
    let long = format!("/{}", "a".repeat(247));
    assert_eq!(check_topic(&long[..247]), Ok(()));
    assert!(check_topic(&long).expect_err("it is too long").to_string().ends_with("it has more than 247 letters"));
    for (robot, name) in [
        ("Rover", "rover"),
        ("LeftArm", "left_arm"),
        ("ArmV2", "arm_v2"),
        ("IMURig", "imurig"),
        ("Left_Arm", "left_arm"),
    ] {
        assert_eq!(Node::of_robot("/", robot).map(|node| node.name().to_owned()), Ok(name.to_owned()));
    }
    let rover = Node::of_robot("/", "Rover").expect("it is a name");
    assert_eq!(rover.topic("sensor/base/imu").as_deref(), Ok("/sensor/base/imu"));
    assert_eq!(rover.service("command/go_home").as_deref(), Ok("/rover/go_home"));
    assert_eq!(rover.service("list_parameters").as_deref(), Ok("/rover/list_parameters"));
    assert_eq!(parameter_name("param/imu/orientation/beta").as_deref(), Some("imu.orientation.beta"));
    assert_eq!(parameter_name("sensor/base/imu"), None);
    assert_eq!(parameter_path("imu.orientation.beta"), "param/imu/orientation/beta");
}
