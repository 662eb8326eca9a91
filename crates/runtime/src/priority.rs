//! Asking the operating system to let the haptic thread run when it is due.

use thread_priority::ThreadPriority;

/// A stack that is small enough to be locked into memory, and ample for a tick.
pub(crate) const HAPTIC_STACK_BYTES: usize = 512 * 1024;

/// Stack of a network or recorder thread.
pub(crate) const HELPER_STACK_BYTES: usize = 256 * 1024;

/// SCHED_FIFO priority of the watchdog: it takes the force away from a haptic thread that keeps the processor, too.
const WATCHDOG_FIFO_PRIORITY: u8 = FIFO_PRIORITY + 1;

/// SCHED_FIFO priority of the haptic thread; audio servers and PREEMPT_RT interrupt threads use more.
const FIFO_PRIORITY: u8 = 40;

/// That of a network thread: what it brings is due for a tick, which comes first.
const NETWORK_FIFO_PRIORITY: u8 = 39;

/// Raises the calling thread to real-time scheduling, locks the process's memory and asks for precise timers. What the
/// system does not allow is left as it was and said in one sentence.
#[must_use]
pub(crate) fn raise_haptic_thread() -> Option<String> {
    let mut refused = Vec::new();
    if raise_to_fifo(FIFO_PRIORITY).is_err() {
        refused.push("real-time scheduling (SCHED_FIFO)");
    }
    if lock_memory().is_err() {
        refused.push("locking its memory");
    }
    if precise_timers().is_err() {
        refused.push("precise timers");
    }
    (!refused.is_empty()).then(|| {
        let refused = refused.join(" and ");
        format!("the system does not allow {refused} for this process; haptic ticks and packets may come late under load")
    })
}

/// Raises the calling thread to real-time scheduling, just below the haptic thread. Where the system does not allow that, it
/// stays as it was: the haptic thread of the same process meets the same refusal, and says so.
pub(crate) fn raise_network_thread() {
    raise_helper("a network thread", NETWORK_FIFO_PRIORITY);
}

/// Raises the calling thread to real-time scheduling, just above the haptic thread, if the system allows that.
pub(crate) fn raise_watchdog_thread() {
    raise_helper("the watchdog", WATCHDOG_FIFO_PRIORITY);
}

fn raise_helper(thread: &str, priority: u8) {
    if let Err(error) = raise_to_fifo(priority) {
        tracing::debug!("{thread} runs without real-time scheduling: {error:?}");
    }
}

#[cfg(target_os = "linux")]
fn raise_to_fifo(priority: u8) -> Result<(), thread_priority::Error> {
    use thread_priority::unix::{
        RealtimeThreadSchedulePolicy, ThreadSchedulePolicy, set_thread_priority_and_policy, thread_native_id,
    };
    let priority = ThreadPriority::Crossplatform(priority.try_into().expect("between 0 and 99"));
    let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    set_thread_priority_and_policy(thread_native_id(), priority, policy)
}

#[cfg(not(target_os = "linux"))]
fn raise_to_fifo(_priority: u8) -> Result<(), thread_priority::Error> {
    thread_priority::set_current_thread_priority(ThreadPriority::Max)
}

#[cfg(target_os = "linux")]
fn lock_memory() -> rustix::io::Result<()> {
    use rustix::mm::{MlockAllFlags, mlockall};
    // On fault: what is never touched, such as the far end of stacks, is not made resident.
    mlockall(MlockAllFlags::CURRENT | MlockAllFlags::FUTURE | MlockAllFlags::ONFAULT)
}

#[cfg(not(target_os = "linux"))]
fn lock_memory() -> std::io::Result<()> {
    Err(std::io::ErrorKind::Unsupported.into())
}

#[cfg(target_os = "linux")]
fn precise_timers() -> rustix::io::Result<()> {
    rustix::thread::set_current_timer_slack(std::num::NonZeroU64::new(1))
}

#[cfg(not(target_os = "linux"))]
fn precise_timers() -> std::io::Result<()> {
    Ok(())
}
