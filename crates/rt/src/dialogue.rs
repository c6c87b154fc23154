//! Questions and answers between two processes through shared memory, without a system call while both are awake.
//!
//! There is one slot for a question and one for an answer (`slot.rs`), each written by one side only. A question is
//! refused until the last one is answered. A waiting side first spins, since an answer is computed within microseconds,
//! and then sleeps. The other side makes the system call that wakes it only if it sleeps.
//!
//! The contents of the memory are untrusted. An unexpected number is not an answer, and the words of an answer can be
//! any bits. Every index and length from the memory is checked.

use std::fs::File;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering, fence};
use std::thread;
use std::time::{Duration, Instant};

use crate::segment::Segment;
use crate::slot::{self, HEAD};

/// Number of words of an answer.
pub const ANSWER: usize = 6;

/// Spinning time before a waiting side sleeps: longer than most answers take.
const SPIN: Duration = Duration::from_micros(50);
/// Where spinning did not help, it is retried with every `RETRY`-th question.
const RETRY: u32 = 64;
/// Words of a cache line.
const LINE: usize = 8;
/// Flags of the sleeping responder and requester, each in a separate cache line.
const RESPONDER_SLEEPS: usize = 0;
const REQUESTER_SLEEPS: usize = LINE;
/// Positions of the answer and, after it, the question.
const ANSWERS: usize = 2 * LINE;
const QUESTIONS: usize = ANSWERS + (HEAD + ANSWER).next_multiple_of(LINE);

/// Size of the memory for questions of `question` words.
fn words(question: usize) -> usize {
    QUESTIONS + HEAD + question
}

fn answers(segment: &Segment) -> &[AtomicU64] {
    &segment.words()[ANSWERS..ANSWERS + HEAD + ANSWER]
}

fn questions(segment: &Segment) -> &[AtomicU64] {
    &segment.words()[QUESTIONS..]
}

/// Spinning time; zero on a single CPU, where the other side could not run meanwhile.
fn spin() -> Duration {
    if thread::available_parallelism().is_ok_and(|cpus| cpus.get() > 1) { SPIN } else { Duration::ZERO }
}

/// Waits up to `within` until `look` returns a value, first spinning, then sleeping. Also returns whether it slept. It
/// may return early if it is woken.
fn until<T>(
    segment: &Segment,
    [sleeps, word]: [usize; 2],
    spin: Duration,
    within: Duration,
    mut look: impl FnMut() -> Option<T>,
) -> Option<(T, bool)> {
    let start = Instant::now();
    loop {
        if let Some(value) = look() {
            return Some((value, false));
        }
        if start.elapsed() >= spin.min(within) {
            break;
        }
        std::hint::spin_loop();
    }
    let left = within.checked_sub(start.elapsed())?;
    let sleeps = &segment.words()[sleeps];
    sleeps.store(1, Ordering::Relaxed);
    // Either this side reads the new word, or the other side reads the sleep flag.
    fence(Ordering::SeqCst);
    let present = segment.words()[word].load(Ordering::Relaxed);
    let value = look().or_else(|| {
        segment.sleep(word, present, left);
        look()
    });
    sleeps.store(0, Ordering::Relaxed);
    value.map(|value| (value, true))
}

/// Wakes the other side if its sleep flag is set. Returns whether it was set.
fn wake(segment: &Segment, [sleeps, word]: [usize; 2]) -> bool {
    fence(Ordering::SeqCst);
    let slept = segment.words()[sleeps].load(Ordering::Relaxed) != 0;
    if slept {
        segment.wake(word);
    }
    slept
}

/// The side that sends questions.
#[derive(Debug)]
pub struct Requester {
    segment: Arc<Segment>,
    spin: Duration,
    /// Number of the last question.
    number: u64,
    /// The last question has no answer yet.
    open: bool,
    /// The other side had to be woken for the last question.
    woken: bool,
}

impl Requester {
    /// Creates the memory for questions of at most `question` words. The file is for the other side.
    ///
    /// # Errors
    /// Errors of the operating system.
    pub fn new(question: usize) -> io::Result<(Self, File)> {
        let (segment, file) = Segment::anonymous(words(question))?;
        Ok((Requester { segment: Arc::new(segment), spin: spin(), number: 0, open: false, woken: false }, file))
    }

    /// Sends a question without waiting; false if the last question has no answer yet.
    pub fn ask(&mut self, words: impl IntoIterator<Item = u64>) -> bool {
        if self.open {
            return false;
        }
        (self.number, self.open) = (self.number.wrapping_add(1), true);
        slot::put(questions(&self.segment), self.number, words);
        self.woken = wake(&self.segment, [RESPONDER_SLEEPS, QUESTIONS]);
        true
    }

    /// Whether the answer to the last question has not been taken yet.
    pub fn is_open(&self) -> bool {
        self.open
    }

    /// The answer if available; its words can be any bits.
    pub fn answer(&mut self) -> Option<[u64; ANSWER]> {
        if !self.open || slot::number(answers(&self.segment)) != self.number {
            return None;
        }
        let mut answer = [0; ANSWER];
        slot::take(answers(&self.segment), &mut answer);
        self.open = false;
        Some(answer)
    }

    /// Waits for the answer up to `within`, or until the alarm rings.
    pub fn wait(&mut self, within: Duration) -> Option<[u64; ANSWER]> {
        let (segment, spin) = (self.segment.clone(), if self.woken { Duration::ZERO } else { self.spin });
        until(&segment, [REQUESTER_SLEEPS, ANSWERS], spin, within, || self.answer()).map(|(answer, _)| answer)
    }

    /// Alarm that ends a wait.
    pub fn alarm(&self) -> Alarm {
        Alarm(self.segment.clone())
    }
}

/// Wakes the requester while it waits for an answer.
#[derive(Clone, Debug)]
pub struct Alarm(Arc<Segment>);

impl Alarm {
    /// Ends a wait in progress.
    pub fn ring(&self) {
        self.0.wake(ANSWERS);
    }
}

/// The side that answers questions.
#[derive(Debug)]
pub struct Responder {
    segment: Segment,
    spin: Duration,
    /// Number of the last question that was taken.
    number: u64,
    taken: Vec<u64>,
    /// Whether the other side had to be woken for the last answer; whether spinning helped last time; number of
    /// questions.
    woken: bool,
    helped: bool,
    count: u32,
}

impl Responder {
    /// Opens the memory that the requester created for questions of at most `question` words.
    ///
    /// # Errors
    /// A file that is too short; errors of the operating system.
    pub fn open(file: &File, question: usize) -> io::Result<Self> {
        let segment = Segment::map(file, words(question))?;
        Ok(Responder {
            segment,
            spin: spin(),
            number: 0,
            taken: vec![0; question],
            woken: false,
            helped: true,
            count: 0,
        })
    }

    /// Whether it always sleeps between two questions with this period. Only then may it have real-time priority;
    /// otherwise it would starve ordinary threads.
    pub fn sleeps_between(period: Duration) -> bool {
        thread::available_parallelism().is_ok_and(|cpus| cpus.get() > 1) && period >= 2 * SPIN
    }

    /// Waits up to `within` for the next question; may return early.
    pub fn question(&mut self, within: Duration) -> Option<&[u64]> {
        let (segment, last) = (&self.segment, self.number);
        let number = || Some(slot::number(questions(segment))).filter(|number| *number != last);
        let spins = (self.helped && !self.woken) || self.count.is_multiple_of(RETRY);
        let spin = if spins { self.spin } else { Duration::ZERO };
        let (number, slept) = until(segment, [RESPONDER_SLEEPS, QUESTIONS], spin, within, number)?;
        if spins {
            self.helped = !slept;
        }
        (self.number, self.count) = (number, self.count.wrapping_add(1));
        let count = slot::take(questions(&self.segment), &mut self.taken);
        Some(&self.taken[..count])
    }

    /// Answers the last question.
    pub fn answer(&mut self, words: [u64; ANSWER]) {
        slot::put(answers(&self.segment), self.number, words);
        self.woken = wake(&self.segment, [REQUESTER_SLEEPS, ANSWERS]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Far longer than a test takes.
    const LONG: Duration = Duration::from_secs(3600);

    fn dialogue(question: usize) -> (Requester, Responder) {
        let (requester, file) = Requester::new(question).expect("memory");
        let responder = Responder::open(&file, question).expect("the same memory");
        (requester, responder)
    }

    #[test]
    fn each_question_has_its_answer_when_either_side_sleeps() {
        let (mut requester, mut responder) = dialogue(3);
        let responding = thread::spawn(move || {
            loop {
                let Some(question) = responder.question(LONG) else { continue };
                let (sum, count) = (question.iter().sum::<u64>(), question.len() as u64);
                if sum % 64 == 9 {
                    // Long enough that the other side sleeps.
                    thread::sleep(20 * SPIN);
                }
                responder.answer([sum, count, 0, 0, 0, 7]);
                if sum == 0 {
                    return;
                }
            }
        });
        for k in (1..400).rev() {
            if k % 64 == 5 {
                thread::sleep(20 * SPIN);
            }
            assert!(requester.ask([k, k + 1, k + 2]));
            assert!(!requester.ask([0]), "one question at a time");
            let answer = std::iter::repeat_with(|| requester.wait(LONG)).find_map(|answer| answer);
            assert_eq!(answer, Some([3 * k + 3, 3, 0, 0, 0, 7]));
        }
        requester.ask([0]);
        while requester.wait(LONG).is_none() {}
        responding.join().expect("it ends");
    }

    #[test]
    fn words_beyond_the_room_are_dropped() {
        let (mut requester, mut responder) = dialogue(3);
        requester.ask([1, 2, 3, 4, 5]);
        assert_eq!(responder.question(LONG), Some(&[1, 2, 3][..]));
    }

    #[test]
    fn a_wait_ends_in_time_or_with_the_alarm() {
        let (mut requester, mut responder) = dialogue(1);
        assert_eq!(responder.question(Duration::from_millis(1)), None);
        requester.ask([1]);
        assert!(
            requester.answer().is_none() && requester.wait(Duration::from_millis(1)).is_none() && requester.is_open()
        );
        let (alarm, rung) = (requester.alarm(), Arc::new(std::sync::atomic::AtomicBool::new(false)));
        let ended = rung.clone();
        let waiting = thread::spawn(move || assert!(requester.wait(LONG).is_none()));
        // Repeatedly: the other thread may not wait yet.
        let ringing = thread::spawn(move || {
            while !ended.load(Ordering::Relaxed) {
                alarm.ring();
                thread::sleep(Duration::from_millis(1));
            }
        });
        waiting.join().expect("it is woken");
        rung.store(true, Ordering::Relaxed);
        ringing.join().expect("it ends");
    }

    #[test]
    fn any_bits_from_the_other_side_are_harmless() {
        let (mut requester, file) = Requester::new(4).expect("memory");
        let hostile = Segment::map(&file, words(4)).expect("the same memory");
        let mut random = 1u64;
        let mut next = move || {
            random = random.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            random ^ (random >> 29)
        };
        let mut answers = 0;
        for round in 0..20_000u64 {
            requester.ask([round; 4]);
            for word in hostile.words() {
                word.store(next(), Ordering::Relaxed);
            }
            assert_eq!(requester.answer(), None, "random bits are not an answer");
            // Sometimes the expected number, with random length and words.
            if round % 3 == 0 {
                hostile.words()[ANSWERS].store(requester.number, Ordering::Relaxed);
                answers += u64::from(requester.answer().is_some());
            }
            if round % 100 == 0 {
                assert!(requester.wait(Duration::from_micros(1)).is_none());
            }
        }
        assert_eq!(answers, 6667);
        // The same for the responder.
        let mut responder = Responder::open(&file, 4).expect("the same memory");
        for _ in 0..1000 {
            hostile.words().iter().for_each(|word| word.store(next(), Ordering::Relaxed));
            assert!(responder.question(LONG).is_some_and(|question| question.len() <= 4));
        }
    }
}
