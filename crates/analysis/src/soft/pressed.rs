//! A soft body with the local models that press on it, as the fingers of one host feel it.
//!
//! Nothing leaves a host's copy of the body but the forces on the host's own fingers, and nothing enters it but where all
//! fingers are. Over a slow period p, with the positions q̄ of the fingers and the surface s̄ as they are gathered for the
//! returned force, results coming D periods later:
//!
//! ```text
//! F_p = K_e·(s̄_p − q̄_p) + K_f·f_(p−D),   f_p = −F_p
//! x⁺ = a·x + b·f_p,   y_p = c·x + d·f_p,   s̄_p = y_(p−D), or (1 − φ)·y_(p−D−1) + φ·y_(p−D) with a first-order hold
//! ```
//!
//! That is one linear system, the same at every host, from q̄ to the forces on all fingers; of its coordinates a host needs
//! those that its own fingers can tell. The others are left out with their eigenvalues, but for the largest.

use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::SurfaceHold;
use nalgebra::{Complex, DMatrix};

use super::local_laws::ticks_of_periods;
use super::reduction::{IMPERCEPTIBLE, Reachable};
use super::touched::{Touched, returned_force};
use crate::eigenvalues::{eigenvalues, spectral_radius};
use crate::loop_spec::Hold;
use cotouch_world::LinearBlock;

/// The bodies of a session's hosts while fingers press on them.
pub(super) struct Pressed {
    /// Which coordinates of the fingers go in, of three a contact that touches: those along which they can move.
    pub(super) inputs: Vec<usize>,
    /// The weights of a period's positions in the input.
    pub(super) weights: Vec<Vec<f64>>,
    /// How each part of the output is held.
    pub(super) holds: Vec<Hold>,
    /// Of each host: from the inputs to the parts of the forces on its own fingers that touch (three numbers a finger each).
    pub(super) felt: Vec<(HostIndex, LinearBlock)>,
    /// The largest eigenvalue of what at some host no own finger feels.
    pub(super) unfelt: Option<Complex<f64>>,
    /// K_e where forces follow fingers at every tick, N/m.
    pub(super) direct: Option<DMatrix<f64>>,
}

/// Eigenvalues that are this near to each other, relative to the largest, may be the same.
const NEAR: f64 = 1e-6;
/// Where a body grows, it is weighed as if its largest eigenvalue had this absolute value.
const INSIDE: f64 = 0.9;

impl Pressed {
    /// Nothing where a law's state follows ticks, periods differ in how a surface moves on, or a host has other fingers than
    /// its own to serve.
    pub(super) fn new(of: &Touched<'_>) -> Option<Self> {
        let serves_others = of.touching.iter().any(|(_, finger)| !of.hosts.contains(&finger.user));
        if of.law.state.is_some() || serves_others {
            return None;
        }
        let weights = match of.law.held {
            true => vec![vec![1.0]],
            false => returned_force(&of.slow, of.returned_force),
        };
        let system = System::new(of, share_of_way(of, &weights)?);
        let all = eigenvalues(&system.a).ok()?;
        let felt = system.felt(of, (spectral_radius(&all) / INSIDE).max(1.0))?;
        let eigenvalues_of = |(_, law): &(HostIndex, LinearBlock)| eigenvalues(&law.a).ok();
        let of_felt = felt.iter().map(eigenvalues_of).collect::<Option<Vec<_>>>()?;
        let unfelt = of_felt.into_iter().filter_map(|others| largest_missing(&all, others));
        Some(Self {
            inputs: system.inputs,
            weights,
            holds: system.holds,
            felt,
            unfelt: unfelt.max_by(|one, other| one.norm().total_cmp(&other.norm())),
            direct: (!of.law.held).then_some(system.k_e),
        })
    }
}

/// φ: how far a surface with a first-order hold is on its way when forces are gathered; nothing where periods differ.
fn share_of_way(of: &Touched<'_>, weights: &[Vec<f64>]) -> Option<f64> {
    if of.hold == SurfaceHold::Zero {
        return Some(1.0);
    }
    let share = |(period, ticks): (usize, u64)| -> f64 {
        let weights = weights[period % weights.len()].iter().enumerate();
        weights.map(|(tick, weight)| weight * tick as f64 / ticks as f64).sum()
    };
    let mut shares = ticks_of_periods(&of.slow).enumerate().map(share);
    let first = shares.next()?;
    shares.all(|other| other == first).then_some(first)
}

/// Three rows for each finger of a host.
fn own_rows(of: &Touched<'_>, host: HostIndex) -> Vec<usize> {
    let contacts = of.touching.iter().enumerate().filter(|(_, (_, finger))| finger.user == host);
    contacts.flat_map(|(contact, _)| 3 * contact..3 * contact + 3).collect()
}

/// The largest of these eigenvalues that is not also one of the others.
fn largest_missing(all: &[Complex<f64>], mut others: Vec<Complex<f64>>) -> Option<Complex<f64>> {
    let mut all = all.to_vec();
    all.sort_by(|one, other| other.norm().total_cmp(&one.norm()));
    let near = NEAR * all.first()?.norm();
    let is_missing = |value: &Complex<f64>| {
        let same = others.iter().position(|other| (other - value).norm() <= near);
        same.map(|place| others.swap_remove(place)).is_none()
    };
    all.into_iter().find(is_missing)
}

/// From the inputs to the forces on all fingers.
struct System {
    inputs: Vec<usize>,
    holds: Vec<Hold>,
    k_e: DMatrix<f64>,
    a: DMatrix<f64>,
    b: DMatrix<f64>,
    /// Of each part of the output.
    c: Vec<DMatrix<f64>>,
    d: Vec<DMatrix<f64>>,
}

/// These rows of each part.
fn stacked(parts: &[DMatrix<f64>], rows: &[usize]) -> DMatrix<f64> {
    let mut stacked = DMatrix::zeros(parts.len() * rows.len(), parts[0].ncols());
    for (part, matrix) in parts.iter().enumerate() {
        stacked.rows_mut(part * rows.len(), rows.len()).copy_from(&matrix.select_rows(rows));
    }
    stacked
}

/// Where the numbers of a system's state are: those of the body, surfaces of past periods, forces of past periods.
struct Places {
    states: usize,
    rows: usize,
    surfaces: usize,
    forces: usize,
}

impl Places {
    fn surface(&self, age: usize) -> usize {
        self.states + self.rows * (age - 1)
    }

    fn force(&self, age: usize) -> usize {
        self.surface(self.surfaces + age)
    }

    fn size(&self) -> usize {
        self.force(self.forces + 1)
    }
}

impl System {
    fn new(of: &Touched<'_>, reached: f64) -> Self {
        let rows = 3 * of.touching.len();
        let inputs: Vec<usize> = (0..rows).filter(|&row| of.number(row).is_some()).collect();
        let (k_e, k_f) = gains(of);
        let delay = 1 + of.result_delay_periods as usize;
        let places = Places {
            states: of.body.law.states(),
            rows,
            surfaces: delay + usize::from(of.hold == SurfaceHold::First),
            forces: if k_f.is_some() { delay } else { 0 },
        };
        let size = places.size();
        let at = |place: usize, gains: &DMatrix<f64>| {
            let mut on_state = DMatrix::zeros(rows, size);
            on_state.columns_mut(place, rows).copy_from(gains);
            on_state
        };
        let newest = at(places.surface(delay), &k_e);
        let surface = match of.hold {
            SurfaceHold::Zero => newest.clone(),
            SurfaceHold::First => &newest * reached + at(places.surface(delay + 1), &k_e) * (1.0 - reached),
        };
        let stepped = k_f.map(|k_f| at(places.force(delay), &k_f));
        let on_inputs = -k_e.select_columns(&inputs);
        let past = stepped.iter().fold(surface, |sum, forces| sum + forces);
        let mut pressing = DMatrix::zeros(rows, size + inputs.len());
        pressing.columns_mut(0, size).copy_from(&-&past);
        pressing.columns_mut(size, inputs.len()).copy_from(&-&on_inputs);
        let next = next(&of.body.law, &places, &pressing);
        let without_direct = DMatrix::zeros(rows, inputs.len());
        let parts = match (of.law.held, of.hold) {
            (true, _) => vec![(Hold::Zero, past, on_inputs)],
            (false, SurfaceHold::Zero) => vec![(Hold::Zero, past, without_direct)],
            (false, SurfaceHold::First) => {
                let stepped = stepped.map(|forces| (Hold::Zero, forces, without_direct.clone()));
                std::iter::once((Hold::First, newest, without_direct)).chain(stepped).collect()
            }
        };
        let (a, b) = (next.columns(0, size).into_owned(), next.columns(size, inputs.len()).into_owned());
        let holds = parts.iter().map(|(hold, ..)| *hold).collect();
        let (c, d) = parts.into_iter().map(|(_, c, d)| (c, d)).unzip();
        Self { inputs, holds, k_e, a, b, c, d }
    }

    /// What each host feels; a `growth` above the spectral radius makes sense of a system that grows.
    fn felt(&self, of: &Touched<'_>, growth: f64) -> Option<Vec<(HostIndex, LinearBlock)>> {
        let reachable = (!self.inputs.is_empty()).then(|| Reachable::new(&self.a, &self.b, growth));
        let by = |&host: &HostIndex| {
            let rows = own_rows(of, host);
            let law = match reachable.as_ref().filter(|_| !rows.is_empty()) {
                Some(system) => {
                    system.balanced(&stacked(&self.c, &rows), &stacked(&self.d, &rows), IMPERCEPTIBLE)?
                }
                None => LinearBlock::gain(DMatrix::zeros(self.c.len() * rows.len(), self.inputs.len())),
            };
            Some((host, law))
        };
        of.hosts.iter().map(by).collect()
    }
}

/// The state and the input, side by side, a period on, with the forces on the body `pressing` as they follow from these.
fn next(body: &LinearBlock, places: &Places, pressing: &DMatrix<f64>) -> DMatrix<f64> {
    let Places { rows, surfaces, forces, .. } = *places;
    let mut next = DMatrix::zeros(places.size(), pressing.ncols());
    let mut put = |row: usize, of_pressing: DMatrix<f64>, of_states: Option<&DMatrix<f64>>| {
        next.rows_mut(row, of_pressing.nrows()).copy_from(&of_pressing);
        if let Some(gains) = of_states {
            let mut block = next.view_mut((row, 0), gains.shape());
            block += gains;
        }
    };
    put(0, &body.b * pressing, Some(&body.a));
    put(places.surface(1), &body.d * pressing, Some(&body.c));
    if forces > 0 {
        put(places.force(1), pressing.clone(), None);
    }
    let older = (2..=surfaces).map(|age| (places.surface(age), places.surface(age - 1)));
    let older = older.chain((2..=forces).map(|age| (places.force(age), places.force(age - 1))));
    for (place, before) in older {
        next.view_mut((place, before), (rows, rows)).fill_with_identity();
    }
    next
}

/// K_e, and K_f of a law that has it, without forces along idle axes.
fn gains(of: &Touched<'_>) -> (DMatrix<f64>, Option<DMatrix<f64>>) {
    let rows = 3 * of.touching.len();
    let mut direct = of.law.direct.clone();
    (0..rows).filter(|row| of.idle_axes[row % 3]).for_each(|row| direct.row_mut(row).fill(0.0));
    let stepped = of.reads_stepped_forces().then(|| direct.columns(rows, rows).into_owned());
    (direct.columns(0, rows).into_owned(), stepped)
}
