//! Exchange of a sample and a torque with a controller in another process: through shared memory, as for a loaded
//! controller, against a socket pair. Back to back with both sides awake, and once per millisecond with a sleeping
//! peer.
//!
//! The peer is a second process of this program.

use std::error::Error;
use std::io::{Read as _, Write as _};
use std::os::fd::{AsFd as _, OwnedFd};
use std::os::unix::net::UnixStream;
use std::process::{Child, Command};
use std::time::{Duration, Instant};

use stickslip_rt::{Clock as _, MonotonicClock, Requester, Responder, hand_over, take_over};

/// Environment variable of the peer: the transport.
const TRANSPORT: &str = "STICKSLIP_BENCH_TRANSPORT";
/// Words of a sample, and bytes of a torque with its time, in the socket.
const SAMPLE: usize = 8;
const TORQUE: usize = 24;
/// Exchanges per round, back to back and paced.
const BACK_TO_BACK: u32 = 20_000;
const PACED: u64 = 200;
/// Period of paced exchanges.
const PERIOD: Duration = Duration::from_millis(1);
/// Timeout, longer than any answer takes.
const LONG: Duration = Duration::from_secs(10);

/// Names of the measurements.
pub(crate) const NAMES: [&str; 2] = ["exchange_awake/socket_pair", "exchange_paced/socket_pair"];

/// Runs as the peer if the environment requests it. Returns whether it did.
pub(crate) fn run_as_peer() -> Result<bool, Box<dyn Error>> {
    let Some(how) = std::env::var_os(TRANSPORT) else { return Ok(false) };
    let mut socket = UnixStream::from(std::io::stdin().as_fd().try_clone_to_owned()?);
    if how == "memory" {
        let mut answerer = Responder::open(&take_over(&socket)?, SAMPLE)?;
        loop {
            let Some(sample) = answerer.question(LONG) else { continue };
            let torque = sample[1];
            answerer.answer([0, torque, 0, 0, 0, 0]);
        }
    }
    let (mut sample, mut torque) = ([0; 8 * SAMPLE], [0; TORQUE]);
    while socket.read_exact(&mut sample).is_ok() {
        torque[8..16].copy_from_slice(&sample[8..16]);
        socket.write_all(&torque)?;
    }
    Ok(true)
}

/// A running peer process.
struct Peer {
    child: Child,
    socket: UnixStream,
}

impl Peer {
    fn start(how: &str) -> Result<Self, Box<dyn Error>> {
        let (socket, peer_socket) = UnixStream::pair()?;
        let mut command = Command::new(std::env::current_exe()?);
        let child = command.env(TRANSPORT, how).stdin(OwnedFd::from(peer_socket)).spawn()?;
        Ok(Peer { child, socket })
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Nanoseconds per exchange through memory and through the socket, median of the rounds: back to back and paced.
pub(crate) fn run(rounds: usize) -> Result<[[f64; 2]; 2], Box<dyn Error>> {
    let (mut asker, memory) = Requester::new(SAMPLE)?;
    let ours = Peer::start("memory")?;
    hand_over(&ours.socket, &memory)?;
    let mut peer = Peer::start("socket")?;
    let mut through_memory = |value: u64| -> Result<u64, Box<dyn Error>> {
        asker.ask([2, value, 3, 4, 5, 6, 7, 8]);
        loop {
            if let Some([_, torque, ..]) = asker.wait(LONG) {
                return Ok(torque);
            }
        }
    };
    let mut through_socket = |value: u64| -> Result<u64, Box<dyn Error>> {
        let mut sample = [0; 8 * SAMPLE];
        sample[8..16].copy_from_slice(&value.to_ne_bytes());
        peer.socket.write_all(&sample)?;
        let mut torque = [0; TORQUE];
        peer.socket.read_exact(&mut torque)?;
        Ok(u64::from_ne_bytes(torque[8..16].try_into()?))
    };
    let mut all: [[Vec<f64>; 2]; 2] = Default::default();
    for _ in 0..rounds {
        all[0][0].push(back_to_back(&mut through_memory)?);
        all[0][1].push(back_to_back(&mut through_socket)?);
        all[1][0].push(paced(&mut through_memory)?);
        all[1][1].push(paced(&mut through_socket)?);
    }
    Ok(all.map(|pair| pair.map(median)))
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

type Exchange<'a> = &'a mut dyn FnMut(u64) -> Result<u64, Box<dyn Error>>;

fn checked(exchange: Exchange<'_>, value: u64) -> Result<(), Box<dyn Error>> {
    if exchange(value)? == value { Ok(()) } else { Err("the answer belongs to another sample".into()) }
}

fn back_to_back(exchange: Exchange<'_>) -> Result<f64, Box<dyn Error>> {
    let start = Instant::now();
    for value in 0..BACK_TO_BACK {
        checked(exchange, value.into())?;
    }
    Ok(start.elapsed().as_secs_f64() * 1e9 / f64::from(BACK_TO_BACK))
}

fn paced(exchange: Exchange<'_>) -> Result<f64, Box<dyn Error>> {
    let clock = MonotonicClock::default();
    let start = clock.now();
    let mut times = Vec::new();
    for k in 1..=PACED {
        let begin = clock.wait_until(start + k * PERIOD.as_nanos() as u64);
        checked(exchange, k)?;
        times.push((clock.now() - begin) as f64);
    }
    Ok(median(times))
}
