//! The one pacing thread of a process: every host's tick at its instant.

use std::sync::atomic::Ordering;
use std::sync::{Arc, PoisonError};

use cotouch_net::ClockMap;
use cotouch_scene::names::HostIndex;
use cotouch_scene::time::Rate;

use crate::clock;
use crate::control::Control;
use crate::failures::catch;
use crate::haptic_host::HapticHost;
use crate::mailbox::Mailbox;
use crate::network_threads::HapticPort;
use crate::observer::{LiveVerdict, Observer};
use crate::priority;

/// Displays are told of at most every this many nanoseconds.
const SNAPSHOT_PERIOD_NS: i64 = 1_000_000_000 / 60;
/// What goes on now is told so often.
const NOW_PERIOD_NS: i64 = 100_000_000;
/// After this time a device that still renders a force is let go of by ending anyway, s.
const LONGEST_RELEASE_S: f64 = 2.0;

/// Runs ticks until a stop is asked for, something fails or `duration_s` is over, then releases the devices. Returns the hosts,
/// whose forces are switched off: also after a panic, which is told.
pub(crate) fn run(
    mut hosts: Vec<HapticHost>,
    rate: Rate,
    duration_s: Option<f64>,
    mut mailbox: Mailbox,
    control: &Arc<Control>,
) -> Vec<HapticHost> {
    let warning = priority::raise_haptic_thread();
    *control.warning.lock().unwrap_or_else(PoisonError::into_inner) = warning;
    let ran = catch(|| {
        if let Some(first) = wait_for_start(&mut hosts, rate, control) {
            run_ticks(&mut hosts, rate, first, duration_s, &mut mailbox, control);
        }
    });
    // However it ended: what a device rendered last it must not go on rendering.
    hosts.iter().for_each(|host| host.switch.disable());
    if let Err(why) = ran {
        control.failures.tell_and_end(format!("the haptic thread failed: {why}"));
    }
    control.ended.store(true, Ordering::Release);
    hosts
}

/// The first tick of this process; `None` when a stop was asked for before the session started.
fn wait_for_start(hosts: &mut [HapticHost], rate: Rate, control: &Control) -> Option<u64> {
    loop {
        if control.is_stopping() {
            return None;
        }
        if hosts.iter_mut().all(|host| host.port.clock().is_some())
            && let Some(map) = hosts[0].port.clock()
        {
            control.started.store(true, Ordering::Release);
            let now = map.session(clock::now());
            return Some(if now.0 < 0 { 0 } else { join_under_way(hosts, rate.last_tick_at(now) + 1) });
        }
        clock::sleep_towards(clock::now().plus_ns(1_000_000));
    }
}

/// A host that comes to a session that is under way takes the world as it finds it; the first host is the world.
fn join_under_way(hosts: &mut [HapticHost], first: u64) -> u64 {
    for host in hosts.iter_mut().filter(|host| host.station.model.host != HostIndex::FIRST) {
        host.station.adopt_world();
    }
    first
}

fn run_ticks(
    hosts: &mut [HapticHost],
    rate: Rate,
    first: u64,
    duration_s: Option<f64>,
    mailbox: &mut Mailbox,
    control: &Control,
) {
    let last = duration_s.map_or(u64::MAX, |duration_s| first.saturating_add(rate.ticks_in(duration_s)));
    control.ends_ns.store(duration_s.map_or(0, |duration_s| (duration_s * 1e9) as u64), Ordering::Relaxed);
    let mut give_up = u64::MAX;
    let mut tick = first;
    let mut next_snapshot_ns = 0;
    let mut next_now_ns = 0;
    loop {
        let Some((due, lateness_ns)) = wait_for_tick(&mut hosts[0].port, rate, tick) else {
            if control.is_stopping() && hosts[0].port.clock().is_none() {
                break;
            }
            continue;
        };
        if control.heartbeat.beat(clock::now()) {
            // Nobody waits for this thread any more: what it renders would be rendered by nobody's will.
            if control.abandoned.load(Ordering::Acquire) {
                break;
            }
            hosts.iter_mut().for_each(HapticHost::resume);
            control.heartbeat.resume();
        }
        let elapsed_ns = rate.instant(due).since(rate.instant(first));
        let is_over = due >= last && elapsed_ns as u64 >= control.go_on_ns.load(Ordering::Relaxed);
        let releasing = give_up != u64::MAX || is_over || control.is_stopping();
        if releasing && give_up == u64::MAX {
            give_up = due.saturating_add(rate.ticks_in(LONGEST_RELEASE_S));
        }
        let shows = elapsed_ns >= next_snapshot_ns;
        mailbox.deliver(hosts);
        for host in hosts.iter_mut() {
            if releasing {
                host.station.release();
            }
            let before_skip = if host.timing.ticks == 0 { due } else { tick };
            host.tick(due, due - before_skip, lateness_ns);
            if shows {
                host.show(due);
            }
        }
        hosts.iter_mut().for_each(|host| host.port.wake_sender());
        if shows {
            next_snapshot_ns = elapsed_ns + SNAPSHOT_PERIOD_NS;
        }
        if elapsed_ns >= next_now_ns {
            next_now_ns = elapsed_ns + NOW_PERIOD_NS;
            let observers = || hosts.iter().map(|host| &host.station.observer);
            control.tell_now(LiveVerdict::combine(observers().map(Observer::now)));
            control.verdict.store(observers().map(Observer::verdict).max());
        }
        if !releasing || control.elapsed_ns.load(Ordering::Relaxed) == 0 {
            // One period on: where this tick ends. The release afterwards is not part of the run.
            let end_ns = elapsed_ns + (1e9 * rate.period_s()) as i64;
            control.elapsed_ns.store(end_ns as u64, Ordering::Relaxed);
        }
        if releasing && (hosts.iter().all(|host| host.station.is_released()) || due >= give_up) {
            break;
        }
        tick = due + 1;
    }
}

/// Waits for the instant of `tick`. The tick that is due then (a later one when this comes too late), and how late it
/// is, ns; `None` when it is not yet time.
fn wait_for_tick(port: &mut HapticPort, rate: Rate, tick: u64) -> Option<(u64, i64)> {
    let Some(map): Option<ClockMap> = port.clock() else {
        // The session's clock is gone; look again without keeping the processor.
        clock::sleep_towards(clock::now().plus_ns(1_000_000));
        return None;
    };
    let instant = map.local(rate.instant(tick));
    let now = clock::sleep_towards(instant);
    if now < instant {
        return None;
    }
    let due = rate.last_tick_at(map.session(now)).max(tick);
    Some((due, now.since(map.local(rate.instant(due))).max(0)))
}
