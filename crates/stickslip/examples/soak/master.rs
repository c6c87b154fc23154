//! An XCP master over UDP that measures twenty signals in every cycle, and counts losses.

use std::io;
use std::net::{SocketAddr, UdpSocket};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use stickslip::xcp::frame::{self, Next};
use stickslip::xcp::{Layout, MAX_DTO};

/// Number of measured signals.
const MEASURED: usize = 20;
/// Bytes before the signals of a row: identification and time.
const HEAD: usize = 6;
/// Timeout of a response.
const PATIENCE: Duration = Duration::from_secs(5);

/// Counts of a master.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Measured {
    /// Rows, frames missing by the counter, and missing cycles.
    pub(crate) rows: u64,
    pub(crate) frames: u64,
    pub(crate) missing: u64,
}

/// One master.
pub(crate) struct Master {
    socket: UdpSocket,
    counter: Option<u16>,
    cycle: Option<f64>,
    measured: Measured,
}

impl Master {
    /// Connects to a bench of a rate [Hz] and starts to measure.
    pub(crate) fn measure(address: SocketAddr, rate: f64) -> io::Result<Self> {
        let socket = UdpSocket::bind((address.ip(), 0))?;
        socket.connect(address)?;
        socket.set_read_timeout(Some(PATIENCE))?;
        let mut master = Master { socket, counter: None, cycle: None, measured: Measured::default() };
        let signals = Layout::new(rate).measurements;
        let write = |address: u32| [&[0xe1, 0xff, 8, 0][..], &address.to_le_bytes()].concat();
        let writes = signals.iter().take(MEASURED).map(|cell| write(cell.address));
        let start: [&[u8]; 6] = [
            // CONNECT; FREE_DAQ; one list of one table with as many entries; to its first.
            &[0xff, 0],
            &[0xd6],
            &[0xd5, 0, 1, 0],
            &[0xd4, 0, 0, 0, 1],
            &[0xd3, 0, 0, 0, 0, MEASURED as u8],
            &[0xe2, 0, 0, 0, 0, 0],
        ];
        // With every cycle and its time; start.
        let end: [&[u8]; 2] = [&[0xe0, 0x10, 0, 0, 0, 0, 1, 0], &[0xde, 1, 0, 0]];
        let start = start.map(<[u8]>::to_vec).into_iter();
        for command in start.chain(writes).chain(end.map(<[u8]>::to_vec)) {
            let mut out = Vec::new();
            frame::push(&mut out, &mut 0, [&command, &[]]);
            master.socket.send(&out)?;
            while master.receive()? != Some(0xff) {}
        }
        Ok(master)
    }

    /// Receives all rows until the end.
    pub(crate) fn follow(mut self, leave: &AtomicBool) -> io::Result<Measured> {
        while !leave.load(Ordering::Relaxed) {
            self.receive()?;
        }
        Ok(self.measured)
    }

    /// Receives a datagram; returns the response in it, if any. A refusal is an error.
    fn receive(&mut self) -> io::Result<Option<u8>> {
        let mut datagram = [0; 2048];
        let size = self.socket.recv(&mut datagram)?;
        let (mut rest, mut response) = (&datagram[..size], None);
        while let Next::Packet(packet, behind) = frame::next(rest, MAX_DTO) {
            let counter = u16::from_le_bytes([rest[2], rest[3]]);
            let expected = self.counter.map_or(counter, |before| before.wrapping_add(1));
            self.measured.frames += u64::from(counter.wrapping_sub(expected));
            (self.counter, rest) = (Some(counter), behind);
            match packet[0] {
                0xff => response = Some(packet[0]),
                0xfe => return Err(io::Error::other(format!("refused with {:#x}", packet[1]))),
                0xfc | 0xfd => {}
                _ => self.row(packet),
            }
        }
        Ok(response)
    }

    /// A row starts with the number of its cycle.
    fn row(&mut self, packet: &[u8]) {
        let Some(Ok(cycle)) = packet.get(HEAD..HEAD + 8).map(<[u8; 8]>::try_from) else { return };
        let cycle = f64::from_le_bytes(cycle);
        self.measured.rows += 1;
        self.measured.missing += self.cycle.map_or(0, |before| (cycle - before - 1.0) as u64);
        self.cycle = Some(cycle);
    }
}
