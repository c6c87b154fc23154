//! Present status of the bench.

use stickslip_rt::Quantiles;

use super::protocol::{ClockStatus, Status};
use super::{Live, Shared};

impl Live {
    pub(super) fn status(&self) -> Status {
        let Shared { parameters, state, motion, operation, acquisition, recorder, runs, health, links, .. } =
            &*self.shared;
        let newest = acquisition.newest();
        let ((undo, redo), changed, rate) =
            parameters.read(|tuning| (tuning.can_undo(), tuning.differences().len(), tuning.preset().bench.tick_rate));
        let (lateness, cycle) = health.times(|times| (times.lateness(), times.total()));
        let (operator, asks) = operation.names();
        let (recording, recorded) = recorder.status(rate);
        let (doing, last) = motion.status();
        let seconds = |q: Quantiles| [q.p50, q.p99, q.p999, q.max].map(|nanoseconds| nanoseconds as f64 * 1e-9);
        Status {
            preset: parameters.file(),
            state: newest.state.into(),
            reason: newest
                .end
                .or_else(|| newest.fault.as_ref().map(|fault| format!("{} {}", fault.cause, fault.remedy))),
            fault: newest.fault,
            cycle: newest.cycle,
            rate,
            angle: newest.signals.angle,
            velocity: newest.signals.software.estimated_velocity,
            drive_torque: newest.signals.software.commanded_torque,
            load_torque: newest.signals.software.measured_load_torque,
            render: newest.signals.render > 0.5,
            preload: motion.preload(),
            doing,
            last,
            changed,
            undo,
            redo,
            operator,
            asks,
            loaded: parameters.loaded.status(),
            clock: ClockStatus {
                lateness: seconds(lateness),
                cycle: seconds(cycle),
                load: seconds(cycle)[0] * rate,
                held: newest.held,
                lost: newest.lost,
            },
            link: links.counts(),
            segment: links.segment(),
            recording,
            recorded,
            measurement_record: recorder.measurement(rate),
            not_entered: runs.not_entered(),
            not_saved: state.problem().or_else(|| recorder.failure()),
            earlier: state.offered(),
            xcp: links.xcp(),
            marks: acquisition.mark_count(),
        }
    }
}
