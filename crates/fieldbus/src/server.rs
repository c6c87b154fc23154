//! Serves a segment on a network interface, in real time.

use std::io::Result;
use std::time::{Duration, Instant};

use crate::frame::LONGEST;
use crate::segment::Segment;
use crate::socket::{Socket, raise_priority};

/// Interval at which the machine continues without frames.
const IDLE: Duration = Duration::from_millis(1);
/// Priority of the thread, below those of a bench on the same computer.
const PRIORITY: u8 = 78;

/// A segment on an interface.
pub struct Server {
    socket: Socket,
    segment: Segment,
    jitter: Duration,
}

impl Server {
    /// Binds an interface. `jitter` is the largest additional delay of a frame, equally distributed.
    ///
    /// # Errors
    /// Errors of the system: the interface does not exist, or the process lacks the right to open a raw socket.
    pub fn bind(interface: &str, segment: Segment, jitter: Duration) -> Result<Self> {
        Ok(Server { socket: Socket::open(interface)?, segment, jitter })
    }

    /// The served segment.
    pub fn segment(&self) -> &Segment {
        &self.segment
    }

    /// Passes frames through the segment until `goes_on` returns false; it is called after each frame, at least every
    /// millisecond. The calling thread gets a real-time priority if the system permits it: otherwise frames are late on a
    /// loaded computer.
    ///
    /// # Errors
    /// Errors of the socket, for example when the interface is switched off.
    pub fn serve(&mut self, mut goes_on: impl FnMut(&mut Segment) -> bool) -> Result<()> {
        let _ = raise_priority(PRIORITY);
        let start = Instant::now();
        let nanoseconds = || start.elapsed().as_nanos() as u64;
        let mut frame = [0; LONGEST];
        let mut random = 0x2545_F491_4F6C_DD1D_u64;
        while goes_on(&mut self.segment) {
            let Some(length) = self.socket.receive(&mut frame, IDLE)? else {
                self.segment.advance(nanoseconds());
                continue;
            };
            if self.segment.pass(&mut frame[..length], nanoseconds()) {
                if !self.jitter.is_zero() {
                    random ^= random << 13;
                    random ^= random >> 7;
                    random ^= random << 17;
                    let until = Instant::now() + self.jitter.mul_f64((random >> 11) as f64 / (1_u64 << 53) as f64);
                    while Instant::now() < until {
                        std::hint::spin_loop();
                    }
                }
                self.socket.send(&frame[..length])?;
            }
        }
        Ok(())
    }
}
