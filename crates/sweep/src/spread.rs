//! Variants in teams, in the numbers that suit how many there are.

use std::sync::Mutex;

use stickslip_core::scalar::Lanes;

use super::kind::SweptFriction;
use super::number::Number;
use super::run::Samples;
use super::{Arithmetic, Error};
use stickslip_base::parallel;

/// So many run sooner one after the other.
const ONE_BY_ONE: usize = 2;
/// So many run sooner in teams of one vector, whose lanes are all taken: three of them.
const FEW: usize = 3 * VECTOR;
/// Lanes of the widest vector.
const VECTOR: usize = 8;
/// Four vectors: one computes while another waits.
const WIDE: usize = 4 * VECTOR;

/// What is done with a team of jobs, in any numbers.
pub(super) trait Work<J>: Sync {
    /// What comes of a job.
    type Done: Send;

    /// Of each job of a team, in its order; at most `T::LANES` jobs.
    fn run<T: Number>(&self, team: &[J], pool: &Pool<T>) -> Vec<Self::Done>;
}

/// Does the work with all jobs, in their order. Of the numbers the arithmetic alone shows in what is done.
pub(super) fn spread<B: SweptFriction, J: Sync, W: Work<J>>(
    jobs: &[J],
    threads: usize,
    arithmetic: Arithmetic,
    work: &W,
) -> Result<Vec<W::Done>, Error> {
    match (jobs.len(), arithmetic) {
        (..=ONE_BY_ONE, Arithmetic::Double) => in_teams::<f64, J, W>(jobs, threads, work),
        (..=ONE_BY_ONE, Arithmetic::Single) => in_teams::<f32, J, W>(jobs, threads, work),
        (..=FEW, Arithmetic::Double) => in_teams::<Lanes<f64, VECTOR>, J, W>(jobs, threads, work),
        (_, Arithmetic::Double) => in_teams::<Lanes<f64, WIDE>, J, W>(jobs, threads, work),
        (_, Arithmetic::Single) => in_teams::<B::Singles, J, W>(jobs, threads, work),
    }
}

fn in_teams<T: Number, J: Sync, W: Work<J>>(jobs: &[J], threads: usize, work: &W) -> Result<Vec<W::Done>, Error> {
    let pool = Pool::<T>::default();
    let teams: Vec<&[J]> = jobs.chunks(T::LANES).collect();
    let done = parallel::map(&teams, threads, |team| Ok(work.run(team, &pool)))?;
    Ok(done.into_iter().flatten().collect())
}

/// Memory for the samples of a team, taken up again by the next one.
pub(super) struct Pool<T>(Mutex<Vec<Samples<T>>>);

impl<T> Default for Pool<T> {
    fn default() -> Self {
        Pool(Mutex::default())
    }
}

impl<T: Number> Pool<T> {
    pub(super) fn take(&self) -> Samples<T> {
        self.0.lock().expect("nobody panics with the lock").pop().unwrap_or_default()
    }

    pub(super) fn put_back(&self, samples: Samples<T>) {
        self.0.lock().expect("nobody panics with the lock").push(samples);
    }
}
