//! Independent work on a few threads.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::Error;

/// `work` on each job, results in the order of the jobs for any number of threads. After a failure no job is started;
/// the first failure in the order of the jobs is returned.
pub fn map<J: Sync, R: Send>(
    jobs: &[J],
    threads: usize,
    work: impl Fn(&J) -> Result<R, Error> + Sync,
) -> Result<Vec<R>, Error> {
    let next = AtomicUsize::new(0);
    let finished = Mutex::new(Vec::with_capacity(jobs.len()));
    let worker = || {
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(job) = jobs.get(index) else { break };
            let result = work(job);
            if result.is_err() {
                next.store(jobs.len(), Ordering::Relaxed);
            }
            finished.lock().expect("no worker panics with the lock").push((index, result));
        }
    };
    on(threads.min(jobs.len()), &worker);
    let mut results: Vec<Option<Result<R, Error>>> = jobs.iter().map(|_| None).collect();
    for (index, result) in finished.into_inner().expect("all workers have ended") {
        results[index] = Some(result);
    }
    results.into_iter().flatten().collect()
}

/// Runs `worker` on a number of threads, including this one. Compiled once for all kinds of work.
pub fn on(threads: usize, worker: &(dyn Fn() + Sync)) {
    std::thread::scope(|scope| {
        for _ in 1..threads {
            scope.spawn(worker);
        }
        worker();
    });
}

/// Number of threads that this machine runs in parallel.
pub fn processors() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}
