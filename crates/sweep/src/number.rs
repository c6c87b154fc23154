//! Numbers that stand for one variant, or for several side by side.

use stickslip_core::scalar::{LaneMask, Lanes, Mask, Scalar};

/// A number for each variant that runs beside others.
pub trait Number: Scalar + Send {
    /// How many.
    const LANES: usize;
    /// The number of one of them.
    fn lane(&self, lane: usize) -> f64;
    /// Another number for one of them.
    fn set(&mut self, lane: usize, value: f64);
    /// How many truth values are true.
    fn count(mask: Self::Mask) -> usize;
}

macro_rules! alone {
    ($float:ident) => {
        impl Number for $float {
            const LANES: usize = 1;

            #[inline(always)]
            fn lane(&self, _lane: usize) -> f64 {
                f64::from(*self)
            }

            #[inline(always)]
            fn set(&mut self, _lane: usize, value: f64) {
                *self = value as $float;
            }

            #[inline(always)]
            fn count(mask: bool) -> usize {
                usize::from(mask)
            }
        }

        impl<const N: usize> Number for Lanes<$float, N>
        where
            LaneMask<N>: Mask<Self>,
        {
            const LANES: usize = N;

            #[inline(always)]
            fn lane(&self, lane: usize) -> f64 {
                f64::from(self.0[lane])
            }

            #[inline(always)]
            fn set(&mut self, lane: usize, value: f64) {
                self.0[lane] = value as $float;
            }

            #[inline(always)]
            fn count(mask: LaneMask<N>) -> usize {
                let mut count = 0;
                for lane in mask.0 {
                    count += usize::from(lane);
                }
                count
            }
        }
    };
}

alone!(f64);
alone!(f32);
