//! Sorted lists without repetition, of about a dozen elements: a tenth of the code size of a `BTreeSet`.

/// Inserts an element in order; `false` if it is present already.
pub(crate) fn insert<T: Ord>(list: &mut Vec<T>, element: T) -> bool {
    match list.binary_search(&element) {
        Ok(_) => false,
        Err(place) => {
            list.insert(place, element);
            true
        }
    }
}

/// The elements in their order, each once.
pub(crate) fn distinct<T: Ord>(elements: impl Iterator<Item = T>) -> Vec<T> {
    let mut list: Vec<T> = elements.collect();
    list.sort_unstable();
    list.dedup();
    list
}
