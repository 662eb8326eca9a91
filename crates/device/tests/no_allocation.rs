//! A haptic tick of hand, governor and port allocates nothing.
#![allow(unsafe_code, reason = "a global allocator that counts")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::hint::black_box;
use std::sync::atomic::{AtomicU64, Ordering};

use cotouch_device::acted::LimitWatch;
use cotouch_device::device::Device;
use cotouch_device::energy::PortEnergy;
use cotouch_device::governor::{Governor, GovernorInput};
use cotouch_device::hand::{Freedom, HandModel, SimulatedHand};
use cotouch_device::script::Script;
use cotouch_scene::geometry::Wrench;
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Action, GovernorLimits, Hand, SpringDamper, User};
use glam::DVec3;

struct Counting;

static ALLOCATIONS: AtomicU64 = AtomicU64::new(0);

// SAFETY: every call is passed on to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
        // SAFETY: as above.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// The only test in this binary: nothing else allocates meanwhile.
#[test]
fn a_tick_allocates_nothing() {
    let control = "1000".parse().unwrap();
    let (amplitude, duration_s) = (DVec3::new(0.02, 0.01, 0.0), 0.25);
    let script = vec![
        Action::Relax { duration_s },
        Action::Hold { duration_s },
        Action::Reach { to_m: amplitude, duration_s },
        Action::Sinusoid { amplitude_m: amplitude, frequency_hz: 2.0, phase_rad: 0.0, duration_s },
        Action::Force { force_n: amplitude, duration_s },
        Action::SinusoidalForce { amplitude_n: amplitude, frequency_hz: 2.0, phase_rad: 0.0, duration_s },
        Action::Tremor { rms_n: amplitude, duration_s },
        Action::PushAndLetGo { force_n: amplitude, push_s: 0.1, duration_s },
    ];
    let tracking = SpringDamper { stiffness_n_per_m: 400.0, damping_n_s_per_m: 10.0 };
    let user = User { name: "ada".into(), tracking, script, repeat: true };
    let arm = Hand { mass_kg: 0.3, damping_n_s_per_m: 2.0, stiffness_n_per_m: 0.0 };
    let model = HandModel::new(&arm, Freedom::Space, Script::new(&user, 1, HostIndex(0), control)).unwrap();
    let mut hand = SimulatedHand::new("ada", model, DVec3::ZERO);
    let limits = GovernorLimits {
        max_force_n: 8.0,
        max_slew_n_per_s: 100.0,
        watchdog_s: 0.02,
        soft_start_s: 0.5,
        release_s: 0.1,
        damping_n_s_per_m: 1.0,
    };
    let governor = Governor::new(&limits, hand.limits(), control);
    let (mut state, mut port, mut watch) = (governor.start(), PortEnergy::default(), LimitWatch::default());

    let before = ALLOCATIONS.load(Ordering::Relaxed);
    for tick in (0..6000).filter(|tick| tick % 100 != 17) {
        let reading = hand.read(tick).unwrap();
        let requested = Wrench::force(reading.pose.position * -5000.0);
        let input =
            GovernorInput { stop: tick > 4000 && tick < 4500, ..GovernorInput::healthy(requested, reading) };
        let output = governor.govern(&mut state, &input);
        port.observe(&reading, output.commanded);
        watch.observe(output.acted);
        hand.write(output.commanded).unwrap();
    }
    let allocations = ALLOCATIONS.load(Ordering::Relaxed) - before;
    black_box((&state, &port, &watch));
    assert_eq!(allocations, 0);
}
