//! How the bench is, at this moment.

use std::time::Instant;

use stickslip_rt::Quantiles;

use super::protocol::{ClockStatus, Status};
use super::{Live, lock};

impl Live {
    pub(super) fn status(&self) -> Status {
        let shared = &self.shared;
        let newest = lock(&shared.newest).clone();
        let tuning = lock(&shared.tuning);
        let (undo, redo) = tuning.can_undo();
        let (changed, rate) = (tuning.differences().len(), tuning.preset().bench.tick_rate);
        drop(tuning);
        let (lateness, cycle) = {
            let histograms = lock(&shared.histograms);
            (histograms.lateness(), histograms.total())
        };
        let (operator, asks) = {
            let (operator, now) = (lock(&shared.operator), Instant::now());
            (operator.name(now).map(str::to_owned), operator.asks(now).map(str::to_owned))
        };
        let recorded = self.recorded(rate);
        let seconds = |q: Quantiles| [q.p50, q.p99, q.p999, q.max].map(|nanoseconds| nanoseconds as f64 * 1e-9);
        Status {
            preset: shared.preset.clone(),
            state: newest.state.into(),
            reason: newest.fault,
            cycle: newest.cycle,
            rate,
            angle: newest.signals.angle,
            velocity: newest.signals.software.estimated_velocity,
            drive_torque: newest.signals.software.commanded_torque,
            load_torque: newest.signals.software.measured_load_torque,
            render: newest.signals.render > 0.5,
            preload: *lock(&shared.preload),
            doing: lock(&shared.doing).clone(),
            last: lock(&shared.last).clone(),
            changed,
            undo,
            redo,
            operator,
            asks,
            loaded: self.loaded_status(),
            clock: ClockStatus {
                lateness: seconds(lateness),
                cycle: seconds(cycle),
                load: seconds(cycle)[0] * rate,
                held: newest.held,
                lost: newest.lost,
            },
            link: shared.traffic.as_ref().map(|traffic| traffic.counts()),
            recording: lock(&shared.recording).clone(),
            recorded,
            not_entered: lock(&shared.not_entered).clone(),
            xcp: lock(&shared.xcp).clone(),
            marks: lock(&shared.marks).count(),
        }
    }
}
