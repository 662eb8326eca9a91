//! The thread that takes the force from every device of a session whose haptic thread stands still.
//!
//! Whatever keeps a tick from coming (a device that blocks, a computer that is busy, a fault of the program) leaves devices
//! with the force of the last one. This thread has a real-time priority one step above the haptic thread's, does nothing but
//! wait for [`PATIENCE_NS`] after the last beat, and so wakes fifty times a second while all is well.

use std::io;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::thread;
use std::time::Duration;

use cotouch_device::ForceSwitch;
use cotouch_scene::time::{LocalTime, Rate};

use crate::clock;
use crate::control::Control;
use crate::priority::{HELPER_STACK_BYTES, raise_watchdog_thread};

/// So long after the beginning of the last tick forces are switched off, ns: with the time in which a thread of real-time priority
/// wakes, 20 ms.
const PATIENCE_NS: i64 = 18_000_000;

/// Of haptic rates below 167 Hz: so many periods instead.
const PATIENCE_PERIODS: f64 = 3.0;

/// Before the first tick, and while forces are off, the thread looks so often.
const IDLE_NS: i64 = 5_000_000;

/// A haptic thread that is to end, and does not tick for so long, is not waited for any more, ns.
const ABANDON_NS: i64 = 3_000_000_000;

/// What looks at a heartbeat.
struct Watchdog {
    control: Arc<Control>,
    switches: Vec<Arc<dyn ForceSwitch>>,
    patience_ns: i64,
}

/// Starts the thread for a session of haptic rate `rate`, whose devices have these switches. It ends with the session.
pub(crate) fn start(
    control: &Arc<Control>,
    switches: Vec<Arc<dyn ForceSwitch>>,
    rate: Rate,
) -> io::Result<()> {
    let watchdog = Watchdog::new(control, switches, rate);
    let thread = thread::Builder::new().name("watchdog".to_owned()).stack_size(HELPER_STACK_BYTES);
    thread.spawn(move || {
        raise_watchdog_thread();
        watchdog.watch();
    })?;
    Ok(())
}

impl Watchdog {
    fn new(control: &Arc<Control>, switches: Vec<Arc<dyn ForceSwitch>>, rate: Rate) -> Self {
        let patience_ns = PATIENCE_NS.max((PATIENCE_PERIODS * rate.period_s() * 1e9) as i64);
        Self { control: Arc::clone(control), switches, patience_ns }
    }

    fn watch(&self) {
        while !self.control.has_ended() {
            let now = clock::now();
            let next = self.look(now);
            thread::sleep(Duration::from_nanos(next.since(now).max(0) as u64));
        }
        self.switch_off();
    }

    /// Looks once, and says when to look again.
    fn look(&self, now: LocalTime) -> LocalTime {
        let Control { heartbeat, failures, .. } = &*self.control;
        let Some(last) = heartbeat.last() else { return now.plus_ns(IDLE_NS) };
        let due = last.plus_ns(self.patience_ns);
        if now < due {
            return due;
        }
        if !heartbeat.is_off() {
            self.switch_off();
            heartbeat.stop();
        }
        let silent_ns = now.since(last);
        let is_to_end = self.control.is_stopping() || self.control.is_overdue(silent_ns);
        if is_to_end && silent_ns >= ABANDON_NS {
            let seconds = silent_ns / 1_000_000_000;
            failures.tell_and_end(format!(
                "the haptic thread has not ticked for {seconds} s, perhaps because a device blocks it; its forces are off"
            ));
            self.control.abandoned.store(true, Ordering::Release);
        }
        now.plus_ns(IDLE_NS)
    }

    fn switch_off(&self) {
        self.switches.iter().for_each(|switch| switch.disable());
    }
}

#[cfg(test)]
mod tests {
    use cotouch_device::SoftwareSwitch;

    use super::*;

    /// A watchdog of two devices at 1 kHz, and what the devices see.
    fn watchdog(hz: u64) -> (Watchdog, [SoftwareSwitch; 2]) {
        let devices = [SoftwareSwitch::default(), SoftwareSwitch::default()];
        let switches = devices.iter().map(SoftwareSwitch::handle).collect();
        let control = Arc::new(Control::default());
        (Watchdog::new(&control, switches, Rate::new(hz, 1).unwrap()), devices)
    }

    fn at_ms(ms: i64) -> LocalTime {
        LocalTime(ms * 1_000_000)
    }

    fn are_off(devices: &[SoftwareSwitch]) -> bool {
        assert_eq!(devices[0].is_disabled(), devices[1].is_disabled());
        devices[0].is_disabled()
    }

    #[test]
    fn forces_are_off_within_20_ms_of_the_last_tick_wherever_it_looks() {
        for stands_still_after_ms in 0..60 {
            let (watchdog, devices) = watchdog(1000);
            let mut look_at = at_ms(0);
            for ms in 0..=stands_still_after_ms + 20 {
                if ms <= stands_still_after_ms {
                    assert!(!watchdog.control.heartbeat.beat(at_ms(ms)), "{ms}");
                }
                if look_at <= at_ms(ms) {
                    look_at = watchdog.look(at_ms(ms));
                }
                assert!(ms > stands_still_after_ms || !are_off(&devices));
            }
            assert!(are_off(&devices), "stood still after {stands_still_after_ms} ms");
            assert_eq!(watchdog.control.heartbeat.times(), 1);
        }
    }

    #[test]
    fn a_thread_that_stands_still_beyond_the_runs_end_is_not_waited_for() {
        let abandoned_at_ms = |ends_ms: u64, goes_on_ms: u64| {
            let (watchdog, _) = watchdog(1000);
            let control = &watchdog.control;
            control.ends_ns.store(ends_ms * 1_000_000, Ordering::Relaxed);
            control.go_on_ns.store(goes_on_ms * 1_000_000, Ordering::Relaxed);
            // The last tick, half a second after the first.
            control.elapsed_ns.store(500_000_000, Ordering::Relaxed);
            assert!(!control.heartbeat.beat(at_ms(0)));
            (0..10_000).find(|&ms| {
                watchdog.look(at_ms(ms));
                control.has_ended()
            })
        };
        assert_eq!(abandoned_at_ms(1000, 0), Some(3000));
        assert_eq!(abandoned_at_ms(6000, 0), Some(5500));
        assert_eq!(abandoned_at_ms(1000, 8000), Some(7500), "somebody watches");
        assert_eq!(abandoned_at_ms(0, 0), None, "for as long as it likes");
    }

    #[test]
    fn nothing_is_switched_off_before_the_first_tick() {
        let (watchdog, devices) = watchdog(1000);
        assert!(watchdog.look(at_ms(100_000)) > at_ms(100_000));
        assert!(!are_off(&devices));
    }

    #[test]
    fn a_slow_loop_may_take_three_periods() {
        let (watchdog, devices) = watchdog(20);
        watchdog.control.heartbeat.beat(at_ms(0));
        assert_eq!(watchdog.look(at_ms(100)), at_ms(150));
        assert!(!are_off(&devices));
        watchdog.look(at_ms(150));
        assert!(are_off(&devices));
    }

    #[test]
    fn a_loop_that_comes_back_is_told_once_and_watched_again() {
        let (watchdog, devices) = watchdog(1000);
        let heartbeat = &watchdog.control.heartbeat;
        heartbeat.beat(at_ms(0));
        watchdog.look(at_ms(18));
        watchdog.look(at_ms(4000));
        assert!(are_off(&devices) && heartbeat.times() == 1);
        assert!(heartbeat.beat(at_ms(4001)));
        // Until the loop has switched it on by itself it stays off.
        watchdog.look(at_ms(4002));
        assert!(are_off(&devices));
        watchdog.switches.iter().for_each(|switch| switch.enable());
        heartbeat.resume();
        assert!(!heartbeat.beat(at_ms(4003)));
        watchdog.look(at_ms(4020));
        assert!(!are_off(&devices));
        watchdog.look(at_ms(4021));
        assert!(are_off(&devices) && heartbeat.times() == 2);
    }

    #[test]
    fn a_loop_that_does_not_end_when_asked_is_not_waited_for() {
        let (watchdog, _devices) = watchdog(1000);
        let control = &watchdog.control;
        control.heartbeat.beat(at_ms(0));
        watchdog.look(at_ms(10_000));
        assert!(!control.has_ended(), "nobody has asked");
        control.stop.store(true, Ordering::Relaxed);
        watchdog.look(at_ms(2999));
        assert!(!control.has_ended());
        watchdog.look(at_ms(3000));
        assert!(control.has_ended() && control.failures.all()[0].contains("has not ticked for 3 s"));
    }
}
