//! `Job`: watching and stopping work from other threads.

use std::sync::Arc;

use espalier_core::job::{self, Phase};
use pyo3::prelude::*;

/// Progress and cancellation of long work, shared between threads.
///
/// Give one to `Accelerator.build`, a query or `render` in one thread; read and cancel it in any other. A job may serve
/// several pieces of work, one after the other, until it is cancelled; after that everything given it raises Cancelled.
#[pyclass(frozen, module = "espalier_rt")]
#[derive(Default)]
pub struct Job(Arc<job::Job>);

impl Job {
    /// The core's job of `job`, or one that nobody watches.
    pub fn shared(job: Option<&Bound<'_, Self>>) -> Arc<job::Job> {
        job.map(|job| Arc::clone(&job.get().0)).unwrap_or_default()
    }
}

#[pymethods]
impl Job {
    #[new]
    fn new() -> Self {
        Self::default()
    }

    /// The share of the current phase that is done, 0 to 1.
    #[getter]
    fn progress(&self) -> f32 {
        self.0.progress()
    }

    /// What is being done, or was done last: "" before anything, "build" or "trace".
    #[getter]
    fn phase(&self) -> &'static str {
        match self.0.phase() {
            Phase::Idle => "",
            Phase::Build => "build",
            Phase::Trace => "trace",
        }
    }

    /// Whether cancel() was called.
    #[getter]
    fn cancelled(&self) -> bool {
        self.0.is_cancelled()
    }

    /// Ask the work to stop: within 0.2 s it raises Cancelled in its own thread. Returns at once.
    fn cancel(&self) {
        self.0.cancel();
    }

    fn __repr__(&self) -> String {
        let cancelled = if self.cancelled() { "True" } else { "False" };
        format!("Job(phase='{}', progress={:.3}, cancelled={cancelled})", self.phase(), self.progress())
    }
}
