//! Jog: a constant speed while a client holds a button, and a move to a position.
//!
//! A jog has a dead-man time: the client repeats its call while the button is held. After [`DEAD_MAN`] without a call
//! the axis comes to rest, whether the button was released, the page closed or the connection lost. Each press has a
//! number: once its jog has ended, late calls of the same press cannot start the axis again.

use std::collections::VecDeque;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use stickslip_core::control::reference::{PointToPoint, Reference, Setpoint};

use super::axis::Job;
use super::protocol::Answer;
use super::{Live, LiveError, lock};
use stickslip_base::{Error, Preset};
use stickslip_bench::SpeedRamp;
use stickslip_design::within;
use stickslip_experiment::trial::{gentle, travel};

/// Time without a call after which a jog ends.
pub(super) const DEAD_MAN: Duration = Duration::from_millis(300);
/// Name of a jog in the status.
const JOG: &str = "jog";
/// Number of ended presses that are remembered.
const MEMORY: usize = 64;
/// Share of the acceleration that brakes at the end of the travel.
const BRAKING: f64 = 0.8;
/// Rest at the end of a move to a position [s].
const SETTLE: f64 = 0.1;

/// The held button.
#[derive(Default)]
pub(super) struct JogSwitch(Mutex<Switch>);

#[derive(Default)]
struct Switch {
    /// Number of the press, its velocity [rad/s], and the time until which it is valid.
    held: Option<(u64, f64, Instant)>,
    /// Presses that have ended, the oldest first.
    ended: VecDeque<u64>,
}

/// State of the button for the axis.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Button {
    /// Held, with this velocity [rad/s].
    Held(f64),
    Released,
    /// No call for [`DEAD_MAN`].
    Silent,
}

impl Switch {
    /// A call of a press; velocity 0 releases it.
    fn call(&mut self, press: u64, velocity: f64, now: Instant) -> Result<(), LiveError> {
        if let Some((other, _, until)) = self.held.filter(|(other, ..)| *other != press) {
            if until > now && velocity != 0.0 {
                return Err(LiveError::Jog { reason: "another button is held" });
            }
            if until <= now {
                self.end(other);
            }
        }
        if velocity == 0.0 {
            self.end(press);
            return Ok(());
        }
        if self.held.is_some_and(|(same, _, until)| same == press && until <= now) {
            self.end(press);
        }
        if self.ended.contains(&press) {
            return Err(LiveError::Jog { reason: "this press has ended" });
        }
        self.held = Some((press, velocity, now + DEAD_MAN));
        Ok(())
    }

    fn end(&mut self, press: u64) {
        self.held.take_if(|(held, ..)| *held == press);
        if !self.ended.contains(&press) {
            self.ended.push_back(press);
            self.ended.drain(..self.ended.len().saturating_sub(MEMORY));
        }
    }

    fn button(&self, now: Instant) -> Button {
        match self.held {
            Some((_, velocity, until)) if until > now => Button::Held(velocity),
            Some(_) => Button::Silent,
            None => Button::Released,
        }
    }
}

impl JogSwitch {
    fn button(&self) -> Button {
        lock(&self.0).button(Instant::now())
    }

    /// Ends the press, if any: the axis moves again only after another one.
    pub(super) fn release(&self) {
        let mut switch = lock(&self.0);
        if let Some((press, ..)) = switch.held {
            switch.end(press);
        }
    }
}

/// The set-point of a jog.
pub(super) struct Jog {
    ramp: SpeedRamp,
    acceleration: f64,
    /// Ends of the travel [rad].
    ends: [f64; 2],
}

impl Jog {
    /// At rest at a position [rad].
    pub(super) fn new(position: f64, preset: &Preset<f64>) -> Self {
        let acceleration = gentle(preset, 1.0).acceleration;
        Jog {
            ramp: SpeedRamp::new(position, acceleration, preset.bench.tick_time()),
            acceleration,
            ends: travel(&preset.bench),
        }
    }

    /// The set-point of the next tick; `None` at the end of the jog.
    ///
    /// # Errors
    /// [`LiveError::Jog`] if the jog ended by the dead-man time.
    pub(super) fn next(&mut self, switch: &JogSwitch) -> Result<Option<Setpoint<f64>>, Error> {
        let button = switch.button();
        let velocity = if let Button::Held(velocity) = button { self.within_travel(velocity) } else { 0.0 };
        if self.ramp.setpoint.velocity == 0.0 {
            match button {
                Button::Released => return Ok(None),
                Button::Silent => {
                    switch.release();
                    return Err(LiveError::Jog { reason: "the page sent no signal for 0.3 s" }.into());
                }
                Button::Held(_) => {}
            }
        }
        Ok(Some(self.ramp.toward(velocity)))
    }

    /// The velocity with which the axis comes to rest before the end of the travel.
    fn within_travel(&self, velocity: f64) -> f64 {
        let position = self.ramp.setpoint.position;
        let room = if velocity > 0.0 { self.ends[1] - position } else { position - self.ends[0] };
        // With less than the full deceleration, so that a tick of delay does not lead beyond the end.
        let most = libm::sqrt(2.0 * BRAKING * self.acceleration * room.max(0.0));
        velocity.clamp(-most, most)
    }
}

impl Live {
    /// A call of a held button.
    pub(super) fn jog(&self, velocity: f64, press: u64, render: bool) -> Result<Answer, Error> {
        let motion = &self.shared.motion;
        let preset = self.shared.parameters.preset();
        let most = preset.bench.safety.speed;
        within("the jog speed", velocity, "rad/s", (-most, most), "Choose a speed within the limit of the axis.")?;
        let moves = velocity != 0.0;
        if moves {
            self.require_torque()?;
        }
        lock(&motion.jog.0).call(press, velocity, Instant::now())?;
        // A jog that comes to rest takes the new velocity; one that has ended meanwhile starts again with the next call.
        if !moves || motion.is_doing(JOG) {
            return Ok(Answer::Done {});
        }
        let begun = self.renderable(render).and_then(|()| self.begin(JOG, Job::Jog { render }));
        begun.inspect_err(|_| motion.jog.release())
    }

    /// Moves to a position, with a speed or a moderate one.
    pub(super) fn go_to(&self, position: f64, speed: Option<f64>, render: bool) -> Result<Answer, Error> {
        let preset = self.shared.parameters.preset();
        let [low, high] = travel(&preset.bench);
        within("the position", position, "rad", (low, high), "Choose a position within the travel of the axis.")?;
        let most = preset.bench.safety.speed;
        let speed = speed.unwrap_or(0.2 * most);
        within("the speed", speed, "rad/s", (1e-3, most), "Choose a speed within the limit of the axis.")?;
        self.require_torque()?;
        self.renderable(render)?;
        let distance = position - self.shared.acquisition.held_angle();
        let moves = PointToPoint { distance, limits: gentle(&preset, speed), dwell_time: SETTLE, moves: 1.0 };
        let reference = Box::new(Reference::PointToPoint(moves));
        self.begin("go to", Job::Move { name: "go to".into(), reference, render })
    }

    /// Refuses a motion without torque.
    pub(super) fn require_torque(&self) -> Result<(), Error> {
        if self.shared.acquisition.newest().state == "running" { Ok(()) } else { Err(LiveError::NoTorque.into()) }
    }

    /// Refuses to render a friction that cannot be rendered.
    pub(super) fn renderable(&self, render: bool) -> Result<(), Error> {
        if render { self.shared.parameters.tuning().renderable().map(drop) } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stickslip_base::parameters::presets;

    #[test]
    fn a_press_ends_by_its_release_by_silence_and_cannot_return() {
        let (mut switch, begin) = (Switch::default(), Instant::now());
        let at = |milliseconds: u64| begin + Duration::from_millis(milliseconds);
        switch.call(1, 5.0, at(0)).unwrap();
        assert_eq!(switch.button(at(299)), Button::Held(5.0));
        assert_eq!(switch.button(at(301)), Button::Silent);
        assert!(switch.call(1, 5.0, at(400)).is_err(), "a late call of a press that was silent");
        switch.call(2, -5.0, at(500)).unwrap();
        assert!(switch.call(3, 5.0, at(600)).is_err(), "a second button");
        switch.call(2, -5.0, at(700)).unwrap();
        assert_eq!(switch.button(at(900)), Button::Held(-5.0));
        switch.call(2, 0.0, at(910)).unwrap();
        assert_eq!(switch.button(at(911)), Button::Released);
        assert!(switch.call(2, -5.0, at(912)).is_err(), "overtaken by its release");
        // The release overtakes the press.
        switch.call(4, 0.0, at(950)).unwrap();
        assert!(switch.call(4, 5.0, at(951)).is_err());
        switch.call(5, 5.0, at(960)).unwrap();
        for press in 100..300 {
            switch.end(press);
        }
        assert!(switch.ended.len() == MEMORY && switch.button(at(961)) == Button::Held(5.0));
    }

    #[test]
    fn a_jog_rests_at_the_end_of_the_travel() {
        let preset: Preset<f64> = presets::find("clm-bench").unwrap().read().unwrap();
        let ends = travel(&preset.bench);
        let (switch, mut jog) = (JogSwitch::default(), Jog::new(ends[1] - 3.0, &preset));
        lock(&switch.0).held = Some((1, 300.0, Instant::now() + Duration::from_secs(3600)));
        let mut last = Setpoint::default();
        for _ in 0..(2.0 * preset.bench.tick_rate) as usize {
            last = jog.next(&switch).unwrap().unwrap();
            assert!(last.position <= ends[1] + 1e-3, "{last:?}");
            assert!(last.acceleration.abs() <= 1.001 * jog.acceleration, "{last:?}");
        }
        assert!((last.position - ends[1]).abs() < 0.01 && last.velocity.abs() < 0.2, "{last:?}");
        // Away from the end it moves at once.
        lock(&switch.0).held = Some((2, -10.0, Instant::now() + Duration::from_secs(3600)));
        (0..1000).for_each(|_| last = jog.next(&switch).unwrap().unwrap());
        assert!((last.velocity + 10.0).abs() < 1e-9, "{last:?}");
        switch.release();
        while let Some(setpoint) = jog.next(&switch).unwrap() {
            last = setpoint;
        }
        assert!(last.velocity.abs() < 0.1, "{last:?}");
    }
}
