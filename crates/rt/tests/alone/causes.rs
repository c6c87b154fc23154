//! Each cause of an overrun is provoked and must be reported correctly.
//!
//! One cycle out of eighty is delayed by tens of milliseconds, and only that one is checked, so that the speed and load
//! of the computer do not matter. Without a real-time priority any thread may be preempted for as long: the tests then
//! print that they are skipped.

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
/// The first cycle that runs from here on is delayed: after 300 ms.
const DELAYED: u64 = 60;
const LONG: Duration = Duration::from_millis(40);

/// One at a time: a thread of higher priority would also delay the cycles of other tests.
static ALONE: Mutex<()> = Mutex::new(());

const BLOCKS: [Block; 2] = [Block::io("read"), Block::new("law")];

/// Two blocks that call a closure with cycle and block.
struct Scripted<F>(F);

impl<F: FnMut(u64, usize) + Send> Cycle for Scripted<F> {
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

/// A CPU that this process may run on.
fn allowed_cpu() -> usize {
    let status = std::fs::read_to_string("/proc/thread-self/status").expect("Linux has it");
    let list = status.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:"));
    let first = list.and_then(|list| list.trim().split([',', '-']).next());
    first.and_then(|cpu| cpu.parse().ok()).expect("a list of CPUs")
}

fn settings(priority: u8) -> ThreadSettings {
    // Memory stays unlocked, so that page faults are possible.
    ThreadSettings { priority: Some(priority), cpu: Cpu::Number(allowed_cpu()), ..ThreadSettings::PLAIN }
}

fn start(work: impl FnMut(u64, usize) + Send + 'static) -> Option<(Running, stickslip_rt::Timings)> {
    let plan = Plan {
        warm_up: 5,
        cycles: Some(DELAYED + 20),
        overrun: OverrunPolicy { stop_after: None, ..OverrunPolicy::default() },
        ..Plan::new(Duration::from_millis(5))
    };
    let (running, timings) =
        Running::start(plan, settings(40), MonotonicClock::default(), Scripted(work)).expect("the plan is valid");
    if running.granted().has(ThreadSetting::Priority(40)) {
        return Some((running, timings));
    }
    println!("skipped: without a priority any thread may delay a cycle\n{}", running.granted());
    None
}

/// The overrun of a cycle with one delayed block; `None` without a priority.
fn provoked(block: usize, mut delay: impl FnMut() + Send + 'static) -> Option<(Overrun, Evidence)> {
    overrun_with(move |cycle, turn, delayed| {
        if turn == block && cycle >= DELAYED && delayed.set(cycle).is_ok() {
            delay();
        }
    })
}

/// The overrun of the cycle that `work` marks as delayed.
fn overrun_with(mut work: impl FnMut(u64, usize, &OnceLock<u64>) + Send + 'static) -> Option<(Overrun, Evidence)> {
    let _alone = ALONE.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    let delayed = Arc::new(OnceLock::new());
    let mark = delayed.clone();
    let (running, timings) = start(move |cycle, block| work(cycle, block, &mark))?;
    running.join();
    let overruns: Vec<_> = timings.filter_map(|timing| timing.overrun).collect();
    overruns.iter().for_each(|overrun| println!("{} {:?}", overrun.sentence(&BLOCKS), overrun.evidence));
    let overrun = overruns.into_iter().find(|overrun| Some(&overrun.cycle) == delayed.get());
    let overrun = overrun.expect("the cycle took eight periods");
    let evidence = overrun.evidence.expect("this system counts");
    // The baseline is recent: 60 cycles are 300 ms.
    assert!(evidence.cycles < DELAYED as u32 / 2, "the baseline is {} cycles old", evidence.cycles);
    Some((overrun, evidence))
}

#[test]
fn a_block_that_computes_too_long_is_named() {
    if let Some((overrun, _)) = provoked(LAW, || spin(LONG)) {
        assert_eq!(overrun.cause, Cause::Block(LAW));
    }
}

#[test]
fn a_wait_for_a_device_is_named() {
    if let Some((overrun, _)) = provoked(READ, || thread::sleep(LONG)) {
        assert_eq!(overrun.cause, Cause::Io(READ));
    }
}

#[test]
fn a_wait_in_a_block_without_a_device_is_named() {
    if let Some((overrun, _)) = provoked(LAW, || thread::sleep(LONG)) {
        assert_eq!(overrun.cause, Cause::Wait(LAW));
    }
}

/// Pages of the system's smallest size that can be released repeatedly.
struct Memory {
    begin: *mut libc::c_void,
    pages: usize,
}

// SAFETY: only this value has the pages, which stay until the process ends.
unsafe impl Send for Memory {}

impl Memory {
    const PAGE: usize = 4096;

    fn new(pages: usize) -> Self {
        let (access, kind) = (libc::PROT_READ | libc::PROT_WRITE, libc::MAP_PRIVATE | libc::MAP_ANONYMOUS);
        // SAFETY: new pages at any address.
        let begin = unsafe { libc::mmap(std::ptr::null_mut(), pages * Self::PAGE, access, kind, -1, 0) };
        assert_ne!(begin, libc::MAP_FAILED);
        let memory = Memory { begin, pages };
        memory.advise(libc::MADV_NOHUGEPAGE);
        memory
    }

    /// Returns the pages to the system.
    fn forget(&self) {
        self.advise(libc::MADV_DONTNEED);
    }

    fn advise(&self, advice: libc::c_int) {
        // SAFETY: the pages are those of `new`, and their contents are never read.
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
fn page_faults_long_before_an_overrun_are_ignored() {
    let memory = Memory::new(1024);
    let work = move |cycle, block, delayed: &OnceLock<u64>| {
        if (cycle, block) == (20, LAW) {
            memory.touch();
        }
        if cycle >= DELAYED && delayed.set(cycle).is_ok() {
            spin(LONG);
        }
    };
    if let Some((overrun, evidence)) = overrun_with(work) {
        assert_eq!(overrun.cause, Cause::Io(READ));
        assert!(evidence.minor_faults < 1024, "{evidence:?}");
    }
}

/// A thread of higher priority on the CPU of the executive; it waits until it is called, then spins.
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
        Running::start(plan, settings(41), MonotonicClock::default(), Above(called)).expect("the plan is valid");
    move || drop(above)
}

#[test]
fn a_preemption_during_a_block_is_named() {
    static CALLED: AtomicBool = AtomicBool::new(false);
    let above = thread_above(&CALLED);
    let call = || {
        CALLED.store(true, Ordering::Relaxed);
        // Until the other thread has started, which requires this CPU.
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
fn a_thread_of_higher_priority_makes_the_executive_wake_late() {
    static CALLED: AtomicBool = AtomicBool::new(false);
    let _alone = ALONE.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    let above = thread_above(&CALLED);
    // Called at the end of a cycle, the other thread starts within 1 ms; the executive then sleeps for 5 ms.
    let call = |cycle, block| {
        if (cycle, block) == (DELAYED, LAW) {
            CALLED.store(true, Ordering::Relaxed);
        }
    };
    if let Some((running, timings)) = start(call) {
        running.join();
        let overrun = timings.filter(|timing| timing.cycle > DELAYED).find_map(|timing| timing.overrun);
        let overrun = overrun.expect("the cycle after it could not begin in time");
        assert_eq!(overrun.cause, Cause::LateWakeUp);
        assert!(overrun.sentence(&[]).contains("was woken"));
    }
    above();
}
