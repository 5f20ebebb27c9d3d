//! Links over the loopback device, with frames that the crate `mavlink` writes.

use super::*;
use mavlink::dialects::ardupilotmega::{HEARTBEAT_DATA, HIGHRES_IMU_DATA, SYSTEM_TIME_DATA};
use mavlink::{MavlinkReader, MavlinkVersion, MessageData, write_versioned_msg};
use std::net::UdpSocket;

const ANY: Peer = Peer { system_id: 0, component_id: 0 };
/// Far longer than it takes.
const LONG: Duration = Duration::from_secs(20);

use std::time::Duration;

/// Other side of the link: a socket at a port that the system chose.
struct Other {
    socket: UdpSocket,
    sequence: u8,
}

impl Other {
    fn new() -> (Self, String) {
        let socket = UdpSocket::bind("127.0.0.1:0").expect("a port is free");
        socket.set_read_timeout(Some(LONG)).expect("it can be set");
        let address = format!("udpout:{}", socket.local_addr().expect("it is bound"));
        (Self { socket, sequence: 0 }, address)
    }

    /// Waits for a frame of the link, and answers to it from then on.
    fn meet(&self) -> MavHeader {
        let mut buffer = [0; 300];
        let (length, from) = self.socket.recv_from(&mut buffer).expect("the link says hello");
        self.socket.connect(from).expect("it is on the loopback device");
        let (header, message) =
            MavlinkReader::new(&buffer[..length]).read_any_message::<MavMessage>().expect("it is a frame");
        assert!(matches!(message, MavMessage::HEARTBEAT(_)));
        header
    }

    fn frame(&mut self, system_id: u8, message: &MavMessage) -> Vec<u8> {
        let mut frame = Vec::new();
        let header = MavHeader { system_id, component_id: 1, sequence: self.sequence };
        self.sequence = self.sequence.wrapping_add(1);
        write_versioned_msg(&mut frame, MavlinkVersion::V2, header, message).expect("a vector takes all");
        frame
    }

    fn send(&mut self, system_id: u8, message: &MavMessage) {
        let frame = self.frame(system_id, message);
        self.socket.send(&frame).expect("it is on the loopback device");
    }
}

fn time(millis: u32) -> MavMessage {
    MavMessage::SYSTEM_TIME(SYSTEM_TIME_DATA { time_unix_usec: 1, time_boot_ms: millis })
}

fn times(inbox: &Inbox) -> Option<u32> {
    match inbox.receive(LONG).expect("the link is open")?.message {
        MavMessage::SYSTEM_TIME(data) => Some(data.time_boot_ms),
        other => panic!("{other:?}"),
    }
}

#[test]
fn two_users_share_a_connection_and_each_gets_everything() {
    let (mut other, address) = Other::new();
    let one = Link::open(&address).expect("it opens");
    let two = Link::open(&address).expect("it opens");
    assert!(Arc::ptr_eq(&one.shared, &two.shared));
    let inboxes = [&one, &two].map(|link| link.listen(ANY, &[SYSTEM_TIME_DATA::ID], 8));
    assert_eq!((other.meet().system_id, one.last_heartbeat(ANY)), (1, None));
    for millis in 0..5 {
        other.send(1, &time(millis));
    }
    for inbox in &inboxes {
        assert_eq!([(); 5].map(|()| times(inbox)), [0, 1, 2, 3, 4].map(Some));
    }
    drop(one);
    other.send(1, &time(5));
    assert_eq!(times(&inboxes[1]), Some(5), "the other user still has it");
}

#[test]
fn the_thread_ends_with_the_last_user() {
    let (other, address) = Other::new();
    let link = Link::open(&address).expect("it opens");
    other.meet();
    let shared = Arc::downgrade(&link.shared);
    let second = Link::open(&address).expect("it opens");
    drop(link);
    assert!(shared.upgrade().is_some());
    drop(second);
    assert!(shared.upgrade().is_none(), "neither the thread nor the registry holds it");
    assert!(!links().contains_key(&address.parse().expect("it is one")));
}

#[test]
fn a_port_can_be_opened_again_at_once() {
    let free = UdpSocket::bind("127.0.0.1:0").and_then(|socket| socket.local_addr()).expect("a port is free");
    for _ in 0..5 {
        let link = Link::open(&format!("udpin:{free}")).expect("it is closed when it is dropped");
        assert_eq!(link.send(&link.identity(1, 191), &time(1)).ok(), Some(false), "nobody is known");
    }
}

#[test]
fn a_link_that_waits_answers_the_one_that_drivers_listen_to() {
    let free = UdpSocket::bind("127.0.0.1:0").and_then(|socket| socket.local_addr()).expect("a port is free");
    let link = Link::open(&format!("udpin:{free}")).expect("it opens");
    let inbox = link.listen(Peer { system_id: 1, component_id: 0 }, &[SYSTEM_TIME_DATA::ID], 8);
    let (mut other, _) = Other::new();
    other.socket.connect(free).expect("it is on the loopback device");
    other.send(1, &time(7));
    assert_eq!(times(&inbox), Some(7));
    // Neither noise nor a system that no driver listens to makes anybody a peer.
    let (mut stranger, _) = Other::new();
    stranger.socket.connect(free).expect("it is on the loopback device");
    stranger.send(77, &time(9));
    stranger.socket.send(b"hello").expect("it is on the loopback device");
    let deadline = link.now() + LONG;
    while link.statistics().bytes_skipped < 5 && link.now() < deadline {
        std::thread::sleep(Duration::from_millis(1));
    }
    assert_eq!((link.statistics().messages, link.statistics().bytes_skipped), (2, 5));
    let identity = link.identity(3, 4);
    let mut buffer = [0; 300];
    loop {
        let _ = link.send(&identity, &time(8));
        let length = other.socket.recv(&mut buffer).expect("it answers");
        let (header, message) =
            MavlinkReader::new(&buffer[..length]).read_any_message::<MavMessage>().expect("it is a frame");
        if message == time(8) {
            assert_eq!((header.system_id, header.component_id), (3, 4));
            return;
        }
    }
}

#[test]
fn each_hears_only_whom_and_what_it_wants() {
    let (mut other, address) = Other::new();
    let link = Link::open(&address).expect("it opens");
    let second = link.listen(Peer { system_id: 2, component_id: 1 }, &[SYSTEM_TIME_DATA::ID], 8);
    let all = link.listen(ANY, &[SYSTEM_TIME_DATA::ID, HEARTBEAT_DATA::ID], 8);
    other.meet();
    other.send(1, &time(1));
    other.send(1, &MavMessage::HIGHRES_IMU(HIGHRES_IMU_DATA::default()));
    other.send(2, &time(2));
    other.send(2, &MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()));
    assert_eq!(times(&second), Some(2));
    assert_eq!([times(&all), times(&all)], [Some(1), Some(2)]);
    assert!(matches!(all.receive(LONG), Ok(Some(Received { message: MavMessage::HEARTBEAT(_), .. }))));
    assert!(link.last_heartbeat(Peer { system_id: 2, component_id: 0 }).is_some());
    assert_eq!(link.last_heartbeat(Peer { system_id: 1, component_id: 0 }), None);
    assert_eq!(link.statistics().messages, 4);
}

#[test]
fn a_flood_is_bounded_and_counted() {
    let (mut other, address) = Other::new();
    let link = Link::open(&address).expect("it opens");
    let slow = link.listen(ANY, &[SYSTEM_TIME_DATA::ID], 4);
    let fence = link.listen(ANY, &[HEARTBEAT_DATA::ID], 4);
    other.meet();
    // Many frames in a datagram, so that the socket loses none.
    let mut datagram: Vec<u8> = (0..1_000).flat_map(|millis| other.frame(1, &time(millis))).collect();
    datagram.extend(other.frame(1, &MavMessage::HEARTBEAT(HEARTBEAT_DATA::default())));
    other.socket.send(&datagram).expect("it is on the loopback device");
    fence.receive(LONG).expect("the link is open").expect("it comes last");
    assert_eq!([(); 4].map(|()| times(&slow)), [996, 997, 998, 999].map(Some));
    assert_eq!((slow.dropped(), slow.receive(Duration::ZERO).ok()), (996, Some(None)));
    assert_eq!(link.statistics().dropped, 996);
}

#[test]
fn noise_other_dialects_and_gaps_are_counted() {
    let (mut other, address) = Other::new();
    let link = Link::open(&address).expect("it opens");
    let inbox = link.listen(ANY, &[SYSTEM_TIME_DATA::ID], 8);
    other.meet();
    other.send(1, &time(0));
    other.socket.send(&[0; 17]).expect("it is on the loopback device");
    // A frame of another dialect, which is numbered 1.
    let unknown = [&[0xfd, 2, 0, 0, 1, 1, 1, 220, 0, 0][..], &[0x11; 4]].concat();
    other.socket.send(&unknown).expect("it is on the loopback device");
    // A frame that is cut off holds up none that follows.
    other.socket.send(&[0xfd, 255, 0, 0, 2, 1, 1, 2, 0, 0, 9]).expect("it is on the loopback device");
    other.sequence = 5;
    other.send(1, &time(1));
    // From another system, whose numbers are its own.
    other.sequence = 200;
    other.send(2, &time(2));
    assert_eq!([(); 3].map(|()| times(&inbox)), [0, 1, 2].map(Some));
    let LinkStatistics { messages, unknown, invalid, bytes_skipped, lost, .. } = link.statistics();
    assert_eq!((messages, unknown, invalid, bytes_skipped, lost), (3, 1, 0, 17 + 11, 3));
}

#[test]
fn identities_send_heartbeats_and_number_their_frames() {
    let (other, address) = Other::new();
    let link = Link::open(&address).expect("it opens");
    let [one, two] = [5, 6].map(|component_id| link.identity(9, component_id));
    assert!(Arc::ptr_eq(&one, &link.identity(9, 5)), "the same ids are the same identity");
    for _ in 0..3 {
        for identity in [&one, &two] {
            link.send(identity, &time(1)).expect("it is open");
        }
    }
    let mut numbers: HashMap<u8, Vec<u8>> = HashMap::new();
    let mut heartbeats = 0;
    while numbers.values().map(Vec::len).sum::<usize>() < 6 || heartbeats < 2 {
        let mut buffer = [0; 300];
        let length = other.socket.recv(&mut buffer).expect("a frame arrives");
        let (header, message) =
            MavlinkReader::new(&buffer[..length]).read_any_message::<MavMessage>().expect("it is a frame");
        if header.system_id == 9 {
            heartbeats += usize::from(matches!(message, MavMessage::HEARTBEAT(_)));
            numbers.entry(header.component_id).or_default().push(header.sequence);
        }
    }
    for (component_id, numbers) in numbers {
        assert!(
            numbers.iter().zip(0..).all(|(number, expected)| *number == expected),
            "{component_id}: {numbers:?}"
        );
    }
}

#[test]
fn links_that_cannot_be_opened_name_the_reason() {
    let taken = UdpSocket::bind("127.0.0.1:0").expect("a port is free");
    let address = format!("udpin:{}", taken.local_addr().expect("it is bound"));
    let message = Link::open(&address).expect_err("it is taken").to_string();
    assert!(message.starts_with(&format!("the link `{address}` cannot be opened: ")), "{message}");
    let malformed = Link::open("nowhere").expect_err("it is no address").to_string();
    assert!(malformed.starts_with("the link `nowhere` names no kind of connection; write"), "{malformed}");
    #[cfg(not(feature = "serial"))]
    assert_eq!(
        Link::open("serial:/dev/ttyACM0:57600").expect_err("it is left out").to_string(),
        "the link `serial:/dev/ttyACM0:57600` cannot be opened: serial ports need the feature `serial` of the crate `bb-mavlink`"
    );
}

/// An identity sends heartbeats until it is dropped. The default one sends them if there is no other, and continues its numbers.
#[test]
fn dropped_identities_send_no_heartbeats() {
    let (_other, address) = Other::new();
    let link = Link::open(&address).expect("it opens");
    let ids = || link.shared.identities().iter().map(|identity| identity.header().component_id).collect::<Vec<_>>();
    assert_eq!(ids(), [191], "the default");
    let odometry = link.identity(1, 197);
    let onboard = link.identity(1, 191);
    assert!(Arc::ptr_eq(&onboard, &link.identity(1, 191)), "shared by those that choose it");
    assert_eq!(ids(), [197, 191]);
    let before = onboard.header().sequence;
    drop(onboard);
    assert_eq!(ids(), [197]);
    drop(odometry);
    assert_eq!(ids(), [191]);
    assert!(link.shared.identities()[0].header().sequence > before, "its numbers continue");
}
