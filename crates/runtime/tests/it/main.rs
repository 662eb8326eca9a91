//! What `cotouch-runtime` promises from outside, in one program.

mod attacks;
mod changes;
mod common;
mod contact_runs;
mod demand;
mod devices;
mod export;
mod faults;
mod fuzz_seeds;
mod hands;
mod live;
mod no_allocation;
mod pointers;
mod real_time_runs;
mod recording;
mod safety;
mod schema;
mod sessions;
mod soft_real_time;
mod soft_runs;
mod transports;
mod verdicts;
mod virtual_runs;
