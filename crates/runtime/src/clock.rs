//! This computer's monotonic clock, and waiting for it.

use cotouch_scene::time::LocalTime;
use rustix::thread::ClockId;
use rustix::time::Timespec;

/// The last stretch before an instant is waited for actively, ns: a sleep ends some microseconds late.
const SPIN_NS: i64 = 10_000;
/// A sleep is cut so short that a clock that is being corrected is looked at again, ns.
const LONGEST_SLEEP_NS: i64 = 100_000_000;

/// The present instant of the monotonic clock.
#[must_use]
pub fn now() -> LocalTime {
    let time = rustix::time::clock_gettime(ClockId::Monotonic);
    LocalTime(time.tv_sec * 1_000_000_000 + time.tv_nsec)
}

/// Waits until `instant`, at most a tenth of a second, and spins for at most 10 µs of it. Returns the time it is then.
pub fn sleep_towards(instant: LocalTime) -> LocalTime {
    let before = now();
    let wake = instant.plus_ns(-SPIN_NS).min(before.plus_ns(LONGEST_SLEEP_NS));
    if wake > before {
        sleep_until(wake);
    }
    let mut time = now();
    while time < instant && instant.since(time) <= SPIN_NS {
        std::hint::spin_loop();
        time = now();
    }
    time
}

#[cfg(target_os = "linux")]
fn sleep_until(instant: LocalTime) {
    let request = Timespec { tv_sec: instant.0 / 1_000_000_000, tv_nsec: instant.0 % 1_000_000_000 };
    // Interrupted by a signal: the caller looks at the clock again anyway.
    let _: Result<(), rustix::io::Errno> =
        rustix::thread::clock_nanosleep_absolute(ClockId::Monotonic, &request);
}

#[cfg(not(target_os = "linux"))]
fn sleep_until(instant: LocalTime) {
    let nanoseconds = instant.since(now()).max(0) as u64;
    std::thread::sleep(std::time::Duration::from_nanos(nanoseconds));
}

/// The wall clock, ns since 1970; only for labels of recordings.
#[expect(clippy::disallowed_methods, reason = "the one place that reads the wall clock")]
#[must_use]
pub(crate) fn unix_now_ns() -> u64 {
    let since_1970 = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    since_1970.map_or(0, |duration| duration.as_nanos() as u64)
}
