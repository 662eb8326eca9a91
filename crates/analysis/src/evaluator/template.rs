//! Loops that were compiled once, whose numbers follow the keys.

use std::ops::RangeInclusive;
use std::sync::Mutex;

use cotouch_scene::{Scene, with_override};
use nalgebra::DMatrix;

use super::forms::{Form, fit_points};
use crate::compile::compile;
use crate::discretise::BodyStep;
use crate::lift::layout::{Layout, Registers};
use crate::lift::program::Program;
use crate::lift::stepping::Run;
use crate::loop_spec::{Dynamics, Estimate, Force, LoopSpec, Signal};
use crate::operating_point::has_surface;
use crate::poles::{check_size, has_outgrown, poles_of, structure};
use crate::rigid::Structure;
use crate::symmetry::{Share, split};
use crate::verdict::{PointVerdict, is_stable};
use cotouch_matrix::spectral_radius;

/// All contact modes of a scene, for any values of one or two keys.
#[derive(Debug)]
pub(super) struct Template {
    /// Values of each key that the scene allows, whatever the other keys are.
    allowed: Vec<RangeInclusive<f64>>,
    /// Every function of the keys that there is, once.
    forms: Vec<Form>,
    parts: Vec<TemplatePart>,
    /// What a thread works on; there are as many as threads once worked at a time.
    spare: Mutex<Vec<Scratch>>,
}

/// One share of one contact mode.
#[derive(Debug)]
struct TemplatePart {
    share: Share,
    layout: Layout,
    program: Program,
    /// Places among the share's numbers, and their forms.
    numbers: Vec<(usize, usize)>,
    /// The same for the program's factors.
    factors: Vec<(usize, usize)>,
    /// Places of bodies whose own dynamics depend on the keys.
    bodies: Vec<usize>,
    /// None where it is another one at every point.
    structure: Option<Structure>,
}

#[derive(Debug, Default)]
struct Scratch {
    values: Vec<f64>,
    run: Run,
    parts: Vec<(LoopSpec, Program)>,
}

/// The loops at one point.
struct PointLoops {
    shares: Vec<Share>,
    programs: Vec<Program>,
    /// For each share.
    numbers: Vec<Vec<f64>>,
    factors: Vec<Vec<f64>>,
    maps: Vec<DMatrix<f64>>,
}

impl Template {
    /// Nothing where there is more to a point than its numbers.
    pub(super) fn new(scene: &Scene, keys: &[&str]) -> Option<Self> {
        let has_surfaces = scene.world_bodies().iter().any(|body| has_surface(&body.shape));
        if has_surfaces
            || scene.soft.exists()
            || !(1..=2).contains(&keys.len())
            || !keys.iter().all(|key| is_gain_or_mass(key))
        {
            return None;
        }
        let allowed: Vec<_> = keys.iter().map(|key| allowed(scene, key)).collect::<Option<_>>()?;
        let sample = |point: &Vec<f64>| PointLoops::new(scene, keys, point);
        let fit: Vec<_> = fit_points(keys.len()).iter().map(sample).collect::<Option<_>>()?;
        let at = check_points(&allowed);
        let checks: Vec<_> = at.iter().map(sample).collect::<Option<_>>()?;
        let first = fit.first()?;
        if !fit.iter().chain(&checks).all(|sample| sample.is_like(first)) {
            return None;
        }
        let mut forms = Forms { fit: &fit, at: &at, checks: &checks, forms: Vec::new() };
        let parts = (0..first.shares.len()).map(|index| forms.part(index)).collect::<Option<_>>()?;
        Some(Self { allowed, forms: forms.forms, parts, spare: Mutex::default() })
    }

    /// Nothing where a value is out of range or a number vanishes.
    pub(super) fn at(&self, keys: &[f64]) -> Option<PointVerdict> {
        if !self.allowed.iter().zip(keys).all(|(range, key)| range.contains(key)) {
            return None;
        }
        let mut workspace = self.spare.lock().ok()?.pop().unwrap_or_else(|| self.workspace());
        let verdict = self.judge(&mut workspace, keys);
        self.spare.lock().ok()?.push(workspace);
        verdict
    }

    fn workspace(&self) -> Scratch {
        let parts = self.parts.iter().map(|part| (part.share.spec.clone(), part.program.clone())).collect();
        Scratch { parts, ..Scratch::default() }
    }

    fn judge(&self, workspace: &mut Scratch, keys: &[f64]) -> Option<PointVerdict> {
        let Scratch { values, run, parts } = workspace;
        values.clear();
        values.extend(self.forms.iter().map(|form| form.value(keys)));
        if !values.iter().all(|value| value.is_normal()) {
            return None;
        }
        let mut worst = PointVerdict::NONE;
        for (part, (spec, program)) in self.parts.iter().zip(parts) {
            worst = worst.and(part.judge(values, run, spec, program)?);
        }
        Some(worst)
    }
}

impl TemplatePart {
    /// Nothing where the eigenvalues were not found.
    fn judge(
        &self,
        values: &[f64],
        run: &mut Run,
        spec: &mut LoopSpec,
        program: &mut Program,
    ) -> Option<PointVerdict> {
        if !self.bodies.is_empty() || self.structure.is_none() {
            let mut numbers = numbers(spec);
            self.numbers.iter().for_each(|&(place, form)| *numbers[place] = values[form]);
        }
        program.set_factors(&self.factors, values);
        if !self.bodies.is_empty() {
            let period_s = spec.schedule.control().period_s();
            for (body, step) in program.steps().filter(|(body, _)| self.bodies.contains(body)) {
                *step = BodyStep::new(&spec.bodies[body], period_s);
            }
        }
        let map = run.pattern(program);
        if has_outgrown(&map) {
            return Some(PointVerdict { spectral_radius: f64::INFINITY, stable: false });
        }
        let fresh;
        let structure = match &self.structure {
            Some(known) => known,
            None => {
                fresh = Structure::new(spec, &self.layout, &map);
                &fresh
            }
        };
        let loose = structure.loose.len();
        let radius = spectral_radius(&poles_of(map, structure).ok()?);
        let spectral_radius = if loose > 0 { radius.max(1.0) } else { radius };
        Some(PointVerdict { spectral_radius, stable: is_stable(spectral_radius, loose) })
    }
}

/// Keys that the scene relates to no other key: any value in a range is allowed.
fn is_gain_or_mass(key: &str) -> bool {
    ["_n_per_m", "_n_s_per_m", "_n_m_per_rad", "_n_m_s_per_rad", ".mass_kg"]
        .iter()
        .any(|unit| key.ends_with(unit))
}

/// From the least to the largest of some values that the scene allows.
fn allowed(scene: &Scene, key: &str) -> Option<RangeInclusive<f64>> {
    let sizes = || (-4..=7).map(|power| 10f64.powi(power));
    let tried = sizes().rev().map(|size| -size).chain(sizes());
    let mut good = tried.filter(|&value| with_override(scene, key, value).is_ok());
    let least = good.next()?;
    Some(least..=good.next_back()?)
}

/// Apart from the points of the fit, over the range of magnitudes.
fn check_points(allowed: &[RangeInclusive<f64>]) -> Vec<Vec<f64>> {
    const SHARES: [[f64; 2]; 5] = [[3.0, 0.7], [0.3, 11.0], [700.0, 0.05], [0.05, 900.0], [350.0, 650.0]];
    let mut points: Vec<Vec<f64>> =
        SHARES.iter().map(|point| point.iter().copied().take(allowed.len()).collect()).collect();
    for (index, range) in allowed.iter().enumerate() {
        if range.contains(&-0.5) {
            let mut point = points[0].clone();
            point[index] = -0.5;
            points.push(point);
        }
    }
    points
}

impl PointLoops {
    fn new(scene: &Scene, keys: &[&str], point: &[f64]) -> Option<Self> {
        let mut scene = scene.clone();
        for (key, &value) in keys.iter().zip(point) {
            scene = with_override(&scene, key, value).ok()?;
        }
        let modes = compile(&scene);
        let are_fine = modes.iter().all(|mode| check_size(&mode.spec).is_ok());
        let mut shares: Vec<Share> = modes.iter().flat_map(|mode| split(&mode.spec)).collect();
        let of_share =
            |share: &Share| Program::new(&share.spec, &Layout::new(&share.spec, Registers::Shared));
        let mut programs: Vec<Program> = shares.iter().map(of_share).collect();
        let maps = programs.iter().map(|program| Run::default().pattern(program)).collect();
        let read = |share: &mut Share| numbers(&mut share.spec).into_iter().map(|number| *number).collect();
        let numbers = shares.iter_mut().map(read).collect();
        let factors = programs.iter_mut().map(|program| program.factors().map(|factor| *factor).collect());
        let factors = factors.collect();
        are_fine.then_some(Self { shares, programs, numbers, factors, maps })
    }

    /// Whether all is the same but for numbers, none of which is 0 in one and not in the other.
    fn is_like(&self, other: &Self) -> bool {
        let blank = |share: &Share| {
            let mut share = share.clone();
            for number in numbers(&mut share.spec) {
                *number = f64::from(u8::from(*number != 0.0));
            }
            share
        };
        let lengths = |sample: &Self| sample.factors.iter().map(Vec::len).collect::<Vec<_>>();
        let same_places = |one: &Program, other: &Program| one.has_the_places_of(other);
        self.shares.len() == other.shares.len()
            && lengths(self) == lengths(other)
            && self.shares.iter().zip(&other.shares).all(|(one, other)| blank(one) == blank(other))
            && self.programs.iter().zip(&other.programs).all(|(one, other)| same_places(one, other))
    }
}

/// Forms that are being collected.
struct Forms<'a> {
    fit: &'a [PointLoops],
    at: &'a [Vec<f64>],
    checks: &'a [PointLoops],
    forms: Vec<Form>,
}

impl Forms<'_> {
    fn part(&mut self, index: usize) -> Option<TemplatePart> {
        let first = &self.fit[0];
        let numbers = self.places(|sample| &sample.numbers[index])?;
        let factors = self.places(|sample| &sample.factors[index])?;
        let share = first.shares[index].clone();
        let layout = Layout::new(&share.spec, Registers::Shared);
        let bodies = share.spec.bodies.iter().enumerate().filter(|(body, known)| {
            let dynamics = |sample: &PointLoops| sample.shares[index].spec.bodies[*body].dynamics.clone();
            self.fit.iter().any(|sample| dynamics(sample) != known.dynamics)
        });
        let bodies = bodies.map(|(body, _)| body).collect();
        let structure = self.structure(index, &layout);
        let program = first.programs[index].clone();
        Some(TemplatePart { share, layout, program, numbers, factors, bodies, structure })
    }

    /// The one that all samples have.
    fn structure(&self, index: usize, layout: &Layout) -> Option<Structure> {
        let of = |sample: &PointLoops| structure(&sample.shares[index], layout, &sample.maps[index]);
        let known = of(&self.fit[0]);
        self.fit.iter().chain(self.checks).all(|sample| of(sample) == known).then_some(known)
    }

    /// Where the keys have an effect, and the forms of that.
    fn places(&mut self, of: impl Fn(&PointLoops) -> &[f64]) -> Option<Vec<(usize, usize)>> {
        let mut places = Vec::new();
        for place in 0..of(&self.fit[0]).len() {
            let value = |sample: &PointLoops| of(sample)[place];
            let fit: Vec<f64> = self.fit.iter().map(value).collect();
            let checks: Vec<f64> = self.checks.iter().map(value).collect();
            if fit.iter().chain(&checks).any(|&other| other != fit[0]) {
                let form = Form::through(&fit, self.at, &checks)?;
                places.push((place, self.place_of(form)));
            }
        }
        Some(places)
    }

    fn place_of(&mut self, form: Form) -> usize {
        self.forms.iter().position(|known| *known == form).unwrap_or_else(|| {
            self.forms.push(form);
            self.forms.len() - 1
        })
    }
}

/// Every number of a loop, in an order that depends on nothing but how many there are.
fn numbers(spec: &mut LoopSpec) -> Vec<&mut f64> {
    let mut numbers: Vec<&mut f64> = Vec::new();
    for body in &mut spec.bodies {
        match &mut body.dynamics {
            Dynamics::Plant(plant) => {
                numbers.extend(plant.a.iter_mut().chain(plant.b.iter_mut()).chain(plant.c.iter_mut()));
            }
            Dynamics::Sensed { plant, estimate } => {
                numbers.extend(plant.a.iter_mut().chain(plant.b.iter_mut()).chain(plant.c.iter_mut()));
                if let Estimate::Filtered { cutoff_rad_per_s } = estimate {
                    numbers.push(cutoff_rad_per_s);
                }
            }
            Dynamics::Mass { mass_kg, .. } => numbers.push(mass_kg),
            Dynamics::Rigid { mass_kg, inertia, .. } => {
                numbers.push(mass_kg);
                let [x, y, z] = [&mut inertia.x_axis, &mut inertia.y_axis, &mut inertia.z_axis];
                numbers.extend([x, y, z].into_iter().flat_map(AsMut::<[f64; 3]>::as_mut));
            }
        }
    }
    for line in &mut spec.lines {
        if let Signal::Force(coupling) = &mut line.signal {
            numbers.extend(coupling.terms.iter_mut().map(|term| &mut term.gain));
        }
    }
    for action in &mut spec.actions {
        if let Force::Gains(coupling) = &mut action.force {
            numbers.extend(coupling.terms.iter_mut().map(|term| &mut term.gain));
        }
    }
    numbers
}
