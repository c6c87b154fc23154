//! The cycle: one frame with the process data of all devices, the reference of the distributed clocks, and their states.

use std::time::{Duration, Instant};

use ethercrab::subdevice_group::{CycleInfo, Op, SafeOp};
use ethercrab::{MainDevice, SubDeviceState, TxRxResponse};
use stickslip_bench::ServoSignals;
use stickslip_bench::segment::FrameRecord;
use stickslip_software::supervise::MachineFault;

use super::bring_up::{DEVICES, Group, step};
use super::drive::{Drive, Signals};
use super::error::MainDeviceError;
use super::image::Place;
use super::lost::SILENT;
use super::profile::Accelerometer;
use super::wire::Wire;

/// Share of the period after which a frame is lost.
const LOST: f64 = 0.8;
/// Time in which a drive must switch on, and to stop before it is disabled.
const PATIENCE: Duration = Duration::from_millis(1500);
/// Time in which all devices must reach OP.
const OPERATIONAL: Duration = Duration::from_secs(10);
/// Time for registers and objects that are read because of a fault.
pub(super) const QUESTION: Duration = Duration::from_millis(20);

/// Outputs of a tick.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Outputs {
    /// Whether the drives are to be on.
    pub(crate) on: bool,
    /// Torques of drive motor and load motor [N m].
    pub(crate) torques: [f64; 2],
}

/// Answer to a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Answer {
    /// Signals, and whether both drives follow torques.
    Signals(ServoSignals, bool),
    /// No answer in time.
    Lost,
    /// The bench must stop, at once or if it lasts.
    Failed(MachineFault),
}

/// The analogue input of the accelerometer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Analogue {
    pub(crate) position: u8,
    pub(crate) place: Place,
    /// Voltage per unit [V].
    pub(crate) unit: f64,
}

/// Why the devices do not reach OP, and the wire for another attempt.
pub(crate) type Refused<'a> = Box<(MainDeviceError, Wire<'a>)>;

/// The devices in OP.
pub(crate) struct Cyclic<'a> {
    pub(super) main: &'a MainDevice<'a>,
    pub(super) wire: Wire<'a>,
    pub(super) group: Group<Op>,
    pub(super) drives: [Drive; 2],
    pub(super) analogue: Option<Analogue>,
    period: Duration,
    /// Expected working counter.
    pub(super) due: u16,
    /// Limit of the cycles for switching on or off, and cycles since the drives are to be on.
    patience: u32,
    waiting: u32,
    was_on: bool,
    /// The fault, until the drives are to be off.
    pub(super) failed: Option<MachineFault>,
    /// The device that has left OP, until all are in OP again; time of the last attempt.
    pub(super) left: Option<MachineFault>,
    pub(super) retry: Instant,
    /// Frames in a row without an answer of a device, and time of the last search for restarted devices.
    pub(super) silent: u32,
    pub(super) searched: Instant,
    /// Time of the reference clock at the last frame [ns].
    pub(crate) clock: Option<u64>,
    /// The last frame, for viewers.
    pub(crate) record: FrameRecord,
}

impl Analogue {
    /// The input of the description.
    pub(crate) fn new(input: Accelerometer) -> Self {
        let Accelerometer { position, byte, volts } = input;
        Analogue { position, place: Place::word(byte), unit: volts / 32_767.0 }
    }
}

impl<'a> Cyclic<'a> {
    /// Brings devices from SAFE-OP to OP, with process data at this period. An error returns the wire.
    pub(crate) fn start(
        main: &'a MainDevice<'a>,
        mut wire: Wire<'a>,
        group: Group<SafeOp>,
        drives: [Drive; 2],
        analogue: Option<Analogue>,
        period: Duration,
    ) -> Result<Self, Refused<'a>> {
        let exchanges = |bytes: usize, counts: u16| if bytes > 0 { counts } else { 0 };
        let counts = |device: (usize, usize)| exchanges(device.0, 2) + exchanges(device.1, 1);
        let due = group.iter(main).map(|device| counts((device.outputs_raw().len(), device.inputs_raw().len()))).sum();
        let patient = period.mul_f64(LOST);
        let pause = |response: Option<&CycleInfo>| {
            std::thread::sleep(response.map_or(period, |info| info.next_cycle_wait).min(2 * period));
        };
        // Process data must flow before OP is requested.
        for _ in 0..20 {
            let response = wire.run_within(group.tx_rx_dc(main), patient);
            pause(response.and_then(Result::ok).as_ref().map(|response| &response.extra));
        }
        let failed = step("OP", "See the messages of the drive.");
        let group = match wire.run(group.request_into_op(main)) {
            Ok(group) => group,
            Err(error) => return Err(Box::new((failed(error), wire))),
        };
        let start = Instant::now();
        loop {
            let response = wire.run_within(group.tx_rx_dc(main), patient).and_then(Result::ok);
            if response.as_ref().is_some_and(TxRxResponse::all_op) {
                break;
            }
            if start.elapsed() > OPERATIONAL {
                return Err(Box::new((not_operational(main, &mut wire, &group, response.as_ref()), wire)));
            }
            pause(response.as_ref().map(|response| &response.extra));
        }
        let patience = (PATIENCE.as_secs_f64() / period.as_secs_f64()) as u32;
        Ok(Cyclic {
            main,
            wire,
            group,
            drives,
            analogue,
            period,
            due,
            patience,
            waiting: 0,
            was_on: false,
            failed: None,
            left: None,
            retry: Instant::now(),
            silent: 0,
            searched: Instant::now(),
            clock: None,
            record: FrameRecord::default(),
        })
    }

    /// One frame with these outputs.
    pub(crate) fn exchange(&mut self, outputs: Outputs) -> Answer {
        let on = outputs.on && self.failed.is_none();
        if !outputs.on {
            (self.failed, self.was_on, self.waiting) = (None, false, 0);
        }
        for (drive, torque) in self.drives.iter_mut().zip(outputs.torques) {
            if let Ok(device) = self.group.subdevice(self.main, drive.position.into()) {
                // Both drives, or neither.
                let torque = if self.was_on { torque } else { 0.0 };
                drive.write(&mut device.outputs_raw_mut(), on, torque, self.patience);
            }
        }
        let cycle = self.group.tx_rx_dc(self.main);
        let sent = Instant::now();
        let response = self.wire.run_within(cycle, self.period.mul_f64(LOST)).and_then(Result::ok);
        let Some(response) = response else {
            (self.clock, self.record.round_trip) = (None, None);
            self.silent = self.silent.saturating_add(1);
            if self.silent > SILENT {
                self.record.states = [0; DEVICES];
            }
            return Answer::Lost;
        };
        self.record.round_trip = u32::try_from(sent.elapsed().as_nanos()).ok();
        self.note(&response);
        self.clock = Some(response.extra.dc_system_time);
        let left = |state: &SubDeviceState| !matches!(state, SubDeviceState::Op | SubDeviceState::None);
        if let Some(position) = response.subdevice_states.iter().position(left) {
            return Answer::Failed(self.left_operation(position));
        }
        (self.left, self.record.left) = (None, None);
        if response.working_counter != self.due {
            let (counter, due) = (response.working_counter, self.due);
            return Answer::Failed(MachineFault::WorkingCounter { counter, due });
        }
        self.take(outputs.on)
    }

    /// Inputs of a complete frame.
    fn take(&mut self, on: bool) -> Answer {
        let mut signals = [Signals::default(); 2];
        for (drive, signals) in self.drives.iter_mut().zip(&mut signals) {
            if let Ok(device) = self.group.subdevice(self.main, drive.position.into()) {
                *signals = drive.read(&device.inputs_raw());
            }
        }
        let all_on = self.drives.iter().all(Drive::is_on);
        if on && self.failed.is_none() {
            self.waiting += 1;
            let late = !self.was_on && self.waiting > self.patience;
            if let (true, Some(at)) = (self.was_on || late, self.drives.iter().position(|drive| !drive.is_on())) {
                let position = u16::from(self.drives[at].position);
                self.failed = Some(MachineFault::Device { position, error: signals[at].error, status: 0 });
            }
            self.was_on |= all_on;
        }
        if let Some(fault) = self.failed {
            return Answer::Failed(fault);
        }
        let [motor, load] = signals;
        let accelerometer = self.analogue.and_then(|input| {
            let device = self.group.subdevice(self.main, input.position.into()).ok()?;
            Some(f64::from(input.place.signed(&device.inputs_raw())) * input.unit)
        });
        let signals = ServoSignals {
            count: load.count,
            latch: load.index.unwrap_or(load.count),
            index: load.index.is_some(),
            velocity: motor.velocity,
            load_torque: load.torque,
            accelerometer: accelerometer.unwrap_or(0.0),
        };
        Answer::Signals(signals, on && self.was_on)
    }

    /// Leaves the devices as they are.
    pub(crate) fn into_wire(self) -> Wire<'a> {
        self.wire
    }

    /// Stops and disables the drives, and brings the devices back to INIT.
    pub(crate) fn shut_down(mut self) {
        let cycles = self.patience + 10;
        for _ in 0..cycles {
            let answer = self.exchange(Outputs::default());
            let is_off = self.drives.iter().all(Drive::is_off);
            let is_known = matches!(answer, Answer::Signals(..) | Answer::Failed(MachineFault::Device { .. }));
            if is_off && is_known {
                break;
            }
            std::thread::sleep(self.period);
        }
        let (main, group) = (self.main, self.group);
        let back = async {
            let group = group.into_safe_op(main).await?;
            group.into_pre_op(main).await?.into_init(main).await
        };
        // Without an answer, the watchdogs of the devices act.
        let _ = self.wire.run_within(back, Duration::from_secs(1));
    }
}

/// The first device that is not in OP, with its code.
fn not_operational<'a>(
    main: &'a MainDevice<'a>,
    wire: &mut Wire<'a>,
    group: &Group<Op>,
    response: Option<&TxRxResponse<DEVICES, CycleInfo>>,
) -> MainDeviceError {
    let states = response.map(|response| response.subdevice_states.as_slice()).unwrap_or_default();
    let position = states.iter().position(|state| *state != SubDeviceState::Op).unwrap_or_default();
    let status = group
        .subdevice(main, position)
        .ok()
        .and_then(|device| wire.run_within(device.register_read::<u16>(0x0134_u16), QUESTION).and_then(Result::ok));
    MainDeviceError::NotOperational { position: position as u8, status: status.unwrap_or(0) }
}
