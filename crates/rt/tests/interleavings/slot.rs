//! Every interleaving of a question, its answer and the next question, with the atomics of loom.

#[path = "../../src/slot.rs"]
mod slot;

use crate::sync::{AtomicU64, Ordering};
use loom::sync::Arc;
use loom::thread;
use slot::{HEAD, number, put, take};

const WORDS: usize = HEAD + 2;

fn place() -> [AtomicU64; WORDS] {
    std::array::from_fn(|_| AtomicU64::new(0))
}

#[test]
fn a_question_and_an_answer_are_whole_or_not_there() {
    loom::model(|| {
        let shared = Arc::new([place(), place()]);
        let responder = shared.clone();
        let answers = thread::spawn(move || {
            let mut last = 0;
            for _ in 0..2 {
                let question = number(&responder[0]);
                if question != last {
                    let mut words = [0; 2];
                    assert_eq!(take(&responder[0], &mut words), 2);
                    assert_eq!(words, [question, 10 * question], "half a question");
                    put(&responder[1], question, [2 * question, 20 * question]);
                    last = question;
                }
            }
        });
        let mut question = 1;
        put(&shared[0], question, [question, 10 * question]);
        for _ in 0..2 {
            if number(&shared[1]) == question {
                let mut words = [0; 2];
                assert_eq!(take(&shared[1], &mut words), 2);
                assert_eq!(words, [2 * question, 20 * question], "half an answer");
                // The other side has taken the question: the slot is free.
                question += 1;
                put(&shared[0], question, [question, 10 * question]);
            }
        }
        answers.join().unwrap();
    });
}

/// Reason for the order: with the number first, an incomplete message would be read.
#[test]
#[should_panic(expected = "half a question")]
fn writing_the_number_first_fails_under_loom() {
    loom::model(|| {
        let shared = Arc::new(place());
        let reader = shared.clone();
        let reads = thread::spawn(move || {
            if number(&reader[..]) == 1 {
                let mut words = [0; 2];
                take(&reader[..], &mut words);
                assert_eq!(words, [1, 10], "half a question");
            }
        });
        shared[0].store(1, Ordering::Release);
        put(&shared[..], 1, [1, 10]);
        reads.join().unwrap();
    });
}
