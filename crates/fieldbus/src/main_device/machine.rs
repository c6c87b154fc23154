//! The machine of the bench behind two servo drives.
//!
//! A thread exchanges the frames. At its end a tick hands it the outputs, and the next tick takes the answer, through
//! bounded rings: a tick neither allocates nor locks, and waits for an answer for at most a quarter of its period.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicI64;
use std::sync::mpsc;
use std::thread::{self, JoinHandle, Thread};
use std::time::{Duration, Instant};

use ethercrab::{MainDevice, MainDeviceConfig, RetryBehaviour, Timeouts};
use rtrb::{Consumer, Producer, RingBuffer};
use stickslip_base::{Error, Preset};
use stickslip_bench::remote::{Event, LinkFault, Traffic};
use stickslip_bench::segment::Segment;
use stickslip_bench::{Arrival, BenchError, Io, ServoScaling};
use stickslip_core::tick::Measurement;
use stickslip_software::cycle::Voltages;
use stickslip_software::supervise::MachineFault;

use super::bring_up::Plan;
use super::cyclic::{Analogue, Answer, Outputs};
use super::error::MainDeviceError;
use super::exchange::Exchange;
use super::profile::DriveFile;
use super::steering::Steering;
use super::units::Expected;
use super::wire::{Storage, Wire};
use crate::socket::Socket;

/// Fraction of the next tick in which readings are still accepted.
const GRACE: f64 = 0.25;
/// Frames that set the clocks at the start.
const CLOCK_FRAMES: u32 = 2000;

/// Two servo drives on one shaft.
#[derive(Debug)]
pub struct ServoDrives {
    scaling: ServoScaling,
    outputs: Option<Producer<Outputs>>,
    answers: Consumer<Answer>,
    thread: Option<JoinHandle<()>>,
    waker: Thread,
    grace: Duration,
    on: bool,
    is_on: bool,
    preload: f64,
    shift: Arc<AtomicI64>,
    traffic: Arc<Traffic>,
    segment: Arc<Segment>,
}

/// Opens servo drives at `INTERFACE` or `INTERFACE,FILE`, with the parameters of a preset. Returns the readings at rest.
///
/// # Errors
/// Cause and remedy: the interface, the file, a device that is missing or does not start, or units that differ from the
/// preset.
pub fn open(preset: &Preset<f64>, address: &str) -> Result<(Box<dyn Io + Send>, Measurement<f64>), Error> {
    let (interface, file) = address.split_once(',').unzip();
    let interface = interface.unwrap_or(address);
    let failed = |error: MainDeviceError| {
        Error::from(BenchError::Fieldbus { interface: interface.into(), reason: error.to_string() })
    };
    let scaling = ServoScaling::new(preset)?;
    let file = DriveFile::read(file.map(Path::new)).map_err(failed)?;
    let plan = plan(preset, &scaling, &file).map_err(failed)?;
    let socket = socket(interface).map_err(failed)?;
    let (outputs, outputs_out) = RingBuffer::new(4);
    let (answers_in, answers) = RingBuffer::new(16);
    let (started, start) = mpsc::channel();
    let shift = Arc::<AtomicI64>::default();
    let period = plan.period;
    let exchange = Exchange {
        analogue: file.accelerometer.map(Analogue::new),
        steering: Steering::new(period.as_nanos() as i64, shift.clone()),
        plan,
        outputs: outputs_out,
        answers: answers_in,
    };
    let exchange = move || exchange.run(socket, &started);
    let thread = thread::Builder::new().name("stickslip-ethercat".into()).stack_size(8 << 20).spawn(exchange);
    let thread = thread.map_err(|error| BenchError::Fieldbus {
        interface: interface.into(),
        reason: format!("the system cannot start a thread ({error})"),
    })?;
    let (signals, segment) = match start.recv() {
        Ok(Ok((Answer::Signals(signals, _), segment))) => (signals, Arc::new(segment)),
        Ok(Err(error)) => return Err(failed(error)),
        _ => {
            let remedy = "Check the cable, and that no other main device uses the interface.";
            return Err(failed(MainDeviceError::Step { step: "first frames".into(), reason: "lost".into(), remedy }));
        }
    };
    let readings = scaling.readings(signals);
    let traffic = Arc::<Traffic>::default();
    traffic.count(Event::Begun);
    let drives = ServoDrives {
        scaling,
        outputs: Some(outputs),
        answers,
        waker: thread.thread().clone(),
        thread: Some(thread),
        grace: period.mul_f64(GRACE),
        on: false,
        is_on: false,
        preload: 1.0,
        shift,
        traffic,
        segment,
    };
    Ok((Box::new(drives), readings))
}

/// The interface as a raw socket.
pub(crate) fn socket(interface: &str) -> Result<Socket, MainDeviceError> {
    let refused = |reason: String, remedy| MainDeviceError::Interface { interface: interface.into(), reason, remedy };
    let socket = Socket::open(interface).map_err(|error| {
        let remedy = match error.kind() {
            std::io::ErrorKind::PermissionDenied => "Raw sockets need the capability CAP_NET_RAW: run as root.",
            _ => "`ip link` lists the interfaces; `ip link set NAME up` switches one on.",
        };
        refused(error.to_string(), remedy)
    })?;
    let state = std::fs::read_to_string(format!("/sys/class/net/{interface}/operstate")).unwrap_or_default();
    if ["down", "lowerlayerdown"].contains(&state.trim()) {
        let remedy = "Switch it on by `ip link set NAME up`, and check the cable.";
        return Err(refused("the interface is off, or has no link".into(), remedy));
    }
    Ok(socket)
}

/// What the preset and the file require.
fn plan(preset: &Preset<f64>, scaling: &ServoScaling, file: &DriveFile) -> Result<Plan, MainDeviceError> {
    let model = &preset.model;
    let [motor, load] = scaling.torque_limits();
    let encoder = (model.encoder.counts_per_revolution, model.encoder.counter_range);
    let expected = [
        Expected {
            torque_constant: model.motor.torque_constant,
            torque: motor,
            parameter: "model.scaling.servo_limit",
            encoder: None,
        },
        Expected {
            torque_constant: model.load_motor.torque_constant,
            torque: load,
            parameter: "model.load_amplifier.current_limit",
            encoder: Some(encoder),
        },
    ];
    let reason = |reason| MainDeviceError::Step { step: "profile".into(), reason, remedy: "Correct the file." };
    Ok(Plan {
        period: Duration::from_secs_f64(preset.bench.tick_time()),
        profiles: file.profiles().map_err(reason)?,
        expected,
        analogue: file.accelerometer.map(|input| input.position),
        watchdog: file.watchdog,
    })
}

/// A main device with the time-outs of a bench.
pub(crate) fn main_device<T>(socket: Socket, run: impl for<'a> FnOnce(&'a MainDevice<'a>, Wire<'a>) -> T) -> T {
    let storage = Storage::new();
    let (tx, rx, frames) = storage.try_split().expect("it is split once");
    let timeouts = Timeouts {
        pdu: Duration::from_millis(100),
        eeprom: Duration::from_millis(500),
        mailbox_echo: Duration::from_millis(500),
        mailbox_response: Duration::from_secs(2),
        ..Timeouts::default()
    };
    let config =
        MainDeviceConfig { dc_static_sync_iterations: CLOCK_FRAMES, retry_behaviour: RetryBehaviour::Count(5) };
    let main = MainDevice::new(frames, timeouts, config);
    run(&main, Wire::new(socket, tx, rx))
}

impl ServoDrives {
    /// The answer that arrived last. Index pulses of earlier ones are not lost.
    fn newest(&mut self) -> Option<Answer> {
        let mut pulse = None;
        let mut newest = None;
        while let Ok(answer) = self.answers.pop() {
            if let Answer::Signals(signals, _) = answer {
                pulse = if signals.index { Some(signals.latch) } else { pulse };
            }
            newest = Some(answer);
        }
        if let (Some(Answer::Signals(signals, _)), Some(latch)) = (&mut newest, pulse) {
            (signals.index, signals.latch) = (true, latch);
        }
        newest
    }

    fn arrival(&mut self, answer: Answer) -> Arrival {
        match answer {
            Answer::Signals(signals, is_on) => {
                self.is_on = is_on && self.on;
                self.traffic.count(Event::Answered);
                Arrival::Readings(self.scaling.readings(signals))
            }
            Answer::Lost => {
                self.traffic.count(Event::Missing);
                Arrival::Missing
            }
            Answer::Failed(fault) => {
                let event = if matches!(fault, MachineFault::WorkingCounter { .. }) {
                    Event::FrameError
                } else {
                    Event::Missing
                };
                self.traffic.count(event);
                Arrival::Failed(fault)
            }
        }
    }
}

impl Io for ServoDrives {
    /// A tick with a blocking wait for its answer.
    fn exchange(&mut self, voltages: Voltages<f64>) -> Result<Measurement<f64>, LinkFault> {
        self.announce(voltages);
        let grace = std::mem::replace(&mut self.grace, Duration::from_secs(1));
        let arrival = self.finish();
        self.grace = grace;
        match arrival {
            Arrival::Readings(readings) => Ok(readings),
            other => Err(LinkFault::Refused { reason: format!("the drives do not answer ({other:?})") }),
        }
    }

    /// The frame was sent at the end of the last tick.
    fn start(&mut self, _: u64, _: Voltages<f64>) -> Result<Option<Measurement<f64>>, LinkFault> {
        Ok(None)
    }

    fn announce(&mut self, voltages: Voltages<f64>) {
        let outputs = Outputs { on: self.on, torques: self.scaling.torques(voltages) };
        // A full ring means that frames do not leave: the answer is missing then.
        let _ = self.outputs.as_mut().map(|ring| ring.push(outputs));
        self.waker.unpark();
    }

    fn finish(&mut self) -> Arrival {
        let start = Instant::now();
        loop {
            if let Some(answer) = self.newest() {
                return self.arrival(answer);
            }
            if start.elapsed() >= self.grace {
                return self.arrival(Answer::Lost);
            }
            std::hint::spin_loop();
        }
    }

    fn switch(&mut self, on: bool) -> bool {
        self.is_on &= on && self.on;
        self.on = on;
        !on || self.is_on
    }

    fn tick_shift(&self) -> Option<Arc<AtomicI64>> {
        Some(self.shift.clone())
    }

    fn traffic(&self) -> Option<Arc<Traffic>> {
        Some(self.traffic.clone())
    }

    fn segment(&self) -> Option<Arc<Segment>> {
        Some(self.segment.clone())
    }

    fn set_preload(&mut self, preload: f64) -> Result<(), Error> {
        stickslip_bench::check_preload(preload)?;
        self.preload = preload;
        Ok(())
    }

    fn preload(&self) -> f64 {
        self.preload
    }
}

/// The drives are stopped and disabled.
impl Drop for ServoDrives {
    fn drop(&mut self) {
        self.outputs = None;
        self.waker.unpark();
        // A thread that has panicked leaves the drives to their watchdogs.
        let _ = self.thread.take().map(JoinHandle::join);
    }
}
