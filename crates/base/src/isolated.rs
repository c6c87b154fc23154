//! Work whose panic is told to whoever asked for it, and ends nothing else.

use std::any::Any;
use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, PanicHookInfo, catch_unwind, set_hook, take_hook};
use std::sync::Once;

thread_local! {
    /// Where the work of this thread panicked; nothing where no work is isolated.
    static PLACE: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// Does the work; `Err` has the words of its panic and the place, which are then not written to the terminal as well. What
/// the work had in its hands is not to be used any more.
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

/// Notes where a panic is, if its work is isolated.
pub fn heard(panic: &PanicHookInfo<'_>) -> bool {
    PLACE.with_borrow_mut(|place| {
        let Some(place) = place else { return false };
        *place = panic.location().map_or(String::new(), |at| format!(" ({}:{})", at.file(), at.line()));
        true
    })
}

/// What a panic says.
pub fn words(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<&str>().copied();
    text.or_else(|| panic.downcast_ref::<String>().map(String::as_str)).unwrap_or("it does not say why")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_told_with_its_place_and_work_without_one_comes_to_its_end() {
        assert_eq!(isolated(|| 2 + 2), Ok(4));
        let told = isolated(|| [1, 2, 3][std::hint::black_box(7)]).unwrap_err();
        assert!(told.starts_with("index out of bounds: the len is 3 but the index is 7 ("), "{told}");
        assert!(told.contains("isolated.rs:"), "{told}");
        assert!(isolated(|| std::panic::panic_any(7)).unwrap_err().starts_with("it does not say why ("));
    }

    #[test]
    fn work_within_work_is_isolated_by_itself() {
        let outer = isolated(|| {
            assert!(isolated(|| panic!("within")).unwrap_err().starts_with("within ("));
            panic!("around")
        });
        assert!(outer.map(|(): ()| ()).unwrap_err().starts_with("around ("));
        // Nobody listens any more: a panic is again what it was.
        assert!(PLACE.with_borrow(Option::is_none));
    }
}
