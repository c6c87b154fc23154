//! Missed ticks of a bench in real time: the outputs stayed, and the machine went on.

use std::borrow::Cow;

use stickslip_bench::Frame;

/// The frames with one for each missed tick: the torque of the tick before, and an even share of the way.
///
/// Without them a torque balance lacks the momentum that the held torque gave to the axis.
pub(super) fn with_missed(frames: &[Frame]) -> Cow<'_, [Frame]> {
    let ticks = |pair: &[Frame]| pair[1].cycle.saturating_sub(pair[0].cycle).max(1);
    if frames.windows(2).all(|pair| ticks(pair) == 1) {
        return Cow::Borrowed(frames);
    }
    let mut all: Vec<Frame> = frames.first().copied().into_iter().collect();
    for pair in frames.windows(2) {
        let (before, count) = (pair[0], ticks(pair));
        let way = (pair[1].angle - before.angle) / count as f64;
        let held = |tick: u64| Frame { cycle: before.cycle + tick, angle: before.angle + tick as f64 * way, ..before };
        all.extend((1..count).map(held));
        all.push(pair[1]);
    }
    Cow::Owned(all)
}
