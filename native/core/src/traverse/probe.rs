//! What a traversal tells about itself. The probe is a type parameter, so that telling nothing costs nothing.

/// Listens to one ray's traversal.
pub trait Probe {
    /// A node or a grid cell was visited.
    #[inline(always)]
    fn step(&mut self) {}
    /// `count` triangles were tested.
    #[inline(always)]
    fn tests(&mut self, _count: u32) {}
}

/// Listens to nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct Silent;

impl Probe for Silent {}

/// Counts.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Traversal steps: nodes and grid cells visited.
    pub steps: u32,
    /// Ray-triangle tests.
    pub tests: u32,
}

impl Probe for Counts {
    #[inline(always)]
    fn step(&mut self) {
        self.steps += 1;
    }
    #[inline(always)]
    fn tests(&mut self, count: u32) {
        self.tests += count;
    }
}
