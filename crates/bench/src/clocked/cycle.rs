//! What runs within the deadline: readings and commands in, voltages out, the software, frames out.
//!
//! A virtual machine waits for a command that is late, as it does where a deadline was missed: what an experiment gets is
//! then as without a clock.
//!
//! What the software computed in the tick before is written at the begin of a tick, before it computes anew: the machine
//! has a whole tick to answer.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use rtrb::{Consumer, Producer};
use stickslip_core::cycle::{Change, Command, ExternalTorques, Frame, Software, Voltages};
use stickslip_core::supervise::{ExternalFault, Fault, MachineFault, Refusal, Role, SafetyState};
use stickslip_core::tick::Measurement;
use stickslip_rt::{Block, Cycle, Lap, Next};

use super::keyframe::Asked;
use super::rings::LoopRings;
use crate::Injection;
use crate::external::ExternalInLoop;
use crate::io::{Arrival, Io};
use crate::remote::LinkFault;
use crate::tap::Samples;

/// What an experiment sends, carried out in its order.
#[derive(Clone, Copy, Debug)]
pub(super) enum Entry {
    /// For the next tick.
    Command(Command),
    /// Between two ticks: the next one of the changes, which are too large to come with each command.
    Change,
    /// How far the linings are pressed on, 0 … 1.
    Preload(f64),
    /// A fault on purpose.
    Fault(Injection),
    /// The next of the guests plays its role where it stands in; nobody does where there is none.
    ExternalInLoop,
    /// No command follows for a while: the set-point may come to rest.
    Pause,
    /// Commands that follow are of an experiment that knows that the last one fell behind.
    Resume,
}

/// What comes back, in the order of what it answers.
#[derive(Debug)]
pub(super) enum Reply {
    /// A command was carried out.
    Frame(Frame),
    /// A change was made before this cycle, or refused; the state and the screw's zero after it.
    Changed { cycle: u64, refusal: Option<Refusal>, safety: SafetyState, zero: Option<f64> },
    /// What the bench may do, and the screw's zero: behind an urgent change, and where it changed while nobody commanded.
    State { safety: SafetyState, zero: Option<f64> },
    /// The linings were pressed on, a fault was injected, or somebody else controls, before this cycle.
    Done(u64),
    /// No command was there for this cycle, though none had said that it was the last.
    Starved(u64),
    /// What was brought along has failed of this, from this cycle on.
    ExternalTorques { cycle: u64, role: Role, fault: ExternalFault },
    /// The machine behind a link is gone, from this cycle on: the bench lives.
    Failed { cycle: u64, fault: MachineFault },
    /// The machine is no more: the bench ends.
    Link(LinkFault),
}

/// The first cycle after an urgent change, or why it was not made.
pub(super) type Answer = (u64, Option<Refusal>);

/// What its time is taken of.
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
    /// Readings at the begin of the tick; of the next one, where they are known already.
    pub(super) readings: Measurement<f64>,
    pub(super) ahead: Option<Measurement<f64>>,
    /// Ticks in a row whose readings did not come.
    pub(super) silent: u64,
    pub(super) rings: LoopRings,
    /// Changes that wait for no command, one a cycle, and what came of them.
    pub(super) urgent: Consumer<Change>,
    pub(super) answers: Producer<Answer>,
    pub(super) flow: Flow,
    /// Ticks in a row through which a command may be waited for, those of now, and all there were.
    pub(super) patience: u64,
    pub(super) waiting: u64,
    pub(super) waited: Arc<AtomicU64>,
    /// Who controls the position instead, or gives the friction or the law.
    pub(super) guest: Option<Box<ExternalInLoop>>,
    /// Who records or watches.
    pub(super) samples: Option<Samples>,
    /// Who asks for its state.
    pub(super) asked: Asked,
}

/// Whether commands are due.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Flow {
    /// Nobody commands.
    Paused,
    /// A command is due in every tick.
    Streaming,
    /// An experiment fell behind; its commands are dropped until it knows.
    Behind,
}

/// What an experiment has for a tick.
enum Due {
    Command(Command),
    /// It has none, and the bench does without.
    Nothing,
    /// It is late, and the machine waits.
    Late,
}

impl<M: Io> BenchCycle<M> {
    /// The command of this tick, after the changes before it.
    fn command(&mut self, cycle: u64) -> Due {
        if let Ok(change) = self.urgent.pop() {
            let refusal = self.software.change(&change).err();
            let (safety, zero) = (self.software.safety().state(), self.software.safety().zero());
            // Whoever asked waits for it, and asks for nothing else meanwhile.
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
                // Checked where it came from: a machine of this process takes it.
                Entry::Preload(preload) => {
                    let _ = self.machine.set_preload(preload);
                    self.reply(Reply::Done(self.software.cycle()));
                }
                // As well: a machine without faults on purpose refused it there.
                Entry::Fault(injection) => {
                    let _ = self.machine.inject(injection);
                    self.reply(Reply::Done(self.software.cycle()));
                }
                Entry::ExternalInLoop => {
                    let gone = std::mem::replace(&mut self.guest, self.rings.guests.pop().ok());
                    // There is room: one comes only when the one before has been taken.
                    gone.into_iter().for_each(|gone| drop(self.rings.gone.push(gone)));
                    self.reply(Reply::Done(self.software.cycle()));
                }
                Entry::Pause if self.flow == Flow::Behind => {}
                Entry::Pause | Entry::Resume => self.flow = Flow::Paused,
            }
        }
        if self.flow != Flow::Streaming {
            return Due::Nothing;
        }
        // A stop, for one, waits for nobody.
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
        // There is room for all that can be under way; whoever waits in vain asks whether the executive has ended.
        let _ = self.rings.replies.push(reply);
    }

    /// Takes the readings of this tick; whether it can be computed. Too many that do not come are a fault: then the
    /// bench goes on without torque, on the last ones.
    fn arrived(&mut self) -> bool {
        let arrival = self.ahead.take().map_or_else(|| self.machine.finish(), Arrival::Readings);
        self.silent += 1;
        let fault = match arrival {
            Arrival::Readings(readings) => {
                (self.readings, self.silent) = (readings, 0);
                return true;
            }
            Arrival::Restarted => MachineFault::Restarted,
            Arrival::Missing => MachineFault::Silent { ticks: self.silent },
        };
        let bearable = self.silent as f64 <= self.software.parameters().safety.missed_ticks;
        let faulted = matches!(self.software.safety().state(), SafetyState::Fault(_));
        if bearable && fault != MachineFault::Restarted && !faulted {
            return false;
        }
        if !faulted {
            // It cannot be refused.
            let _ = self.software.change(&Change::MachineFailed(fault));
            self.reply(Reply::Failed { cycle: self.software.cycle(), fault });
        }
        true
    }

    /// Torque of the guest in this tick; where it fails, supervision brakes.
    fn brought(&mut self, command: Option<&Command>) -> ExternalTorques {
        let Some(guest) = &mut self.guest else { return ExternalTorques::default() };
        let sample = self.software.sample(&self.readings, command);
        let torque = guest.torque_by_the_clock(&sample, self.software.parameters());
        let late =
            matches!(self.software.safety().state().fault(), Some(Fault::External(_, ExternalFault::Late { .. })));
        if let Some(fault) = torque.err().or_else(|| late.then(|| guest.reason()).flatten()) {
            // It cannot be refused.
            let role = guest.external().role();
            let _ = self.software.change(&Change::ForeignFailed(role, fault));
            self.reply(Reply::ExternalTorques { cycle: self.software.cycle(), role, fault });
        }
        torque.unwrap_or_default()
    }

    /// Writes what acts in this tick.
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
        let computes = self.arrived();
        lap.done(MACHINE);
        if !computes {
            // What was written stays, and commands wait: dropped, they would let the set-point jump.
            let next = self.write();
            lap.done(MACHINE);
            self.software.miss();
            self.samples.iter_mut().for_each(Samples::hold);
            return next;
        }
        self.asked.answer(&mut self.software, &mut self.readings, &mut self.machine);
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
        let brought = self.brought(command.as_ref());
        let frame = self.software.step_with(self.readings, command, brought);
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

    /// Commands wait: dropped, they would let the set-point jump, and an experiment would lack their frames.
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
