//! Every interleaving of a question, its answer and the next question, by loom: on its atomics in place of those of std.

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
        let answerer = shared.clone();
        let answers = thread::spawn(move || {
            let mut last = 0;
            for _ in 0..2 {
                let asked = number(&answerer[0]);
                if asked != last {
                    let mut words = [0; 2];
                    assert_eq!(take(&answerer[0], &mut words), 2);
                    assert_eq!(words, [asked, 10 * asked], "half a question");
                    put(&answerer[1], asked, [2 * asked, 20 * asked]);
                    last = asked;
                }
            }
        });
        let mut asked = 1;
        put(&shared[0], asked, [asked, 10 * asked]);
        for _ in 0..2 {
            if number(&shared[1]) == asked {
                let mut words = [0; 2];
                assert_eq!(take(&shared[1], &mut words), 2);
                assert_eq!(words, [2 * asked, 20 * asked], "half an answer");
                // The other side has taken the question: the place is free.
                asked += 1;
                put(&shared[0], asked, [asked, 10 * asked]);
            }
        }
        answers.join().unwrap();
    });
}

/// What the order is for: with the number first, a message would be seen before it is whole.
#[test]
#[should_panic(expected = "half a question")]
fn with_the_number_first_a_message_would_be_torn_and_this_test_would_see_it() {
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
