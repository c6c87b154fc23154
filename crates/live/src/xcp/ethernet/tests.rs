//! The XCP addresses with masters and hostile clients.

use std::io::{Read as _, Write as _};
use std::net::{TcpStream, UdpSocket};

use crate::Start;
use crate::protocol::{Answer, Call, Status};
use crate::xcp::frame::{self, Next};
use crate::xcp::{MAX_DTO, MEASUREMENTS};
use stickslip_base::parameters::presets;
use stickslip_bench::ThreadSettings;

use super::*;

const CONNECT: &[u8] = &[0xff, 0];
/// Short, for fast tests.
const SHORT: Duration = Duration::from_millis(300);

struct Bench {
    xcp: Xcp,
    live: Arc<Live>,
    _project: tempfile::TempDir,
}

fn open() -> Bench {
    open_for(SHORT)
}

/// A bench with a low tick rate, which a busy machine can keep, with both addresses open.
fn open_for(patience: Duration) -> Bench {
    let mut source = presets::find("clm-bench").unwrap();
    source.text =
        stickslip_base::parameters::set::<stickslip_base::Preset<f64>>(&source.text, "t", "bench.tick_rate", "1000")
            .unwrap();
    let project = tempfile::tempdir().unwrap();
    let start = Start { thread_settings: ThreadSettings::PLAIN, ..Start::new(source, project.path()) };
    let live = Arc::new(Live::start(start).unwrap());
    let anywhere = "127.0.0.1:0".parse().ok();
    let xcp = Xcp::open(&live, Doors { udp: anywhere, tcp: anywhere }, patience).unwrap();
    Bench { xcp, live, _project: project }
}

impl Bench {
    fn status(&self) -> Status {
        match self.live.call("looks", Call::Status {}).unwrap() {
            Answer::Status(status) => *status,
            other => panic!("{other:?}"),
        }
    }

    /// Waits until the status satisfies a condition.
    fn until(&self, condition: impl Fn(&Status) -> bool) -> Status {
        loop {
            let status = self.status();
            if condition(&status) {
                return status;
            }
            thread::sleep(POLL_INTERVAL);
        }
    }

    fn stop(self) -> stickslip_bench::TimingReport {
        self.xcp.stop();
        Arc::into_inner(self.live).expect("no door holds it any more").stop().unwrap()
    }

    fn tcp(&self) -> TcpStream {
        let stream = TcpStream::connect(self.xcp.doors.tcp.unwrap()).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
        stream
    }
}

/// A master over UDP.
struct Master {
    socket: UdpSocket,
    counter: Option<u16>,
    measured: Vec<Vec<u8>>,
}

impl Master {
    fn of(bench: &Bench) -> Self {
        Master::at("127.0.0.1:0", bench)
    }

    fn at(address: &str, bench: &Bench) -> Self {
        let socket = UdpSocket::bind(address).unwrap();
        socket.connect(bench.xcp.doors.udp.unwrap()).unwrap();
        Master { socket, counter: None, measured: Vec::new() }
    }

    fn send(&self, packet: &[u8]) {
        // Fails if the port is closed at the moment.
        let _ = self.socket.send(&framed(packet));
    }

    /// Receives one datagram. Returns the response in it, if any.
    fn hear(&mut self, patience: Duration) -> Option<Vec<u8>> {
        let mut datagram = [0; 2048];
        self.socket.set_read_timeout(Some(patience)).unwrap();
        let size = self.socket.recv(&mut datagram).ok()?;
        assert!(size <= 1452, "fits Ethernet");
        let (mut rest, mut response) = (&datagram[..size], None);
        while let Next::Packet(packet, behind) = frame::next(rest, MAX_DTO) {
            let counter = u16::from_le_bytes([rest[2], rest[3]]);
            assert!(self.counter.is_none_or(|before| counter == before.wrapping_add(1)), "no frame is lost");
            (self.counter, rest) = (Some(counter), behind);
            match packet[0] {
                0xfe | 0xff => response = Some(packet.to_vec()),
                0xfc | 0xfd => {}
                _ => self.measured.push(packet.to_vec()),
            }
        }
        response
    }

    fn ask(&mut self, packet: &[u8]) -> Vec<u8> {
        self.send(packet);
        let begun = Instant::now();
        while begun.elapsed() < Duration::from_secs(60) {
            if let Some(response) = self.hear(Duration::from_secs(1)) {
                return response;
            }
            // A datagram may be lost while the address is reopened; masters repeat it.
            if packet == CONNECT {
                self.send(packet);
            }
        }
        panic!("no response to {packet:02x?}");
    }

    /// Measures the number of every cycle.
    fn measure(&mut self) {
        let write = [&[0xe1, 0xff, 8, 0][..], &MEASUREMENTS.to_le_bytes()].concat();
        for command in [
            CONNECT,
            &[0xd6],
            &[0xd5, 0, 1, 0],
            &[0xd4, 0, 0, 0, 1],
            &[0xd3, 0, 0, 0, 0, 1],
            &[0xe2, 0, 0, 0, 0, 0],
            &write,
            &[0xe0, 0x10, 0, 0, 0, 0, 1, 0],
            &[0xde, 1, 0, 0],
        ] {
            assert_eq!(self.ask(command)[0], 0xff, "{command:02x?}");
        }
    }
}

fn framed(packet: &[u8]) -> Vec<u8> {
    let mut out = Vec::new();
    frame::push(&mut out, &mut 0, [packet, &[]]);
    out
}

/// The next packet of a connection; `None`: closed.
fn heard(stream: &mut TcpStream) -> Option<Vec<u8>> {
    let mut header = [0; 4];
    stream.read_exact(&mut header).ok()?;
    let mut packet = vec![0; usize::from(u16::from_le_bytes([header[0], header[1]]))];
    stream.read_exact(&mut packet).ok()?;
    Some(packet)
}

#[test]
fn every_cycle_is_measured_while_parameters_change_and_other_masters_get_nothing() {
    let bench = open();
    let mut master = Master::of(&bench);
    master.measure();
    let mut second = Master::of(&bench);
    second.send(CONNECT);
    assert_eq!(second.hear(SHORT), None);
    // A change of a gain makes it the operator.
    let layout = Layout::new(1000.0);
    let path = "bench.controller.position_gain";
    let at = layout.parameters.iter().find(|parameter| parameter.cell.path == path).unwrap().cell.address;
    let gain = |value: f64| [&[0xed, 8, 0, 0][..], &at.to_le_bytes(), &value.to_le_bytes()].concat();
    assert_eq!(master.ask(&gain(11.5)), [0xff]);
    let status = bench.until(|status| status.xcp.iter().any(|door| door.measuring));
    assert!(status.operator.unwrap().starts_with("XCP of 127.0.0.1:") && status.changed == 1);
    let refused = bench.live.call("ann", Call::Undo {}).unwrap_err();
    assert!(matches!(refused.of(), Some(crate::LiveError::Operated { .. })), "{refused}");
    while master.measured.len() < 500 {
        master.hear(Duration::from_secs(20));
    }
    assert_eq!(master.ask(&[0xfe]), [0xff]);
    let cycle = |packet: &Vec<u8>| f64::from_le_bytes(packet[6..14].try_into().unwrap());
    let lost = bench.status().xcp[0].lost;
    let cycles: Vec<f64> = master.measured.iter().map(cycle).collect();
    // Cycles missed by the machine itself are counted.
    let missing = cycles.windows(2).filter(|pair| pair[1] != pair[0] + 1.0).count();
    assert!(
        missing as u64 <= lost && lost <= bench.status().clock.held + bench.status().clock.lost,
        "{missing} {lost}"
    );
    // It is no longer master and operator.
    bench.until(|status| status.xcp[0].master.is_none());
    assert_eq!(second.ask(CONNECT)[0], 0xff);
    assert_eq!(second.ask(&gain(12.0)), [0xff]);
    assert_eq!(bench.stop().summary.ending.to_string(), "it was stopped");
}

#[test]
fn a_gone_or_silent_master_is_replaced() {
    let bench = open();
    let mut first = Master::of(&bench);
    first.measure();
    // It measures and its port is closed: the system reports it.
    drop(first);
    bench.until(|status| status.xcp[0].master.is_none());
    let mut second = Master::of(&bench);
    assert_eq!(second.ask(CONNECT)[0], 0xff);
    // It is silent: it may continue until another one connects.
    thread::sleep(2 * SHORT);
    assert_eq!(second.ask(&[0xfd])[0], 0xff);
    thread::sleep(2 * SHORT);
    let mut third = Master::of(&bench);
    assert_eq!(third.ask(CONNECT)[0], 0xff);
    second.send(&[0xfd]);
    assert_eq!(second.hear(SHORT), None);
    bench.stop();
}

#[test]
fn a_master_that_restarts_on_the_same_host_takes_over_at_once_and_one_on_another_host_does_not() {
    let bench = open_for(Duration::from_secs(3600));
    let mut first = Master::of(&bench);
    assert_eq!(first.ask(CONNECT)[0], 0xff);
    // All addresses 127.x.x.x are on this computer; each is another host for the bench.
    let mut other = Master::at("127.0.0.2:0", &bench);
    other.send(CONNECT);
    assert_eq!(other.hear(SHORT), None);
    // The former port is still open, as after a crash behind a firewall: the system reports nothing.
    let mut restarted = Master::of(&bench);
    assert_eq!(restarted.ask(CONNECT)[0], 0xff);
    assert_eq!(restarted.ask(&[0xfd])[0], 0xff);
    first.send(&[0xfd]);
    assert_eq!(first.hear(SHORT), None);
    bench.stop();
}

#[test]
fn a_measurement_is_taken_over_from_the_same_host_only_after_a_silence() {
    let bench = open();
    let mut first = Master::of(&bench);
    first.measure();
    let mut second = Master::of(&bench);
    second.send(CONNECT);
    assert_eq!(second.hear(SHORT / 3), None);
    thread::sleep(2 * SHORT);
    assert_eq!(second.ask(CONNECT)[0], 0xff);
    let address = second.socket.local_addr().unwrap().to_string();
    bench.until(|status| status.xcp[0].master.as_ref() == Some(&address));
    bench.stop();
}

#[test]
fn a_flood_of_invalid_datagrams_does_not_affect_the_bench() {
    let bench = open();
    let before = bench.status();
    let strangers: Vec<Master> = (0..4).map(|_| Master::of(&bench)).collect();
    for i in 0..5000u32 {
        let rubbish: Vec<u8> =
            (0..(i % 300)).map(|j| (i.wrapping_mul(2654435761).wrapping_add(j * j) >> 7) as u8).collect();
        let _ = strangers[i as usize % 4].socket.send(&rubbish);
    }
    drop(strangers);
    let mut master = Master::of(&bench);
    // The next master is served as soon as there is no other.
    while {
        master.send(CONNECT);
        master.hear(SHORT).is_none()
    } {}
    // Invalid lengths after a valid command.
    let _ = master.socket.send(&[framed(&[0xfd]), vec![0xff, 0xff, 0, 0, 1], framed(&[0xfd])].concat());
    assert_eq!(master.hear(Duration::from_secs(20)).map(|answer| answer[0]), Some(0xff));
    assert_eq!(master.hear(SHORT), None, "the rest of the datagram is dropped");
    let after = bench.until(|status| status.cycle > before.cycle + 100);
    assert_eq!(after.clock.lost, 0);
    bench.stop();
}

#[test]
fn a_corrupt_length_ends_its_connection_and_no_other() {
    let bench = open();
    // One client sends nothing, one half a frame: both stay connected.
    let mut half = bench.tcp();
    half.write_all(&[2, 0]).unwrap();
    let mut mute = bench.tcp();
    let mut stream = bench.tcp();
    stream.write_all(&framed(CONNECT)).unwrap();
    assert_eq!(heard(&mut stream).unwrap().len(), 8);
    // Piece by piece.
    for byte in framed(&[0xfd]) {
        stream.write_all(&[byte]).unwrap();
    }
    assert_eq!(heard(&mut stream).unwrap().len(), 6);
    // A second master is refused.
    let mut second = bench.tcp();
    second.write_all(&framed(CONNECT)).unwrap();
    assert_eq!(heard(&mut second), None);
    stream.write_all(&[0xff, 0xff, 0, 0]).unwrap();
    assert_eq!(heard(&mut stream), None);
    let mut next = bench.tcp();
    loop {
        next.write_all(&framed(CONNECT)).unwrap();
        match heard(&mut next) {
            Some(answer) => break assert_eq!(answer[0], 0xff),
            // The first master is released a moment later.
            None => next = bench.tcp(),
        }
    }
    // Clients that never sent `CONNECT` are disconnected.
    assert_eq!((heard(&mut half), heard(&mut mute)), (None, None));
    assert_eq!(bench.until(|status| status.xcp[1].master.is_some()).clock.lost, 0);
    bench.stop();
}

#[test]
fn a_client_that_never_reads_its_responses_is_disconnected() {
    let bench = open();
    let mut stream = bench.tcp();
    stream.set_write_timeout(Some(POLL_INTERVAL)).unwrap();
    stream.write_all(&framed(CONNECT)).unwrap();
    let many = framed(&[0xfd]).repeat(500);
    // Until the buffers of both sides are full and the connection is ended.
    loop {
        match stream.write(&many) {
            Err(error) if !is_later(&error) => break,
            _ => {}
        }
    }
    let mut next = bench.tcp();
    next.write_all(&framed(CONNECT)).unwrap();
    while heard(&mut next).is_none() {
        next = bench.tcp();
        next.write_all(&framed(CONNECT)).unwrap();
    }
    bench.stop();
}
