//! Time from the end of one estimator's callback to the start of the next one's on another island, beside a message
//! that one thread sends another over a channel.

use super::Line;
use super::chain::Inertial;
use bb_core::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use std::time::Instant;

/// Emits when it did so.
#[derive(Debug)]
pub(super) struct Depart(Clock);

impl Estimator for Depart {
    type Options = NoOptions;
    type Input = Inertial;
    type Output = Inertial;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self(Clock::real()))
    }

    fn handle_input(&mut self, _: &Stamped<Inertial>) -> Result<Reply<Inertial>, Fault> {
        Ok(Reply::emit(departure(&self.0)))
    }
}

/// Delays of messages, in nanoseconds.
#[derive(Debug)]
pub(super) struct Arrivals {
    clock: Clock,
    delays_ns: Vec<f64>,
}

impl Arrivals {
    fn new() -> Self {
        Self { clock: Clock::real(), delays_ns: Vec::with_capacity(ROUNDS * MESSAGES) }
    }

    fn note(&mut self, departure: &Inertial) {
        self.delays_ns.push(self.clock.now().as_nanos() as f64 - departure.first());
    }
}

/// The only input of an estimator on a worker.
#[derive(Debug)]
pub(super) struct Arrive(Arrivals);

impl Estimator for Arrive {
    type Options = NoOptions;
    type Input = Inertial;
    type Output = Inertial;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self(Arrivals::new()))
    }

    fn handle_input(&mut self, message: &Stamped<Inertial>) -> Result<Reply<Inertial>, Fault> {
        self.0.note(&message.payload);
        Ok(Reply::none())
    }
}

/// Messages of two islands to a third.
#[derive(Clone, Copy, Debug, Inputs)]
pub(super) struct Two<'a> {
    pub(super) driver: Input<'a, Inertial>,
    pub(super) other: Option<Input<'a, Inertial>>,
}

/// The driver of an estimator whose other input keeps its island busy.
#[derive(Debug)]
pub(super) struct Meet(Arrivals);

impl Estimator for Meet {
    type Options = NoOptions;
    type Input = Two<'static>;
    type Output = Inertial;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self(Arrivals::new()))
    }

    fn handle_input(&mut self, two: Two<'_>) -> Result<Reply<Inertial>, Fault> {
        std::hint::black_box(two.other);
        self.0.note(&two.driver);
        Ok(Reply::none())
    }
}

/// Takes the delays since the last time.
pub(super) struct Take;

impl HandleCall<Take> for Arrive {
    type Response = Vec<f64>;
    fn handle_call(&mut self, Take: Take) -> Result<(Vec<f64>, Reply<Inertial>), Fault> {
        Ok((std::mem::take(&mut self.0.delays_ns), Reply::none()))
    }
}

impl HandleCall<Take> for Meet {
    type Response = Vec<f64>;
    fn handle_call(&mut self, Take: Take) -> Result<(Vec<f64>, Reply<Inertial>), Fault> {
        Ok((std::mem::take(&mut self.0.delays_ns), Reply::none()))
    }
}

robot! {
    robot Busy;
    link base {
        sensor first: External<Inertial>() { estimator depart: Depart(); }
        sensor second: External<Inertial>() { estimator depart: Depart(); }
        estimator meet: Meet() {
            input driver: sensor::base::first::depart, driver;
            input other: sensor::base::second::depart, optional;
        }
    }
}

robot! {
    robot Handing;
    link base {
        sensor first: External<Inertial>() { estimator depart: Depart(); }
        estimator arrive: Arrive() { input message: sensor::base::first::depart; runs_on: worker; }
    }
}

const ROUNDS: usize = 5;
const MESSAGES: usize = 22_000;
const WARM_UP: usize = 2_000;
/// Time from one message to the next: enough for a thread to fall asleep.
const PERIOD: Duration = Duration::from_micros(20);

pub(super) fn measure() -> Result<Vec<Line>, Box<dyn std::error::Error>> {
    let busy = Busy::builder().start()?;
    let handing = Handing::builder().start()?;
    let mut best = [[f64::INFINITY; 2]; 3];
    let mut dropped = 0;
    for _ in 0..ROUNDS {
        let (busy, dropped_now) = busy_islands(&busy)?;
        dropped += dropped_now;
        let rounds = [(busy, dropped_now), (to_a_worker(&handing)?, 0), (over_a_channel()?, 0)];
        for (best, (delays_ns, dropped)) in best.iter_mut().zip(rounds) {
            let [p50, p99] = percentiles(delays_ns, dropped)?;
            *best = [best[0].min(p50), best[1].min(p99)];
        }
    }
    let [busy, worker, channel] = best;
    let dropped_percent = 100.0 * dropped as f64 / (ROUNDS * MESSAGES) as f64;
    Ok(vec![
        Line::Beside { name: "hop_busy_islands_p50", ours_ns: busy[0], beside_ns: channel[0] },
        Line::Beside { name: "hop_busy_islands_p99", ours_ns: busy[1], beside_ns: channel[1] },
        Line::Figure { name: "hop_busy_islands_dropped", ours: dropped_percent, unit: "%" },
        Line::Beside { name: "hop_to_worker_p50", ours_ns: worker[0], beside_ns: channel[0] },
        Line::Beside { name: "hop_to_worker_p99", ours_ns: worker[1], beside_ns: channel[1] },
    ])
}

/// Two threads publish: one at the period, the other without a pause. Their islands meet in a third. Returns the delays, and how
/// many messages found its inbox full: the flood fills it while the thread that drains it has no core.
fn busy_islands(running: &Running<Busy>) -> Result<(Vec<f64>, usize), Fault> {
    let dropped_before = dropped_at_meet(running);
    let clock = running.clock();
    let is_over = AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            while !is_over.load(Ordering::Relaxed) {
                running.publish(busy::sensor::base::second, clock.now(), Inertial::new(0.0));
            }
        });
        at_the_period(|| running.publish(busy::sensor::base::first, clock.now(), Inertial::new(0.0)));
        is_over.store(true, Ordering::Relaxed);
    });
    let dropped = || dropped_at_meet(running) - dropped_before;
    let delays_ns = all_of(|| running.call(busy::estimator::base::meet, Take), dropped)?;
    Ok((delays_ns, dropped()))
}

fn dropped_at_meet(running: &Running<Busy>) -> usize {
    let report = running.report();
    let driver = report.estimator("estimator/base/meet").and_then(|meet| meet.inputs.first());
    driver.map_or(0, |driver| driver.dropped(bb_core::run::DropReason::Overflow) as usize)
}

fn to_a_worker(running: &Running<Handing>) -> Result<Vec<f64>, Fault> {
    let clock = running.clock();
    at_the_period(|| running.publish(handing::sensor::base::first, clock.now(), Inertial::new(0.0)));
    all_of(|| running.call(handing::estimator::base::arrive, Take), || 0)
}

/// A call may overtake the last messages.
fn all_of(take: impl Fn() -> Result<Vec<f64>, Fault>, dropped: impl Fn() -> usize) -> Result<Vec<f64>, Fault> {
    let mut delays_ns = take()?;
    let patience = Instant::now() + Duration::from_secs(5);
    while delays_ns.len() + dropped() < MESSAGES && Instant::now() < patience {
        std::thread::sleep(Duration::from_millis(1));
        delays_ns.extend(take()?);
    }
    Ok(delays_ns)
}

/// One thread sends at the period, the other waits for it.
fn over_a_channel() -> Result<Vec<f64>, &'static str> {
    let (send, receive) = mpsc::sync_channel::<Stamped<Inertial>>(1024);
    let receiver = std::thread::spawn(move || {
        let mut arrivals = Arrivals::new();
        receive.iter().for_each(|message| arrivals.note(&message.payload));
        arrivals.delays_ns
    });
    let clock = Clock::real();
    at_the_period(|| {
        // It fails only if the receiver has panicked, which joining tells.
        let _ = send.send(Stamped::new(clock.now(), departure(&clock)));
    });
    drop(send);
    receiver.join().map_err(|_| "the receiver panicked")
}

fn departure(clock: &Clock) -> Inertial {
    // Whole below 2^53 ns, 104 days.
    Inertial::new(clock.now().as_nanos() as f64)
}

/// Keeps its core: a publisher that sleeps would add its own waking up.
fn at_the_period(mut send: impl FnMut()) {
    let clock = Clock::real();
    let mut next = clock.now();
    for _ in 0..MESSAGES {
        while clock.now() < next {
            std::hint::spin_loop();
        }
        send();
        next = clock.now() + PERIOD;
    }
}

fn percentiles(mut delays_ns: Vec<f64>, dropped: usize) -> Result<[f64; 2], String> {
    let arrived = delays_ns.len();
    if arrived + dropped != MESSAGES || arrived < MESSAGES / 2 {
        return Err(format!("{arrived} of {MESSAGES} messages arrived, and {dropped} were counted as dropped"));
    }
    // A new thread may at first have no core of its own.
    delays_ns.drain(..WARM_UP);
    delays_ns.sort_unstable_by(f64::total_cmp);
    Ok([50, 99].map(|percent| delays_ns[delays_ns.len() * percent / 100]))
}
