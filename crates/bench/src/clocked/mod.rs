//! The bench by the clock: software and machine on an executive, the experiment on the thread of whoever calls.
//!
//! Commands go ahead of the clock by a lead, so that an experiment may be late by as much without anybody noticing;
//! frames come back behind them. Where an experiment falls further behind, a virtual machine waits; one of steel does not:
//! the set-point comes to rest under control and the experiment is told. Between experiments the set-point rests.

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
use immediate::urgent;
use keyframe::keyframes;
pub use keyframe::{Keyframe, Keyframes};
use rings::{BenchRings, rings};
use rtrb::PushError;
use stickslip_core::cycle::{Change, Command, Frame, Parameters, Software};
use stickslip_core::friction::Stribeck;
use stickslip_core::supervise::{ExternalFault, Fault, Refusal, SafetyState};
use stickslip_core::tick::Measurement;
use stickslip_rt::{Granted, Histograms, OverrunPolicy, Plan, Running, ThreadSettings, Timings};
pub use timing_report::overrun_sentence;
pub use timing_report::{TimingReport, refusals};

use super::io::{Io, check_preload};
use super::lockstep::SETTLING;
use super::remote::{Address, Paced, Traffic};
use super::tap::{Changed, Tap, What};
use super::{Bench, InProcess, Injection};
use crate::BenchError;
use crate::external::{External, ExternalInLoop, Role, role};
use stickslip_base::preset::{Model, Settings};
use stickslip_base::{Error, Preset};
use stickslip_design as design;

/// How far commands go ahead of the clock [s]: several times what a plain system lets a thread wait now and then.
const LEAD: f64 = 0.05;
/// How long a virtual machine waits for a command beyond that [s]: longer, and who sends them has stopped.
const WAIT: f64 = 1.0;
/// Deadlines in a row that may be missed: by a machine that stands still meanwhile, and by one of steel.
const PATIENCE: u32 = 1000;
const STEEL_PATIENCE: u32 = 10;
/// How long it is waited for the reason why a guest was late.
const WHY: Duration = Duration::from_millis(100);
/// From look to look at a bench that has nothing to say.
const LOOK: Duration = Duration::from_millis(1);
/// From look to look of who collects the timings.
const COLLECT: Duration = Duration::from_millis(50);

/// A bench by the clock.
pub struct ClockedBench {
    model: Model<f64>,
    settings: Settings<f64>,
    parameters: Parameters<f64>,
    preload: f64,
    rings: BenchRings,
    /// What was brought along is, where something was.
    role: Option<Role>,
    /// Not sent yet: a stream begins with a whole lead.
    staged: Vec<Entry>,
    /// Commands in a lead.
    lead: usize,
    streaming: bool,
    /// Commands whose frame has not come, and what was changed and not answered.
    commands_under_way: usize,
    changes_under_way: VecDeque<Option<What>>,
    /// Who records or watches.
    told: Option<mpsc::Sender<Changed>>,
    /// Came, and not fetched yet.
    frames: VecDeque<Frame>,
    refused: Option<Refusal>,
    safety: SafetyState,
    zero: Option<f64>,
    /// What came last.
    last: Option<Frame>,
    running: Option<Running>,
    /// Why it is not any more.
    end: String,
    collector: Option<JoinHandle<()>>,
    histograms: Arc<Mutex<Histograms>>,
    /// How late a command may be [s], and the ticks through which the machine waited for one.
    lateness: f64,
    waited: Arc<AtomicU64>,
    urgent: Option<ImmediateChanges>,
    keyframes: Option<Keyframes>,
    traffic: Option<Arc<Traffic>>,
}

impl ClockedBench {
    /// The virtual machine of a preset, by the clock, switched on and at rest.
    ///
    /// # Errors
    /// What the design of the bench refuses; [`BenchError::RealTime`] where the system has no thread for it.
    pub fn virtual_machine(
        preset: &Preset<f64>,
        seed: u64,
        wishes: ThreadSettings,
        tap: Option<Tap>,
    ) -> Result<Self, Error> {
        let (machine, readings) = InProcess::new(preset, seed)?;
        Self::over(preset, machine, readings, wishes, tap)
    }

    /// What a preset believes and sets, over the machine that is reached at an address.
    ///
    /// # Errors
    /// As [`virtual_machine`](Self::virtual_machine); [`Error::BenchFault`] where the machine does not answer.
    pub fn connect(
        preset: &Preset<f64>,
        address: &Address,
        wishes: ThreadSettings,
        tap: Option<Tap>,
    ) -> Result<Self, Error> {
        let (machine, readings) = Paced::begin(address, preset.bench.tick_time())
            .map_err(|fault| Error::BenchFault { cycle: 0, reason: fault.to_string() })?;
        Self::over(preset, machine, readings, wishes, tap)
    }

    /// What a preset believes and sets, over a machine with these readings at rest; who taps it gets all cycles.
    ///
    /// # Errors
    /// As [`virtual_machine`](Self::virtual_machine).
    pub fn over(
        preset: &Preset<f64>,
        machine: impl Io + Send + 'static,
        readings: Measurement<f64>,
        wishes: ThreadSettings,
        tap: Option<Tap>,
    ) -> Result<Self, Error> {
        let (samples, told) = tap.map(|tap| (tap.samples, tap.changes)).unzip();
        let Preset { model, bench: settings, .. } = preset;
        let lead = (LEAD * settings.tick_rate).ceil().max(16.0) as usize;
        let (rings, rings_of_loop) = rings(lead);
        let (preload, traffic) = (machine.preload(), machine.traffic());
        // A virtual machine waits: only one that is too slow for its rate is to end.
        let (stop_after, wait) = if machine.waits() { (PATIENCE, WAIT) } else { (STEEL_PATIENCE, 0.0) };
        let waited = Arc::new(AtomicU64::new(0));
        let parameters = design::parameters(model, settings)?;
        let (urgent, urgent_out, answers) = urgent(told.clone());
        let (keyframes, asked) = keyframes();
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
            guest: None,
            samples,
            asked,
        };
        let (running, timings) = start(cycle, settings, stop_after, wishes)?;
        let (histograms, collector) = collect(timings);
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
            told,
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
        })
    }

    /// What happened on the link to the machine, where there is one.
    pub fn traffic(&self) -> Option<Arc<Traffic>> {
        self.traffic.clone()
    }

    /// The way past the commands, for one who takes it.
    pub fn urgent(&mut self) -> Option<ImmediateChanges> {
        self.urgent.take()
    }

    /// The way to its whole state, for one who takes it.
    pub fn keyframes(&mut self) -> Option<Keyframes> {
        self.keyframes.take()
    }

    /// Lets a file of one's own play its role from now on; what the preset has for it is out of force. Of a controller
    /// these are controller, filter, compensation and holding. One that was there before goes.
    ///
    /// # Errors
    /// What the design of the bench refuses; [`BenchError::FollowsNoFriction`], [`BenchError::ForeignRate`], [`BenchError::ExternalTorques`];
    /// [`Error::BenchFault`] where the loop has ended.
    pub fn bring(&mut self, external: External) -> Result<(), Error> {
        let (role, settings, mut parameters) = (external.role(), self.settings, self.parameters);
        role::enter(role, true, &mut parameters, &self.model, &settings)?;
        self.seat(external, &settings)?;
        self.settings = role::without(role, &settings);
        self.change(Change::Parameters(parameters))
    }

    /// Lets a file of one's own play its role on a bench of these settings whenever what stands in for it is in force
    /// there. One that was there before goes.
    ///
    /// # Errors
    /// As [`bring`](Self::bring).
    pub fn seat(&mut self, external: External, settings: &Settings<f64>) -> Result<(), Error> {
        let priority = self.running.as_ref().and_then(|running| running.granted().priority());
        let guest = Box::new(ExternalInLoop::in_real_time(external, &self.model, settings, priority)?);
        self.role = Some(guest.external().role());
        self.send(Some(guest)).map(drop)
    }

    /// Takes it away again: these settings are in force, with what they have in its place.
    ///
    /// # Errors
    /// What the design of the bench refuses; [`Error::BenchFault`] where the loop has ended.
    pub fn take_back(&mut self, settings: &Settings<f64>) -> Result<Option<ExternalInLoop>, Error> {
        let Some(role) = self.role.take() else { return Ok(None) };
        let mut parameters = self.parameters;
        role::enter(role, false, &mut parameters, &self.model, settings)?;
        self.settings = *settings;
        self.change(Change::Parameters(parameters))?;
        self.send(None)
    }

    /// Puts somebody in the place of who was brought along before, or nobody: who was there before.
    fn send(&mut self, guest: Option<Box<ExternalInLoop>>) -> Result<Option<ExternalInLoop>, Error> {
        // The place is free: who is sent is taken below.
        guest.into_iter().for_each(|guest| drop(self.rings.guests.push(guest)));
        self.give(Entry::ExternalInLoop)?;
        self.changes_under_way.push_back(None);
        self.pause()?;
        while !self.changes_under_way.is_empty() {
            self.wait()?;
        }
        Ok(self.rings.gone.pop().ok().map(|gone| *gone))
    }

    /// What is wrong; where a guest was late, why, as far as that is known soon.
    ///
    /// # Errors
    /// [`Error::BenchFault`] once the loop has ended.
    pub fn named_fault(&mut self) -> Result<Option<Fault>, Error> {
        let begin = Instant::now();
        loop {
            self.refresh()?;
            let fault = self.safety.fault();
            let late = matches!(fault, Some(Fault::External(_, ExternalFault::Late { .. })));
            if !late || begin.elapsed() > WHY {
                return Ok(fault);
            }
            thread::sleep(LOOK);
        }
    }

    /// Injects a fault behind the commands that were handed over, where the machine is [`Faulty`](super::Faulty); else
    /// nothing happens.
    ///
    /// # Errors
    /// [`Error::BenchFault`] where the loop has ended.
    pub fn inject(&mut self, injection: Injection) -> Result<(), Error> {
        self.changes_under_way.push_back(Some(What::Fault(injection)));
        self.give(Entry::Fault(injection))
    }

    /// How the clock is kept, as known so far.
    pub fn histograms(&self) -> Arc<Mutex<Histograms>> {
        self.histograms.clone()
    }

    /// What the system granted; nothing once the loop has ended.
    pub fn granted(&self) -> Option<&Granted> {
        self.running.as_ref().map(Running::granted)
    }

    /// Takes what came while nothing was commanded.
    ///
    /// # Errors
    /// [`Error::BenchFault`] once the loop has ended.
    pub fn refresh(&mut self) -> Result<(), Error> {
        self.take()?;
        if self.running.as_ref().is_none_or(Running::has_ended) { Err(self.ended()) } else { Ok(()) }
    }

    /// Another belief and other settings, whose parameters have come into force by the urgent way.
    pub fn adopt(&mut self, model: &Model<f64>, settings: &Settings<f64>, parameters: &Parameters<f64>) {
        (self.model, self.settings, self.parameters) = (*model, *settings, *parameters);
    }

    /// Stops it: how the clock was kept; none where the loop had ended by itself, which was told.
    pub fn stop(mut self) -> Option<TimingReport> {
        let running = self.running.take()?;
        let granted = running.granted().clone();
        running.stop();
        let summary = running.join();
        // Changes that came into force last are told as well; how it ended is in the summary.
        let _ = self.take();
        self.collector.take()?.join().ok()?;
        let histograms = self.histograms.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let waited = self.waited.load(Ordering::Relaxed);
        Some(TimingReport { summary, histograms, waited, granted })
    }

    /// Sends an entry, or keeps it until there is a lead of commands.
    fn give(&mut self, mut entry: Entry) -> Result<(), Error> {
        if !self.streaming {
            self.staged.push(entry);
            return if self.commands_under_way >= self.lead { self.begin() } else { Ok(()) };
        }
        while let Err(PushError::Full(again)) = self.rings.entries.push(entry) {
            entry = again;
            if let Err(error) = self.wait() {
                // A change goes with its number: left out, the next one would be taken for it.
                self.staged.extend(Some(entry).filter(|entry| !matches!(entry, Entry::Command(_))));
                return Err(error);
            }
        }
        Ok(())
    }

    /// Sends what was kept, all of it at once: nothing may seem to be missing behind the first.
    fn begin(&mut self) -> Result<(), Error> {
        while self.rings.entries.slots() < self.staged.len() {
            self.wait()?;
        }
        let chunk = self.rings.entries.write_chunk_uninit(self.staged.len());
        chunk.expect("there is room").fill_from_iter(self.staged.drain(..));
        self.streaming = true;
        Ok(())
    }

    /// Says that nothing follows for now, and sends what was kept.
    fn pause(&mut self) -> Result<(), Error> {
        if self.streaming || !self.staged.is_empty() {
            self.give(Entry::Pause)?;
            if !self.streaming {
                self.begin()?;
            }
            self.streaming = false;
        }
        Ok(())
    }

    /// Takes what came, and sleeps a moment if that was nothing.
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

    /// Takes what came; whether that was anything.
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
                    self.tell(cycle, What::Software(Change::MachineFailed(fault), None));
                }
                Reply::ExternalTorques { cycle, role, fault } => {
                    self.tell(cycle, What::Software(Change::ForeignFailed(role, fault), None));
                }
                Reply::Link(fault) => return Err(self.fault(fault.to_string())),
            }
        }
        Ok(any)
    }

    /// What was changed longest ago has come into force with this cycle.
    fn answered(&mut self, cycle: u64) {
        // Who controls is in no record: his torque is.
        if let Some(Some(mut what)) = self.changes_under_way.pop_front() {
            if let What::Software(_, refused) = &mut what {
                *refused = self.refused;
            }
            self.tell(cycle, what);
        }
    }

    fn tell(&self, cycle: u64, what: What) {
        if let Some(told) = &self.told {
            // Who does not listen any more misses nothing.
            let _ = told.send(Changed { cycle, what });
        }
    }

    /// The oldest frame. One of a fault ends what is under way: all behind it is of the same fault.
    fn next_frame(&mut self) -> Result<Option<Frame>, Error> {
        let frame = self.frames.pop_front().map(judged).transpose();
        if frame.is_err() {
            while self.pause().is_ok() && self.commands_under_way > 0 && self.wait().is_ok() {}
            self.frames.clear();
        }
        frame
    }

    /// Begins anew: commands that were under way are lost.
    fn fell_behind(&mut self, cycle: u64) -> Error {
        (self.commands_under_way, self.streaming) = (0, false);
        self.frames.clear();
        self.staged.retain(|entry| !matches!(entry, Entry::Command(_)));
        self.staged.insert(0, Entry::Resume);
        Error::BenchFault {
            cycle,
            reason: format!(
                "the experiment fell behind the clock by more than {:.0} ms; the set-point came to rest. Close other \
                 programs, and see what `stickslip doctor` finds.",
                1e3 * self.lateness
            ),
        }
    }

    /// Why the executive has ended, though nobody stopped it.
    fn ended(&mut self) -> Error {
        if let Some(summary) = self.running.take().map(Running::join) {
            let worst = summary.worst.map_or(String::new(), |worst| format!(" {}", worst.sentence(&BLOCKS)));
            self.end =
                format!("the real-time loop has ended: {}.{worst} See what `stickslip doctor` finds.", summary.ending);
        }
        self.fault(self.end.clone())
    }

    /// Behind the cycle that came last.
    fn fault(&self, reason: String) -> Error {
        Error::BenchFault { cycle: self.last.map_or(0, |frame| frame.cycle), reason }
    }
}

/// Starts the loop, a cycle each tick; it ends after `stop_after` missed deadlines in a row.
fn start(
    cycle: BenchCycle<impl Io + Send + 'static>,
    settings: &Settings<f64>,
    stop_after: u32,
    wishes: ThreadSettings,
) -> Result<(Running, Timings), BenchError> {
    let plan = Plan::new(Duration::from_secs_f64(settings.tick_time()));
    let plan = Plan { overrun: OverrunPolicy { stop_after: Some(stop_after), ..plan.overrun }, ..plan };
    let clock = wishes.clock(plan.period);
    Running::start(plan, wishes, clock, cycle).map_err(BenchError::RealTime)
}

/// Histograms of the timings, and the thread that fills them until the loop has ended.
fn collect(mut timings: Timings) -> (Arc<Mutex<Histograms>>, JoinHandle<()>) {
    let histograms = Arc::new(Mutex::new(Histograms::new(timings.blocks())));
    let collected = histograms.clone();
    let collector = thread::spawn(move || {
        loop {
            // Asked before the records are taken: those that came last are not left behind.
            let last = timings.is_closed();
            collected.lock().unwrap_or_else(PoisonError::into_inner).take(&mut timings);
            if last {
                return;
            }
            thread::sleep(COLLECT);
        }
    });
    (histograms, collector)
}

/// A frame, unless supervision has taken the torque away.
fn judged(frame: Frame) -> Result<Frame, Error> {
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
        self.give(Entry::Command(command))?;
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
        // A set-point that is no number never rests: supervision has stopped it.
        thread::sleep(Duration::try_from_secs_f64(stop + SETTLING).unwrap_or_default());
        self.take()?;
        match self.safety {
            SafetyState::Fault(fault) => Err(self.fault(fault.to_string())),
            _ => Ok(()),
        }
    }

    fn change(&mut self, change: Change) -> Result<(), Error> {
        let answered = !matches!(change, Change::Parameters(_));
        if self.rings.changes.is_full() {
            self.pause()?;
        }
        while self.rings.changes.is_full() {
            self.wait()?;
        }
        self.rings.changes.push(change).expect("there is room");
        self.changes_under_way.push_back(Some(What::Software(change, None)));
        if let Change::Parameters(parameters) = change {
            self.parameters = parameters;
        }
        self.give(Entry::Change)?;
        if answered {
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
        self.changes_under_way.push_back(Some(What::Preload(preload)));
        self.give(Entry::Preload(preload))?;
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
