//! Every law that there is does in a tick what its linear block says, as long as its contacts stick.

use cotouch_scene::scene::Scene;
use cotouch_testkit::scenes::local_model_kinds;
use cotouch_world::MeshSurface;
use cotouch_world::local::{
    FingerForces, FrameCompliance, LocalContact, LocalFinger, LocalGains, LocalLaw, LocalTick, Slots,
    SoftContactModel, StickingContacts, SurfaceInUse, local_law,
};
use glam::DVec3;
use nalgebra::{DMatrix, DVector};

const CONTACTS: usize = 2;
/// Of the contacts, which no law exceeds.
const STIFFEST_N_PER_M: f64 = 350.0;
const TICKS_PER_PERIOD: u64 = 50;
const FINGERS: [DVec3; CONTACTS] = [DVec3::new(0.06, 0.01, 0.02), DVec3::new(-0.03, 0.05, 0.04)];

/// A power of two, so that differences of a linear map have no error but rounding.
const STEP: f64 = 1.0 / 1024.0;

/// Two fingers that hold a tetrahedron for good.
struct Grip {
    law: &'static dyn LocalLaw,
    model: SoftContactModel,
    gains: Slots<LocalGains>,
    surface: MeshSurface,
    compliance: DMatrix<f64>,
    contacts: Vec<LocalContact>,
}

/// The inputs of a law, and its state before the tick.
#[derive(Clone)]
struct Start {
    fingers: [DVec3; CONTACTS],
    frame_forces: [DVec3; CONTACTS],
    state: DVector<f64>,
}

impl Grip {
    fn new(kind: &str) -> Self {
        let overrides = [format!("local_model.kind={kind}"), "local_model.sides=two".to_owned()];
        let overrides: Vec<_> = overrides.iter().map(|text| text.parse().unwrap()).collect();
        let scene: Scene = cotouch_scene::load("spring", &overrides).unwrap();
        let model = SoftContactModel::new(&scene);
        let gains =
            [200.0, STIFFEST_N_PER_M].map(|ko| LocalGains::new(&scene.local_model, ko, TICKS_PER_PERIOD));
        let corners = [DVec3::splat(0.04), DVec3::new(-0.05, -0.04, 0.04), DVec3::new(-0.04, 0.05, -0.04)];
        let vertices = [corners.as_slice(), &[DVec3::new(0.04, -0.04, -0.05)]].concat();
        let surface = MeshSurface::new(vertices, &[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]).unwrap();
        let mut grip = Self {
            law: local_law(scene.local_model.kind),
            model,
            gains: gains.into_iter().collect(),
            surface,
            compliance: compliance(),
            contacts: vec![LocalContact::default(); CONTACTS],
        };
        let surface = still(&grip.surface);
        for (contact, finger) in grip.contacts.iter_mut().zip(FINGERS) {
            contact.hold_nearest(&grip.model, &surface, finger);
        }
        grip
    }

    fn rest(&self) -> Start {
        let states = CONTACTS * self.law.states().len();
        Start { fingers: FINGERS, frame_forces: [DVec3::ZERO; CONTACTS], state: DVector::zeros(states) }
    }

    /// The forces and the next state.
    fn tick(&self, start: &Start) -> (DVector<f64>, DVector<f64>) {
        let states = self.law.states();
        let mut contacts = self.contacts.clone();
        let mut before = start.state.iter();
        for contact in &mut contacts {
            states.iter().for_each(|&state| *contact.state_mut(state) = *before.next().unwrap());
        }
        let forces = self.forces(start, &mut contacts);
        let after = contacts
            .iter_mut()
            .flat_map(|contact| states.iter().map(|&state| *contact.state_mut(state)).collect::<Vec<_>>());
        (stacked(&forces), DVector::from_iterator(start.state.len(), after))
    }

    fn forces(&self, start: &Start, contacts: &mut [LocalContact]) -> FingerForces {
        let compliance = self.compliance.transpose();
        let tick = LocalTick {
            model: &self.model,
            gains: self.gains.clone(),
            surface: still(&self.surface),
            frame: FrameCompliance {
                slots: &[0, 1],
                compliance: compliance.as_slice(),
                forces_n: &start.frame_forces,
            },
            begins_period: true,
        };
        let fingers =
            start.fingers.map(|centre| LocalFinger { place: Some((centre, DVec3::ZERO)), fade: 1.0 });
        self.law.forces(&tick, contacts, &fingers)
    }

    fn assert_is_linear_block(&self, kind: &str) {
        let normals: Vec<DVec3> = self.contacts.iter().map(|contact| contact.normal).collect();
        let block = self.law.linear(&StickingContacts {
            model: &self.model,
            gains: &self.gains,
            normals: &normals,
            compliance: Some(&self.compliance),
        });
        let (rest_force, rest_state) = self.tick(&self.rest());
        assert!(rest_force.amax() < 1e-12 && rest_state.amax() < 1e-12, "{kind}: rest is no rest");
        assert!(block.d.amax() > 1.0, "{kind}: a block without content agrees with anything");
        for input in 0..block.d.ncols() {
            let mut start = self.rest();
            let (contact, axis) = (input / 3 % CONTACTS, input % 3);
            if input < 3 * CONTACTS {
                // e = x_a + o − x_h
                start.fingers[contact][axis] -= STEP;
            } else {
                start.frame_forces[contact][axis] = STEP;
            }
            self.assert_column(kind, &start, (&block.d, &block.b), input);
        }
        for number in 0..block.a.nrows() {
            let mut start = self.rest();
            start.state[number] = STEP;
            self.assert_column(kind, &start, (&block.c, &block.a), number);
        }
    }

    /// A tick from `start`, which is a step away from rest, moves forces and state as a column of both matrices says.
    fn assert_column(&self, kind: &str, start: &Start, by: (&DMatrix<f64>, &DMatrix<f64>), column: usize) {
        let (force, state) = self.tick(start);
        for (moved, matrix) in [(force, by.0), (state, by.1)].iter().filter(|(moved, _)| !moved.is_empty()) {
            let error = (moved / STEP - matrix.column(column)).amax();
            assert!(error <= 1e-12 * STIFFEST_N_PER_M, "{kind}: column {column} is off by {error}");
        }
    }
}

fn still(surface: &MeshSurface) -> SurfaceInUse<'_> {
    SurfaceInUse { latest: surface, before_m: &[], share: 1.0, speed_per_s: 0.0 }
}

/// Symmetric, positive, and far from diagonal, m/N.
fn compliance() -> DMatrix<f64> {
    let root = DMatrix::from_fn(6, 6, |row, column| 0.03 * ((row * 7 + column * 5 + 1) as f64).sin());
    &root * root.transpose() + DMatrix::identity(6, 6) * 1e-3
}

fn stacked(forces: &FingerForces) -> DVector<f64> {
    DVector::from_iterator(3 * CONTACTS, forces.iter().flat_map(|force| force.to_array()))
}

#[test]
fn step_and_linear_block_are_the_same_map() {
    assert!(local_model_kinds().len() >= 4);
    for kind in local_model_kinds() {
        Grip::new(&kind).assert_is_linear_block(&kind);
    }
}
