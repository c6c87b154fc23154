//! What only a design can fail of.

/// A failure of a design, beside those that every crate has.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DesignError {
    /// The input does not reach, or the output does not show, all states.
    #[error(
        "the system is not {property}: the reciprocal condition of its {property} matrix is {reciprocal_condition:.1e}, \
         below {limit:.1e}. {remedy}"
    )]
    NotReachable {
        /// "controllable" or "observable".
        property: &'static str,
        /// Of the scaled matrix; 1 is perfect, 0 singular.
        reciprocal_condition: f64,
        /// Smallest one that still gives digits.
        limit: f64,
        /// What to do.
        remedy: &'static str,
    },
    /// A wanted pole outside the unit circle.
    #[error(
        "the pole {real} + {imaginary}i has magnitude {magnitude}, at most {limit} is stable. \
         Move it inwards: a pole at p 1/s is e^(-p T)."
    )]
    UnstablePole {
        /// Real part.
        real: f64,
        /// Imaginary part.
        imaginary: f64,
        /// Distance from the origin.
        magnitude: f64,
        /// Largest allowed distance.
        limit: f64,
    },
    /// A complex pole without its conjugate: the gains would be complex.
    #[error(
        "the pole {real} + {imaginary}i has no partner at {real} - {imaginary}i. Give complex poles in conjugate pairs."
    )]
    UnpairedPole {
        /// Real part.
        real: f64,
        /// Imaginary part.
        imaginary: f64,
    },
    /// A system without a stationary covariance.
    #[error(
        "the system's spectral radius is {spectral_radius}, a stationary covariance needs less than {limit}. {remedy}"
    )]
    Unstable {
        /// Magnitude of its largest eigenvalue.
        spectral_radius: f64,
        /// It must stay below this.
        limit: f64,
        /// What to do.
        remedy: &'static str,
    },
    /// A desired friction outside the renderable region.
    #[error("{0}")]
    NotRenderable(Box<crate::Verdict>),
    /// An arm whose rigid part is too heavy to be rendered.
    #[error(
        "an arm of which {rigid_inertia:e} kg m² move with the carriage cannot be rendered: the loop over accelerometer \
         and load motor would oscillate. Up to {feasible:.2e} kg m² can be (bench.arm.rigid_inertia): take less, tick \
         faster, or add the rest to the load as a real mass."
    )]
    ArmTooHeavy {
        /// What was asked for [kg m²].
        rigid_inertia: f64,
        /// What can be rendered [kg m²].
        feasible: f64,
    },
    /// A rendering law that would chatter.
    #[error(
        "rendered like this the load motor would chatter by {}, {limit} N m are allowed: {cause}. {}",
        chatter_in_words(*predicted_chatter), chatter_remedy(*stiffness, *feasible)
    )]
    Chatters {
        /// Predicted change of the load torque from millisecond to millisecond [N m RMS].
        predicted_chatter: f64,
        /// What is allowed of it [N m].
        limit: f64,
        /// Where most of it comes from.
        cause: &'static str,
        /// Stiffness of the bristles that were to be rendered [N m/rad].
        stiffness: Option<f64>,
        /// The nearest below it that can be [N m/rad].
        feasible: Option<f64>,
    },
}

impl From<DesignError> for stickslip_base::Error {
    fn from(error: DesignError) -> Self {
        stickslip_base::Error::Of(Box::new(error))
    }
}

/// Chatter [N m]: what has grown for half a second is of no size.
fn chatter_in_words(torque: f64) -> String {
    if torque < 10.0 { format!("{torque:.3} N m") } else { "as much as it can".into() }
}

/// What to do about chatter.
fn chatter_remedy(stiffness: Option<f64>, feasible: Option<f64>) -> String {
    match (stiffness, feasible) {
        (Some(stiffness), Some(feasible)) => format!(
            "Of bench.desired_bristles.stiffness = {stiffness:.0} N m/rad the nearest that is rendered quietly is \
             {feasible:.0} N m/rad."
        ),
        _ => "Raise bench.tick_rate, or choose another bench.law.".into(),
    }
}
