//! Work whose panic is returned as an error to the caller and ends nothing else.

use std::any::Any;
use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, PanicHookInfo, catch_unwind, set_hook, take_hook};
use std::sync::Once;

thread_local! {
    /// Place of the panic in the work of this thread; `None` outside isolated work.
    static PLACE: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// Does the work; `Err` has the message and the place of its panic, which are then not written to the terminal. Do not
/// use values that the work has changed after a panic.
pub fn isolated<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    static LISTENS: Once = Once::new();
    LISTENS.call_once(|| {
        let others = take_hook();
        set_hook(Box::new(move |panic| {
            if !heard(panic) {
                others(panic);
            }
        }));
    });
    let around = PLACE.replace(Some(String::new()));
    let ended = catch_unwind(AssertUnwindSafe(work));
    let place = PLACE.replace(around).unwrap_or_default();
    ended.map_err(|panic| format!("{}{place}", words(&*panic)))
}

/// Stores the place of a panic if its work is isolated; returns whether it is.
pub fn heard(panic: &PanicHookInfo<'_>) -> bool {
    PLACE.with_borrow_mut(|place| {
        let Some(place) = place else { return false };
        *place = panic.location().map_or(String::new(), |at| format!(" ({}:{})", at.file(), at.line()));
        true
    })
}

/// The message of a panic.
pub fn words(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<&str>().copied();
    text.or_else(|| panic.downcast_ref::<String>().map(String::as_str)).unwrap_or("panic without a message")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_returned_with_its_place_and_other_work_ends_normally() {
        assert_eq!(isolated(|| 2 + 2), Ok(4));
        let message = isolated(|| [1, 2, 3][std::hint::black_box(7)]).unwrap_err();
        assert!(message.starts_with("index out of bounds: the len is 3 but the index is 7 ("), "{message}");
        assert!(message.contains("isolated.rs:"), "{message}");
        assert!(isolated(|| std::panic::panic_any(7)).unwrap_err().starts_with("panic without a message ("));
    }

    #[test]
    fn nested_work_is_isolated_separately() {
        let outer = isolated(|| {
            assert!(isolated(|| panic!("within")).unwrap_err().starts_with("within ("));
            panic!("around")
        });
        assert!(outer.map(|(): ()| ()).unwrap_err().starts_with("around ("));
        // Afterwards panics are reported as usual.
        assert!(PLACE.with_borrow(Option::is_none));
    }
}
