//! The real-time cycle: reads sensors and commands, writes voltages, runs the software, and sends frames.
//!
//! A virtual machine waits for late commands and after missed deadlines, so that the results are the same as in
//! lockstep.
//!
//! At the start of a tick the result of the previous tick is written, before the software computes the next one: the
//! machine has a whole tick to answer.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use rtrb::{Consumer, Producer};
use stickslip_core::tick::Measurement;
use stickslip_rt::{Block, Cycle, Lap, Next};
use stickslip_software::cycle::{Change, Command, ExternalTorques, Frame, Software, Voltages};
use stickslip_software::supervise::{ExternalFault, Fault, MachineFault, Refusal, Role, SafetyState};

use super::keyframe::KeyframeResponder;
use super::rings::LoopRings;
use crate::Injection;
use crate::external::ExternalInLoop;
use crate::io::{Arrival, Io};
use crate::remote::LinkFault;
use crate::tap::Samples;

/// Entries from an experiment, processed in their order.
#[derive(Clone, Copy, Debug)]
pub(super) enum Entry {
    /// Command for the next tick.
    Command(Command),
    /// A change between two ticks; its contents are in the ring of changes, since they are large.
    Change,
    /// Preload of the linings, 0 … 1.
    Preload(f64),
    /// An injected fault.
    Fault(Injection),
    /// Exchanges the external controller for the next one in its ring, or removes it.
    External,
    /// No command follows for now: the set-point may come to rest.
    Pause,
    /// The following commands come from an experiment that has been informed of its delay.
    Resume,
}

/// Replies in the order of the entries.
#[derive(Debug)]
pub(super) enum Reply {
    /// Frame of a command.
    Frame(Frame),
    /// A change was made before this cycle, or refused; state and zero of the screw after it.
    Changed { cycle: u64, refusal: Option<Refusal>, safety: SafetyState, zero: Option<f64> },
    /// Safety state and zero of the screw: after an immediate change, or after a change of state without a command.
    State { safety: SafetyState, zero: Option<f64> },
    /// Preload, injected fault or exchange of the external controller is done before this cycle.
    Done(u64),
    /// A command was due for this cycle and missing.
    Starved(u64),
    /// The external controller, friction or law has failed, from this cycle on.
    ExternalFailed { cycle: u64, role: Role, fault: ExternalFault },
    /// The machine behind a link is lost, from this cycle on; the bench continues.
    Failed { cycle: u64, fault: MachineFault },
    /// The link failed; the bench ends.
    Link(LinkFault),
}

/// First cycle after an immediate change; the reason if it was refused.
pub(super) type Answer = (u64, Option<Refusal>);

/// Timed blocks of a cycle.
pub(super) const BLOCKS: [Block; 4] =
    [Block::new("commands"), Block::new("software"), Block::io("machine"), Block::new("frames")];
const COMMANDS: usize = 0;
const SOFTWARE: usize = 1;
const MACHINE: usize = 2;
const FRAMES: usize = 3;

/// The bench, cycle after cycle.
pub(super) struct BenchCycle<M> {
    pub(super) software: Software,
    pub(super) machine: M,
    /// Readings at the start of the tick, and of the next one if available.
    pub(super) readings: Measurement<f64>,
    pub(super) ahead: Option<Measurement<f64>>,
    /// Consecutive ticks without readings.
    pub(super) silent: u64,
    pub(super) rings: LoopRings,
    /// Immediate changes, one per cycle, and their results.
    pub(super) urgent: Consumer<Change>,
    pub(super) answers: Producer<Answer>,
    pub(super) flow: Flow,
    /// Consecutive ticks of waiting for a command: limit, present number; total number.
    pub(super) patience: u64,
    pub(super) waiting: u64,
    pub(super) waited: Arc<AtomicU64>,
    /// External controller, friction or law.
    pub(super) external: Option<Box<ExternalInLoop>>,
    /// Samples for a recorder or viewer.
    pub(super) samples: Option<Samples>,
    /// Requests for keyframes.
    pub(super) keyframes: KeyframeResponder,
}

/// Whether commands are due.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Flow {
    /// No experiment sends commands.
    Paused,
    /// A command is due in every tick.
    Streaming,
    /// An experiment fell behind; its commands are dropped until it is informed.
    Behind,
}

/// Command of a tick.
enum Due {
    Command(Command),
    /// No command, and none is required.
    Nothing,
    /// The command is late, and the machine waits.
    Late,
}

impl<M: Io> BenchCycle<M> {
    /// The command of this tick, after the changes before it.
    fn command(&mut self, cycle: u64) -> Due {
        if let Ok(change) = self.urgent.pop() {
            let refusal = self.software.change(&change).err();
            let (safety, zero) = (self.software.safety().state(), self.software.safety().zero());
            // The caller waits for this answer, so that there is room.
            let _ = self.answers.push((self.software.cycle(), refusal));
            self.reply(Reply::State { safety, zero });
        }
        while let Ok(entry) = self.rings.entries.pop() {
            match entry {
                Entry::Command(command) if self.flow != Flow::Behind => {
                    (self.flow, self.waiting) = (Flow::Streaming, 0);
                    return Due::Command(command);
                }
                Entry::Command(_) => {}
                Entry::Change => {
                    let Ok(change) = self.rings.changes.pop() else { continue };
                    let refusal = self.software.change(&change).err();
                    let (safety, cycle) = (self.software.safety(), self.software.cycle());
                    let (safety, zero) = (safety.state(), safety.zero());
                    self.reply(Reply::Changed { cycle, refusal, safety, zero });
                }
                // Checked by the sender: a machine in this process accepts it.
                Entry::Preload(preload) => {
                    let _ = self.machine.set_preload(preload);
                    self.reply(Reply::Done(self.software.cycle()));
                }
                // Checked by the sender: refused there if the machine is not [`Faulty`](crate::Faulty).
                Entry::Fault(injection) => {
                    let _ = self.machine.inject(injection);
                    self.reply(Reply::Done(self.software.cycle()));
                }
                Entry::External => {
                    let previous = std::mem::replace(&mut self.external, self.rings.externals.pop().ok());
                    // There is room: the next one is sent only after the previous one was taken.
                    previous.into_iter().for_each(|previous| drop(self.rings.returned.push(previous)));
                    self.reply(Reply::Done(self.software.cycle()));
                }
                Entry::Pause if self.flow == Flow::Behind => {}
                Entry::Pause | Entry::Resume => self.flow = Flow::Paused,
            }
        }
        if self.flow != Flow::Streaming {
            return Due::Nothing;
        }
        // A stop never waits.
        let waits = self.machine.waits() && self.software.safety().state().allows_torque();
        if waits && self.waiting < self.patience {
            self.waiting += 1;
            return Due::Late;
        }
        (self.flow, self.waiting) = (Flow::Behind, 0);
        self.reply(Reply::Starved(cycle));
        Due::Nothing
    }

    fn reply(&mut self, reply: Reply) {
        // There is room for all outstanding replies; the experiment detects the end of the executive itself.
        let _ = self.rings.replies.push(reply);
    }

    /// Takes the readings of this tick. Returns whether the tick can be computed. Too many missing readings are a
    /// fault: the bench then continues without torque on the last readings.
    fn read(&mut self) -> bool {
        let arrival = self.ahead.take().map_or_else(|| self.machine.finish(), Arrival::Readings);
        self.silent += 1;
        let fault = match arrival {
            Arrival::Readings(readings) => {
                (self.readings, self.silent) = (readings, 0);
                return true;
            }
            Arrival::Restarted => MachineFault::Restarted,
            Arrival::Missing => MachineFault::Silent { ticks: self.silent },
            Arrival::Failed(fault) => fault,
        };
        let bearable = matches!(fault, MachineFault::Silent { .. } | MachineFault::WorkingCounter { .. })
            && self.silent as f64 <= self.software.parameters().safety.missed_ticks;
        let faulted = matches!(self.software.safety().state(), SafetyState::Fault(_));
        if bearable && !faulted {
            return false;
        }
        if !faulted {
            // This change is never refused.
            let _ = self.software.change(&Change::MachineFailed(fault));
            self.reply(Reply::Failed { cycle: self.software.cycle(), fault });
        }
        true
    }

    /// Torque of the external controller, friction or law in this tick. If it fails, supervision brakes.
    fn external_torques(&mut self, command: Option<&Command>) -> ExternalTorques {
        let Some(external) = &mut self.external else { return ExternalTorques::default() };
        let sample = self.software.sample(&self.readings, command);
        let torque = external.real_time_torque(&sample, self.software.parameters());
        let late =
            matches!(self.software.safety().state().fault(), Some(Fault::External(_, ExternalFault::Late { .. })));
        if let Some(fault) = torque.err().or_else(|| late.then(|| external.reason()).flatten()) {
            // This change is never refused.
            let role = external.external().role();
            let _ = self.software.change(&Change::ForeignFailed(role, fault));
            self.reply(Reply::ExternalFailed { cycle: self.software.cycle(), role, fault });
        }
        torque.unwrap_or_default()
    }

    /// Writes the voltages of this tick.
    fn write(&mut self) -> Next {
        match self.machine.start(self.software.cycle(), self.software.voltages()) {
            Ok(ahead) => {
                self.ahead = ahead;
                Next::Continue
            }
            Err(fault) => {
                self.reply(Reply::Link(fault));
                Next::Stop
            }
        }
    }
}

impl<M: Io + Send> Cycle for BenchCycle<M> {
    fn blocks(&self) -> &[Block] {
        &BLOCKS
    }

    fn run(&mut self, cycle: u64, lap: &mut Lap) -> Next {
        let next = self.tick(cycle, lap);
        self.machine.announce(self.software.voltages());
        lap.done(MACHINE);
        next
    }

    /// Commands wait: without them the set-point would jump, and the experiment would lack their frames.
    fn hold(&mut self, _: u64) {
        if !self.machine.waits() {
            self.software.miss();
        }
        if let Some(samples) = &mut self.samples {
            samples.hold();
        }
    }

    fn end(&mut self) {
        let _ = self.machine.start(self.software.cycle(), Voltages::default());
    }
}

impl<M: Io> BenchCycle<M> {
    /// A tick, up to its voltages.
    fn tick(&mut self, cycle: u64, lap: &mut Lap) -> Next {
        let computes = self.read();
        lap.done(MACHINE);
        if !computes {
            // The voltages are held, and commands wait: without them the set-point would jump.
            let next = self.write();
            lap.done(MACHINE);
            self.software.miss();
            self.samples.iter_mut().for_each(Samples::hold);
            return next;
        }
        let on = !matches!(self.software.safety().state(), SafetyState::Off | SafetyState::Fault(_));
        if !self.machine.switch(on) {
            // The outputs are those of a bench without torque.
            let next = self.write();
            lap.done(MACHINE);
            self.samples.iter_mut().for_each(Samples::wait_for_command);
            return next;
        }
        self.keyframes.answer(&mut self.software, &mut self.readings, &mut self.machine);
        let command = match self.command(cycle) {
            Due::Command(command) => Some(command),
            Due::Nothing => None,
            Due::Late => {
                lap.done(COMMANDS);
                self.ahead = Some(self.readings);
                self.waited.fetch_add(1, Ordering::Relaxed);
                self.samples.iter_mut().for_each(Samples::wait_for_command);
                return Next::Continue;
            }
        };
        lap.done(COMMANDS);
        let before = self.software.safety().state();
        let next = self.write();
        lap.done(MACHINE);
        let external = self.external_torques(command.as_ref());
        let frame = self.software.step_with(self.readings, command, external);
        self.machine.disturb(&mut self.software);
        lap.done(SOFTWARE);
        match command {
            Some(_) => self.reply(Reply::Frame(frame)),
            None if before != frame.safety => {
                self.reply(Reply::State { safety: frame.safety, zero: self.software.safety().zero() });
            }
            None => {}
        }
        if let Some(samples) = &mut self.samples {
            samples.offer(&frame);
        }
        lap.done(FRAMES);
        next
    }
}
