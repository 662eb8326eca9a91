//! Fotoohi Ghiam's formulas for what users perceive, as printed, and corrected where the print is wrong.
//!
//! Only for comparison: everything else in this crate is computed from the loop. All take a single-axis scene, from which
//! they read the seed's symbols; T_c is the control period.

use cotouch_scene::scene::SceneValues;

/// The seed's symbols.
struct Symbols {
    m_1: f64,
    m_o: f64,
    t_c: f64,
    k_11: f64,
    b_11: f64,
    k_12: f64,
    b_12: f64,
    k_o: f64,
    b_o: f64,
    k_w: f64,
}

impl Symbols {
    fn of(scene: &SceneValues) -> Self {
        let coupling = &scene.coupling;
        Self {
            m_1: scene.hand_impedance().mass_kg,
            m_o: scene.object.mass_kg,
            t_c: scene.rates.control_hz.period_s(),
            k_11: coupling.hand_object.stiffness_n_per_m,
            b_11: coupling.hand_object.damping_n_s_per_m,
            k_12: coupling.remote_hand_object.stiffness_n_per_m,
            b_12: coupling.remote_hand_object.damping_n_s_per_m,
            k_o: coupling.object_object.stiffness_n_per_m,
            b_o: coupling.object_object.damping_n_s_per_m,
            k_w: scene.wall.stiffness_n_per_m,
        }
    }
}

/// (6.3): added damping of the simplified distributed model of two users at N = 2, n = 0, N·s/m. Exact.
#[must_use]
pub fn simplified_damping(scene: &SceneValues) -> f64 {
    let Symbols { m_o, k_o, b_o, t_c, .. } = Symbols::of(scene);
    2.0 * m_o * k_o / (4.0 * m_o / t_c - t_c * k_o - 2.0 * b_o)
}

/// (B.10): added damping of the remote user of a centralized session at N = 2, n = 0, N·s/m. Exact.
#[must_use]
pub fn centralized_remote_damping(scene: &SceneValues) -> f64 {
    let Symbols { m_o, k_12: k_2, b_12: b_2, t_c, .. } = Symbols::of(scene);
    k_2 / (2.0 / t_c - b_2 / m_o)
}

/// (B.11): added damping of a distributed user at N = 2, n = 0, N·s/m, as printed: (B.12)/(B.13). About three times the
/// exact value: it belongs to data that are one T_c older.
#[must_use]
pub fn distributed_damping_as_printed(scene: &SceneValues) -> f64 {
    let symbols = Symbols::of(scene);
    numerator_as_printed(&symbols) / denominator_as_printed(&symbols)
}

/// (B.12) as printed, `M_o` being m_o.
#[rustfmt::skip]
fn numerator_as_printed(symbols: &Symbols) -> f64 {
    let &Symbols { m_1, m_o, t_c, k_11, b_11, k_12, b_12, k_o, b_o, .. } = symbols;
    let (t_c2, t_c3, k_o2, k_12_2) = (t_c * t_c, t_c * t_c * t_c, k_o * k_o, k_12 * k_12);
    t_c * k_11 * (
        10.0 * m_1 * k_o2 * t_c2 * b_o * b_11 - 24.0 * t_c * k_o2 * m_1 * m_o * b_11 - 40.0 * m_1 * t_c * m_o * k_o2 * b_o
        - 24.0 * m_1 * t_c * m_o * k_o2 * b_12 + t_c3 * b_12 * b_12 * k_o2 * b_11 - 24.0 * t_c * b_11 * m_o * m_o * k_o2
        - 4.0 * t_c3 * b_11 * b_o * b_o * k_o2
        + 10.0 * m_1 * t_c2 * b_o * k_o2 * b_12 + 8.0 * m_1 * t_c2 * b_o * b_o * k_o2 - 4.0 * t_c3 * b_11 * b_o * k_o2 * b_12
        + 10.0 * t_c2 * b_11 * m_o * k_o2 * b_12
        + 12.0 * m_1 * t_c2 * k_o2 * b_12 * b_11 + 48.0 * m_1 * m_o * m_o * k_o2 + 20.0 * t_c2 * b_11 * m_o * k_o2 * b_o
        - 2.0 * t_c2 * k_12_2 * m_o * b_o * b_11
        - 2.0 * t_c2 * k_12_2 * m_1 * b_o * b_o - 2.0 * t_c2 * k_12_2 * m_1 * b_o * b_11 + 4.0 * t_c * k_12_2 * m_1 * m_o * b_o
        + t_c3 * k_12_2 * b_o * b_o * b_11
        + 8.0 * t_c2 * m_1 * b_11 * k_o * b_o * k_12 - 40.0 * t_c * m_1 * m_o * k_o * b_o * k_12
        - 4.0 * t_c3 * k_o * b_o * b_o * b_11 * k_12
        + 8.0 * t_c2 * m_1 * b_o * b_o * k_o * k_12 + 12.0 * m_1 * t_c2 * b_11 * k_o * b_12 * k_12
        + 12.0 * m_1 * t_c2 * b_o * k_o * b_12 * k_12
        + 20.0 * t_c2 * m_o * k_o * b_o * k_12 * b_11 + 12.0 * t_c2 * m_o * k_12 * k_o * b_12 * b_11
        - 6.0 * t_c3 * k_12 * k_o * b_12 * b_11 * b_o
        - 24.0 * m_1 * m_o * t_c * k_o * b_12 * k_12 + 48.0 * m_1 * m_o * m_o * k_12 * k_o
        - 24.0 * t_c * m_o * m_o * k_12 * k_o * b_11 - 24.0 * m_1 * m_o * t_c * b_11 * k_o * k_12
    )
}

/// (B.13) as printed.
fn denominator_as_printed(symbols: &Symbols) -> f64 {
    let &Symbols { m_1, m_o, t_c, k_11, b_11, k_12, b_12, k_o, b_o, .. } = symbols;
    (t_c * b_o + t_c * b_12 - 2.0 * m_o)
        * (k_11 * k_12 + k_o * k_12 + k_11 * k_o)
        * (-t_c.powi(3) * b_11 * k_o - 2.0 * t_c * t_c * b_11 * b_o
            + 4.0 * m_1 * t_c * b_o
            + 4.0 * m_1 * t_c * b_11
            + 4.0 * m_o * t_c * b_11
            - 8.0 * m_1 * m_o)
}

/// (6.4), ideal: the wall's stiffness, N/m.
#[must_use]
pub fn ideal_stiffness(scene: &SceneValues) -> f64 {
    Symbols::of(scene).k_w
}

/// (6.4), centralized: wall and coupler in series, N/m, the coupler being k_1 (local user) or k_2 (remote user).
#[must_use]
pub fn centralized_stiffness(scene: &SceneValues, remote: bool) -> f64 {
    let Symbols { k_11: k_1, k_12: k_2, k_w, .. } = Symbols::of(scene);
    let coupler = if remote { k_2 } else { k_1 };
    k_w * coupler / (coupler + k_w)
}

/// (6.4), distributed, as printed, N/m.
#[must_use]
pub fn distributed_stiffness_as_printed(scene: &SceneValues) -> f64 {
    let Symbols { k_11, k_12: k_21, k_o, k_w, .. } = Symbols::of(scene);
    k_11 * (2.0 * k_o * k_o + k_21 * k_w + 2.0 * k_o * k_w + k_w * k_w)
        / (k_o * k_21
            + k_21 * k_11
            + k_11 * k_o
            + k_11 * k_w
            + 2.0 * k_o * k_o
            + k_21 * k_w
            + 2.0 * k_o * k_w
            + k_w * k_w)
}

/// (6.4), distributed, corrected, N/m: two users, copies coupled pairwise. 0 without a wall.
#[must_use]
pub fn distributed_stiffness(scene: &SceneValues) -> f64 {
    let Symbols { k_11, k_12: k_21, k_o, k_w, .. } = Symbols::of(scene);
    k_11 * (k_w * k_w + k_w * (2.0 * k_o + k_21))
        / (k_11 * k_21 + k_11 * k_o + k_11 * k_w + k_21 * k_o + k_21 * k_w + 2.0 * k_o * k_w + k_w * k_w)
}

/// (6.5): the limits of (6.4) for an infinitely stiff wall, N/m: the coupler between hand and object.
#[must_use]
pub fn stiffness_at_rigid_wall(scene: &SceneValues, remote: bool) -> f64 {
    let Symbols { k_11, k_12, .. } = Symbols::of(scene);
    if remote { k_12 } else { k_11 }
}
