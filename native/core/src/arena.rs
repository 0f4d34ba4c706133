//! Stores for the bulk of a structure, in pages as large as the system gives them: rays jump about in them, and with
//! pages of 4 KiB most jumps also miss the translation buffer.

use std::{
    marker::PhantomData,
    ops::{Deref, DerefMut},
};

use bytemuck::Pod;
use memmap2::MmapMut;

use crate::Error;

/// A growing list whose room is reserved, not used, from the start.
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
        let bytes = capacity * size_of::<T>();
        let map = if bytes == 0 { None } else { Some(reserve(bytes, what)?) };
        Ok(Self { map, ..Self::empty() })
    }

    /// `len` values of zero bytes, whose pages cost nothing until they are written to.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn zeroed(len: usize, what: &'static str) -> Result<Self, Error> {
        Ok(Self { len, ..Self::with_capacity(len, what)? })
    }

    /// Append a value; there must be room.
    #[inline]
    pub fn push(&mut self, value: T) {
        self.len += 1;
        let last = self.len - 1;
        self.as_mut_slice()[last] = value;
    }

    /// The values, to be changed.
    #[inline]
    pub fn as_mut_slice(&mut self) -> &mut [T] {
        let Self { map, len, .. } = self;
        map.as_mut().map_or(&mut [], |map| bytemuck::cast_slice_mut(&mut map[..*len * size_of::<T>()]))
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
        self.map.as_ref().map_or(&[], |map| bytemuck::cast_slice(&map[..self.len * size_of::<T>()]))
    }
}

fn reserve(bytes: usize, what: &'static str) -> Result<MmapMut, Error> {
    let map = MmapMut::map_anon(bytes).map_err(|_| Error::OutOfMemory { what, bytes })?;
    // Only a hint: a system without large pages serves small ones.
    #[cfg(target_os = "linux")]
    let _ = map.advise(memmap2::Advice::HugePage);
    Ok(map)
}
