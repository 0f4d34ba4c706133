//! The core's errors as Python exceptions, and panics as one of them.

use std::{
    any::Any,
    panic::{AssertUnwindSafe, catch_unwind},
};

use espalier_core::Error;
use pyo3::{
    create_exception,
    exceptions::{PyException, PyMemoryError},
    prelude::*,
    sync::PyOnceLock,
    types::{PyDict, PyType},
};

create_exception!(
    espalier_rt,
    EspalierError,
    PyException,
    "Any error of Espalier's own. Its message says what is wrong and what to do."
);

/// An exception of this module.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    Mesh,
    Ray,
    Config,
    Scene,
    Cancelled,
    OutOfMemory,
    Internal,
}

/// Every kind, in their order, with its name, the built-in exception it also is, and its docstring.
const KINDS: [(Kind, &str, &str, &str); 7] = [
    (Kind::Mesh, "MeshError", "ValueError", "A mesh is unusable: its arrays' form, a coordinate or an index."),
    (Kind::Ray, "RayError", "ValueError", "Rays are unusable: their arrays' form, or one ray, which is named."),
    (Kind::Config, "ConfigError", "ValueError", "A method, setting or number of threads that does not exist."),
    (Kind::Scene, "SceneError", "ValueError", "A material, texture, light or camera is unusable."),
    (Kind::Cancelled, "Cancelled", "Exception", "The job was cancelled before the work was finished."),
    (Kind::OutOfMemory, "OutOfMemory", "MemoryError", "The work needs more memory than there is."),
    (Kind::Internal, "InternalError", "RuntimeError", "A bug in Espalier: please report it with the message."),
];

static TYPES: PyOnceLock<Vec<Py<PyType>>> = PyOnceLock::new();

/// Create the exceptions and put them into the module.
pub fn add_to(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    module.add("EspalierError", py.get_type::<EspalierError>())?;
    for ((_, name, ..), exception) in KINDS.iter().zip(types(py)?) {
        module.add(*name, exception.bind(py))?;
    }
    Ok(())
}

fn types(py: Python<'_>) -> PyResult<&Vec<Py<PyType>>> {
    TYPES.get_or_try_init(py, || KINDS.iter().map(|&(_, name, base, doc)| create(py, name, base, doc)).collect())
}

/// `class name(EspalierError, base)`; every one is an Exception already.
fn create(py: Python<'_>, name: &str, base: &str, doc: &str) -> PyResult<Py<PyType>> {
    let builtins = py.import("builtins")?;
    let own = py.get_type::<EspalierError>().into_any();
    let bases = if base == "Exception" { vec![own] } else { vec![own, builtins.getattr(base)?] };
    let members = PyDict::new(py);
    members.set_item("__module__", "espalier_rt")?;
    members.set_item("__doc__", doc)?;
    let bases = pyo3::types::PyTuple::new(py, bases)?;
    Ok(builtins.getattr("type")?.call1((name, bases, members))?.cast_into::<PyType>()?.unbind())
}

impl Kind {
    /// An exception of this kind.
    pub fn error(self, py: Python<'_>, message: impl Into<String>) -> PyErr {
        match types(py) {
            Ok(types) => PyErr::from_type(types[self as usize].bind(py).clone(), message.into()),
            Err(error) => error,
        }
    }
}

impl Kind {
    /// The core's error of this kind, where the core has one about an argument.
    pub fn core(self, message: String) -> Error {
        match self {
            Self::Mesh => Error::Mesh(message),
            Self::Ray => Error::Ray(message),
            Self::Config => Error::Config(message),
            _ => Error::Scene(message),
        }
    }
}

/// The core's results as Python's.
pub trait OrRaise<T> {
    /// The value, or the Python exception of the error.
    fn or_raise(self, py: Python<'_>) -> PyResult<T>;
}

impl<T> OrRaise<T> for Result<T, Error> {
    fn or_raise(self, py: Python<'_>) -> PyResult<T> {
        self.map_err(|error| kind(&error).error(py, error.to_string()))
    }
}

fn kind(error: &Error) -> Kind {
    match error {
        Error::Mesh(_) => Kind::Mesh,
        Error::Ray(_) => Kind::Ray,
        Error::Config(_) => Kind::Config,
        Error::Scene(_) => Kind::Scene,
        Error::Cancelled => Kind::Cancelled,
        Error::OutOfMemory { .. } => Kind::OutOfMemory,
        _ => Kind::Internal,
    }
}

/// Run `work`, and turn a panic of it into an InternalError, and Python's own MemoryError into an OutOfMemory.
pub fn guard<T>(py: Python<'_>, work: impl FnOnce() -> PyResult<T>) -> PyResult<T> {
    let result = catch_unwind(AssertUnwindSafe(work));
    let result = result.unwrap_or_else(|panic| Err(Kind::Internal.error(py, describe(&*panic))));
    result.map_err(|error| {
        let is_foreign = error.is_instance_of::<PyMemoryError>(py) && !error.is_instance_of::<EspalierError>(py);
        if is_foreign { Kind::OutOfMemory.error(py, format!("out of memory: {}", error.value(py))) } else { error }
    })
}

fn describe(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().copied();
    let text = text.or_else(|| panic.downcast_ref::<String>().map(String::as_str)).unwrap_or("no message");
    format!("a bug in Espalier, please report it: {text}")
}
