use super::*;
use crate::remote::Counts;
use crate::remote::frame::Begun;
use crate::remote::line::Peer;

/// A slow tick for busy computers.
const TICK: f64 = 4e-3;

/// A machine controlled by a test.
struct Scripted {
    line: Line,
    bench: Peer,
}

impl Scripted {
    /// The next frame of the bench.
    fn next(&mut self) -> Option<(u64, Message)> {
        let mut bytes = [0; LONGEST];
        let (length, bench) = self.line.look(&mut bytes).ok()?;
        self.bench = bench;
        Some(Message::read(&bytes[..length]).unwrap())
    }

    fn send(&mut self, message: Message, number: u64) {
        self.line.send(&message.datagram(number), self.bench).unwrap();
    }

    /// Readings whose tacho shows a number.
    fn answer(&mut self, number: u64) {
        self.send(Message::Readings(readings(number)), number);
    }
}

fn readings(number: u64) -> Measurement<f64> {
    Measurement { tacho_voltage: number as f64, ..Measurement::default() }
}

fn begun(preload: f64) -> Message {
    Message::Begun(Begun { preload, measurement: readings(77) })
}

/// A link over datagrams, and one over shared memory, each with its machine.
fn over_both(test: impl Fn(&mut Paced, &mut Scripted)) {
    let folder = tempfile::tempdir().unwrap();
    let memory = Address::Shm(folder.path().join("axis").display().to_string());
    for address in ["udp:127.0.0.1:0".parse().unwrap(), memory] {
        let (line, address) = Line::bind(&address).unwrap();
        let mut machine = Scripted { line, bench: None };
        let answering = std::thread::spawn(move || {
            let (number, message) = loop {
                if let Some(came) = machine.next() {
                    break came;
                }
                std::thread::yield_now();
            };
            assert_eq!((number, message), (0, Message::BeginRealTime(Begin { tick_time: TICK })));
            machine.send(begun(1.0), 0);
            machine
        });
        let (mut bench, first) = Paced::begin(&address, TICK).unwrap();
        assert_eq!(first, readings(77));
        test(&mut bench, &mut answering.join().unwrap());
    }
}

/// One tick: the machine receives the voltages and runs `act`. Returns the result of the bench.
fn tick(bench: &mut Paced, machine: &mut Scripted, tick: u64, act: impl FnOnce(&mut Scripted, u64)) -> Arrival {
    let voltages = Voltages { servo_voltage: tick as f64, amplifier_voltage: 0.0 };
    assert_eq!(bench.start(tick, voltages).unwrap(), None);
    while let Some((number, message)) = machine.next() {
        if message == Message::Voltages(voltages) {
            assert_eq!(number, tick + 1);
            act(machine, number);
            return bench.finish();
        }
    }
    panic!("tick {tick} did not reach the machine")
}

#[test]
fn each_tick_has_its_own_readings() {
    over_both(|bench, machine| {
        for k in [0, 1, 2, 7, 8] {
            assert_eq!(tick(bench, machine, k, Scripted::answer), Arrival::Readings(readings(k + 1)));
        }
        assert_eq!(bench.traffic.counts(), Counts { answered: 5, begun: 1, ..Counts::default() });
    });
}

#[test]
fn lost_late_duplicated_and_reordered_answers_are_counted_and_never_assigned_to_another_tick() {
    over_both(|bench, machine| {
        assert_eq!(tick(bench, machine, 0, |_, _| ()), Arrival::Missing, "lost");
        // The answer to the first one comes with the second's: it is late.
        let both = |machine: &mut Scripted, number: u64| (number - 1..=number).for_each(|n| machine.answer(n));
        assert_eq!(tick(bench, machine, 1, both), Arrival::Readings(readings(2)));
        let twice = |machine: &mut Scripted, number: u64| (0..2).for_each(|_| machine.answer(number));
        assert_eq!(tick(bench, machine, 2, twice), Arrival::Readings(readings(3)));
        assert_eq!(tick(bench, machine, 3, Scripted::answer), Arrival::Readings(readings(4)));
        // In the wrong order the newer one is taken, and the older one is late.
        let swapped =
            |machine: &mut Scripted, number: u64| [number, number - 1].into_iter().for_each(|n| machine.answer(n));
        assert_eq!(tick(bench, machine, 4, swapped), Arrival::Readings(readings(5)));
        assert_eq!(tick(bench, machine, 5, Scripted::answer), Arrival::Readings(readings(6)));
        assert_eq!(tick(bench, machine, 6, |machine, _| machine.answer(99)), Arrival::Missing, "of no tick yet");
        let counts = Counts { answered: 5, missing: 2, late: 2, doubled: 1, garbled: 1, begun: 1 };
        assert_eq!(bench.traffic.counts(), counts);
    });
}

#[test]
fn a_wrong_checksum_loses_only_its_frame() {
    over_both(|bench, machine| {
        let garbled = |machine: &mut Scripted, number: u64| {
            let mut frame = Message::Readings(readings(number)).datagram(number);
            frame[30] ^= 4;
            machine.line.send(&frame, machine.bench).unwrap();
            machine.line.send(b"something else", machine.bench).unwrap();
        };
        assert_eq!(tick(bench, machine, 0, garbled), Arrival::Missing);
        // The machine reports an unreadable frame: it has held its voltages.
        let there = |machine: &mut Scripted, _: u64| machine.send(Reason::FrameError.message(0.0, 0.0), 0);
        assert_eq!(tick(bench, machine, 1, there), Arrival::Missing);
        assert_eq!(tick(bench, machine, 2, Scripted::answer), Arrival::Readings(readings(3)));
        assert_eq!((bench.traffic.counts().garbled, bench.traffic.counts().missing), (3, 2));
    });
}

/// Ticks until the machine gets a frame of this kind, without an answer meanwhile.
fn until(bench: &mut Paced, machine: &mut Scripted, from: u64, kind: u8) -> u64 {
    for tick in from..from + 3 * bench.retry {
        bench.start(tick, Voltages::default()).unwrap();
        while let Some((number, message)) = machine.next() {
            if message.kind() == kind {
                return number;
            }
        }
        assert_eq!(bench.finish(), Arrival::Missing);
    }
    panic!("no frame of kind {kind}")
}

#[test]
fn a_restarted_machine_is_started_again_by_the_bench() {
    over_both(|bench, machine| {
        let stranger = |machine: &mut Scripted, number| machine.send(Reason::Stranger.message(0.0, 0.0), number);
        assert_eq!(tick(bench, machine, 100, stranger), Arrival::Restarted);
        let number = until(bench, machine, 101, 9);
        // Answers to earlier frames are ignored.
        machine.send(Reason::Stranger.message(0.0, 0.0), 101);
        machine.send(begun(0.5), number);
        assert_eq!(bench.finish(), Arrival::Missing, "the old refusal is passed over");
        assert_eq!(bench.finish(), Arrival::Readings(readings(77)));
        assert_eq!((bench.preload(), bench.traffic.counts().begun), (0.5, 2));
        assert_eq!(tick(bench, machine, number, Scripted::answer), Arrival::Readings(readings(number + 1)));
    });
}

#[test]
fn a_machine_used_by_another_bench_is_started_once_it_is_free() {
    over_both(|bench, machine| {
        let taken = |machine: &mut Scripted, number| machine.send(Reason::Stranger.message(1.0, 0.0), number);
        assert_eq!(tick(bench, machine, 0, taken), Arrival::Restarted);
        let retry = bench.retry;
        let number = until(bench, machine, 1, 3);
        assert!(number >= retry, "requests are rare: {number}");
        taken(machine, number);
        assert_eq!(bench.finish(), Arrival::Missing);
        let number = until(bench, machine, number, 3);
        machine.send(Reason::Stranger.message(0.0, 0.0), number);
        assert_eq!(bench.finish(), Arrival::Missing);
        until(bench, machine, number, 9);
    });
}

#[test]
fn a_preload_is_sent_until_it_is_confirmed() {
    over_both(|bench, machine| {
        assert!(matches!(bench.set_preload(1.5), Err(Error::OutOfRange { .. })));
        bench.set_preload(0.25).unwrap();
        let request = Message::Preload(Preload { preload: 0.25 });
        assert_eq!(machine.next(), Some((1, request)), "before the voltages of its tick");
        let number = until(bench, machine, 0, 5);
        machine.send(Message::Pressed(Preload { preload: 0.25 }), number);
        assert_eq!(bench.finish(), Arrival::Missing);
        for tick in number..number + 3 * bench.retry {
            bench.start(tick, Voltages::default()).unwrap();
            while let Some((_, message)) = machine.next() {
                assert_eq!(message.kind(), 3, "it is confirmed");
            }
        }
    });
}
