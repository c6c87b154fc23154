//! The floating-point control word of a thread: round to nearest, subnormal numbers enabled.
//!
//! A library built with fast-math changes it for the whole thread when it is loaded, and with it the bits of every
//! result. Code that runs the tick therefore sets it for that time.

#![expect(unsafe_code, reason = "the control word is accessible only by an instruction")]

use std::marker::PhantomData;

/// Sets the control word of this thread to the default of IEEE 754 until it is dropped.
pub struct FloatingPoint {
    before: u64,
    /// The control word belongs to one thread.
    thread: PhantomData<*const ()>,
}

impl FloatingPoint {
    /// Sets the standard control word; the previous one is restored when the guard is dropped.
    #[must_use = "dropped at once it changes nothing"]
    pub fn standard() -> Self {
        let before = control::read();
        if before & control::DEVIATION != 0 {
            control::write(before & !control::DEVIATION);
        }
        FloatingPoint { before, thread: PhantomData }
    }

    /// Sets the standard control word permanently. Returns whether it was standard before.
    pub fn set_standard() -> bool {
        let guard = Self::standard();
        let standard = guard.was_standard();
        std::mem::forget(guard);
        standard
    }

    /// Whether the control word was standard before.
    pub fn was_standard(&self) -> bool {
        self.before & control::DEVIATION == 0
    }
}

impl Drop for FloatingPoint {
    fn drop(&mut self) {
        // Exception flags raised meanwhile (inexact, underflow) remain set.
        if !self.was_standard() {
            control::write(control::read() | (self.before & control::DEVIATION));
        }
    }
}

#[cfg(target_arch = "x86_64")]
mod control {
    use std::arch::asm;

    /// MXCSR: rounding control, flush to zero, denormals are zero.
    pub(super) const DEVIATION: u64 = 0x6000 | 0x8000 | 0x0040;

    pub(super) fn read() -> u64 {
        let mut word = 0u32;
        // SAFETY: stores the 32 bits of MXCSR to `word`.
        unsafe { asm!("stmxcsr [{}]", in(reg) &mut word, options(nostack, preserves_flags)) };
        word.into()
    }

    pub(super) fn write(word: u64) {
        let word = word as u32;
        // SAFETY: the word was read from MXCSR and changed in bits that exist.
        unsafe { asm!("ldmxcsr [{}]", in(reg) &word, options(nostack, preserves_flags, readonly)) };
    }
}

#[cfg(target_arch = "aarch64")]
mod control {
    use std::arch::asm;

    /// FPCR: rounding mode, flush to zero for all and for half precision.
    pub(super) const DEVIATION: u64 = 3 << 22 | 1 << 24 | 1 << 19;

    pub(super) fn read() -> u64 {
        let word: u64;
        // SAFETY: reads a register.
        unsafe { asm!("mrs {}, fpcr", out(reg) word, options(nomem, nostack, preserves_flags)) };
        word
    }

    pub(super) fn write(word: u64) {
        // SAFETY: the word was read from FPCR and changed in bits that exist.
        unsafe { asm!("msr fpcr, {}", in(reg) word, options(nomem, nostack, preserves_flags)) };
    }
}

#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
mod control {
    /// Unknown on this processor: assumed to be standard.
    pub(super) const DEVIATION: u64 = 0;

    pub(super) fn read() -> u64 {
        0
    }

    pub(super) fn write(_: u64) {}
}

#[cfg(all(test, any(target_arch = "x86_64", target_arch = "aarch64")))]
mod tests {
    use std::hint::black_box;

    use super::*;

    fn half_of_the_smallest_normal_number() -> f64 {
        black_box(f64::MIN_POSITIVE) * black_box(0.5)
    }

    #[test]
    fn a_fast_math_control_word_is_replaced_and_then_restored() {
        let clean = control::read() & !control::DEVIATION;
        control::write(clean | control::DEVIATION);
        assert_eq!(half_of_the_smallest_normal_number(), 0.0);
        {
            let guard = FloatingPoint::standard();
            assert!(!guard.was_standard());
            assert!(half_of_the_smallest_normal_number() > 0.0);
            assert_eq!(black_box(1.0) + black_box(1e-17), 1.0);
        }
        assert_eq!(half_of_the_smallest_normal_number(), 0.0);
        assert!(!FloatingPoint::set_standard());
        assert!(FloatingPoint::set_standard() && half_of_the_smallest_normal_number() > 0.0);
        control::write(clean);
        assert!(FloatingPoint::standard().was_standard());
    }
}
