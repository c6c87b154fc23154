//! Frames of the main device on a raw socket: futures of `ethercrab` run on the calling thread, without a reactor.

use std::future::Future;
use std::io::ErrorKind;
use std::pin::{Pin, pin};
use std::task::{Context, Poll, Waker};
use std::time::{Duration, Instant};

use ethercrab::error::Error;
use ethercrab::{PduRx, PduStorage, PduTx};

use crate::frame::LONGEST;
use crate::socket::Socket;

/// Room for the frames of a main device.
pub(crate) type Storage = PduStorage<16, { PduStorage::element_size(1100) }>;

/// Longest wait for a frame, after which timers are checked.
const LOOK: Duration = Duration::from_micros(500);

/// The socket of a main device.
pub(crate) struct Wire<'a> {
    socket: Socket,
    tx: PduTx<'a>,
    rx: PduRx<'a>,
    buffer: [u8; LONGEST],
}

impl<'a> Wire<'a> {
    pub(crate) fn new(socket: Socket, tx: PduTx<'a>, rx: PduRx<'a>) -> Self {
        Wire { socket, tx, rx, buffer: [0; LONGEST] }
    }

    /// Runs a future to its end.
    pub(crate) fn run<F: Future>(&mut self, future: F) -> F::Output {
        let mut future = pin!(future);
        loop {
            if let Poll::Ready(output) = self.poll(future.as_mut()) {
                return output;
            }
            self.receive(LOOK);
        }
    }

    /// Runs a future for this time at most, then drops it: `None`.
    pub(crate) fn run_within<F: Future>(&mut self, future: F, time: Duration) -> Option<F::Output> {
        let mut future = pin!(future);
        let start = Instant::now();
        loop {
            if let Poll::Ready(output) = self.poll(future.as_mut()) {
                return Some(output);
            }
            let left = time.checked_sub(start.elapsed()).filter(|left| !left.is_zero())?;
            self.receive(LOOK.min(left));
        }
    }

    /// Polls a future and sends its frames. A frame that the interface refuses counts as sent and lost: the future ends
    /// by its own time-out.
    fn poll<F: Future>(&mut self, future: Pin<&mut F>) -> Poll<F::Output> {
        let output = future.poll(&mut Context::from_waker(Waker::noop()));
        while let Some(frame) = self.tx.next_sendable_frame() {
            let socket = &mut self.socket;
            let sent = frame.send_blocking(|bytes| {
                let _ = socket.send(bytes);
                Ok(bytes.len())
            });
            debug_assert_eq!(sent.as_ref().err(), None::<&Error>);
        }
        output
    }

    /// Waits for a frame for this time at most.
    fn receive(&mut self, wait: Duration) {
        match self.socket.receive(&mut self.buffer, wait) {
            // A late answer to a frame that was given up is refused there.
            Ok(Some(length)) => drop(self.rx.receive_frame(&self.buffer[..length])),
            Ok(None) => {}
            Err(error) if error.kind() == ErrorKind::WouldBlock => {}
            // The interface is down: no frame comes.
            Err(_) => std::thread::sleep(wait),
        }
    }
}
