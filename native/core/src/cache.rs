//! What is known of the processor's caches.

/// Bytes of a core's second-level cache where the processor does not tell.
const USUAL: usize = 512 << 10;

/// Bytes of a core's second-level cache.
pub fn second_level() -> usize {
    told().filter(|bytes| *bytes > 0).unwrap_or(USUAL)
}

#[cfg(target_arch = "x86_64")]
fn told() -> Option<usize> {
    use std::arch::x86_64::__cpuid;
    const EXTENDED: u32 = 0x8000_0000;
    const CACHES: u32 = 0x8000_0006;
    (__cpuid(EXTENDED).eax >= CACHES).then(|| (__cpuid(CACHES).ecx as usize >> 16) << 10)
}

#[cfg(not(target_arch = "x86_64"))]
fn told() -> Option<usize> {
    None
}
