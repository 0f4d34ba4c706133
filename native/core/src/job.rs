//! Progress and cancellation of one piece of long work, shared between threads without a lock.

use std::sync::atomic::{AtomicBool, AtomicU8, AtomicU64, Ordering::Relaxed};

use crate::Error;

/// What a job is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Phase {
    /// Nothing yet, or nothing any more.
    Idle,
    /// Building an accelerator.
    Build,
    /// Tracing rays.
    Trace,
}

/// The shared state: the worker reports units done, anybody may read or cancel.
#[derive(Debug, Default)]
pub struct Job {
    cancelled: AtomicBool,
    phase: AtomicU8,
    done: AtomicU64,
    total: AtomicU64,
}

impl Job {
    /// A job that has not begun.
    pub fn new() -> Self {
        Self::default()
    }

    /// Ask the work to stop; it returns [`Error::Cancelled`] within 50 ms of work.
    pub fn cancel(&self) {
        self.cancelled.store(true, Relaxed);
    }

    /// Whether somebody asked the work to stop.
    pub fn is_cancelled(&self) -> bool {
        self.cancelled.load(Relaxed)
    }

    /// The share of the current phase that is done, 0 to 1.
    pub fn progress(&self) -> f32 {
        let total = self.total.load(Relaxed).max(1);
        (self.done.load(Relaxed) as f32 / total as f32).min(1.0)
    }

    /// What the job is doing now.
    pub fn phase(&self) -> Phase {
        match self.phase.load(Relaxed) {
            1 => Phase::Build,
            2 => Phase::Trace,
            _ => Phase::Idle,
        }
    }

    /// Begin a phase of `total` units.
    pub fn begin(&self, phase: Phase, total: u64) {
        self.done.store(0, Relaxed);
        self.total.store(total, Relaxed);
        self.phase.store(phase as u8, Relaxed);
    }

    /// Count `units` as done.
    pub fn advance(&self, units: u64) {
        self.done.fetch_add(units, Relaxed);
    }

    /// `Err(Cancelled)` once somebody asked the work to stop.
    pub fn check(&self) -> Result<(), Error> {
        if self.is_cancelled() { Err(Error::Cancelled) } else { Ok(()) }
    }
}
