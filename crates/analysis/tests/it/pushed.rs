//! Fig 6.1 (b) and (c) in time: one user pushes, the other is absent. Written out for two hosts, with nothing in common
//! with the analysis but the scene.

use cotouch_scene::scene::{Architecture, Scene, SpringDamper};
use nalgebra::Complex;

#[derive(Clone, Copy, Debug, Default)]
struct Point {
    x: f64,
    v: f64,
}

impl Point {
    /// Under a constant force.
    fn step(&mut self, force: f64, mass_kg: f64, duration_s: f64) {
        let a = force / mass_kg;
        self.x += duration_s * (self.v + 0.5 * duration_s * a);
        self.v += duration_s * a;
    }
}

fn pull(spring: SpringDamper, end: Point, anchor: Point) -> f64 {
    spring.stiffness_n_per_m * (anchor.x - end.x) + spring.damping_n_s_per_m * (anchor.v - end.v)
}

/// Of 1 N, on the hand.
pub(crate) enum Force {
    Constant,
    /// cos(ω·t).
    Sinusoidal(f64),
    /// The same, held from network instant to network instant.
    HeldSinusoidal(f64),
}

/// What was sampled at one network instant.
#[derive(Clone, Copy, Debug, Default)]
struct Sample {
    hand: Point,
    own: Point,
    other: Point,
    force: f64,
}

/// Distributed: the first user's hand and both copies. Centralized: the second user's hand and the server's object.
pub(crate) struct Pushed<'a> {
    scene: &'a Scene,
    ratio: usize,
    substeps: usize,
    hand: Point,
    own: Point,
    other: Point,
    samples: Vec<Sample>,
    /// Position and velocity of the hand: before each substep (none kept but those of the tail), at network instants.
    fine: Vec<Point>,
    instants: Vec<Point>,
}

impl<'a> Pushed<'a> {
    pub(crate) fn new(scene: &'a Scene, substeps: usize) -> Self {
        Self {
            scene,
            ratio: scene.schedule().ticks_per_pattern() as usize,
            substeps,
            hand: Point::default(),
            own: Point::default(),
            other: Point::default(),
            samples: Vec::new(),
            fine: Vec::new(),
            instants: Vec::new(),
        }
    }

    fn tick_s(&self) -> f64 {
        self.scene.rates.control_hz.period_s()
    }

    pub(crate) fn run(&mut self, duration_s: f64, force: &Force) {
        let periods = (duration_s / (self.tick_s() * self.ratio as f64)).ceil() as usize;
        for tick in 0..periods * self.ratio {
            self.tick(tick, force);
        }
    }

    fn tick(&mut self, tick: usize, force: &Force) {
        let step = tick / self.ratio;
        if tick.is_multiple_of(self.ratio) {
            self.instants.push(self.hand);
            self.samples.push(Sample { hand: self.hand, own: self.own, other: self.other, force: 0.0 });
            let held = self.held(step);
            let remote = self.scene.coupling.remote_hand_object;
            // The server's force on the hand goes back at once: all of the delay is on the way there.
            self.samples[step].force = pull(remote, held.hand, self.own);
        }
        let held = self.held(step);
        let (on_hand, on_own, on_other) = self.forces(&held, step);
        let substep_s = self.tick_s() / self.substeps as f64;
        for substep in 0..self.substeps {
            self.fine.push(self.hand);
            let middle_s = tick as f64 * self.tick_s() + (substep as f64 + 0.5) * substep_s;
            let push = match *force {
                Force::Constant => 1.0,
                Force::Sinusoidal(frequency) => (frequency * middle_s).cos(),
                Force::HeldSinusoidal(frequency) => {
                    (frequency * (step * self.ratio) as f64 * self.tick_s()).cos()
                }
            };
            self.hand.step(on_hand + push, self.scene.hand.mass_kg, substep_s);
        }
        let (mass_kg, tick_s) = (self.scene.object.mass_kg, self.tick_s());
        self.own.step(on_own, mass_kg, tick_s);
        self.other.step(on_other, mass_kg, tick_s);
    }

    /// The samples in use: none before the first ones arrive.
    fn held(&self, step: usize) -> Sample {
        let n = self.scene.link.delay_periods as usize;
        step.checked_sub(n).map_or_else(Sample::default, |sampled| self.samples[sampled])
    }

    fn forces(&self, held: &Sample, step: usize) -> (f64, f64, f64) {
        let coupling = &self.scene.coupling;
        let damper =
            SpringDamper { stiffness_n_per_m: 0.0, damping_n_s_per_m: self.scene.object.damping_n_s_per_m };
        let ground = |point: Point| pull(damper, point, Point::default());
        match self.scene.session.architecture {
            Architecture::Centralized => {
                let on_object = pull(coupling.remote_hand_object, self.own, held.hand);
                (self.samples[step].force, on_object + ground(self.own), 0.0)
            }
            Architecture::Distributed => {
                let on_own = pull(coupling.hand_object, self.own, self.hand)
                    + pull(coupling.object_object, self.own, held.other);
                let on_other = pull(coupling.remote_hand_object, self.other, held.hand)
                    + pull(coupling.object_object, self.other, held.own);
                let on_hand = pull(coupling.hand_object, self.hand, self.own);
                (on_hand, on_own + ground(self.own), on_other + ground(self.other))
            }
        }
    }

    pub(crate) fn velocity_at_last_instant(&self) -> f64 {
        self.instants[self.instants.len() - 1].v
    }

    pub(crate) fn mean_velocity_of_last_period(&self) -> f64 {
        let [.., before, last] = self.instants[..] else { panic!("too short a run") };
        (last.x - before.x) / (self.tick_s() * self.ratio as f64)
    }

    /// Of the velocity, over the last so many network periods, per N.
    pub(crate) fn fundamental(&self, frequency_rad_s: f64, network_periods: u32) -> Complex<f64> {
        let substep_s = self.tick_s() / self.substeps as f64;
        let count = network_periods as usize * self.ratio * self.substeps;
        let first = self.fine.len() - count;
        let middle = |index: usize| {
            let next = self.fine.get(index + 1).unwrap_or(&self.hand);
            let mean_velocity = (next.x - self.fine[index].x) / substep_s;
            Complex::from_polar(mean_velocity, -frequency_rad_s * (index as f64 + 0.5) * substep_s)
        };
        (first..self.fine.len()).map(middle).sum::<Complex<f64>>() * (2.0 / count as f64)
    }

    /// Of the velocity at network instants.
    pub(crate) fn fundamental_at_instants(&self, frequency_rad_s: f64, network_periods: u32) -> Complex<f64> {
        let period_s = self.tick_s() * self.ratio as f64;
        let count = network_periods as usize;
        let first = self.instants.len() - count;
        let turned = |index: usize| {
            Complex::from_polar(self.instants[index].v, -frequency_rad_s * index as f64 * period_s)
        };
        (first..self.instants.len()).map(turned).sum::<Complex<f64>>() * (2.0 / count as f64)
    }
}
