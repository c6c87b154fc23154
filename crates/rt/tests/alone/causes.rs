//! Each cause of an overrun, provoked for real, must be called by its name.
//!
//! One cycle out of eighty is spoilt by tens of milliseconds, and only that one is looked at: how fast the machine is
//! and what else it does changes nothing. Where the system grants no priority, an innocent thread may be preempted for
//! as long: those tests then print why they say nothing.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, OnceLock};
use std::thread;
use std::time::{Duration, Instant};

use stickslip_rt::{
    Block, Cause, Cpu, Cycle, Evidence, Lap, MonotonicClock, Next, Overrun, OverrunPolicy, Plan, Running,
    ThreadSetting, ThreadSettings,
};

const READ: usize = 0;
const LAW: usize = 1;
/// The first cycle from here on that runs is spoilt: after 300 ms.
const SPOILT: u64 = 60;
const LONG: Duration = Duration::from_millis(40);

/// One at a time: a thread above another would spoil its neighbour's cycle, too.
static ALONE: Mutex<()> = Mutex::new(());

const BLOCKS: [Block; 2] = [Block::io("read"), Block::new("law")];

/// Two blocks that do what they are told, by cycle and block.
struct Told<F>(F);

impl<F: FnMut(u64, usize) + Send> Cycle for Told<F> {
    fn blocks(&self) -> &[Block] {
        &BLOCKS
    }

    fn run(&mut self, cycle: u64, lap: &mut Lap) -> Next {
        for block in [READ, LAW] {
            (self.0)(cycle, block);
            lap.done(block);
        }
        Next::Continue
    }

    fn hold(&mut self, _: u64) {}

    fn end(&mut self) {}
}

fn spin(time: Duration) {
    let begin = Instant::now();
    while begin.elapsed() < time {
        std::hint::spin_loop();
    }
}

/// One that this process may run on.
fn allowed_cpu() -> usize {
    let status = std::fs::read_to_string("/proc/thread-self/status").expect("Linux has it");
    let list = status.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:"));
    let first = list.and_then(|list| list.trim().split([',', '-']).next());
    first.and_then(|cpu| cpu.parse().ok()).expect("a list of CPUs")
}

fn wishes(priority: u8) -> ThreadSettings {
    // Memory stays unlocked, or nobody could touch a page that is not there.
    ThreadSettings { priority: Some(priority), cpu: Cpu::Number(allowed_cpu()), ..ThreadSettings::PLAIN }
}

fn start(work: impl FnMut(u64, usize) + Send + 'static) -> Option<(Running, stickslip_rt::Timings)> {
    let plan = Plan {
        warm_up: 5,
        cycles: Some(SPOILT + 20),
        overrun: OverrunPolicy { stop_after: None, ..OverrunPolicy::default() },
        ..Plan::new(Duration::from_millis(5))
    };
    let (running, timings) =
        Running::start(plan, wishes(40), MonotonicClock::default(), Told(work)).expect("the plan can be");
    if running.granted().has(ThreadSetting::Priority(40)) {
        return Some((running, timings));
    }
    println!("nothing is said: without a priority any thread may spoil a cycle\n{}", running.granted());
    None
}

/// The overrun of a cycle with one block spoilt; `None` without a priority.
fn provoked(block: usize, mut spoil: impl FnMut() + Send + 'static) -> Option<(Overrun, Evidence)> {
    overrun_with(move |cycle, turn, spoilt| {
        if turn == block && cycle >= SPOILT && spoilt.set(cycle).is_ok() {
            spoil();
        }
    })
}

/// The overrun of the cycle that the work says that it spoilt.
fn overrun_with(mut work: impl FnMut(u64, usize, &OnceLock<u64>) + Send + 'static) -> Option<(Overrun, Evidence)> {
    let _alone = ALONE.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    let spoilt = Arc::new(OnceLock::new());
    let says = spoilt.clone();
    let (running, timings) = start(move |cycle, block| work(cycle, block, &says))?;
    running.join();
    let overruns: Vec<_> = timings.filter_map(|timing| timing.overrun).collect();
    overruns.iter().for_each(|overrun| println!("{} {:?}", overrun.sentence(&BLOCKS), overrun.evidence));
    let overrun = overruns.into_iter().find(|overrun| Some(&overrun.cycle) == spoilt.get());
    let overrun = overrun.expect("the cycle took eight periods");
    let evidence = overrun.evidence.expect("this system counts");
    // Shortly before: 60 cycles are 300 ms.
    assert!(evidence.cycles < SPOILT as u32 / 2, "the baseline is {} cycles old", evidence.cycles);
    Some((overrun, evidence))
}

#[test]
fn a_block_that_computes_too_long_is_named() {
    if let Some((overrun, _)) = provoked(LAW, || spin(LONG)) {
        assert_eq!(overrun.cause, Cause::Block(LAW));
    }
}

#[test]
fn a_device_that_lets_its_block_wait_is_named() {
    if let Some((overrun, _)) = provoked(READ, || thread::sleep(LONG)) {
        assert_eq!(overrun.cause, Cause::Io(READ));
    }
}

#[test]
fn a_block_that_waits_though_it_talks_to_no_device_is_named() {
    if let Some((overrun, _)) = provoked(LAW, || thread::sleep(LONG)) {
        assert_eq!(overrun.cause, Cause::Wait(LAW));
    }
}

/// Pages of the system's smallest size that can be made fresh again and again.
struct Memory {
    begin: *mut libc::c_void,
    pages: usize,
}

// SAFETY: nobody else has the pages, which stay until the process ends.
unsafe impl Send for Memory {}

impl Memory {
    const PAGE: usize = 4096;

    fn new(pages: usize) -> Self {
        let (access, kind) = (libc::PROT_READ | libc::PROT_WRITE, libc::MAP_PRIVATE | libc::MAP_ANONYMOUS);
        // SAFETY: new pages, nowhere in particular.
        let begin = unsafe { libc::mmap(std::ptr::null_mut(), pages * Self::PAGE, access, kind, -1, 0) };
        assert_ne!(begin, libc::MAP_FAILED);
        let memory = Memory { begin, pages };
        memory.advise(libc::MADV_NOHUGEPAGE);
        memory
    }

    /// The system takes the pages back.
    fn forget(&self) {
        self.advise(libc::MADV_DONTNEED);
    }

    fn advise(&self, advice: libc::c_int) {
        // SAFETY: the pages are those of `new`, and hold nothing that anybody reads.
        unsafe { libc::madvise(self.begin, self.pages * Self::PAGE, advice) };
    }

    fn touch(&self) {
        for page in 0..self.pages {
            // SAFETY: within the pages of `new`.
            unsafe { self.begin.cast::<u8>().add(page * Self::PAGE).write_volatile(1) };
        }
    }
}

#[test]
fn a_block_that_touches_fresh_memory_is_named_with_its_pages() {
    let memory = Memory::new(4096);
    let touch = move || {
        let begin = Instant::now();
        while begin.elapsed() < LONG {
            memory.forget();
            memory.touch();
        }
    };
    if let Some((overrun, evidence)) = provoked(LAW, touch) {
        let Cause::PageFault { minor, block, .. } = overrun.cause else { panic!("{:?}", overrun.cause) };
        assert_eq!((block, minor), (LAW, evidence.minor_faults));
    }
}

#[test]
fn pages_that_were_touched_long_before_explain_nothing() {
    let memory = Memory::new(1024);
    let work = move |cycle, block, spoilt: &OnceLock<u64>| {
        if (cycle, block) == (20, LAW) {
            memory.touch();
        }
        if cycle >= SPOILT && spoilt.set(cycle).is_ok() {
            spin(LONG);
        }
    };
    if let Some((overrun, evidence)) = overrun_with(work) {
        assert_eq!(overrun.cause, Cause::Io(READ));
        assert!(evidence.minor_faults < 1024, "{evidence:?}");
    }
}

/// A thread above that of the executive, on its CPU; it waits until it is called, then spins.
fn thread_above(called: &'static AtomicBool) -> impl FnOnce() + Send {
    struct Above(&'static AtomicBool);
    impl Cycle for Above {
        fn blocks(&self) -> &[Block] {
            &[]
        }
        fn run(&mut self, _: u64, _: &mut Lap) -> Next {
            if self.0.swap(false, Ordering::Relaxed) {
                spin(LONG);
            }
            Next::Continue
        }
        fn hold(&mut self, _: u64) {}
        fn end(&mut self) {}
    }
    let overrun = OverrunPolicy { stop_after: None, ..OverrunPolicy::default() };
    let plan = Plan { overrun, ..Plan::new(Duration::from_millis(1)) };
    let (above, _) =
        Running::start(plan, wishes(41), MonotonicClock::default(), Above(called)).expect("the plan can be");
    move || drop(above)
}

#[test]
fn a_thread_above_that_takes_the_cpu_during_a_block_is_named() {
    static CALLED: AtomicBool = AtomicBool::new(false);
    let above = thread_above(&CALLED);
    let call = || {
        CALLED.store(true, Ordering::Relaxed);
        // Until the other has begun, which it can only by taking this CPU.
        while CALLED.load(Ordering::Relaxed) {
            std::hint::spin_loop();
        }
    };
    if let Some((overrun, _)) = provoked(LAW, call) {
        assert_eq!(overrun.cause, Cause::Preempted { block: LAW });
    }
    above();
}

#[test]
fn a_thread_above_that_runs_while_the_executive_sleeps_makes_it_wake_late() {
    static CALLED: AtomicBool = AtomicBool::new(false);
    let _alone = ALONE.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    let above = thread_above(&CALLED);
    // Called at the end of a cycle, the other begins within a millisecond: the executive then sleeps for five.
    let call = |cycle, block| {
        if (cycle, block) == (SPOILT, LAW) {
            CALLED.store(true, Ordering::Relaxed);
        }
    };
    if let Some((running, timings)) = start(call) {
        running.join();
        let overrun = timings.filter(|timing| timing.cycle > SPOILT).find_map(|timing| timing.overrun);
        let overrun = overrun.expect("the cycle after it could not begin in time");
        assert_eq!(overrun.cause, Cause::LateWakeUp);
        assert!(overrun.sentence(&[]).contains("was woken"));
    }
    above();
}
