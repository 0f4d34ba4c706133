//! Memory in pages as large as the system gives them, kept for a while when it is given back: fresh pages are dear. On a
//! virtual machine a megabyte of small ones takes 0.9 ms until it can be written to, of large ones 0.17 ms, and of
//! neither kind if it was written to before.

use std::sync::{Mutex, PoisonError};

use memmap2::MmapMut;

/// A large page of most systems. What is at least half as long is a multiple of it, since systems give large pages only
/// to what is.
const LARGE_PAGE: usize = 2 << 20;

/// Most bytes that are kept for the next who asks: what a mesh of a million triangles, its structure and its builder
/// need. Old maps go first.
const MOST_KEPT: usize = 128 << 20;

/// Shorter maps are not kept, nor more than so many: there would be too many to look through.
const LEAST_KEPT: usize = 4 << 10;
const MOST_MAPS: usize = 64;

/// A kept map is not given to who asks for less than a fourth of it.
const MOST_SURPLUS: usize = 4;

static KEPT: Mutex<Vec<MmapMut>> = Mutex::new(Vec::new());

/// A map of at least so many bytes, and whether they are known to be zero.
///
/// # Errors
/// The system's, where it refuses.
pub fn take(bytes: usize) -> std::io::Result<(MmapMut, bool)> {
    let length = if bytes < LARGE_PAGE / 2 { bytes } else { bytes.next_multiple_of(LARGE_PAGE) };
    if let Some(map) = kept(length) {
        return Ok((map, false));
    }
    let map = MmapMut::map_anon(length).or_else(|_| {
        // What is kept may be what is missing.
        forget();
        MmapMut::map_anon(length)
    })?;
    // Only a hint: a system without large pages serves small ones.
    #[cfg(target_os = "linux")]
    let _ = map.advise(memmap2::Advice::HugePage);
    Ok((map, true))
}

/// The smallest of the kept maps that fits.
fn kept(length: usize) -> Option<MmapMut> {
    let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    let fits = |map: &MmapMut| map.len() >= length && map.len() / MOST_SURPLUS <= length;
    let fitting = kept.iter().enumerate().filter(|(_, map)| fits(map));
    let (index, _) = fitting.min_by_key(|(_, map)| map.len())?;
    Some(kept.remove(index))
}

/// Give all that is kept back to the system.
fn forget() {
    KEPT.lock().unwrap_or_else(PoisonError::into_inner).clear();
}

/// Take a map back.
pub fn give(map: MmapMut) {
    if map.len() < LEAST_KEPT {
        return;
    }
    let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    kept.push(map);
    let (mut sum, mut surplus) = (kept.iter().map(|map| map.len()).sum::<usize>(), 0);
    while sum > MOST_KEPT || kept.len() - surplus > MOST_MAPS {
        sum -= kept[surplus].len();
        surplus += 1;
    }
    kept.drain(..surplus);
}
