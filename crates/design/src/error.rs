//! Errors of designs.

/// Errors of designs, besides those common to all crates.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DesignError {
    /// A system that is not controllable or not observable.
    #[error(
        "the system is not {property}: the reciprocal condition of its {property} matrix is {reciprocal_condition:.1e}, \
         below {limit:.1e}. {remedy}"
    )]
    NotReachable {
        /// "controllable" or "observable".
        property: &'static str,
        /// Reciprocal condition of the scaled matrix; 1 is perfect, 0 singular.
        reciprocal_condition: f64,
        /// Smallest accepted value.
        limit: f64,
        /// The remedy.
        remedy: &'static str,
    },
    /// A specified pole outside the unit circle.
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
        /// Its limit.
        limit: f64,
        /// The remedy.
        remedy: &'static str,
    },
    /// A desired friction outside the renderable region.
    #[error("{0}")]
    NotRenderable(Box<crate::Verdict>),
    /// An arm whose rigid part is too heavy to be rendered.
    #[error(
        "the rigid inertia {rigid_inertia:e} kg m² of the arm cannot be rendered: the loop over accelerometer and load \
         motor would oscillate. Reduce bench.arm.rigid_inertia to {feasible:.2e} kg m², raise bench.tick_rate, or add \
         the rest to the load as a physical mass."
    )]
    ArmTooHeavy {
        /// The specified inertia [kg m²].
        rigid_inertia: f64,
        /// The largest rendered inertia [kg m²].
        feasible: f64,
    },
    /// A controller whose loop is unstable with the delays of the drives.
    #[error(
        "the position loop of the {controller} controller is unstable: with {late} it oscillates at {frequency:.0} rad/s \
         with growing amplitude. {remedy}"
    )]
    LateLoop {
        /// Kind of the controller.
        controller: &'static str,
        /// The delays, with their parameters.
        late: String,
        /// Frequency of the oscillation [rad/s].
        frequency: f64,
        /// The remedy.
        remedy: String,
    },
    /// A rendering law that would chatter.
    #[error(
        "the chatter of the load motor would {}, limit {limit} N m; main cause: {cause}. {}",
        chatter_in_words(*predicted_chatter), chatter_remedy(*stiffness, *feasible)
    )]
    Chatters {
        /// Predicted change of the load torque from millisecond to millisecond [N m RMS].
        predicted_chatter: f64,
        /// Its limit [N m].
        limit: f64,
        /// Its main cause.
        cause: &'static str,
        /// Stiffness of the desired bristles [N m/rad].
        stiffness: Option<f64>,
        /// Largest renderable stiffness below it [N m/rad].
        feasible: Option<f64>,
    },
}

impl From<DesignError> for stickslip_base::Error {
    fn from(error: DesignError) -> Self {
        stickslip_base::Error::Of(Box::new(error))
    }
}

/// Chatter [N m]; a value that has grown for half a second is arbitrary.
fn chatter_in_words(torque: f64) -> String {
    if torque < 10.0 { format!("reach {torque:.3} N m") } else { "grow without bound".into() }
}

/// Remedy for chatter.
fn chatter_remedy(stiffness: Option<f64>, feasible: Option<f64>) -> String {
    match (stiffness, feasible) {
        (Some(stiffness), Some(feasible)) => format!(
            "Reduce bench.desired_bristles.stiffness from {stiffness:.0} N m/rad to at most {feasible:.0} N m/rad."
        ),
        _ => "Raise bench.tick_rate, or choose another bench.law.".into(),
    }
}
