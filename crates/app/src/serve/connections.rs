//! Limit of simultaneous connections. A new client always gets a place: above the limit, the connection that has waited
//! longest for its client is closed. Slow and idle clients therefore never delay others.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use tokio::sync::{Notify, OwnedSemaphorePermit, Semaphore};

/// Interval of the checks for a connection to close while all of them are busy.
const RETRY: Duration = Duration::from_millis(20);

/// The open connections.
pub(super) struct Connections {
    places: Arc<Semaphore>,
    waiting: Mutex<Waiting>,
}

/// Connections that wait for their client, in the order in which the wait began.
#[derive(Default)]
struct Waiting {
    next: u64,
    clients: BTreeMap<u64, Arc<Notify>>,
}

/// One connection.
pub(super) struct Connection {
    all: Arc<Connections>,
    /// Position among those that wait for their client; `None` while the bench works for the client.
    position: Mutex<Option<u64>>,
    close: Arc<Notify>,
}

/// Locks also after a panic of another thread: each change below is complete.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Connections {
    /// Up to `limit` connections.
    pub(super) fn new(limit: usize) -> Arc<Self> {
        Arc::new(Connections { places: Arc::new(Semaphore::new(limit)), waiting: Mutex::default() })
    }

    /// A place for a new client. Waits only while the bench works for all clients.
    pub(super) async fn enter(self: &Arc<Self>) -> (Arc<Connection>, OwnedSemaphorePermit) {
        let place = loop {
            if let Ok(place) = self.places.clone().try_acquire_owned() {
                break place;
            }
            self.close_longest_waiting();
            if let Ok(Ok(place)) = tokio::time::timeout(RETRY, self.places.clone().acquire_owned()).await {
                break place;
            }
        };
        let connection = Connection { all: self.clone(), position: Mutex::default(), close: Arc::default() };
        connection.wait();
        (Arc::new(connection), place)
    }

    fn close_longest_waiting(&self) {
        if let Some((_, close)) = lock(&self.waiting).clients.pop_first() {
            close.notify_one();
        }
    }
}

impl Connection {
    /// The next bytes are due from the client: the connection may be closed for another one.
    pub(super) fn wait(&self) {
        self.work();
        let mut waiting = lock(&self.all.waiting);
        let position = waiting.next;
        waiting.next += 1;
        waiting.clients.insert(position, self.close.clone());
        *lock(&self.position) = Some(position);
    }

    /// The bench works for the client: the connection stays open.
    pub(super) fn work(&self) {
        if let Some(position) = lock(&self.position).take() {
            lock(&self.all.waiting).clients.remove(&position);
        }
    }

    /// Waits until the connection must be closed.
    pub(super) async fn closed(&self) {
        self.close.notified().await;
    }
}

impl Drop for Connection {
    fn drop(&mut self) {
        self.work();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_connection_that_waited_longest_is_closed_and_no_busy_one() {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_time().build().unwrap();
        runtime.block_on(async {
            let all = Connections::new(3);
            let (busy, _busy_place) = all.enter().await;
            busy.work();
            let (first, first_place) = all.enter().await;
            let (second, _second_place) = all.enter().await;
            // The first sends its next request, so that the second has waited longer.
            first.wait();
            let entering = tokio::spawn({
                let all = all.clone();
                async move { all.enter().await }
            });
            second.closed().await;
            // It holds its place until it has ended: the next one is closed.
            first.closed().await;
            drop(first_place);
            let (_new, _new_place) = entering.await.unwrap();
            let still_open = tokio::time::timeout(2 * RETRY, busy.closed()).await;
            assert!(still_open.is_err(), "a busy connection stays open");
        });
    }
}
