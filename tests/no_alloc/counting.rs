//! An allocator that counts each thread's calls.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

/// Counts what each thread asks of it.
struct Counting;

thread_local! {
    static CALLS: Cell<Calls> = const { Cell::new(Calls { allocations: 0, frees: 0, held: 0 }) };
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Calls {
    pub(crate) allocations: u64,
    pub(crate) frees: u64,
    /// Bytes allocated less bytes freed.
    pub(crate) held: i64,
}

impl Calls {
    /// Those of the calling thread so far.
    pub(crate) fn so_far() -> Self {
        CALLS.get()
    }

    pub(crate) fn since(self, earlier: Self) -> Self {
        Self {
            allocations: self.allocations - earlier.allocations,
            frees: self.frees - earlier.frees,
            held: self.held - earlier.held,
        }
    }
}

/// `from` and `to` are the bytes of a block before and after, 0 where there is none.
#[expect(clippy::cast_possible_wrap, reason = "no block has so many")]
fn count(from: usize, to: usize) {
    // Not there any more while its thread ends; nobody measures then.
    let _ = CALLS.try_with(|calls| {
        let before = calls.get();
        calls.set(Calls {
            allocations: before.allocations + u64::from(to > 0),
            frees: before.frees + u64::from(from > 0),
            held: before.held + to as i64 - from as i64,
        });
    });
}

#[expect(unsafe_code, reason = "an allocator is unsafe by its trait")]
// SAFETY: every method passes its arguments on to the system's allocator as they are, and returns what that returns;
// counting touches only a thread-local without a destructor, which needs no memory of its own.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(0, layout.size());
        // SAFETY: the caller keeps the trait's contract, which is that of `System`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count(0, layout.size());
        // SAFETY: as above.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, len: usize) -> *mut u8 {
        count(layout.size(), len);
        // SAFETY: as above; `block` came from `System` with that layout.
        unsafe { System.realloc(block, layout, len) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        count(layout.size(), 0);
        // SAFETY: as above; `block` came from `System` with that layout.
        unsafe { System.dealloc(block, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;
