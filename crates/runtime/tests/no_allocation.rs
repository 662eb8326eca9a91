//! The haptic thread's side of the recorder never allocates, with room in the ring or without.

mod common;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use common::session;
use cotouch_runtime::exchange::{RecordSink, record_ring};
use cotouch_scene::names::HostIndex;

struct Counting;

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

#[allow(unsafe_code)] // A global allocator cannot be written without.
// SAFETY: everything is passed on to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.with(|count| count.set(count.get() + 1));
        // SAFETY: as the caller's.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as the caller's.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn allocations(act: impl FnOnce()) -> u64 {
    let before = ALLOCATIONS.with(Cell::get);
    act();
    ALLOCATIONS.with(Cell::get) - before
}

#[test]
fn recording_does_not_allocate() {
    let items = session(500);
    let (mut producer, mut consumer) = record_ring(HostIndex(0), 1 << 20);
    assert_eq!(allocations(|| items.iter().for_each(|item| producer.record(item))), 0);
    assert_eq!(producer.dropped(), 0);
    // Again until it is full, and on.
    assert_eq!(allocations(|| (0..5).for_each(|_| items.iter().for_each(|item| producer.record(item)))), 0);
    assert!(producer.dropped() > 0);
    let mut out = Vec::new();
    let counted = allocations(|| {
        consumer.drain(&mut out);
    });
    assert!(counted > 0, "the counter counts");
    assert_eq!(allocations(|| producer.record(&items[0])), 0);
}
