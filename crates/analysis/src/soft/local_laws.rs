//! The laws of local models (Fotoohi Ghiam 2006, §2, §3) as linear blocks: gains in, blocks out.
//!
//! With m contacts, the error `e` has three numbers a contact, surface minus finger along the axes of the world, and forces
//! act on fingers.

use cotouch_scene::scene::LocalModelKind;
use glam::DVec3;
use nalgebra::DMatrix;

use crate::linear::Linear;

/// What a host's local models are made of.
pub(super) struct Gains<'a> {
    /// K_h, one a contact.
    pub(super) kh_n_per_m: &'a [f64],
    /// INT, one a contact.
    pub(super) int_n_per_m: &'a [f64],
    /// Of the contacts, outward, unit.
    pub(super) normals: &'a [DVec3],
    /// W, m/N, 3m × 3m.
    pub(super) compliance: &'a DMatrix<f64>,
}

/// A law of all contacts of a host.
pub(super) struct LocalLaw {
    /// Forces on fingers per `[e; f]`, f being the forces with which the body in use was stepped; or per e.
    pub(super) direct: DMatrix<f64>,
    /// Whether these forces are those of the first tick of a slow period.
    pub(super) held: bool,
    /// From e to forces on fingers; the input is gathered at every tick, with the weight 1/N.
    pub(super) integral: Option<Linear>,
}

/// The law of a kind. Where no forces fit the compliance (K_h is 0), contacts know nothing of each other.
pub(super) fn law(kind: LocalModelKind, gains: &Gains<'_>) -> LocalLaw {
    match kind {
        LocalModelKind::Hold => LocalLaw { held: true, ..proportional(gains) },
        LocalModelKind::P => proportional(gains),
        LocalModelKind::Pi => proportional_integral(gains),
        LocalModelKind::Compliance => shared(gains).unwrap_or_else(|| proportional(gains)),
    }
}

/// F = K_h·e (3).
fn proportional(gains: &Gains<'_>) -> LocalLaw {
    let size = 3 * gains.kh_n_per_m.len();
    let gain = |row: usize, column: usize| if row == column { gains.kh_n_per_m[row / 3] } else { 0.0 };
    LocalLaw { direct: DMatrix::from_fn(size, size, gain), held: false, integral: None }
}

/// F = K_h·e + n·I, I⁺ = I + INT/N·n·e (6).
fn proportional_integral(gains: &Gains<'_>) -> LocalLaw {
    let contacts = gains.normals.len();
    let along = |row: usize, contact: usize| {
        if row / 3 == contact { gains.normals[contact][row % 3] } else { 0.0 }
    };
    let c = DMatrix::from_fn(3 * contacts, contacts, along);
    let b =
        DMatrix::from_fn(contacts, 3 * contacts, |row, column| gains.int_n_per_m[row] * along(column, row));
    let (a, d) = (DMatrix::identity(contacts, contacts), DMatrix::zeros(3 * contacts, 3 * contacts));
    LocalLaw { integral: Some(Linear { a, b, c, d }), ..proportional(gains) }
}

/// F = (1/K_h + W)⁻¹·(e − W·f): all contacts of a host together.
fn shared(gains: &Gains<'_>) -> Option<LocalLaw> {
    let mut sum = gains.compliance.clone();
    for row in 0..sum.nrows() {
        sum[(row, row)] += gains.kh_n_per_m[row / 3].recip();
    }
    let stiffness = sum.try_inverse()?;
    let size = stiffness.nrows();
    let mut direct = stiffness.clone().resize_horizontally(2 * size, 0.0);
    direct.columns_mut(size, size).copy_from(&(&stiffness * -gains.compliance));
    Some(LocalLaw { direct, held: false, integral: None })
}
