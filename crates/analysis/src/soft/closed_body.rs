//! A soft body in a loop with the local models that press on it, as the fingers of one host observe it.
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
//! That is one linear system, the same at every host, from q̄ to the forces on all fingers. A host's part of the loop is
//! what its own fingers observe of it; of the modes that they do not, the loop keeps the largest eigenvalue.

use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::SurfaceHold;
use cotouch_world::LinearBlock;
use nalgebra::{Complex, DMatrix};

use super::local_laws::ticks_of_periods;
use super::reduction::{NEGLIGIBLE_IN_LOOP, Reachable};
use super::touched::{Touched, returned_force};
use crate::loop_spec::Hold;
use cotouch_matrix::{eigenvalues, spectral_radius};

/// The bodies of a session's hosts, in a loop with local models.
pub(super) struct ClosedBodies {
    /// Which coordinates of the fingers go in, of three a contact that touches: those along which they can move.
    pub(super) inputs: Vec<usize>,
    /// The weights of a period's positions in the input.
    pub(super) weights: Vec<Vec<f64>>,
    /// How each part of the output is held.
    pub(super) holds: Vec<Hold>,
    /// Of each host: from the inputs to the parts of the forces on its own fingers that touch (three numbers a finger each).
    pub(super) observable: Vec<(HostIndex, LinearBlock)>,
    /// The largest eigenvalue of what the own fingers of some host do not observe.
    pub(super) unobservable: Option<Complex<f64>>,
    /// K_e where forces follow fingers at every tick, N/m.
    pub(super) direct: Option<DMatrix<f64>>,
}

/// Eigenvalues that are this near to each other, relative to the largest, may be the same.
const NEAR: f64 = 1e-6;
/// A system that grows is balanced as if its largest eigenvalue had this absolute value.
const INSIDE: f64 = 0.9;

impl ClosedBodies {
    /// Nothing where a law has a state at the haptic rate, periods differ in how a surface moves on, or a host has other
    /// fingers than its own to serve.
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
        let observable = system.observable(of, (spectral_radius(&all) / INSIDE).max(1.0))?;
        let known = observable.iter().map(|(_, law)| eigenvalues(&law.a).ok());
        let known = known.collect::<Option<Vec<_>>>()?;
        // Where forces cancel but for rounding, what is balanced is rounding, and its eigenvalues are anything.
        let largest = spectral_radius(&all) * (1.0 + NEAR);
        if known.iter().any(|known| spectral_radius(known) > largest) {
            return None;
        }
        let missing = known.into_iter().filter_map(|known| largest_missing(&all, known));
        Some(Self {
            inputs: system.inputs,
            weights,
            holds: system.outputs.iter().map(|output| output.hold).collect(),
            observable,
            unobservable: missing.max_by(|one, other| one.norm().total_cmp(&other.norm())),
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

/// The largest of `all` eigenvalues that is not among the known ones.
fn largest_missing(all: &[Complex<f64>], mut known: Vec<Complex<f64>>) -> Option<Complex<f64>> {
    let mut all = all.to_vec();
    all.sort_by(|one, other| other.norm().total_cmp(&one.norm()));
    let near = NEAR * all.first()?.norm();
    let is_missing = |value: &Complex<f64>| {
        let same = known.iter().position(|other| (other - value).norm() <= near);
        same.map(|place| known.swap_remove(place)).is_none()
    };
    all.into_iter().find(is_missing)
}

/// From the inputs to the forces on all fingers.
struct System {
    inputs: Vec<usize>,
    k_e: DMatrix<f64>,
    a: DMatrix<f64>,
    b: DMatrix<f64>,
    /// The parts of the forces, which add up.
    outputs: Vec<Output>,
}

/// A part of the forces on all fingers, and how it is held.
struct Output {
    hold: Hold,
    c: DMatrix<f64>,
    d: DMatrix<f64>,
}

impl System {
    fn new(of: &Touched<'_>, share_of_way: f64) -> Self {
        let rows = 3 * of.touching.len();
        let inputs: Vec<usize> = (0..rows).filter(|&row| of.number(row).is_some()).collect();
        let (k_e, k_f) = gains(of);
        let places = Places::new(of);
        let (size, delay) = (places.size(), places.delay);
        let newest = places.on_state(places.surface(delay), &k_e);
        let surface = match of.hold {
            SurfaceHold::Zero => newest.clone(),
            SurfaceHold::First => {
                let before = places.on_state(places.surface(delay + 1), &k_e);
                &newest * share_of_way + before * (1.0 - share_of_way)
            }
        };
        let stepped = k_f.map(|k_f| places.on_state(places.force(delay), &k_f));
        let on_state = stepped.iter().fold(surface, |sum, forces| sum + forces);
        let on_inputs = -k_e.select_columns(&inputs);
        let mut forces = on_state.clone().resize_horizontally(size + inputs.len(), 0.0);
        forces.columns_mut(size, inputs.len()).copy_from(&on_inputs);
        let next = places.next(&of.body.law, &-forces);
        let from_state = |hold, c| Output { hold, c, d: DMatrix::zeros(rows, inputs.len()) };
        let outputs = match of.hold {
            _ if of.law.held => vec![Output { hold: Hold::Zero, c: on_state, d: on_inputs }],
            SurfaceHold::Zero => vec![from_state(Hold::Zero, on_state)],
            SurfaceHold::First => {
                let stepped = stepped.map(|forces| from_state(Hold::Zero, forces));
                std::iter::once(from_state(Hold::First, newest)).chain(stepped).collect()
            }
        };
        let (a, b) = (next.columns(0, size).into_owned(), next.columns(size, inputs.len()).into_owned());
        Self { inputs, k_e, a, b, outputs }
    }

    /// What the own fingers of each host observe; a `growth` above the spectral radius makes sense of a system that grows.
    fn observable(&self, of: &Touched<'_>, growth: f64) -> Option<Vec<(HostIndex, LinearBlock)>> {
        let reachable = (!self.inputs.is_empty()).then(|| Reachable::new(&self.a, &self.b, growth));
        let observed_at = |&host: &HostIndex| {
            let rows: Vec<usize> =
                of.own_contacts(host).flat_map(|contact| 3 * contact..3 * contact + 3).collect();
            let c = stacked(self.outputs.iter().map(|output| output.c.select_rows(&rows)));
            let d = stacked(self.outputs.iter().map(|output| output.d.select_rows(&rows)));
            let law = match reachable.as_ref().filter(|_| !rows.is_empty()) {
                Some(system) => system.balanced(&c, &d, NEGLIGIBLE_IN_LOOP)?,
                None => LinearBlock::gain(d),
            };
            Some((host, law))
        };
        of.hosts.iter().map(observed_at).collect()
    }
}

/// Parts of equal size, one above the other.
fn stacked(parts: impl Iterator<Item = DMatrix<f64>>) -> DMatrix<f64> {
    let parts: Vec<_> = parts.collect();
    let (rows, columns) = parts[0].shape();
    DMatrix::from_fn(parts.len() * rows, columns, |row, column| parts[row / rows][(row % rows, column)])
}

/// K_e, and K_f of a law that has it, without forces along idle axes.
fn gains(of: &Touched<'_>) -> (DMatrix<f64>, Option<DMatrix<f64>>) {
    let rows = 3 * of.touching.len();
    let mut direct = of.law.direct.clone();
    (0..rows).filter(|row| of.idle_axes[row % 3]).for_each(|row| direct.row_mut(row).fill(0.0));
    let stepped = of.reads_stepped_forces().then(|| direct.columns(rows, rows).into_owned());
    (direct.columns(0, rows).into_owned(), stepped)
}

/// Where the numbers of a system's state are: those of the body, surfaces of past periods, forces of past periods.
struct Places {
    states: usize,
    rows: usize,
    /// D.
    delay: usize,
    surfaces: usize,
    forces: usize,
}

impl Places {
    fn new(of: &Touched<'_>) -> Self {
        let delay = 1 + of.result_delay_periods as usize;
        Self {
            states: of.body.law.states(),
            rows: 3 * of.touching.len(),
            delay,
            surfaces: delay + usize::from(of.hold == SurfaceHold::First),
            forces: if of.reads_stepped_forces() { delay } else { 0 },
        }
    }

    fn surface(&self, age: usize) -> usize {
        self.states + self.rows * (age - 1)
    }

    fn force(&self, age: usize) -> usize {
        self.surface(self.surfaces + age)
    }

    fn size(&self) -> usize {
        self.force(self.forces + 1)
    }

    /// Gains on the numbers from `place` on.
    fn on_state(&self, place: usize, gains: &DMatrix<f64>) -> DMatrix<f64> {
        let mut on_state = DMatrix::zeros(self.rows, self.size());
        on_state.columns_mut(place, self.rows).copy_from(gains);
        on_state
    }

    /// The state a period on, from the state and the inputs side by side, as `pressing`, the forces on the body, is.
    fn next(&self, body: &LinearBlock, pressing: &DMatrix<f64>) -> DMatrix<f64> {
        let mut next = DMatrix::zeros(self.size(), pressing.ncols());
        next.rows_mut(0, self.states).copy_from(&(&body.b * pressing));
        next.rows_mut(self.surface(1), self.rows).copy_from(&(&body.d * pressing));
        let mut on_body = next.columns_mut(0, self.states);
        let mut of_body = on_body.rows_mut(0, self.states);
        of_body += &body.a;
        let mut of_surface = on_body.rows_mut(self.surface(1), self.rows);
        of_surface += &body.c;
        if self.forces > 0 {
            next.rows_mut(self.force(1), self.rows).copy_from(pressing);
        }
        let surfaces = (2..=self.surfaces).map(|age| (self.surface(age), self.surface(age - 1)));
        let forces = (2..=self.forces).map(|age| (self.force(age), self.force(age - 1)));
        for (older, newer) in surfaces.chain(forces) {
            next.view_mut((older, newer), (self.rows, self.rows)).fill_with_identity();
        }
        next
    }
}
