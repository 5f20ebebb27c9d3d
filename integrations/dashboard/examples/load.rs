//! Cost of viewers for a robot: ten sensors at 1 kHz in real time, alone, then with a viewer that watches all of them, then under attack.
//!
//! Prints the processor time of the whole process, how long it takes to publish a message, and the memory. On Linux alone:
//! `cargo run --release -p bb-dashboard --example load`. `--serve SECONDS` only serves the robot, for a browser, and prints the processor time.

use bb_core::Publisher;
use bb_core::prelude::*;
use bb_dashboard::{Dashboard, DashboardOptions};
use std::error::Error;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Instant;
use tungstenite::Message;

const SPAN: Duration = Duration::from_secs(10);

robot! {
    robot Busy;
    link base {
        sensor s0: External<Imu>();
        sensor s1: External<Imu>();
        sensor s2: External<Imu>();
        sensor s3: External<Imu>();
        sensor s4: External<Imu>();
        sensor s5: External<Imu>();
        sensor s6: External<Imu>();
        sensor s7: External<Imu>();
        sensor s8: External<Imu>();
        sensor s9: External<Imu>();
    }
}

/// Cost of a span of time.
#[derive(Clone, Debug)]
struct Cost {
    cpu_s: f64,
    span_s: f64,
    memory_kib: u64,
    /// Durations of ten messages, sorted, ns.
    publishing: Vec<u64>,
}

impl Cost {
    fn print(&self, what: &str) {
        let quantile = |part: f64| {
            let index =
                ((self.publishing.len() as f64 * part) as usize).min(self.publishing.len().saturating_sub(1));
            self.publishing.get(index).map_or(0.0, |nanos| *nanos as f64 / 1e3)
        };
        println!(
            "{what:24} {:6.2} % of a core   ten messages: p50 {:6.1} us, p99 {:6.1} us, p99.9 {:7.1} us   {} KiB",
            self.cpu_s / self.span_s * 100.0,
            quantile(0.5),
            quantile(0.99),
            quantile(0.999),
            self.memory_kib
        );
    }
}

/// Seconds of the processor that this process has used, in ticks of 10 ms.
fn cpu_s() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let after = stat.rsplit(')').next().unwrap_or_default();
    let ticks = after.split_whitespace().skip(11).take(2).filter_map(|ticks| ticks.parse::<f64>().ok());
    ticks.sum::<f64>() / 100.0
}

fn memory_kib() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).unwrap_or_default();
    line.split_whitespace().next().and_then(|kib| kib.parse().ok()).unwrap_or_default()
}

/// Runs for a while and measures.
fn measure(times: &Mutex<Vec<u64>>, during: impl FnOnce()) -> Cost {
    times.lock().map(|mut times| times.clear()).unwrap_or_default();
    let (cpu, start) = (cpu_s(), Instant::now());
    during();
    std::thread::sleep(SPAN.saturating_sub(start.elapsed()));
    let mut publishing = times.lock().map(|times| times.clone()).unwrap_or_default();
    publishing.sort_unstable();
    Cost { cpu_s: cpu_s() - cpu, span_s: start.elapsed().as_secs_f64(), memory_kib: memory_kib(), publishing }
}

/// Reads frames until it is told to stop; counts them and the messages in them.
fn watch(dashboard: &Dashboard, stop: &AtomicBool, frames: &AtomicU64) -> Result<(), Box<dyn Error>> {
    let address = dashboard.address();
    let (mut socket, _) = tungstenite::client(format!("ws://{address}/ws"), TcpStream::connect(address)?)?;
    // With the token: readers make room for others.
    let token = dashboard.url().split("#token=").nth(1).unwrap_or_default().to_owned();
    socket.send(Message::text(format!(r#"{{"op":"hello","version":1,"token":"{token}"}}"#)))?;
    let paths: Vec<String> = (0..10).map(|number| format!("\"sensor/base/s{number}\"")).collect();
    socket.send(Message::text(format!(r#"{{"op":"watch","id":1,"paths":[{}]}}"#, paths.join(","))))?;
    while !stop.load(Ordering::Relaxed) {
        if socket.read()?.to_text()?.contains("\"messages\"") {
            frames.fetch_add(1, Ordering::Relaxed);
        }
    }
    Ok(())
}

/// Ten thousand connections, garbage, frames of 1 GiB that are announced, viewers that read nothing.
fn attack(address: SocketAddr) {
    let mut held = Vec::new();
    for number in 0..10_000_u32 {
        let Ok(mut stream) = TcpStream::connect(address) else { continue };
        let upgrade = "GET /ws HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\
                       Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";
        let upgrade = upgrade.replace("localhost", &format!("localhost:{}", address.port()));
        let _ = match number % 4 {
            0 => stream.write_all(b"\x00\x01\x02garbage\r\n\r\n"),
            1 => stream.write_all(b"GET /ws HTTP/1.1\r\nUpgrade: webso"),
            2 => stream
                .write_all(upgrade.as_bytes())
                .and_then(|()| stream.write_all(&[0x81, 0xff, 0, 0, 0, 0, 0x40, 0, 0, 0, 1, 2, 3, 4])),
            _ => Ok(()),
        };
        held.push(stream);
        if held.len() > 500 {
            held.remove(0);
        }
    }
}

/// Time until the next page is there.
fn page(address: SocketAddr) -> Result<Duration, Box<dyn Error>> {
    let start = Instant::now();
    let mut stream = TcpStream::connect(address)?;
    let request = format!("GET / HTTP/1.1\r\nHost: localhost:{}\r\nConnection: close\r\n\r\n", address.port());
    stream.write_all(request.as_bytes())?;
    let mut answer = String::new();
    stream.read_to_string(&mut answer)?;
    if answer.starts_with("HTTP/1.1 200") { Ok(start.elapsed()) } else { Err("no page".into()) }
}

fn main() -> Result<(), Box<dyn Error>> {
    let running = Busy::builder().start()?;
    let publishers: Vec<Publisher<Imu>> =
        (0..10).map(|number| running.publisher(&format!("sensor/base/s{number}"))).collect::<Result<_, _>>()?;
    let times = Arc::new(Mutex::new(Vec::with_capacity(1 << 16)));
    let (stop, taken) = (Arc::new(AtomicBool::new(false)), Arc::clone(&times));
    let stopped = Arc::clone(&stop);
    let feeding = std::thread::spawn(move || {
        let mut next = Instant::now();
        while !stopped.load(Ordering::Relaxed) {
            let start = Instant::now();
            for (number, publisher) in publishers.iter().enumerate() {
                let rate = bb_core::nalgebra::Vector3::new(0.1, 0.2, number as f64);
                publisher.publish(Imu::new(rate, bb_core::nalgebra::Vector3::new(0.0, 0.0, 9.81)));
            }
            let nanos = u64::try_from(start.elapsed().as_nanos()).unwrap_or(u64::MAX);
            if let Ok(mut times) = taken.lock() {
                times.push(nanos);
            }
            next += Duration::from_millis(1);
            std::thread::sleep(next.saturating_duration_since(Instant::now()));
        }
    });
    let options = DashboardOptions { port: 0, ..DashboardOptions::defaults() };
    let serve: Vec<String> = std::env::args().skip(1).collect();
    if let [flag, seconds] = &serve[..]
        && flag == "--serve"
    {
        let dashboard = Dashboard::serve(&running, options)?;
        println!("to steer: {}", dashboard.url());
        let seconds: u64 = seconds.parse()?;
        for _ in 0..seconds.div_ceil(SPAN.as_secs()) {
            measure(&times, || ()).print(&format!("{} viewers", dashboard.viewers()));
        }
    } else {
        measure(&times, || ()).print("no dashboard");
        let dashboard = Dashboard::serve(&running, options)?;
        measure(&times, || ()).print("no viewer");
        let (leave, frames) = (AtomicBool::new(false), AtomicU64::new(0));
        std::thread::scope(|scope| -> Result<(), Box<dyn Error>> {
            let viewer = scope.spawn(|| watch(&dashboard, &leave, &frames).map_err(|error| error.to_string()));
            std::thread::sleep(Duration::from_secs(1));
            let before = frames.load(Ordering::Relaxed);
            let cost = measure(&times, || ());
            cost.print("a viewer of ten topics");
            let count = frames.load(Ordering::Relaxed) - before;
            println!("{:24} {:6.1} frames a second", "", count as f64 / cost.span_s);
            let attacked = measure(&times, || attack(dashboard.address()));
            attacked.print("the same, attacked");
            println!("{:24} the next page after {:?}", "", page(dashboard.address())?);
            leave.store(true, Ordering::Relaxed);
            Ok(viewer.join().map_err(|_| "the viewer panicked")??)
        })?;
    }
    stop.store(true, Ordering::Relaxed);
    feeding.join().map_err(|_| "the feeding thread panicked")?;
    running.stop().ok()?;
    Ok(())
}
