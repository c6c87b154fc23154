//! The bench in real time: software and machine on an executive, the experiment on the calling thread.
//!
//! Commands are queued ahead of the clock by a lead, so that delays of the experiment up to this lead have no effect;
//! the frames follow. If an experiment falls further behind, a virtual machine waits. Physical hardware does not wait:
//! the set-point comes to rest under control and the experiment receives an error. Between experiments the set-point
//! rests.

mod cycle;
mod immediate;
pub mod keyframe;
mod rings;
#[cfg(test)]
mod tests;
mod timing_report;

use std::collections::VecDeque;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use cycle::{BLOCKS, BenchCycle, Entry, Flow, Reply};
pub use immediate::ImmediateChanges;
use immediate::immediate_changes;
use keyframe::keyframes;
pub use keyframe::{Keyframe, Keyframes};
use rings::{BenchRings, rings};
use rtrb::PushError;
use stickslip_core::friction::Stribeck;
use stickslip_core::tick::Measurement;
use stickslip_rt::{Granted, Histograms, OverrunPolicy, Plan, Running, ShiftedClock, ThreadSettings, Timings};
use stickslip_software::cycle::{Change, Command, Frame, Parameters, Software};
use stickslip_software::supervise::{ExternalFault, Fault, Refusal, SafetyState};
pub use timing_report::overrun_sentence;
pub use timing_report::{TimingReport, refusals};

use super::io::{Io, OpenFieldbus, check_preload};
use super::lockstep::SETTLING;
use super::remote::{Address, Paced, Traffic};
use super::segment::Segment;
use super::tap::{ChangeKind, Changed, Tap};
use super::{Bench, InProcess, Injection};
use crate::BenchError;
use crate::external::{External, ExternalInLoop, Role, role};
use stickslip_base::preset::{Model, Settings};
use stickslip_base::{Error, Preset};
use stickslip_design as design;

/// Lead of the commands over the clock [s]: several times the typical scheduling delay of an ordinary system.
const LEAD: f64 = 0.05;
/// Additional time that a virtual machine waits for a command [s]; after that the sender is assumed to have stopped.
const WAIT: f64 = 1.0;
/// Permitted consecutive missed deadlines of a virtual machine and of physical hardware.
const PATIENCE: u32 = 1000;
const HARDWARE_PATIENCE: u32 = 10;
/// Time-out for the reason of a late external controller.
const REASON_TIMEOUT: Duration = Duration::from_millis(100);
/// Polling interval of the bench.
const LOOK: Duration = Duration::from_millis(1);
/// Polling interval of the timings.
const COLLECT: Duration = Duration::from_millis(50);

/// A bench in real time.
pub struct ClockedBench {
    model: Model<f64>,
    settings: Settings<f64>,
    parameters: Parameters<f64>,
    preload: f64,
    rings: BenchRings,
    /// Role of the external file, if there is one.
    role: Option<Role>,
    /// Entries not sent yet: a stream starts with a whole lead.
    staged: Vec<Entry>,
    /// Number of commands in a lead.
    lead: usize,
    streaming: bool,
    /// Commands without a frame, and unanswered changes.
    commands_under_way: usize,
    changes_under_way: VecDeque<Option<ChangeKind>>,
    /// Recorder or viewer of the changes.
    listener: Option<mpsc::Sender<Changed>>,
    /// Received and not fetched yet.
    frames: VecDeque<Frame>,
    refused: Option<Refusal>,
    safety: SafetyState,
    zero: Option<f64>,
    /// Last frame.
    last: Option<Frame>,
    running: Option<Running>,
    /// Reason of its end.
    end: String,
    collector: Option<JoinHandle<()>>,
    histograms: Arc<Mutex<Histograms>>,
    /// Permitted delay of a command [s], and number of ticks that the machine waited for one.
    lateness: f64,
    waited: Arc<AtomicU64>,
    urgent: Option<ImmediateChanges>,
    keyframes: Option<Keyframes>,
    traffic: Option<Arc<Traffic>>,
    segment: Option<Arc<Segment>>,
}

impl ClockedBench {
    /// The virtual machine of a preset in real time, switched on and at rest.
    ///
    /// # Errors
    /// Errors of the design of the bench; [`BenchError::RealTime`] if the system cannot start a thread.
    pub fn virtual_machine(
        preset: &Preset<f64>,
        seed: u64,
        thread_settings: ThreadSettings,
        tap: Option<Tap>,
    ) -> Result<Self, Error> {
        design::check_delays(&preset.model, &preset.bench)?;
        let (machine, readings) = InProcess::new(preset, seed)?;
        Self::over(preset, machine, readings, thread_settings, tap)
    }

    /// Model and settings of a preset, with the machine at an address; `fieldbus` opens servo drives.
    ///
    /// # Errors
    /// As [`virtual_machine`](Self::virtual_machine); [`Error::BenchFault`] if the machine does not answer;
    /// [`BenchError::Fieldbus`] without `fieldbus`, or if the drives do not start.
    pub fn connect(
        preset: &Preset<f64>,
        address: &Address,
        fieldbus: Option<OpenFieldbus>,
        thread_settings: ThreadSettings,
        tap: Option<Tap>,
    ) -> Result<Self, Error> {
        if let Address::Ethercat(interface) = address {
            let open = fieldbus.ok_or_else(|| BenchError::without_main_device(interface))?;
            let (machine, readings) = open(preset, interface)?;
            return Self::over(preset, machine, readings, thread_settings, tap);
        }
        let (machine, readings) = Paced::begin(address, preset.bench.tick_time())
            .map_err(|fault| Error::BenchFault { cycle: 0, reason: fault.to_string() })?;
        Self::over(preset, machine, readings, thread_settings, tap)
    }

    /// Model and settings of a preset, with a machine that has these readings at rest; the tap receives all cycles.
    ///
    /// # Errors
    /// As [`virtual_machine`](Self::virtual_machine).
    pub fn over(
        preset: &Preset<f64>,
        machine: impl Io + Send + 'static,
        readings: Measurement<f64>,
        thread_settings: ThreadSettings,
        tap: Option<Tap>,
    ) -> Result<Self, Error> {
        let (samples, listener) = tap.map(|tap| (tap.samples, tap.changes)).unzip();
        let Preset { model, bench: settings, .. } = preset;
        let lead = (LEAD * settings.tick_rate).ceil().max(16.0) as usize;
        let (rings, rings_of_loop) = rings(lead);
        let (preload, traffic, segment) = (machine.preload(), machine.traffic(), machine.segment());
        // A virtual machine waits: it ends only if it is too slow for its rate.
        let (stop_after, wait) = if machine.waits() { (PATIENCE, WAIT) } else { (HARDWARE_PATIENCE, 0.0) };
        let waited = Arc::new(AtomicU64::new(0));
        let parameters = design::parameters(model, settings)?;
        let (urgent, urgent_out, answers) = immediate_changes(listener.clone());
        let (keyframes, keyframe_responder) = keyframes();
        let cycle = BenchCycle {
            software: Software::new(parameters, settings.tick_time()),
            machine,
            readings,
            ahead: Some(readings),
            silent: 0,
            rings: rings_of_loop,
            urgent: urgent_out,
            answers,
            flow: Flow::Paused,
            patience: (wait * settings.tick_rate) as u64,
            waiting: 0,
            waited: waited.clone(),
            external: None,
            samples,
            keyframes: keyframe_responder,
        };
        let (running, timings) = start(cycle, settings, stop_after, thread_settings)?;
        let (histograms, collector) = collect(timings, segment.clone());
        Ok(ClockedBench {
            model: *model,
            settings: *settings,
            parameters,
            preload,
            rings,
            role: None,
            staged: Vec::new(),
            lead,
            streaming: false,
            commands_under_way: 0,
            changes_under_way: VecDeque::new(),
            listener,
            frames: VecDeque::new(),
            refused: None,
            safety: SafetyState::Off,
            zero: None,
            last: None,
            running: Some(running),
            end: String::new(),
            collector: Some(collector),
            histograms,
            lateness: LEAD + wait,
            waited,
            urgent: Some(urgent),
            keyframes: Some(keyframes),
            traffic,
            segment,
        })
    }

    /// Traffic on the link to the machine, if there is one.
    pub fn traffic(&self) -> Option<Arc<Traffic>> {
        self.traffic.clone()
    }

    /// State of the segment of a fieldbus, if the machine is on one.
    pub fn segment(&self) -> Option<Arc<Segment>> {
        self.segment.clone()
    }

    /// Immediate changes; `None` after the first call.
    pub fn urgent(&mut self) -> Option<ImmediateChanges> {
        self.urgent.take()
    }

    /// Keyframes; `None` after the first call.
    pub fn keyframes(&mut self) -> Option<Keyframes> {
        self.keyframes.take()
    }

    /// Activates an external controller, friction or law. It replaces the corresponding settings of the preset: for a
    /// controller, these are controller, filter, compensation and holding. A previous external file is removed.
    ///
    /// # Errors
    /// Errors of the design of the bench; [`BenchError::FollowsNoFriction`], [`BenchError::ForeignRate`],
    /// [`BenchError::ExternalNotStarted`]; [`Error::BenchFault`] if the loop has ended.
    pub fn bring(&mut self, external: External) -> Result<(), Error> {
        let (role, settings, mut parameters) = (external.role(), self.settings, self.parameters);
        role::enter(role, true, &mut parameters, &self.model, &settings)?;
        self.seat(external, &settings)?;
        self.settings = role::without(role, &settings);
        self.change(Change::Parameters(parameters))
    }

    /// Installs an external controller, friction or law on a bench with these settings. It acts whenever its substitute
    /// is active there. A previous one is removed.
    ///
    /// # Errors
    /// As [`bring`](Self::bring).
    pub fn seat(&mut self, external: External, settings: &Settings<f64>) -> Result<(), Error> {
        let priority = self.running.as_ref().and_then(|running| running.granted().priority());
        let in_loop = Box::new(ExternalInLoop::in_real_time(external, &self.model, settings, priority)?);
        self.role = Some(in_loop.external().role());
        self.exchange(Some(in_loop)).map(drop)
    }

    /// Removes it: these settings become active again.
    ///
    /// # Errors
    /// Errors of the design of the bench; [`Error::BenchFault`] if the loop has ended.
    pub fn take_back(&mut self, settings: &Settings<f64>) -> Result<Option<ExternalInLoop>, Error> {
        let Some(role) = self.role.take() else { return Ok(None) };
        let mut parameters = self.parameters;
        role::enter(role, false, &mut parameters, &self.model, settings)?;
        self.settings = *settings;
        self.change(Change::Parameters(parameters))?;
        self.exchange(None)
    }

    /// Exchanges the external controller, friction or law, or removes it. Returns the previous one.
    fn exchange(&mut self, external: Option<Box<ExternalInLoop>>) -> Result<Option<ExternalInLoop>, Error> {
        // The ring is empty: its entry is taken below.
        external.into_iter().for_each(|external| drop(self.rings.externals.push(external)));
        self.enqueue(Entry::External)?;
        self.changes_under_way.push_back(None);
        self.pause()?;
        while !self.changes_under_way.is_empty() {
            self.wait()?;
        }
        Ok(self.rings.returned.pop().ok().map(|previous| *previous))
    }

    /// The active fault. For a late external controller, its reason, if known within 100 ms.
    ///
    /// # Errors
    /// [`Error::BenchFault`] after the end of the loop.
    pub fn named_fault(&mut self) -> Result<Option<Fault>, Error> {
        let start = Instant::now();
        loop {
            self.refresh()?;
            let fault = self.safety.fault();
            let late = matches!(fault, Some(Fault::External(_, ExternalFault::Late { .. })));
            if !late || start.elapsed() > REASON_TIMEOUT {
                return Ok(fault);
            }
            thread::sleep(LOOK);
        }
    }

    /// Injects a fault after the queued commands, if the machine is [`Faulty`](super::Faulty); otherwise without
    /// effect.
    ///
    /// # Errors
    /// [`Error::BenchFault`] if the loop has ended.
    pub fn inject(&mut self, injection: Injection) -> Result<(), Error> {
        self.changes_under_way.push_back(Some(ChangeKind::Fault(injection)));
        self.enqueue(Entry::Fault(injection))
    }

    /// Timing histograms since the start.
    pub fn histograms(&self) -> Arc<Mutex<Histograms>> {
        self.histograms.clone()
    }

    /// Granted and refused thread settings; `None` after the end of the loop.
    pub fn granted(&self) -> Option<&Granted> {
        self.running.as_ref().map(Running::granted)
    }

    /// Processes replies that came without commands.
    ///
    /// # Errors
    /// [`Error::BenchFault`] after the end of the loop.
    pub fn refresh(&mut self) -> Result<(), Error> {
        self.take()?;
        if self.running.as_ref().is_none_or(Running::has_ended) { Err(self.ended()) } else { Ok(()) }
    }

    /// Adopts a model, settings and parameters that have become active by an immediate change.
    pub fn adopt(&mut self, model: &Model<f64>, settings: &Settings<f64>, parameters: &Parameters<f64>) {
        (self.model, self.settings, self.parameters) = (*model, *settings, *parameters);
    }

    /// Stops the bench and returns the timing report; `None` if the loop had already ended with an error.
    pub fn stop(mut self) -> Option<TimingReport> {
        let running = self.running.take()?;
        let granted = running.granted().clone();
        running.stop();
        let summary = running.join();
        // Reports the last changes; the reason of the end is in the summary.
        let _ = self.take();
        self.collector.take()?.join().ok()?;
        let histograms = self.histograms.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let waited = self.waited.load(Ordering::Relaxed);
        let segment = self.segment.map(|segment| segment.status());
        Some(TimingReport { summary, histograms, waited, granted, segment })
    }

    /// Sends an entry, or stages it until there is a lead of commands.
    fn enqueue(&mut self, mut entry: Entry) -> Result<(), Error> {
        if !self.streaming {
            self.staged.push(entry);
            return if self.commands_under_way >= self.lead { self.send_staged() } else { Ok(()) };
        }
        while let Err(PushError::Full(rejected)) = self.rings.entries.push(entry) {
            entry = rejected;
            if let Err(error) = self.wait() {
                // Entries and changes correspond in order: a dropped entry would assign the next change wrongly.
                self.staged.extend(Some(entry).filter(|entry| !matches!(entry, Entry::Command(_))));
                return Err(error);
            }
        }
        Ok(())
    }

    /// Sends all staged entries at once, so that none seems to be missing after the first.
    fn send_staged(&mut self) -> Result<(), Error> {
        while self.rings.entries.slots() < self.staged.len() {
            self.wait()?;
        }
        let chunk = self.rings.entries.write_chunk_uninit(self.staged.len());
        chunk.expect("there is room").fill_from_iter(self.staged.drain(..));
        self.streaming = true;
        Ok(())
    }

    /// Marks a pause of the commands, and sends staged entries.
    fn pause(&mut self) -> Result<(), Error> {
        if self.streaming || !self.staged.is_empty() {
            self.enqueue(Entry::Pause)?;
            if !self.streaming {
                self.send_staged()?;
            }
            self.streaming = false;
        }
        Ok(())
    }

    /// Processes replies; without any, sleeps for a moment.
    fn wait(&mut self) -> Result<(), Error> {
        if self.take()? {
            return Ok(());
        }
        if self.running.as_ref().is_none_or(Running::has_ended) && !self.take()? {
            return Err(self.ended());
        }
        thread::sleep(LOOK);
        Ok(())
    }

    /// Processes replies. Returns whether there were any.
    fn take(&mut self) -> Result<bool, Error> {
        let mut any = false;
        while let Ok(reply) = self.rings.replies.pop() {
            any = true;
            match reply {
                Reply::Frame(frame) => {
                    self.commands_under_way -= 1;
                    (self.safety, self.last) = (frame.safety, Some(frame));
                    self.frames.push_back(frame);
                }
                Reply::Changed { cycle, refusal, safety, zero } => {
                    (self.refused, self.safety, self.zero) = (refusal, safety, zero);
                    self.answered(cycle);
                }
                Reply::Done(cycle) => self.answered(cycle),
                Reply::State { safety, zero } => (self.safety, self.zero) = (safety, zero),
                Reply::Starved(cycle) => return Err(self.fell_behind(cycle)),
                Reply::Failed { cycle, fault } => {
                    let first = self.safety.fault().unwrap_or(Fault::Machine(fault));
                    (self.safety, self.zero) = (SafetyState::Fault(first), None);
                    self.report(cycle, ChangeKind::Software(Change::MachineFailed(fault), None));
                }
                Reply::ExternalFailed { cycle, role, fault } => {
                    self.report(cycle, ChangeKind::Software(Change::ForeignFailed(role, fault), None));
                }
                Reply::Link(fault) => return Err(self.fault(fault.to_string())),
            }
        }
        Ok(any)
    }

    /// The oldest outstanding change became active with this cycle.
    fn answered(&mut self, cycle: u64) {
        // An exchange of the external controller is not recorded; its torque is.
        if let Some(Some(mut what)) = self.changes_under_way.pop_front() {
            if let ChangeKind::Software(_, refused) = &mut what {
                *refused = self.refused;
            }
            self.report(cycle, what);
        }
    }

    fn report(&self, cycle: u64, what: ChangeKind) {
        if let Some(listener) = &self.listener {
            // The listener may have ended.
            let _ = listener.send(Changed { cycle, what });
        }
    }

    /// The oldest frame. A frame with a fault discards all outstanding ones, which have the same fault.
    fn next_frame(&mut self) -> Result<Option<Frame>, Error> {
        let frame = self.frames.pop_front().map(checked).transpose();
        if frame.is_err() {
            while self.pause().is_ok() && self.commands_under_way > 0 && self.wait().is_ok() {}
            self.frames.clear();
        }
        frame
    }

    /// Resets the stream; outstanding commands are lost.
    fn fell_behind(&mut self, cycle: u64) -> Error {
        (self.commands_under_way, self.streaming) = (0, false);
        self.frames.clear();
        self.staged.retain(|entry| !matches!(entry, Entry::Command(_)));
        self.staged.insert(0, Entry::Resume);
        Error::BenchFault {
            cycle,
            reason: format!(
                "the experiment fell behind the clock by more than {:.0} ms; the set-point came to rest. Close other \
                 programs, and run `stickslip doctor`.",
                1e3 * self.lateness
            ),
        }
    }

    /// Error for an executive that ended without a stop.
    fn ended(&mut self) -> Error {
        if let Some(summary) = self.running.take().map(Running::join) {
            let worst = summary.worst.map_or(String::new(), |worst| format!(" {}", worst.sentence(&BLOCKS)));
            self.end = format!("the real-time loop has ended: {}.{worst} Run `stickslip doctor`.", summary.ending);
        }
        self.fault(self.end.clone())
    }

    /// Error after the last cycle.
    fn fault(&self, reason: String) -> Error {
        Error::BenchFault { cycle: self.last.map_or(0, |frame| frame.cycle), reason }
    }
}

/// Starts the loop with one cycle per tick; it ends after `stop_after` consecutive missed deadlines.
fn start(
    cycle: BenchCycle<impl Io + Send + 'static>,
    settings: &Settings<f64>,
    stop_after: u32,
    thread_settings: ThreadSettings,
) -> Result<(Running, Timings), BenchError> {
    let plan = Plan::new(Duration::from_secs_f64(settings.tick_time()));
    let plan = Plan { overrun: OverrunPolicy { stop_after: Some(stop_after), ..plan.overrun }, ..plan };
    let shift = cycle.machine.tick_shift().unwrap_or_default();
    let clock = ShiftedClock::new(thread_settings.clock(plan.period), shift);
    Running::start(plan, thread_settings, clock, cycle).map_err(BenchError::RealTime)
}

/// Histograms of the timings, and the thread that fills them until the end of the loop.
fn collect(mut timings: Timings, segment: Option<Arc<Segment>>) -> (Arc<Mutex<Histograms>>, JoinHandle<()>) {
    let histograms = Arc::new(Mutex::new(Histograms::new(timings.blocks())));
    let collected = histograms.clone();
    let collector = thread::spawn(move || {
        loop {
            // Checked before the records are taken, so that the last ones are included.
            let last = timings.is_closed();
            collected.lock().unwrap_or_else(PoisonError::into_inner).take(&mut timings);
            segment.iter().for_each(|segment| segment.collect());
            if last {
                return;
            }
            thread::sleep(COLLECT);
        }
    });
    (histograms, collector)
}

/// The frame, or an error if supervision has removed the torque.
fn checked(frame: Frame) -> Result<Frame, Error> {
    match frame.safety {
        SafetyState::Fault(fault) => Err(Error::BenchFault { cycle: frame.cycle, reason: fault.to_string() }),
        _ => Ok(frame),
    }
}

impl Bench for ClockedBench {
    fn model(&self) -> &Model<f64> {
        &self.model
    }

    fn settings(&self) -> &Settings<f64> {
        &self.settings
    }

    fn hand_over(&mut self, command: Command) -> Result<Option<Frame>, Error> {
        self.commands_under_way += 1;
        self.enqueue(Entry::Command(command))?;
        self.take()?;
        self.next_frame()
    }

    fn outstanding(&mut self) -> Result<Option<Frame>, Error> {
        self.pause()?;
        while self.frames.is_empty() && self.commands_under_way > 0 {
            self.wait()?;
        }
        self.next_frame()
    }

    fn come_to_rest(&mut self) -> Result<(), Error> {
        while self.outstanding()?.is_some() {}
        let speed = self.last.map_or(0.0, |frame| frame.command.setpoint.velocity.abs());
        let stop = speed / self.settings.safety.stop_deceleration;
        // A non-finite set-point never comes to rest; supervision has stopped it.
        thread::sleep(Duration::try_from_secs_f64(stop + SETTLING).unwrap_or_default());
        self.take()?;
        match self.safety {
            SafetyState::Fault(fault) => Err(self.fault(fault.to_string())),
            _ => Ok(()),
        }
    }

    fn change(&mut self, change: Change) -> Result<(), Error> {
        let waits = !matches!(change, Change::Parameters(_));
        if self.rings.changes.is_full() {
            self.pause()?;
        }
        while self.rings.changes.is_full() {
            self.wait()?;
        }
        self.rings.changes.push(change).expect("there is room");
        self.changes_under_way.push_back(Some(ChangeKind::Software(change, None)));
        if let Change::Parameters(parameters) = change {
            self.parameters = parameters;
        }
        self.enqueue(Entry::Change)?;
        if waits {
            self.pause()?;
            while !self.changes_under_way.is_empty() {
                self.wait()?;
            }
            if let Some(refusal) = self.refused.take() {
                return Err(refusal.into());
            }
        }
        Ok(())
    }

    fn parameters(&self) -> &Parameters<f64> {
        &self.parameters
    }

    fn safety(&self) -> SafetyState {
        self.safety
    }

    fn zero(&self) -> Option<f64> {
        self.zero
    }

    fn set_preload(&mut self, preload: f64) -> Result<(), Error> {
        check_preload(preload)?;
        self.changes_under_way.push_back(Some(ChangeKind::Preload(preload)));
        self.enqueue(Entry::Preload(preload))?;
        self.preload = preload;
        Ok(())
    }

    fn preload(&self) -> f64 {
        self.preload
    }

    fn learn_own(&mut self, own: Stribeck<f64>) {
        self.model.own = own;
    }
}
