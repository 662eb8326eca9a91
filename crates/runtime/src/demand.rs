//! What the scripts of a scene ask of the devices, found by running them in virtual time with every limit lifted.
//!
//! Below all limits a loop is the linear one of the analysis, and this run is the session's own, tick by tick. What is found
//! is the largest force and the largest change of force within a tick, with user, finger and time, soft start
//! included. The run goes on until every script has come to its end and nothing changes any more, and repeated scripts have gone
//! through three times; what only goes on for very long is cut ([`shortening`]). It lasts at most [`LONGEST_S`] of session time,
//! less where there are many fingers ([`MAX_FINGER_TICKS`]). Where that ends it, or where a steady state does not
//! come, the answer says so.

mod progress;
mod shortening;
mod stillness;

use cotouch_device::SimulatedUser;
use cotouch_scene::limits::MAX_FINGERS;
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Scene, SceneValues, SpringDamper};
use cotouch_scene::{AskedForce, DemandExtent, ScriptedDemand};
use glam::DVec3;

use crate::record::TickRecord;
use crate::virtual_time::VirtualSession;
use progress::{News, Progress};
use shortening::{longest_action_s, shorten};
use stillness::Stillness;

/// The longest run, s of session time.
const LONGEST_S: f64 = 300.0;
/// The longest run in ticks of each finger at each host: some seconds of work.
const MAX_FINGER_TICKS: u64 = 2_500_000;
/// So often it is looked whether there is more to see, s.
const LOOK_S: f64 = 0.25;
/// The largest force and change of force that a scene may allow, N and N/s: as good as none.
const UNLIMITED: (f64, f64) = (1e3, 1e9);

/// Runs the scripts of `scene` with its limits of force, slew and torque and its passivity controller lifted, and tells the largest
/// forces that they ask for. It is given up, and is then about what was seen so far, when `wanted` says no; it is asked four times in a
/// second of session time. The same scene gives the same answer.
#[must_use]
pub fn scripted_demand(scene: &Scene, wanted: &dyn Fn() -> bool) -> ScriptedDemand {
    let mut peaks = Peaks::new(scene);
    let extent = run(scene, wanted, &mut peaks).unwrap_or_else(|why| DemandExtent::NotRun { why });
    ScriptedDemand { extent, ..peaks.found }
}

/// Runs `scene` unlimited for as long as there is more to see.
fn run(scene: &Scene, wanted: &dyn Fn() -> bool, peaks: &mut Peaks) -> Result<DemandExtent, String> {
    let longest_s = longest_action_s(scene);
    let prepare = |values: &mut SceneValues| {
        lift_limits(values);
        values.users.iter_mut().for_each(|user| shorten(user, longest_s));
    };
    let unlimited = scene.edit(prepare).map_err(|error| error.to_string())?;
    let device = |host| SimulatedUser::new(&unlimited, host).map_err(|error| error.to_string());
    let mut devices = unlimited.hosts().map(device).collect::<Result<Vec<_>, _>>()?.into_iter();
    let mut session =
        VirtualSession::with_devices(&unlimited, |_| (devices.next().expect("a device for each host"), None))
            .map_err(|error| error.to_string())?;
    if !session.run_to_tick(0, |_, _| {}) {
        return Err("the hosts cannot join over the simulated link".to_owned());
    }
    let control = unlimited.rates.control_hz;
    let (mut progress, mut stillness) = (Progress::new(scene, longest_s), Stillness::new(scene, LOOK_S));
    let (last, look) = (last_tick(&unlimited), control.ticks_in(LOOK_S));
    let mut tick = 0;
    while tick < last && wanted() {
        tick = (tick + look).min(last);
        let mut diverged_at_s = None;
        session.run_to_tick(tick, |host, record| {
            peaks.observe(host, record);
            stillness.observe(host, record);
            if record.diverged && diverged_at_s.is_none() {
                diverged_at_s = Some(record.instant.as_secs_f64());
            }
        });
        if let Some(at_s) = diverged_at_s {
            return Ok(DemandExtent::Diverged { at_s });
        }
        let News { goes_on, cut_ended } =
            progress.observe(session.hosts().iter().map(|host| &host.station.device));
        if cut_ended && !stillness.is_steady() {
            break;
        }
        if goes_on {
            stillness.begin_anew();
        } else {
            stillness.look();
        }
        if progress.is_done(stillness.is_steady()) {
            return Ok(DemandExtent::Whole);
        }
    }
    Ok(DemandExtent::Until { at_s: tick as f64 * control.period_s() })
}

/// Nothing stands between what is asked of devices and what they render.
fn lift_limits(scene: &mut SceneValues) {
    let (force_n, slew_n_per_s) = UNLIMITED;
    scene.governor.max_force_n = force_n;
    scene.governor.max_slew_n_per_s = slew_n_per_s;
    scene.governor.passivity_control = false;
    scene.device.max_joint_torque_n_m = 0.0;
}

/// The last tick that may be looked at.
fn last_tick(scene: &Scene) -> u64 {
    let fingers: usize = scene.users.iter().map(|user| user.fingers.len().max(1)).sum();
    let budget = MAX_FINGER_TICKS / (fingers * scene.users.len().max(1)) as u64;
    scene.rates.control_hz.ticks_in(LONGEST_S).min(budget)
}

/// The largest forces so far.
struct Peaks<'a> {
    scene: &'a Scene,
    /// What every device renders whatever it touches.
    rendered: SpringDamper,
    /// What reached each finger at its last tick, N; of each host.
    before: Vec<[DVec3; MAX_FINGERS]>,
    found: ScriptedDemand,
}

impl<'a> Peaks<'a> {
    fn new(scene: &'a Scene) -> Self {
        let rendered = scene.hand_impedance().rendered;
        let before = vec![[DVec3::ZERO; MAX_FINGERS]; scene.users.len()];
        Self { scene, rendered, before, found: ScriptedDemand::default() }
    }

    fn observe(&mut self, host: HostIndex, record: &TickRecord) {
        let scene = self.scene;
        for finger in 0..record.requested.len() {
            let named = |newtons| {
                let user = scene.users[host.index()].name.clone();
                AskedForce { newtons, user, finger, at_s: record.instant.as_secs_f64() }
            };
            let asked_n = self.asked(host, finger, record).length();
            raise(&mut self.found.force, asked_n, named);
            let commanded = record.commanded[finger].force;
            let before = std::mem::replace(&mut self.before[host.index()][finger], commanded);
            raise(&mut self.found.change, (commanded - before).length(), named);
        }
    }

    /// What a governor is asked for at a finger, before it fades anything in or out, N.
    fn asked(&self, host: HostIndex, finger: usize, record: &TickRecord) -> DVec3 {
        let SpringDamper { stiffness_n_per_m, damping_n_s_per_m } = self.rendered;
        let reading = &record.readings[finger];
        let start = self.scene.users[host.index()].fingers.get(finger).map(|finger| finger.position_m);
        let away = reading.pose.position - start.unwrap_or_default();
        record.requested[finger].force - stiffness_n_per_m * away - damping_n_s_per_m * reading.twist.linear
    }
}

/// Keeps the larger one.
fn raise(peak: &mut AskedForce, newtons: f64, named: impl FnOnce(f64) -> AskedForce) {
    if newtons > peak.newtons {
        *peak = named(newtons);
    }
}
