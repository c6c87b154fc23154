//! The right side of the balance of forces.

use super::track::Instant;

/// Frictions of the directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Directions {
    /// One for both, and an offset.
    Both,
    /// One for each.
    Each,
    /// Motion in one direction only: +1 or −1.
    Only(i8),
}

/// Right side of the balance.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Terms {
    pub(crate) directions: Directions,
    /// Friction in proportion to the drive force.
    pub(crate) load: bool,
    /// Periodic forces over position.
    pub(crate) waves: Vec<Wave>,
    pub(crate) timing: Timing,
}

/// How the force of the command reaches the recorded position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Timing {
    /// Delay, beside the lag [samples].
    pub(crate) delay: f64,
    /// Time constant of a lag of the drive, of first order [samples].
    pub(crate) lag: f64,
    pub(crate) estimates: Estimates,
}

/// What of the timing is estimated, with its present value for a start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Estimates {
    Nothing,
    Delay,
    /// Both: their sum, and half of the square of the lag, by which the balance is linear for a short lag.
    DelayAndLag,
}

impl Timing {
    /// A delay without a lag, held.
    pub(crate) fn held(delay: f64) -> Self {
        Timing { delay, lag: 0.0, estimates: Estimates::Nothing }
    }

    /// A delay without a lag, estimated from this start.
    pub(crate) fn from(delay: f64) -> Self {
        Timing { delay, lag: 0.0, estimates: Estimates::Delay }
    }

    /// The same values, held.
    pub(crate) fn fixed(self) -> Self {
        Timing { estimates: Estimates::Nothing, ..self }
    }

    /// Delay and lag together: by how much a slow movement is late [samples].
    pub(crate) fn total(&self) -> f64 {
        self.delay + self.lag
    }

    /// Number of estimated values.
    pub(crate) fn count(&self) -> usize {
        self.estimates as usize
    }

    /// Changes the total and half of the square of the lag.
    pub(crate) fn advance(&mut self, total: f64, half_square: f64) {
        let total = self.total() + total;
        self.lag = (self.lag * self.lag + 2.0 * half_square).max(0.0).sqrt();
        self.delay = total - self.lag;
    }
}

/// Angular spatial frequency of one period per turn of a rotary axis [1].
pub(crate) const TURN: f64 = 1.0;

/// A sine and a cosine over position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Wave {
    /// Angular spatial frequency [rad/m, or 1].
    pub(crate) number: f64,
    /// Cut-off of the low-pass [rad/s]; at speed the wave is a fast oscillation in time.
    pub(crate) cutoff: f64,
    /// Order of the low-pass.
    pub(crate) order: i32,
}

impl Wave {
    /// Sine and cosine as they pass the low-pass, which runs both ways.
    pub(crate) fn columns(&self, at: Instant) -> [f64; 2] {
        let share = (self.number * at.velocity / self.cutoff).powi(2).powi(self.order);
        let angle = self.number * at.position;
        let (sine, cosine) = libm::sincos(angle);
        [sine, cosine].map(|value| value / (1.0 + share))
    }
}

impl Terms {
    /// Mass and friction alone.
    pub(crate) fn of(directions: Directions, timing: Timing) -> Self {
        Terms { directions, load: false, waves: Vec::new(), timing }
    }

    /// The same with other timing.
    pub(crate) fn with(&self, timing: Timing) -> Self {
        Terms { timing, ..self.clone() }
    }

    /// Number of coefficients of mass, friction and offset.
    pub(crate) fn body(&self) -> usize {
        match self.directions {
            Directions::Both => 4,
            Directions::Each => 5,
            Directions::Only(_) => 3,
        }
    }

    /// Index of the first coefficient of a wave.
    pub(crate) fn wave(&self, place: usize) -> usize {
        self.body() + usize::from(self.load) + 2 * place
    }

    /// Number of coefficients without those of the timing.
    pub(super) fn count(&self) -> usize {
        self.wave(self.waves.len())
    }

    /// Regressors at an instant under a drive force.
    pub(super) fn columns(&self, at: Instant, force: f64, columns: &mut Vec<f64>) {
        let Instant { velocity, acceleration, .. } = at;
        let sign = if velocity < 0.0 { -1.0 } else { 1.0 };
        columns.push(acceleration);
        match self.directions {
            Directions::Both => columns.extend([velocity, sign, 1.0]),
            Directions::Each => {
                let forward = f64::from(velocity > 0.0);
                columns.extend([forward * velocity, forward, (1.0 - forward) * velocity, forward - 1.0]);
            }
            Directions::Only(_) => columns.extend([velocity, sign]),
        }
        if self.load {
            columns.push(force.abs() * sign);
        }
        for wave in &self.waves {
            columns.extend(wave.columns(at));
        }
    }
}
