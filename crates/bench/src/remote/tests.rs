use std::net::{SocketAddr, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};

use super::frame::{Begun, Reason};
use super::*;
use crate::home;
use crate::{Bench, Command, VirtualBench};
use stickslip_base::parameters::presets;
use stickslip_base::{Preset, Watch};

const LOCAL: &str = "udp:127.0.0.1:0";

fn preset() -> Preset<f64> {
    presets::find("clm-real").unwrap().read().unwrap()
}

/// A machine that serves until the end of the first bench.
fn plant(address: &str, seed: u64) -> (Address, JoinHandle<Result<Served, Error>>) {
    let mut server = PlantServer::bind(&address.parse().unwrap(), &preset(), seed).unwrap();
    (server.address().clone(), thread::spawn(move || server.serve(true, &Watch::silent())))
}

/// A shared memory of this test.
fn memory(folder: &tempfile::TempDir) -> String {
    format!("shm:{}", folder.path().join("axis").display())
}

#[test]
fn another_process_gives_the_same_bits_with_changes_of_the_preload() {
    gives_the_same_bits(LOCAL);
    let folder = tempfile::tempdir().unwrap();
    gives_the_same_bits(&memory(&folder));
    assert_eq!(folder.path().read_dir().unwrap().count(), 0, "nothing is left of the shared memory");
}

fn gives_the_same_bits(address: &str) {
    let (address, server) = plant(address, 7);
    let mut here = VirtualBench::new(&preset(), 7).unwrap();
    let mut there = RemoteBench::connect(&preset(), &address).unwrap();
    assert_eq!(there.preload(), here.preload());
    home(&mut here, &Watch::silent()).unwrap();
    home(&mut there, &Watch::silent()).unwrap();
    let ticks = |bench: &mut dyn Bench| -> Vec<_> {
        let mut frames = Vec::new();
        for preload in [0.3, 1.0] {
            bench.set_preload(preload).unwrap();
            let command = Command { added_torque: 0.4, ..Command::default() };
            frames.extend((0..500).map(|_| bench.step(command).unwrap()));
        }
        frames
    };
    let (ours, theirs) = (ticks(&mut here), ticks(&mut there));
    assert_eq!(ours, theirs);
    assert!(ours.last().unwrap().angle > 1.0, "it moves");
    assert!(matches!(there.set_preload(1.5), Err(Error::OutOfRange { value: 1.5, .. })));
    drop(there);
    let served = server.join().unwrap().unwrap();
    assert_eq!((served.sessions, served.refused), (1, 0));
    assert!(served.ticks > 1000);
}

/// The fault of a bench whose machine starts correctly and answers the first tick by `answer`.
fn fault(answer: impl FnOnce(&UdpSocket, SocketAddr, u64) + Send + 'static) -> String {
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    let address = Address::Udp(socket.local_addr().unwrap());
    let machine = thread::spawn(move || {
        let mut bytes = [0; LONGEST];
        for first in [true, false] {
            let (length, peer) = socket.recv_from(&mut bytes).unwrap();
            let (sequence, _) = Message::read(&bytes[..length]).unwrap();
            if first {
                let begun = Message::Begun(Begun { preload: 1.0, measurement: Measurement::default() });
                socket.send_to(&begun.datagram(sequence), peer).unwrap();
            } else {
                answer(&socket, peer, sequence);
                break;
            }
        }
        socket
    });
    let Preset { model, bench: settings, .. } = preset();
    let mut bench = RemoteBench::connect_within(&model, &settings, &address, Duration::from_millis(300)).unwrap();
    let mut step = || match bench.step(Command::default()) {
        Err(Error::BenchFault { cycle, reason }) => (cycle, reason),
        other => panic!("{other:?}"),
    };
    let (cycle, reason) = step();
    assert_eq!((cycle, step().1), (0, reason.clone()), "a failed link stays failed");
    machine.join().unwrap();
    reason
}

/// Readings under a number.
fn readings(sequence: u64) -> Vec<u8> {
    Message::Readings(Measurement::default()).datagram(sequence).to_vec()
}

fn send(bytes: Vec<u8>) -> impl FnOnce(&UdpSocket, SocketAddr, u64) + Send + 'static {
    move |socket, peer, _| {
        socket.send_to(&bytes, peer).unwrap();
    }
}

#[test]
fn a_lost_datagram_is_reported() {
    let text = fault(|_, _, _| ());
    assert!(text.starts_with("no answer to frame 1 from udp:127.0.0.1:"), "{text}");
}

#[test]
fn a_duplicated_answer_is_reported() {
    let text = fault(send(readings(0)));
    assert!(text.starts_with("the answer to frame 0 arrived twice"), "{text}");
}

#[test]
fn an_answer_to_another_datagram_is_reported() {
    let text = fault(send(readings(9)));
    assert!(text.contains("to frame 9 arrived instead of that to frame 1"), "{text}");
}

#[test]
fn a_damaged_answer_is_reported() {
    let mut bytes = readings(1);
    bytes[20] ^= 1;
    assert!(fault(send(bytes)).contains("damaged: its checksum is wrong"));
    assert!(fault(send(vec![1, 2, 3])).contains("damaged: its length of 3 bytes"));
    assert!(fault(send(Message::End.datagram(1).to_vec())).contains("damaged: its kind is 8"));
}

#[test]
fn a_refusal_is_reported() {
    let lost = Reason::Sequence.message(1.0, 2.0).datagram(1).to_vec();
    assert!(fault(send(lost)).contains("frame 2 arrived instead of frame 1: a frame was lost"));
    let late = Reason::Sequence.message(3.0, 2.0).datagram(1).to_vec();
    assert!(fault(send(late)).contains("a frame was duplicated or late"));
}

/// A client with raw datagrams.
struct Raw {
    socket: UdpSocket,
    address: SocketAddr,
}

impl Raw {
    fn new(address: &Address) -> Self {
        let Address::Udp(address) = *address else { panic!("{address}") };
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        socket.set_read_timeout(Some(Duration::from_secs(5))).unwrap();
        Raw { socket, address }
    }

    fn ask(&self, datagram: &[u8]) -> Message {
        self.socket.send_to(datagram, self.address).unwrap();
        let mut bytes = [0; LONGEST];
        let length = self.socket.recv(&mut bytes).unwrap();
        Message::read(&bytes[..length]).unwrap().1
    }

    fn refusal(&self, datagram: &[u8]) -> String {
        match self.ask(datagram) {
            Message::Refusal(refusal) => refusal.to_string(),
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn a_machine_refuses_damaged_lost_duplicated_and_foreign_frames_and_another_tick_time() {
    let (address, server) = plant(LOCAL, 1);
    let (bench, stranger) = (Raw::new(&address), Raw::new(&address));
    let tick = |sequence: u64| Message::Voltages(Voltages::default()).datagram(sequence);
    assert_eq!(bench.refusal(&tick(0)), "no bench has started it");
    let begin = |tick_time: f64| Message::Begin(Begin { tick_time }).datagram(0);
    let other_tick = bench.refusal(&begin(1e-3));
    assert!(other_tick.contains("its tick time is 0.00025 s, that of this bench is 0.001 s"), "{other_tick}");
    assert!(matches!(bench.refusal(&begin(f64::NAN)), text if text.contains("NaN s")));
    assert!(matches!(bench.ask(&begin(250e-6)), Message::Begun(_)));
    assert!(matches!(bench.ask(&tick(1)), Message::Readings(_)));
    assert!(bench.refusal(&tick(1)).contains("frame 1 arrived instead of frame 2: a frame was duplicated or late"));
    assert!(bench.refusal(&tick(4)).contains("frame 4 arrived instead of frame 2: a frame was lost"));
    assert_eq!(stranger.refusal(&tick(2)), "another bench uses it");
    let mut garbled = tick(2);
    garbled[18] ^= 4;
    assert_eq!(bench.refusal(&garbled), "a frame arrived damaged");
    let pressed = Message::Preload(Preload { preload: 2.0 }).datagram(2);
    assert!(bench.refusal(&pressed).contains("the preload 2 is outside 0 … 1"));
    assert!(bench.refusal(&readings(3)).contains("kind 4"));
    // The refused frames have not moved the machine.
    assert!(matches!(bench.ask(&tick(4)), Message::Readings(_)));
    stranger.socket.send_to(&Message::End.datagram(5), bench.address).unwrap();
    bench.socket.send_to(&Message::End.datagram(5), bench.address).unwrap();
    let served = server.join().unwrap().unwrap();
    assert_eq!((served.sessions, served.ticks), (1, 2));
    assert!(served.refused >= 9, "{served:?}");
}

#[test]
fn a_waiting_machine_ends_when_cancelled() {
    let mut server = PlantServer::bind(&LOCAL.parse().unwrap(), &preset(), 1).unwrap();
    let cancelled = Arc::new(AtomicBool::new(false));
    let watch = Watch::new(cancelled.clone(), |_, _| {});
    let serving = thread::spawn(move || server.serve(false, &watch));
    cancelled.store(true, Ordering::Relaxed);
    assert_eq!(serving.join().unwrap().unwrap(), Served::default());
}

#[test]
fn a_missing_machine_is_reported_with_the_command_to_start_it() {
    // A free port.
    let free = UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let Err(Error::BenchFault { reason, .. }) = RemoteBench::connect(&preset(), &Address::Udp(free)) else { panic!() };
    assert!(reason.contains(&format!("Is `stickslip plant --io udp:{free}` running there?")), "{reason}");
}
