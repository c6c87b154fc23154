//! Set-points and noise of runs side by side.
//!
//! A study runs thousands of machines along the same path with the same noise: both are computed once.

use std::cell::RefCell;
use std::rc::Rc;

use stickslip_core::control::reference::{Generator, Reference, Setpoint};
use stickslip_core::fields::Fields as _;
use stickslip_core::plant::Noise;

use crate::fast_bench::{FastBench, LaneNumber};
use stickslip_base::noise::Normals;

/// Most ticks of a table: 2 MB.
const MOST: u64 = 1 << 15;

thread_local! {
    /// The last table of this thread.
    static LAST: RefCell<Option<Rc<Table>>> = const { RefCell::new(None) };
}

/// Set-points of a run: a rest, then a reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Path {
    pub(super) reference: Reference<f64>,
    /// Ticks at rest before, and ticks in all.
    pub(super) rest: u64,
    pub(super) cycles: u64,
    /// Ticks in a second [Hz].
    pub(super) rate: f64,
}

/// Inputs of the ticks of a run.
#[derive(Debug)]
pub(super) struct Table {
    path: Path,
    normals: Normals,
    ticks: Vec<(Setpoint<f64>, Noise<f64>)>,
}

impl Table {
    /// The table of a path and a seed: the last one of this thread, or a new one.
    fn of(path: &Path, normals: Normals) -> Rc<Self> {
        LAST.with_borrow_mut(|last| match last {
            Some(table) if table.path == *path && table.normals == normals => table.clone(),
            _ => {
                let mut setpoints = Setpoints::of(path);
                let tick = |cycle| (setpoints.at(cycle), normals.of_tick(cycle));
                let ticks = (0..path.cycles).map(tick).collect();
                last.insert(Rc::new(Table { path: *path, normals, ticks })).clone()
            }
        })
    }
}

/// Set-points of a path, one after the other.
pub(super) struct Setpoints {
    path: Path,
    generator: Generator<'static>,
    now: Setpoint<f64>,
}

impl Setpoints {
    fn of(path: &Path) -> Self {
        Setpoints { path: *path, generator: Generator::new(path.reference, path.rate), now: Setpoint::default() }
    }

    fn at(&mut self, cycle: u64) -> Setpoint<f64> {
        if cycle >= self.path.rest {
            self.now = self.generator.next();
        }
        self.now
    }
}

/// Inputs of runs side by side.
pub(super) enum Inputs {
    /// The same in all lanes.
    Alike(Rc<Table>),
    /// The place of each lane's path among all different ones.
    Various(Vec<usize>, Vec<Setpoints>),
}

impl Inputs {
    /// Inputs of these paths in the lanes of a bench.
    pub(super) fn of<T: LaneNumber>(paths: &[Path], bench: &FastBench<T>) -> Self {
        if let (Some(path), Some(normals)) = (paths.first(), bench.common_noise())
            && path.cycles <= MOST
            && paths.iter().all(|other| other == path)
        {
            return Inputs::Alike(Table::of(path, normals));
        }
        let mut all: Vec<Setpoints> = Vec::new();
        let place = |path: &Path| {
            let is_same = |other: &Setpoints| other.path.reference == path.reference && other.path.rest == path.rest;
            all.iter().position(is_same).unwrap_or_else(|| {
                all.push(Setpoints::of(path));
                all.len() - 1
            })
        };
        Inputs::Various(paths.iter().map(place).collect(), all)
    }

    /// Set-points and noise of the next tick of a bench.
    pub(super) fn next<T: LaneNumber>(&mut self, cycle: u64, bench: &FastBench<T>) -> (Setpoint<T>, Noise<T>) {
        match self {
            Inputs::Alike(table) => {
                let (setpoint, noise) = &table.ticks[cycle as usize];
                (setpoint.map(&mut T::of), noise.map(&mut T::of))
            }
            Inputs::Various(places, paths) => {
                for path in paths.iter_mut() {
                    path.at(cycle);
                }
                let mut all = Setpoint::default();
                for (lane, place) in places.iter().enumerate() {
                    put(&mut all, lane, paths[*place].now);
                }
                (all, bench.noise())
            }
        }
    }
}

fn put<T: LaneNumber>(all: &mut Setpoint<T>, lane: usize, one: Setpoint<f64>) {
    all.position = all.position.with_lane(lane, one.position);
    all.velocity = all.velocity.with_lane(lane, one.velocity);
    all.acceleration = all.acceleration.with_lane(lane, one.acceleration);
}
