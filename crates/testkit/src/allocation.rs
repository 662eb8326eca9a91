//! The allocator of every test program that links this crate: the system's, which counts its calls by thread.

#![allow(unsafe_code, reason = "a global allocator cannot be written without")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::thread::LocalKey;

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
    static DEALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

struct Counting;

// SAFETY: every call is passed on to the system's allocator unchanged; the counts are plain numbers of the thread.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        increment(&ALLOCATIONS);
        // SAFETY: the caller's promises are the system allocator's conditions.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        increment(&DEALLOCATIONS);
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn increment(count: &'static LocalKey<Cell<u64>>) {
    // A thread that ends may allocate when its counts are gone.
    let _ = count.try_with(|count| count.set(count.get() + 1));
}

fn counted(count: &'static LocalKey<Cell<u64>>, work: impl FnOnce()) -> u64 {
    let before = count.get();
    work();
    count.get() - before
}

/// How often `work` allocates on the calling thread; what grows an allocation counts as another.
///
/// What other threads do meanwhile is not counted, so tests that run side by side do not see each other.
pub fn allocations(work: impl FnOnce()) -> u64 {
    counted(&ALLOCATIONS, work)
}

/// How often `work` gives memory back on the calling thread; what grows an allocation counts here too.
pub fn deallocations(work: impl FnOnce()) -> u64 {
    counted(&DEALLOCATIONS, work)
}
