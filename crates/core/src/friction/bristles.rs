//! Bristles that add presliding to a sliding curve.

use super::{ElastoPlastic, Fading, Friction, LuGre, Model, Stribeck};
use crate::Fields;
use crate::scalar::Scalar;

/// Parameters of the bristles of a contact, without its sliding curve: the result of a presliding measurement, and the
/// input of a rendering law besides the two characteristics.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Bristles<T> {
    /// Stiffness of the bristles, the slope of the presliding loop at rest.
    #[field(symbol = "σ₀", unit = "N m/rad", range = 1e-3..=1e7, default = 300.0)]
    pub stiffness: T,
    /// Damping of the bristles at rest.
    #[field(symbol = "σ₁", unit = "N m s/rad", range = 0.0..=1e3, default = 0.85)]
    pub damping: T,
    /// Fading of the damping with speed.
    pub fading: Fading<T>,
    /// Elastic limit as a share of the breakaway deflection M_S/σ₀.
    #[field(symbol = "z_ba·σ₀/M_S", unit = "1", range = 0.0..=0.95, default = 0.7)]
    pub elastic_fraction: T,
}

impl<T: Scalar> Bristles<T> {
    /// Elasto-plastic friction that slides on this curve.
    pub fn under(&self, sliding: Stribeck<T>) -> Friction<T> {
        let Bristles { stiffness, damping, fading, elastic_fraction } = *self;
        let lugre = LuGre { sliding, bristle_stiffness: stiffness, bristle_damping: damping, fading };
        Friction { model: Model::ElastoPlastic(ElastoPlastic { lugre, elastic_fraction }), ..Friction::default() }
    }
}

impl<T: Scalar> From<ElastoPlastic<T>> for Bristles<T> {
    fn from(model: ElastoPlastic<T>) -> Self {
        let ElastoPlastic { lugre, elastic_fraction } = model;
        Bristles {
            stiffness: lugre.bristle_stiffness,
            damping: lugre.bristle_damping,
            fading: lugre.fading,
            elastic_fraction,
        }
    }
}
