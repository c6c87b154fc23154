use rtrb::RingBuffer;
use stickslip_core::control::reference::Setpoint;
use stickslip_core::tick::Measurement;
use stickslip_software::supervise::{MachineFault, Request};

use super::rings::LoopRings;
use super::*;
use crate::external::{Answer, Caller, Description, ModuleSample, Question};
use crate::home;
use crate::remote::{LinkFault, PlantServer};
use crate::{Arrival, VirtualBench, Voltages};
use stickslip_base::Watch;
use stickslip_base::parameters::presets;

fn preset() -> Preset<f64> {
    let mut preset: Preset<f64> = presets::find("clm-bench").unwrap().read().unwrap();
    // A slow tick with many permitted misses, so that a busy computer keeps real time.
    preset.bench.tick_rate = 1000.0;
    preset.bench.safety.missed_ticks = 100.0;
    preset
}

fn bench() -> ClockedBench {
    ClockedBench::virtual_machine(&preset(), 1, ThreadSettings::PLAIN, None).unwrap()
}

/// Sends 200 commands with a pause after the 150th. Returns the error.
fn pause_for(milliseconds: u64, bench: &mut ClockedBench) -> Option<String> {
    home(bench, &Watch::silent()).unwrap();
    let mut moving = |k: u32| {
        if k == 150 {
            thread::sleep(Duration::from_millis(milliseconds));
        }
        let setpoint = Setpoint { position: f64::from(k) * 5e-3, velocity: 5.0, acceleration: 0.0 };
        bench.hand_over(Command { setpoint, control: true, mark: 7, ..Command::default() }).err()
    };
    (0..200).find_map(&mut moving).map(|error| error.to_string())
}

#[test]
fn a_virtual_machine_waits_for_late_commands_and_reports_it() {
    let (tap, mut stream) = crate::tap::tap(1 << 14);
    let mut bench = ClockedBench::virtual_machine(&preset(), 1, ThreadSettings::PLAIN, Some(tap)).unwrap();
    assert_eq!(pause_for(400, &mut bench), None);
    bench.drain(&mut |_| {}).unwrap();
    let report = bench.stop().unwrap();
    // The queued commands last 50 ms; deadlines missed by a busy computer are not counted as waiting.
    assert!(report.waited >= 100, "{}", report.waited);
    assert!(report.warnings().iter().any(|warning| warning.contains("waited for late commands")));
    let samples: Vec<_> = std::iter::from_fn(|| stream.sample()).collect();
    assert!(samples.windows(2).all(|pair| pair[1].frame.cycle == pair[0].frame.cycle + 1), "time stood still");
    assert_eq!(samples.iter().map(|sample| sample.waited).sum::<u64>(), report.waited);
    let marked = samples.iter().filter(|sample| sample.frame.command.mark == 7);
    let steps: Vec<_> = marked.map(|sample| sample.frame.command.setpoint.position).collect();
    assert_eq!(steps, (0..200).map(|k| f64::from(k) * 5e-3).collect::<Vec<_>>(), "nothing was dropped");
}

#[test]
fn a_bench_whose_experiment_falls_behind_stops_and_accepts_the_next_one() {
    let preset = preset();
    let (machine, readings) = InProcess::new(&preset, 1).unwrap();
    let hardware = Breaking { machine, ticks: u32::MAX, link: false };
    let hardware = ClockedBench::over(&preset, hardware, readings, ThreadSettings::PLAIN, None).unwrap();
    falls_behind(hardware, 400, 50);
    falls_behind(bench(), 2000, 1050);
}

fn falls_behind(mut bench: ClockedBench, away: u64, limit: u32) {
    let message = pause_for(away, &mut bench).expect("it was late");
    bench.set_controller(bench.parameters().tick.control.controller, 1).unwrap();
    assert!(message.contains(&format!("fell behind the clock by more than {limit} ms")), "{message}");
    let frame = bench.step(Command::default()).unwrap();
    assert_eq!(frame.command.mark, 0, "late commands were dropped");
    assert!(bench.safety().allows_torque(), "nothing was wrong with the machine");
    // No change is lost or mistaken for another.
    bench.change(Change::Request(Request::Stop)).unwrap();
    assert_eq!(bench.safety(), SafetyState::Ready);
    // At most 150 commands of 5 mrad, and 5²/(2·600) rad to stop.
    assert!((0.01..0.8).contains(&frame.angle), "{}", frame.angle);
}

#[test]
fn a_request_that_is_not_permitted_is_refused_with_a_remedy() {
    let mut bench = bench();
    let refused = bench.change(Change::Request(Request::Start)).unwrap_err();
    assert!(refused.to_string().contains("Home or arm first"), "{refused}");
    bench.change(Change::Request(Request::Home)).unwrap();
    assert_eq!(bench.safety(), SafetyState::Homing);
    assert!(matches!(bench.set_preload(1.5), Err(Error::OutOfRange { .. })));
}

/// A machine whose tacho or link fails after `ticks` ticks.
struct Breaking {
    machine: InProcess,
    ticks: u32,
    link: bool,
}

impl Io for Breaking {
    fn exchange(&mut self, voltages: Voltages<f64>) -> Result<Measurement<f64>, LinkFault> {
        self.ticks = self.ticks.saturating_sub(1);
        let readings = self.machine.exchange(voltages)?;
        match (self.ticks, self.link) {
            (0, true) => Err(LinkFault::Doubled { sequence: 1 }),
            (0, false) => Ok(Measurement { tacho_voltage: f64::NAN, ..readings }),
            _ => Ok(readings),
        }
    }

    fn set_preload(&mut self, preload: f64) -> Result<(), Error> {
        self.machine.set_preload(preload)
    }

    fn preload(&self) -> f64 {
        self.machine.preload()
    }
}

fn breaking(link: bool) -> String {
    let preset = preset();
    let (machine, readings) = InProcess::new(&preset, 1).unwrap();
    let machine = Breaking { machine, ticks: 500, link };
    let mut bench = ClockedBench::over(&preset, machine, readings, ThreadSettings::PLAIN, None).unwrap();
    home(&mut bench, &Watch::silent()).unwrap_err().to_string()
}

#[test]
fn a_failed_sensor_or_link_ends_the_experiment_with_its_reason() {
    assert!(breaking(false).contains("tacho velocity is not finite"));
    assert!(breaking(true).contains("arrived twice"));
}

/// A machine that is slower than its tick.
struct Slow(InProcess);

impl Io for Slow {
    fn exchange(&mut self, voltages: Voltages<f64>) -> Result<Measurement<f64>, LinkFault> {
        thread::sleep(Duration::from_millis(3));
        self.0.exchange(voltages)
    }

    fn set_preload(&mut self, preload: f64) -> Result<(), Error> {
        self.0.set_preload(preload)
    }

    fn preload(&self) -> f64 {
        self.0.preload()
    }
}

#[test]
fn a_machine_that_is_too_slow_ends_the_loop_and_is_named() {
    let preset = preset();
    let (machine, readings) = InProcess::new(&preset, 1).unwrap();
    let mut bench = ClockedBench::over(&preset, Slow(machine), readings, ThreadSettings::PLAIN, None).unwrap();
    let ended = (0..10_000).find_map(|_| bench.hand_over(Command::default()).err());
    let message = ended.expect("ten consecutive overruns end it").to_string();
    assert!(message.contains("machine") && message.contains("doctor"), "{message}");
}

#[test]
fn an_immediate_change_bypasses_all_commands() {
    let (tap, mut stream) = crate::tap::tap(1 << 14);
    let mut bench = ClockedBench::virtual_machine(&preset(), 1, ThreadSettings::PLAIN, Some(tap)).unwrap();
    home(&mut bench, &Watch::silent()).unwrap();
    let mut urgent = bench.urgent().unwrap();
    // Commands are queued ahead of the clock; a change in the queue would wait for them.
    let mut parameters = *bench.parameters();
    parameters.safety.speed = 300.0;
    let angle = bench.step(Command::default()).unwrap().angle;
    let hold = Command { setpoint: Setpoint { position: angle, ..Setpoint::default() }, ..Command::default() };
    let mut entered = None;
    for mark in 1..=1000 {
        bench.hand_over(Command { mark, ..hold }).unwrap();
        if mark == 500 {
            entered = Some(urgent.change(Change::Parameters(parameters)).unwrap());
        }
    }
    bench.drain(&mut |_| {}).unwrap();
    let refused = urgent.change(Change::Request(Request::Home)).unwrap_err();
    assert!(matches!(refused, Error::Refused(_)), "{refused}");
    urgent.change(Change::Request(Request::Stop)).unwrap();
    bench.outstanding().unwrap();
    assert_eq!(bench.take().map(|_| bench.safety()).unwrap(), SafetyState::Ready);
    bench.stop();
    let changes: Vec<_> = std::iter::from_fn(|| stream.change()).collect();
    let cycles: Vec<_> = changes.iter().rev().take(3).map(|changed| changed.cycle).collect();
    assert!(cycles[2] == entered.unwrap() && cycles[1] <= cycles[0], "{cycles:?}");
    let mut frames = std::iter::from_fn(|| stream.sample()).map(|sample| sample.frame);
    let last_before = frames.find(|frame| frame.command.mark == 500).unwrap();
    assert!(entered.unwrap() < last_before.cycle, "{entered:?}: not behind what was handed over before it");
    // After the end of the loop the call returns an error at once.
    let ended = urgent.change(Change::Request(Request::Start)).unwrap_err();
    assert!(matches!(ended, Error::BenchFault { .. }), "{ended}");
}

/// A machine with missing answers.
struct Absent {
    machine: InProcess,
    answer: Option<Measurement<f64>>,
    tick: u64,
    away: std::ops::Range<u64>,
    written: mpsc::Sender<Voltages<f64>>,
}

impl Io for Absent {
    fn exchange(&mut self, voltages: Voltages<f64>) -> Result<Measurement<f64>, LinkFault> {
        self.machine.exchange(voltages)
    }

    fn start(&mut self, tick: u64, voltages: Voltages<f64>) -> Result<Option<Measurement<f64>>, LinkFault> {
        let _ = self.written.send(voltages);
        self.tick = tick;
        self.answer = Some(self.machine.exchange(voltages)?);
        Ok(None)
    }

    fn finish(&mut self) -> Arrival {
        let away = self.away.contains(&self.tick);
        self.answer.take().filter(|_| !away).map_or(Arrival::Missing, Arrival::Readings)
    }

    fn set_preload(&mut self, preload: f64) -> Result<(), Error> {
        self.machine.set_preload(preload)
    }

    fn preload(&self) -> f64 {
        self.machine.preload()
    }
}

/// A controller whose torques depend on the sample number. It answers at once, or in real time on the next look.
struct Counts {
    samples: u32,
    later: bool,
    /// From this sample on it does not answer, until `ended` was called [`SILENT`] times.
    silent_from: u32,
    /// Sample number, and the number of looks before its answer.
    slow: (u32, u32),
    queries: std::cell::Cell<u32>,
    waiting: Option<Result<Answer, ExternalFault>>,
}

/// Number of queries for the reason without an answer.
const SILENT: u32 = 14;

impl Counts {
    fn external(later: bool, silent_from: u32) -> External {
        Self::external_as(Role::Controller, later, silent_from)
    }

    fn external_as(role: Role, later: bool, silent_from: u32) -> External {
        let counts = Counts { samples: 0, later, silent_from, slow: (0, 0), queries: 0.into(), waiting: None };
        External::new(role, Description::default(), String::new(), Box::new(counts))
    }

    fn slow(role: Role, sample: u32, looks: u32) -> External {
        let slow = (sample, looks);
        let counts = Counts { samples: 0, later: true, silent_from: u32::MAX, slow, queries: 0.into(), waiting: None };
        External::new(role, Description::default(), String::new(), Box::new(counts))
    }
}

impl Caller for Counts {
    fn begin(&mut self, _: f64, _: f64, _: &[f64]) -> Result<(), ExternalFault> {
        self.samples = 0;
        Ok(())
    }

    fn step(&mut self, sample: &ModuleSample, _: Option<&[f64]>) -> Result<Answer, ExternalFault> {
        self.samples += 1;
        let deviation = sample.reference_position - sample.measured_angle;
        let beside = sample.estimated_velocity + sample.measured_load_torque + sample.commanded_torque;
        let torque = 0.5 * deviation + 1e-3 * f64::from(self.samples) + 1e-4 * sample.time + 1e-3 * beside;
        Ok(Answer { torque, time: 7, refused: 0 })
    }

    fn ask(&mut self, question: Question<'_>) -> Option<Result<Answer, ExternalFault>> {
        let answer = match question {
            Question::Begin(..) => self.begin(0.0, 0.0, &[]).map(|()| Answer::default()),
            Question::Step(sample, values) => self.step(sample, values),
        };
        if !self.later {
            return Some(answer);
        }
        self.waiting = Some(answer).filter(|_| self.samples < self.silent_from);
        None
    }

    fn look(&mut self) -> Option<Result<Answer, ExternalFault>> {
        let (sample, looks) = &mut self.slow;
        if self.samples == *sample && *looks > 0 {
            *looks -= 1;
            return None;
        }
        self.waiting.take()
    }

    fn answers_at_once(&self) -> bool {
        !self.later
    }

    fn ended(&self) -> Option<ExternalFault> {
        self.queries.set(self.queries.get() + 1);
        (self.queries.get() > SILENT).then_some(ExternalFault::Crashed { signal: 11 })
    }
}

/// Commands with one gap in the control and one in rendering, for a bench that homes.
fn guiding(rate: f64) -> impl Iterator<Item = Command> {
    (0..400).map(move |k| {
        let time = f64::from(k) / rate;
        let setpoint = Setpoint { position: 0.3 * (20.0 * time).sin(), ..Setpoint::default() };
        Command { setpoint, control: !(101..109).contains(&k), render: !(203..207).contains(&k), ..Command::default() }
    })
}

fn guided(divider: f64) -> Preset<f64> {
    let mut preset = preset();
    preset.bench.control_divider = divider;
    // With the simulated clock, only the external controller can miss ticks.
    preset.bench.safety.missed_ticks = 8.0;
    preset
}

/// Frames of all cycles in real time with an external controller, and its reported faults.
fn in_real_time(preset: &Preset<f64>, external: External) -> (Vec<Frame>, Vec<(u64, ExternalFault)>) {
    let Preset { model, bench, .. } = *preset;
    let (machine, readings) = InProcess::new(preset, 7).unwrap();
    let role = external.role();
    let in_loop = ExternalInLoop::in_real_time(external, &model, &bench, None).unwrap();
    let mut parameters = design::parameters(&model, &bench).unwrap();
    let software = Software::new(parameters, bench.tick_time());
    super::role::enter(role, true, &mut parameters, &model, &bench).unwrap();
    let (mut entries_in, entries) = RingBuffer::new(500);
    let (mut changes_in, changes) = RingBuffer::new(2);
    let (mut externals_in, externals) = RingBuffer::new(1);
    let (replies_in, mut replies) = RingBuffer::new(1000);
    let (tap, mut stream) = crate::tap::tap(1000);
    let (_urgent, urgent, answers) = immediate_changes(None);
    let (returned, _returned) = RingBuffer::new(1);
    changes_in.push(Change::Request(Request::Home)).unwrap();
    changes_in.push(Change::Parameters(parameters)).unwrap();
    assert!(externals_in.push(Box::new(in_loop)).is_ok());
    let entries_of_all = [Entry::Change, Entry::External, Entry::Change].into_iter();
    for entry in entries_of_all.chain(guiding(bench.tick_rate).map(Entry::Command)).chain([Entry::Pause]) {
        entries_in.push(entry).unwrap();
    }
    let cycle = BenchCycle {
        software,
        machine,
        readings,
        ahead: Some(readings),
        silent: 0,
        rings: LoopRings { entries, changes, externals, returned, replies: replies_in },
        urgent,
        answers,
        flow: Flow::Paused,
        patience: 0,
        waiting: 0,
        waited: Arc::default(),
        external: None,
        samples: Some(tap.samples),
        keyframes: keyframe::keyframes().1,
    };
    let plan = Plan { warm_up: 0, cycles: Some(400), ..Plan::new(Duration::from_millis(1)) };
    let (executive, _) = stickslip_rt::Executive::new(plan, cycle).unwrap();
    executive.run(&stickslip_rt::SimulatedClock::default());
    let faults = std::iter::from_fn(|| replies.pop().ok()).filter_map(|reply| match reply {
        Reply::ExternalFailed { cycle, fault, .. } => Some((cycle, fault)),
        _ => None,
    });
    let faults = faults.collect();
    (std::iter::from_fn(|| stream.sample()).map(|sample| sample.frame).collect(), faults)
}

#[test]
fn an_external_controller_gives_the_same_bits_in_real_time() {
    for (divider, later) in [(1.0, false), (4.0, false), (2.0, true), (4.0, true), (7.0, true)] {
        let preset = guided(divider);
        let (clocked, faults) = in_real_time(&preset, Counts::external(later, u32::MAX));
        assert_eq!(faults, []);
        let mut bench = VirtualBench::new(&preset, 7).unwrap();
        bench.change(Change::Request(Request::Home)).unwrap();
        bench.bring(Counts::external(false, u32::MAX)).unwrap();
        let simulated: Vec<_> = guiding(preset.bench.tick_rate).map(|command| bench.step(command).unwrap()).collect();
        assert!(simulated.iter().any(|frame| frame.command.added_torque > 0.02), "it controls");
        for (now, then) in clocked.iter().zip(&simulated) {
            assert_eq!(now, then, "{divider} {later}");
        }
        assert_eq!(clocked.len(), simulated.len());
    }
}

#[test]
fn a_torque_missing_for_too_long_is_a_fault_whose_reason_follows() {
    let (frames, faults) = in_real_time(&guided(4.0), Counts::external(true, 20));
    // Its twentieth sample starts in cycle 76 and ends with cycle 79; eight missed ticks are permitted.
    let crashed = ExternalFault::Crashed { signal: 11 };
    assert!(faults.len() == 2 && faults[0].0 == 87 && faults[1] == (93, crashed), "{faults:?}");
    let ExternalFault::Late { time } = faults[0].1 else { panic!("{faults:?}") };
    assert!((time - 11e-3).abs() < 1e-12, "{time}");
    let torque = |cycle: usize| frames[cycle].command.added_torque;
    assert!(frames[86].safety.allows_torque() && torque(78) != torque(74));
    assert!((79..87).all(|cycle| torque(cycle) == torque(78)), "it is held");
    let stopped = |frame: &Frame| frame.safety.fault();
    assert_eq!(stopped(&frames[87]), Some(Fault::External(Role::Controller, faults[0].1)));
    assert_eq!(stopped(&frames[92]), Some(Fault::External(Role::Controller, faults[0].1)));
    assert!(frames[93..].iter().all(|frame| stopped(frame) == Some(Fault::External(Role::Controller, crashed))));
    assert!(frames[87..].iter().all(|frame| frame.command.added_torque == 0.0), "nothing more of it");
    assert!(matches!(frames[399].safety, SafetyState::Fault(_)), "at rest");
}

#[test]
fn a_late_torque_becomes_active_on_arrival_and_the_next_sample_is_regular() {
    let mut preset = guided(4.0);
    // The twentieth sample ends with cycle 79; from then on each cycle looks for its answer.
    let (frames, faults) = in_real_time(&preset, Counts::slow(Role::Controller, 20, 3));
    assert_eq!(faults, []);
    let torque = |cycle: usize| frames[cycle].command.added_torque;
    assert!(torque(79) == torque(78) && torque(80) == torque(78), "held");
    assert!(torque(81) == torque(78) && torque(82) != torque(78), "it comes");
    // The sample that starts in cycle 80 is skipped; the next one is active from its end on.
    assert!((82..87).all(|cycle| torque(cycle) == torque(82)) && torque(87) != torque(82) && torque(91) != torque(87));

    preset.bench.safety.missed_ticks = 2.0;
    let (_, faults) = in_real_time(&preset, Counts::slow(Role::Controller, 20, 20));
    assert!(matches!(faults[..], [(81, ExternalFault::Late { .. }), ..]), "{faults:?}");

    let (frames, faults) = in_real_time(&guided(4.0), Counts::slow(Role::Friction, 20, 5));
    assert_eq!(faults, []);
    let torque = |cycle: usize| frames[cycle].command.added_load_torque;
    assert!((20..25).all(|cycle| torque(cycle) == torque(19)) && torque(25) != torque(19) && torque(26) != torque(25));
}

#[test]
fn an_external_friction_or_law_gives_the_same_bits_in_real_time_one_tick_later() {
    for (role, later) in [(Role::Friction, false), (Role::Friction, true), (Role::Law, false), (Role::Law, true)] {
        let mut preset = guided(4.0);
        // At this slow tick the controller of the preset does not hold a load without friction.
        preset.bench.safety.following_error = 100.0;
        let (clocked, faults) = in_real_time(&preset, Counts::external_as(role, later, u32::MAX));
        assert_eq!(faults, []);
        let mut bench = VirtualBench::new(&preset, 7).unwrap();
        bench.change(Change::Request(Request::Home)).unwrap();
        bench.bring(Counts::external_as(role, false, u32::MAX)).unwrap();
        let simulated: Vec<_> = guiding(preset.bench.tick_rate).map(|command| bench.step(command).unwrap()).collect();
        let torque = |k: usize| simulated[k].command.added_load_torque;
        assert!(torque(0) == 0.0 && torque(1) != 0.0 && torque(203) == 0.0 && torque(207) == 0.0 && torque(208) != 0.0);
        assert!(simulated.iter().all(|frame| frame.command.added_torque == 0.0), "{role}: the drive is the preset's");
        assert_eq!(clocked, simulated, "{role} {later}");
    }
}

#[test]
fn a_friction_torque_missing_for_too_long_is_a_named_fault() {
    let (frames, faults) = in_real_time(&guided(4.0), Counts::external_as(Role::Friction, true, 20));
    let crashed = ExternalFault::Crashed { signal: 11 };
    // Its twentieth sample is requested in cycle 19.
    assert!(faults.len() == 2 && faults[0].0 == 28 && faults[1] == (34, crashed), "{faults:?}");
    assert!(matches!(faults[0].1, ExternalFault::Late { time } if (time - 9e-3).abs() < 1e-12), "{faults:?}");
    let named = frames[34].safety.fault().map(|fault| fault.to_string()).unwrap_or_default();
    assert!(named.contains("the friction's library crashed"), "{named}");
    assert!(frames[28..].iter().all(|frame| frame.command.added_load_torque == 0.0), "nothing more of it");
    assert!(matches!(frames[399].safety, SafetyState::Fault(_)), "at rest");
}

#[test]
fn a_controller_in_another_process_needs_more_than_one_tick_per_sample() {
    let mut bench = ClockedBench::virtual_machine(&guided(1.0), 1, ThreadSettings::PLAIN, None).unwrap();
    let refused = bench.bring(Counts::external(true, u32::MAX)).unwrap_err().to_string();
    assert!(refused.contains("in every tick of 1000 Hz") && refused.contains("--trust"), "{refused}");
    bench.bring(Counts::external(false, u32::MAX)).unwrap();
    assert!(bench.take_back(&guided(1.0).bench).unwrap().is_some());
    assert!(bench.take_back(&guided(1.0).bench).unwrap().is_none());
}

/// Frames of the start of homing, some changes and a following idle time, on a simulated clock.
fn ticks(machine: impl Io + Send, readings: Measurement<f64>, later: &[Change]) -> Vec<Frame> {
    let (_externals, externals) = RingBuffer::new(1);
    let (returned, _returned) = RingBuffer::new(1);
    const TICKS: usize = 600;
    let preset = preset();
    let (mut entries_in, entries) = RingBuffer::new(2 * TICKS);
    let (mut changes_in, changes) = RingBuffer::new(4);
    let (replies, _replies) = RingBuffer::new(2 * TICKS);
    let (_urgent, urgent, answers) = immediate_changes(None);
    let (tap, mut stream) = crate::tap::tap(TICKS);
    changes_in.push(Change::Request(Request::Home)).unwrap();
    entries_in.push(Entry::Change).unwrap();
    for k in 0..TICKS / 2 {
        if k == 200 {
            entries_in.push(Entry::Preload(0.5)).unwrap();
        }
        let torque = 0.5 * f64::from(u8::from(k % 100 < 50));
        entries_in.push(Entry::Command(Command { added_torque: torque, ..Command::default() })).unwrap();
    }
    for change in later {
        changes_in.push(*change).unwrap();
        entries_in.push(Entry::Change).unwrap();
        entries_in.push(Entry::Command(Command { added_torque: 0.4, ..Command::default() })).unwrap();
    }
    entries_in.push(Entry::Pause).unwrap();
    let parameters = design::parameters(&preset.model, &preset.bench).unwrap();
    let software = Software::new(parameters, preset.bench.tick_time());
    let (samples, ahead, silent, flow) = (Some(tap.samples), Some(readings), 0, Flow::Paused);
    let cycle = BenchCycle {
        software,
        machine,
        readings,
        ahead,
        silent,
        rings: LoopRings { entries, changes, externals, returned, replies },
        urgent,
        answers,
        flow,
        patience: 0,
        waiting: 0,
        waited: Arc::default(),
        external: None,
        samples,
        keyframes: keyframe::keyframes().1,
    };
    let plan = Plan { warm_up: 0, cycles: Some(TICKS as u64), ..Plan::new(Duration::from_millis(1)) };
    let (executive, _) = stickslip_rt::Executive::new(plan, cycle).unwrap();
    assert_eq!(executive.run(&stickslip_rt::SimulatedClock::default()).cycles, TICKS as u64);
    std::iter::from_fn(|| stream.sample()).map(|sample| sample.frame).collect()
}

#[test]
fn a_machine_behind_a_link_gives_the_same_bits_in_real_time() {
    let preset = preset();
    let (machine, readings) = InProcess::new(&preset, 7).unwrap();
    let here = ticks(machine, readings, &[]);
    assert!(here.len() == 600 && here[300].angle != here[0].angle, "it moves");
    let folder = tempfile::tempdir().unwrap();
    for address in ["udp:127.0.0.1:0".into(), format!("shm:{}", folder.path().join("axis").display())] {
        let mut server = PlantServer::bind(&address.parse().unwrap(), &preset, 7).unwrap();
        let address = server.address().clone();
        let serving = thread::spawn(move || server.serve(true, &Watch::silent()));
        let (machine, readings) = Paced::begin(&address, preset.bench.tick_time()).unwrap();
        assert_eq!(here, ticks(machine.patient(), readings, &[]), "{address}");
        let served = serving.join().unwrap().unwrap();
        // The last tick switches the torque off.
        assert_eq!((served.ticks, served.held, served.refused), (601, 0, 0));
    }
}

/// The same with a machine that does not answer for `ticks_away` ticks, where 100 are permitted: frames and written
/// voltages.
fn away(ticks_away: u64) -> (Vec<Frame>, Vec<Voltages<f64>>) {
    let (machine, readings) = InProcess::new(&preset(), 1).unwrap();
    let (written, voltages) = mpsc::channel();
    let machine = Absent { machine, answer: None, tick: 0, away: 120..120 + ticks_away, written };
    let later = [Change::Request(Request::Acknowledge), Change::Request(Request::Home)];
    (ticks(machine, readings, &later), voltages.try_iter().collect())
}

#[test]
fn with_missing_answers_voltages_are_held_and_commands_wait() {
    let (frames, written) = away(10);
    assert_eq!(frames.len(), 590, "nothing was computed without readings");
    let gap = frames.windows(2).find(|pair| pair[1].cycle != pair[0].cycle + 1).unwrap();
    assert_eq!((gap[0].cycle, gap[1].cycle), (120, 131), "the number of a cycle is time");
    assert_eq!([gap[0].safety, gap[1].safety], [SafetyState::Homing; 2]);
    assert!(written[121] != Voltages::default() && written[121..=131].iter().all(|held| *held == written[121]));
    assert!(written[132] != written[131]);
}

#[test]
fn too_many_missing_answers_remove_the_torque_and_the_bench_homes_after_recovery() {
    let (frames, written) = away(101);
    let fault = SafetyState::Fault(Fault::Machine(MachineFault::Silent { ticks: 101 }));
    let first = frames.iter().position(|frame| frame.safety == fault).unwrap();
    assert_eq!((first, frames[first].cycle), (121, 221));
    assert_eq!(written[222..400], [Voltages::default(); 178], "zero from the tick of the fault on");
    // After the commands of the aborted experiment.
    let homing = frames.iter().rposition(|frame| frame.safety == SafetyState::Homing).unwrap();
    assert!(homing == frames.len() - 1 && frames[homing].cycle == 599);
    let voltage = |frame: &&Frame| frame.signals.servo_voltage != 0.0;
    assert_eq!(frames[first..].iter().filter(voltage).count(), 1, "one command had torque again");
}
