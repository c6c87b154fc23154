//! Every interleaving of a writer and a reader, with the atomics and cells of loom.

#[path = "../../src/pages.rs"]
#[expect(unreachable_pub, reason = "public items of the crate")]
mod pages;

use loom::thread;
use pages::exchange;

/// A page of two equal halves, on the heap, so that a wrong release is detected.
type Page = Box<[u64; 2]>;

fn page(number: u64) -> Page {
    Box::new([number, number])
}

#[test]
fn a_reader_has_whole_pages_in_their_order_and_the_writer_knows_their_first_cycle() {
    loom::model(|| {
        let (mut writer, mut reader) = exchange(page(0));
        let reads = thread::spawn(move || {
            let mut before = 0;
            for cycle in 10..13 {
                let fresh = reader.take(cycle);
                let [one, other] = **reader.page();
                assert_eq!((one, one), (other, reader.generation()), "half a page");
                assert!(if fresh { one > before } else { one == before }, "an old page again");
                before = one;
            }
            reader
        });
        for number in 1..=2 {
            assert_eq!(writer.publish(page(number)), number);
            assert!(writer.entered().is_none_or(|cycle| (10..13).contains(&cycle)));
        }
        let mut reader = reads.join().unwrap();
        // The newest page is never lost.
        let pending = writer.entered().is_none();
        assert_eq!(reader.take(99), pending);
        assert_eq!(**reader.page(), [2, 2]);
        assert_eq!(pending, writer.entered() == Some(99));
    });
}

/// Reason for the third slot: with two slots, writer and reader access the same one.
#[test]
#[should_panic(expected = "Causality violation")]
fn a_design_with_two_slots_fails_under_loom() {
    use crate::sync::{Arc, AtomicU8, Ordering, UnsafeCell};
    loom::model(|| {
        let shared = Arc::new(([UnsafeCell::new(0), UnsafeCell::new(0)], AtomicU8::new(0)));
        let of_reader = shared.clone();
        let reads = thread::spawn(move || {
            let newest = of_reader.1.load(Ordering::Acquire);
            // SAFETY: loom panics before two sides access one slot.
            of_reader.0[usize::from(newest)].with(|page| unsafe { *page })
        });
        for number in 1..=2u8 {
            let slot = number % 2;
            // SAFETY: as above.
            shared.0[usize::from(slot)].with_mut(|page| unsafe { *page = number });
            shared.1.store(slot, Ordering::Release);
        }
        reads.join().unwrap();
    });
}
