//! After an outage of the network hands feel what the analysis says: the running session, in virtual time, with hands that push as
//! predicted.
//!
//! What is measured is what the pushes add: the same session with the same outage, with and without them.

use std::sync::Arc;

use cotouch_analysis::{FingerPush, Outage, OutageDirection, outages};
use cotouch_device::{Device, DeviceError, DeviceLimits, ForceSwitch, SimulatedUser, WorldView};
use cotouch_runtime::{TickRecord, VirtualSession};
use cotouch_scene::geometry::{Readings, Wrench, Wrenches};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Action, Impairment, Scene, SceneValues, Way};
use cotouch_testkit::scenes::{built_in, edited};
use glam::DVec3;

/// How hard hands push, as a share of the predicted pushes of 1 N: nothing slides, nothing is limited.
const SHARE: f64 = 0.005;
/// A linear session does what is predicted but for rounding and what friction and turning add.
const LINEAR: f64 = 0.01;
/// Where what came apart is brought together, bodies that turn do so not quite linearly.
const BROUGHT_TOGETHER: f64 = 0.02;
/// Where hosts let go of each other, when exactly depends on when pings are due.
const LET_GO: f64 = 0.1;

/// Small pushes would stick on a ground with friction.
const SMOOTH: [&str; 2] = ["ground.friction_coefficient=0", "ground.rotational_friction_coefficient=0"];

/// A user whose fingers also push constantly from a tick on.
#[derive(Clone)]
struct Pushing {
    user: SimulatedUser,
    forces_n: Vec<DVec3>,
    from_tick: u64,
    tick: u64,
}

impl Device for Pushing {
    fn name(&self) -> &str {
        self.user.name()
    }

    fn fingers(&self) -> usize {
        self.user.fingers()
    }

    fn limits(&self) -> DeviceLimits {
        self.user.limits()
    }

    fn force_switch(&self) -> Arc<dyn ForceSwitch> {
        self.user.force_switch()
    }

    fn start(&mut self, tick: u64) {
        self.user.start(tick);
    }

    fn recentre(&mut self, position: DVec3) {
        self.user.recentre(position);
    }

    fn observe(&mut self, view: &WorldView<'_>) {
        self.user.observe(view);
    }

    fn read(&mut self, tick: u64) -> Result<Readings, DeviceError> {
        self.tick = tick;
        self.user.read(tick)
    }

    fn write(&mut self, wrenches: &[Wrench]) -> Result<(), DeviceError> {
        let pushes = if self.tick >= self.from_tick { &self.forces_n[..] } else { &[] };
        let mut sums: Wrenches = wrenches.iter().copied().collect();
        sums.iter_mut().zip(pushes).for_each(|(sum, push)| sum.force += *push);
        self.user.write(&sums)
    }

    fn rendered(&self) -> Wrenches {
        self.user.rendered()
    }
}

/// Forces at all fingers of all hosts, and the places of the first bodies, tick by tick from the beginning of the outage on.
struct Run {
    forces: Vec<Vec<DVec3>>,
    bodies: Vec<Vec<DVec3>>,
}

/// An outage as it is made: when it begins, and whose packets do not arrive.
struct Made<'a> {
    scene: &'a Scene,
    outage: &'a Outage,
    first_step: u64,
}

impl Made<'_> {
    fn impairment(&self) -> Impairment {
        let network = self.scene.rates.network_hz;
        Impairment {
            // Half a period early, so that rounding loses no packet more or less.
            outage_from_s: network.period_s() * (self.first_step as f64 - 0.5),
            outage_duration_s: network.period_s() * f64::from(self.outage.lost_steps),
            ..self.scene.link.impairment.clone()
        }
    }

    fn scene(&self) -> Scene {
        let silent = self.outage.worst.silent.as_ref();
        let silent = silent.map(|name| self.scene.users.iter().position(|user| user.name == *name).unwrap());
        edited(self.scene, |scene| match silent {
            None => scene.link.impairment = self.impairment(),
            Some(from) => {
                let from = HostIndex(from as u8);
                let others = from.others(scene.session.users);
                let way = |to| Way { from, to, impairment: self.impairment() };
                scene.link.ways = others.map(way).collect();
            }
        })
    }

    fn run(&self, share: f64, end_s: f64) -> Run {
        let scene = self.scene();
        let schedule = scene.schedule();
        let begins = schedule.tick_of_step(self.first_step);
        let device = |host: HostIndex| {
            let fingers = scene.users[host.index()].fingers.len();
            let push = |finger: usize| {
                let is_it = |push: &&FingerPush| {
                    push.user == scene.users[host.index()].name && usize::from(push.finger) == finger + 1
                };
                let push = self.outage.worst.pushes.iter().find(is_it).unwrap();
                share * DVec3::from_array(push.force_n)
            };
            let forces_n = (0..fingers).map(push).collect();
            let user = SimulatedUser::new(&scene, host).unwrap();
            (Pushing { user, forces_n, from_tick: begins, tick: 0 }, None)
        };
        let mut session = VirtualSession::with_devices(&scene, device).unwrap();
        assert!(session.run_to_tick(begins, |_, _| {}), "the hosts did not join");
        let ticks = scene.rates.control_hz.ticks_in(end_s);
        let mut run =
            Run { forces: vec![Vec::new(); ticks as usize], bodies: vec![Vec::new(); ticks as usize] };
        session.run_to_tick(begins + ticks, |_, record: &TickRecord| {
            let tick = (scene.rates.control_hz.first_tick_at(record.instant) - begins) as usize;
            run.forces[tick].extend(record.commanded.iter().map(|wrench| wrench.force));
            run.bodies[tick].extend(record.bodies.first().map(|body| body.pose.position));
        });
        run
    }

    /// By pushes of 1 N: the largest force at a finger after the outage, and how far copies of the first body come apart.
    fn measured(&self) -> (f64, f64) {
        let network_s = self.scene.rates.network_hz.period_s();
        let lasts_s = network_s * f64::from(self.outage.lost_steps);
        let ends = self.scene.rates.control_hz.ticks_in(lasts_s) as usize;
        let end_s = lasts_s + (self.outage.whole_again_after_s + 2.0).max(self.outage.worst.after_s + 0.5);
        let (pushed, alone) = (self.run(SHARE, end_s), self.run(0.0, end_s));
        let added = |with: &[DVec3], without: &[DVec3]| {
            let sizes = with.iter().zip(without).map(|(with, without)| (*with - *without).length());
            sizes.fold(0.0, f64::max) / SHARE
        };
        let force =
            pushed.forces.iter().zip(&alone.forces).skip(ends).map(|(with, without)| added(with, without));
        let between =
            |places: &[DVec3]| places.iter().skip(1).map(|place| *place - places[0]).collect::<Vec<_>>();
        let apart = pushed.bodies.iter().zip(&alone.bodies);
        let apart = apart.map(|(with, without)| added(&between(with), &between(without)));
        (force.fold(0.0, f64::max), apart.fold(0.0, f64::max))
    }
}

/// What is predicted and what is measured: the worst over outages that begin at different times.
fn compare(scene: &Scene, begins_s: f64, durations_s: &[f64], copies_move_apart: bool) {
    let predicted = outages(scene, durations_s, &|_| true).unwrap().rows;
    assert!(!predicted.is_empty());
    for outage in &predicted {
        let first_step = (begins_s * scene.rates.network_hz.hz()) as u64;
        let let_go = outage.lets_go_after_s.is_some();
        // Pings, for which hosts wait that both let go, are 125 ms, or 16 network steps, apart.
        let phases = if let_go && outage.direction == OutageDirection::Both { 8 } else { 1 };
        let of_phase = |phase: u64| Made { scene, outage, first_step: first_step + 2 * phase }.measured();
        let measured: Vec<_> = (0..phases).map(of_phase).collect();
        let force = measured.iter().map(|(force, _)| *force).fold(0.0, f64::max);
        let apart = measured.iter().map(|(_, apart)| *apart).fold(0.0, f64::max);
        let label = format!("{} {} s {:?}", scene.name, outage.duration_s, outage.direction);
        println!(
            "{label}: force {:.4} predicted, {force:.4} measured; apart {:.5}, {apart:.5}",
            outage.peak_force_n_per_n, outage.excursion_m_per_n
        );
        let tolerance = match let_go {
            true => LET_GO,
            false if scene.session.rejoin_s > 0.0 => BROUGHT_TOGETHER,
            false => LINEAR,
        };
        assert!(
            (force / outage.peak_force_n_per_n - 1.0).abs() <= tolerance,
            "{label}: {measured:?} {outage:?}"
        );
        // One way, pushes that take copies farthest apart are not those of the largest force.
        if copies_move_apart && !let_go && outage.direction == OutageDirection::Both {
            let error = (apart / outage.excursion_m_per_n - 1.0).abs();
            assert!(error <= LINEAR, "{label}: {measured:?} {outage:?}");
        }
    }
}

/// Hosts that leave it to the couplings to bring together what came apart.
const AT_ONCE: &str = "session.rejoin_s=0";

/// Hands that do nothing of their own accord.
fn relaxed(name: &str, settings: &[&str]) -> Scene {
    edited(&built_in(name, settings), |scene| {
        for user in &mut scene.users {
            user.script = vec![Action::Relax { duration_s: 1000.0 }];
        }
    })
}

#[test]
fn hands_on_an_object_on_a_line() {
    let durations_s = [0.0078125, 0.05, 0.2, 0.6, 3.0];
    compare(&relaxed("single-axis", &[AT_ONCE]), 2.0, &durations_s, true);
    // Those who push one way meet at the largest force, and do not come apart.
    compare(&relaxed("single-axis", &[]), 2.0, &durations_s, false);
}

#[test]
fn three_hands_and_the_average_of_their_copies() {
    for rejoin in [AT_ONCE, "session.rejoin_s=1"] {
        let average = ["session.users=3", "session.coordination=average", "link.delay_periods=0", rejoin];
        compare(&relaxed("single-axis", &average), 2.0, &[0.05, 0.6], false);
    }
}

#[test]
fn hands_on_an_object_that_a_server_keeps() {
    for rejoin in [AT_ONCE, "session.rejoin_s=1.5"] {
        let scene = relaxed("single-axis-centralized", &[rejoin]);
        compare(&scene, 2.0, &[0.0078125, 0.05, 0.2, 0.6, 3.0], false);
    }
}

/// A script that begins as a scene's does and then stays.
fn staying(scene: &mut SceneValues, actions: usize) {
    scene.users.iter_mut().for_each(|user| stay_after(&mut user.script, actions));
}

fn stay_after(script: &mut Vec<Action>, actions: usize) {
    script.truncate(actions);
    script.push(Action::Hold { duration_s: 1000.0 });
}

#[test]
fn two_users_who_hold_a_box() {
    for rejoin in [AT_ONCE, "session.rejoin_s=1.5"] {
        let scene = edited(&built_in("grasp", &[SMOOTH[0], SMOOTH[1], rejoin]), |scene| staying(scene, 2));
        compare(&scene, 7.0, &[0.05, 0.2], false);
    }
}

#[test]
fn one_user_who_holds_a_box_that_another_hosts_too() {
    for (rejoin, durations_s) in [(AT_ONCE, &[0.05, 0.2][..]), ("session.rejoin_s=1.5", &[0.05])] {
        let scene = edited(&built_in("sinusoid", &[rejoin]), |scene| {
            scene.users[0].fingers[0].script = vec![Action::Hold { duration_s: 1000.0 }];
        });
        compare(&scene, 6.0, durations_s, false);
    }
}

#[test]
fn two_users_at_a_soft_block() {
    let scene = edited(&built_in("soft-block", &[AT_ONCE]), |scene| {
        staying(scene, 2);
        scene.users[0].fingers.iter_mut().for_each(|finger| stay_after(&mut finger.script, 2));
    });
    compare(&scene, 7.0, &[0.05, 0.2], false);
}
