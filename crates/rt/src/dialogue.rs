//! One process asks, another answers, through memory that both see: without a system call where both are awake.
//!
//! There is one place for a question and one for an answer (`slot.rs`), each written by one side alone. The next question
//! is put when the last one has its answer, and not before: it is refused until then. Whoever waits spins for a while,
//! since an answer that is computed comes within microseconds, and then sleeps; the other side wakes it, which is a system
//! call, only where it sleeps.
//!
//! What stands in the memory, the other side can have written: a number that nobody waits for is no answer, and the words
//! of one are any bits. Nothing here follows an index or a length from there unchecked.

use std::fs::File;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering, fence};
use std::thread;
use std::time::{Duration, Instant};

use crate::segment::Segment;
use crate::slot::{self, HEAD};

/// Words of an answer.
pub const ANSWER: usize = 6;

/// So long whoever waits spins before it sleeps: longer than most answers take.
const SPIN: Duration = Duration::from_micros(50);
/// Where spinning does not help, so often it is tried again.
const AGAIN: u32 = 64;
/// Words of a cache line.
const LINE: usize = 8;
/// Where whoever answers, and whoever asks, says that it sleeps; each has a line of its own.
const ANSWERER_SLEEPS: usize = 0;
const ASKER_SLEEPS: usize = LINE;
/// Where the answer is, and behind it the question.
const ANSWERS: usize = 2 * LINE;
const QUESTIONS: usize = ANSWERS + (HEAD + ANSWER).next_multiple_of(LINE);

/// Memory for questions of so many words.
fn words(question: usize) -> usize {
    QUESTIONS + HEAD + question
}

fn answers(segment: &Segment) -> &[AtomicU64] {
    &segment.words()[ANSWERS..ANSWERS + HEAD + ANSWER]
}

fn questions(segment: &Segment) -> &[AtomicU64] {
    &segment.words()[QUESTIONS..]
}

/// How long to spin: not at all where nobody else could run meanwhile.
fn spin() -> Duration {
    if thread::available_parallelism().is_ok_and(|cpus| cpus.get() > 1) { SPIN } else { Duration::ZERO }
}

/// Looks until something is there, for so long at most, spinning first: with whether it slept. It may give up early where
/// it is woken.
fn until<T>(
    segment: &Segment,
    [sleeps, word]: [usize; 2],
    spin: Duration,
    within: Duration,
    mut look: impl FnMut() -> Option<T>,
) -> Option<(T, bool)> {
    let begin = Instant::now();
    loop {
        if let Some(found) = look() {
            return Some((found, false));
        }
        if begin.elapsed() >= spin.min(within) {
            break;
        }
        std::hint::spin_loop();
    }
    let left = within.checked_sub(begin.elapsed())?;
    let sleeps = &segment.words()[sleeps];
    sleeps.store(1, Ordering::Relaxed);
    // Either this side sees what the other has put, or the other sees that this one sleeps.
    fence(Ordering::SeqCst);
    let seen = segment.words()[word].load(Ordering::Relaxed);
    let found = look().or_else(|| {
        segment.sleep(word, seen, left);
        look()
    });
    sleeps.store(0, Ordering::Relaxed);
    found.map(|found| (found, true))
}

/// Wakes the other side where it says that it sleeps: whether it did.
fn wake(segment: &Segment, [sleeps, word]: [usize; 2]) -> bool {
    fence(Ordering::SeqCst);
    let slept = segment.words()[sleeps].load(Ordering::Relaxed) != 0;
    if slept {
        segment.wake(word);
    }
    slept
}

/// The side that asks.
#[derive(Debug)]
pub struct Requester {
    segment: Arc<Segment>,
    spin: Duration,
    /// Of the last question.
    number: u64,
    /// It has no answer yet.
    open: bool,
    /// The other side had to be woken for it.
    woken: bool,
}

impl Requester {
    /// Makes the memory for questions of at most so many words; its file is for the other side.
    ///
    /// # Errors
    /// What the system refuses.
    pub fn new(question: usize) -> io::Result<(Self, File)> {
        let (segment, file) = Segment::anonymous(words(question))?;
        Ok((Requester { segment: Arc::new(segment), spin: spin(), number: 0, open: false, woken: false }, file))
    }

    /// Asks, and does not wait; false where the last question has no answer yet.
    pub fn ask(&mut self, words: impl IntoIterator<Item = u64>) -> bool {
        if self.open {
            return false;
        }
        (self.number, self.open) = (self.number.wrapping_add(1), true);
        slot::put(questions(&self.segment), self.number, words);
        self.woken = wake(&self.segment, [ANSWERER_SLEEPS, QUESTIONS]);
        true
    }

    /// Whether the last question has no answer yet, as known by now.
    pub fn is_open(&self) -> bool {
        self.open
    }

    /// The answer, where it is there: any bits.
    pub fn answer(&mut self) -> Option<[u64; ANSWER]> {
        if !self.open || slot::number(answers(&self.segment)) != self.number {
            return None;
        }
        let mut answer = [0; ANSWER];
        slot::take(answers(&self.segment), &mut answer);
        self.open = false;
        Some(answer)
    }

    /// Waits for it for so long at most, or until somebody rings the alarm.
    pub fn wait(&mut self, within: Duration) -> Option<[u64; ANSWER]> {
        let (segment, spin) = (self.segment.clone(), if self.woken { Duration::ZERO } else { self.spin });
        until(&segment, [ASKER_SLEEPS, ANSWERS], spin, within, || self.answer()).map(|(answer, _)| answer)
    }

    /// What wakes it while it waits.
    pub fn alarm(&self) -> Alarm {
        Alarm(self.segment.clone())
    }
}

/// Wakes whoever waits for an answer, which may be none.
#[derive(Clone, Debug)]
pub struct Alarm(Arc<Segment>);

impl Alarm {
    /// Rings: a wait that has begun ends.
    pub fn ring(&self) {
        self.0.wake(ANSWERS);
    }
}

/// The side that answers.
#[derive(Debug)]
pub struct Responder {
    segment: Segment,
    spin: Duration,
    /// Of the last question that was taken.
    number: u64,
    taken: Vec<u64>,
    /// The other side had to be woken for the last answer; spinning helped the last time; questions so far.
    woken: bool,
    helped: bool,
    count: u32,
}

impl Responder {
    /// In the memory of a file, for questions of at most so many words, as the asking side has made it.
    ///
    /// # Errors
    /// A file that is shorter; what the system refuses.
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

    /// Whether it sleeps between two questions so far apart, however it waits for the second: only then may it run before
    /// all ordinary threads, which it would starve.
    pub fn sleeps_between(period: Duration) -> bool {
        thread::available_parallelism().is_ok_and(|cpus| cpus.get() > 1) && period >= 2 * SPIN
    }

    /// The next question, for which it waits for so long at most; it may give up early.
    pub fn question(&mut self, within: Duration) -> Option<&[u64]> {
        let (segment, last) = (&self.segment, self.number);
        let asked = || Some(slot::number(questions(segment))).filter(|number| *number != last);
        let spins = (self.helped && !self.woken) || self.count.is_multiple_of(AGAIN);
        let spin = if spins { self.spin } else { Duration::ZERO };
        let (number, slept) = until(segment, [ANSWERER_SLEEPS, QUESTIONS], spin, within, asked)?;
        if spins {
            self.helped = !slept;
        }
        (self.number, self.count) = (number, self.count.wrapping_add(1));
        let count = slot::take(questions(&self.segment), &mut self.taken);
        Some(&self.taken[..count])
    }

    /// Answers it.
    pub fn answer(&mut self, words: [u64; ANSWER]) {
        slot::put(answers(&self.segment), self.number, words);
        self.woken = wake(&self.segment, [ASKER_SLEEPS, ANSWERS]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Far longer than a test may take.
    const LONG: Duration = Duration::from_secs(3600);

    fn dialogue(question: usize) -> (Requester, Responder) {
        let (asker, file) = Requester::new(question).expect("memory");
        let answerer = Responder::open(&file, question).expect("the same memory");
        (asker, answerer)
    }

    #[test]
    fn each_question_has_its_answer_whoever_sleeps_meanwhile() {
        let (mut asker, mut answerer) = dialogue(3);
        let answering = thread::spawn(move || {
            loop {
                let Some(question) = answerer.question(LONG) else { continue };
                let (sum, count) = (question.iter().sum::<u64>(), question.len() as u64);
                if sum % 64 == 9 {
                    // Long enough that the other side sleeps.
                    thread::sleep(20 * SPIN);
                }
                answerer.answer([sum, count, 0, 0, 0, 7]);
                if sum == 0 {
                    return;
                }
            }
        });
        for k in (1..400).rev() {
            if k % 64 == 5 {
                thread::sleep(20 * SPIN);
            }
            assert!(asker.ask([k, k + 1, k + 2]));
            assert!(!asker.ask([0]), "one question at a time");
            let answer = std::iter::repeat_with(|| asker.wait(LONG)).find_map(|answer| answer);
            assert_eq!(answer, Some([3 * k + 3, 3, 0, 0, 0, 7]));
        }
        asker.ask([0]);
        while asker.wait(LONG).is_none() {}
        answering.join().expect("it ends");
    }

    #[test]
    fn words_for_which_there_is_no_room_are_left_out() {
        let (mut asker, mut answerer) = dialogue(3);
        asker.ask([1, 2, 3, 4, 5]);
        assert_eq!(answerer.question(LONG), Some(&[1, 2, 3][..]));
    }

    #[test]
    fn nobody_waits_longer_than_he_wants_to_and_the_alarm_ends_a_wait() {
        let (mut asker, mut answerer) = dialogue(1);
        assert_eq!(answerer.question(Duration::from_millis(1)), None);
        asker.ask([1]);
        assert!(asker.answer().is_none() && asker.wait(Duration::from_millis(1)).is_none() && asker.is_open());
        let (alarm, rung) = (asker.alarm(), Arc::new(std::sync::atomic::AtomicBool::new(false)));
        let ended = rung.clone();
        let waiting = thread::spawn(move || assert!(asker.wait(LONG).is_none()));
        // Until it has heard one: it may not wait yet.
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
    fn whatever_the_other_side_writes_is_a_value_and_nothing_worse() {
        let (mut asker, file) = Requester::new(4).expect("memory");
        let hostile = Segment::map(&file, words(4)).expect("the same memory");
        let mut random = 1u64;
        let mut next = move || {
            random = random.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            random ^ (random >> 29)
        };
        let mut answers = 0;
        for round in 0..20_000u64 {
            asker.ask([round; 4]);
            for word in hostile.words() {
                word.store(next(), Ordering::Relaxed);
            }
            assert_eq!(asker.answer(), None, "the number of an answer is guessed by nobody");
            // Now and then the number that is due, with a length and words that are none.
            if round % 3 == 0 {
                hostile.words()[ANSWERS].store(asker.number, Ordering::Relaxed);
                answers += u64::from(asker.answer().is_some());
            }
            if round % 100 == 0 {
                assert!(asker.wait(Duration::from_micros(1)).is_none());
            }
        }
        assert_eq!(answers, 6667);
        // One that answers is no better off.
        let mut answerer = Responder::open(&file, 4).expect("the same memory");
        for _ in 0..1000 {
            hostile.words().iter().for_each(|word| word.store(next(), Ordering::Relaxed));
            assert!(answerer.question(LONG).is_some_and(|question| question.len() <= 4));
        }
    }
}
