//! Stores for the bulk of a structure, in [large pages](crate::pages): rays jump about in them, and with pages of 4 KiB
//! most jumps also miss the translation buffer.

use std::{
    marker::PhantomData,
    ops::{Deref, DerefMut},
};

use bytemuck::Pod;
use memmap2::MmapMut;

use crate::{Error, pages};

/// A growing list whose room is reserved from the start.
#[derive(Debug)]
pub struct Arena<T> {
    map: Option<MmapMut>,
    len: usize,
    values: PhantomData<T>,
}

impl<T: Pod> Arena<T> {
    /// Room for nothing.
    pub fn empty() -> Self {
        Self { map: None, len: 0, values: PhantomData }
    }

    /// Room for `capacity` values.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn with_capacity(capacity: usize, what: &'static str) -> Result<Self, Error> {
        let mut arena = Self::stale(capacity, what)?;
        arena.truncate(0);
        Ok(arena)
    }

    /// `len` values of zero bytes.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn zeroed(len: usize, what: &'static str) -> Result<Self, Error> {
        let (mut arena, is_zero) = Self::taken(len, what)?;
        if !is_zero {
            arena.as_mut_slice().fill(T::zeroed());
        }
        Ok(arena)
    }

    /// `len` values that nobody knows, to be written to.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn stale(len: usize, what: &'static str) -> Result<Self, Error> {
        Ok(Self::taken(len, what)?.0)
    }

    /// The values of a slice.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn copied(values: &[T], what: &'static str) -> Result<Self, Error> {
        let mut arena = Self::stale(values.len(), what)?;
        arena.copy_from_slice(values);
        Ok(arena)
    }

    /// `len` values, and whether they are zero.
    fn taken(len: usize, what: &'static str) -> Result<(Self, bool), Error> {
        let bytes = len.saturating_mul(size_of::<T>());
        if bytes == 0 {
            return Ok((Self { map: None, len, values: PhantomData }, true));
        }
        let (map, is_zero) = pages::take(bytes).map_err(|_| Error::OutOfMemory { what, bytes })?;
        Ok((Self { map: Some(map), len, values: PhantomData }, is_zero))
    }

    /// Append a value; there must be room.
    #[inline]
    pub fn push(&mut self, value: T) {
        self.len += 1;
        let last = self.len - 1;
        self.as_mut_slice()[last] = value;
    }

    /// Forget all values from `len` on.
    pub fn truncate(&mut self, len: usize) {
        self.len = self.len.min(len);
    }

    /// The values, to be changed.
    #[inline]
    pub fn as_mut_slice(&mut self) -> &mut [T] {
        let Self { map, len, .. } = self;
        map.as_mut().map_or(&mut [], |map| bytemuck::cast_slice_mut(&mut map[..*len * size_of::<T>()]))
    }
}

impl<T> Drop for Arena<T> {
    fn drop(&mut self) {
        self.map.take().into_iter().for_each(pages::give);
    }
}

impl<T: Pod> DerefMut for Arena<T> {
    #[inline]
    fn deref_mut(&mut self) -> &mut [T] {
        self.as_mut_slice()
    }
}

impl<T: Pod> Deref for Arena<T> {
    type Target = [T];

    #[inline]
    fn deref(&self) -> &[T] {
        match &self.map {
            Some(map) => bytemuck::cast_slice(&map[..self.len * size_of::<T>()]),
            None => &[],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_zero_where_that_was_asked_for_also_in_kept_memory() {
        for round in 0..3 {
            let mut arena: Arena<u32> = Arena::zeroed(1 << 20, "a test").unwrap();
            assert!(arena.iter().all(|&value| value == 0), "round {round}");
            arena.as_mut_slice().fill(7);
        }
    }
}
