//! Intel Embree 4 through its C interface, from a shared library given by its path.
//!
//! This file is the harness's only home of `unsafe`. The declarations are written by hand after `rtcore_common.h`,
//! `rtcore_ray.h`, `rtcore_scene.h` and `rtcore_geometry.h` of Embree 4.4. Its rays are rows of numbers, whatever the
//! width of the call, so [`Packet`] serves all widths: 12 rows of a ray, then the rows of a hit.
#![allow(unsafe_code)]

use std::{
    ffi::{CStr, CString, c_char, c_int, c_uint, c_void},
    mem::ManuallyDrop,
    path::Path,
    ptr::null_mut,
    sync::atomic::{AtomicIsize, Ordering::Relaxed},
};

use espalier_core::ray::HitsMut;
use libloading::Library;

use crate::{error::Error, plan::Quality, rays::RayColumns};

/// A call of Embree: how many rays it takes, and whether it is told that they are coherent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Call {
    /// 1, 8 or 16.
    pub width: usize,
    /// `RTC_RAY_QUERY_FLAG_COHERENT`.
    pub coherent: bool,
}

impl Call {
    /// All calls that can differ; a single ray ignores the flag.
    pub const ALL: [Self; 5] =
        [Self::new(1, false), Self::new(8, false), Self::new(8, true), Self::new(16, false), Self::new(16, true)];

    /// A call.
    pub const fn new(width: usize, coherent: bool) -> Self {
        Self { width, coherent }
    }

    /// As results name it: `1`, `8`, `8c`, `16`, `16c`.
    pub fn name(self) -> String {
        format!("{}{}", self.width, if self.coherent { "c" } else { "" })
    }
}

/// Rays and hits of one call: `org_x org_y org_z tnear dir_x dir_y dir_z time tfar mask id flags`, then
/// `Ng_x Ng_y Ng_z u v primID geomID instID instPrimID`, as bits.
#[repr(C, align(64))]
struct Packet<const N: usize> {
    rows: [[u32; N]; 21],
}

const TFAR: usize = 8;
const MASK: usize = 9;
const U: usize = 15;
const V: usize = 16;
const PRIMITIVE: usize = 17;
const GEOMETRY: usize = 18;
/// The rows of a packet that our columns fill, in the columns' order.
const COLUMN_ROWS: [usize; 8] = [0, 1, 2, 4, 5, 6, 3, TFAR];

/// `RTCIntersectArguments` and `RTCOccludedArguments`, with the member of `RTC_MIN_WIDTH` that they may have.
#[repr(C)]
struct Arguments {
    flags: c_uint,
    feature_mask: c_uint,
    context: *mut c_void,
    filter: *mut c_void,
    callback: *mut c_void,
    min_width_distance_factor: f32,
}

type Handle = *mut c_void;
type TraceOne = unsafe extern "C" fn(Handle, *mut c_void, *mut Arguments);
type TraceMany = unsafe extern "C" fn(*const c_int, Handle, *mut c_void, *mut Arguments);

macro_rules! functions {
    ($($name:ident: $type:ty),+ $(,)?) => {
        /// The library and what is used of it.
        #[allow(non_snake_case)] // The library's own names.
        struct Functions {
            $($name: $type,)+
        }

        impl Functions {
            /// The library stays until the process ends: a thread of its TBB that has nothing left to do ends when it
            /// likes, by the library's code.
            fn load(library: Library) -> Result<Self, libloading::Error> {
                let library = ManuallyDrop::new(library);
                // SAFETY: each type is that of the function's declaration in Embree 4's headers, and the library is
                // never closed.
                unsafe { Ok(Self { $($name: *library.get(stringify!($name).as_bytes())?,)+ }) }
            }
        }
    };
}

functions! {
    rtcNewDevice: unsafe extern "C" fn(*const c_char) -> Handle,
    rtcReleaseDevice: unsafe extern "C" fn(Handle),
    rtcGetDeviceError: unsafe extern "C" fn(Handle) -> c_uint,
    rtcGetDeviceLastErrorMessage: unsafe extern "C" fn(Handle) -> *const c_char,
    rtcSetDeviceMemoryMonitorFunction:
        unsafe extern "C" fn(Handle, Option<unsafe extern "C" fn(*mut c_void, isize, bool) -> bool>, *mut c_void),
    rtcNewScene: unsafe extern "C" fn(Handle) -> Handle,
    rtcReleaseScene: unsafe extern "C" fn(Handle),
    rtcSetSceneBuildQuality: unsafe extern "C" fn(Handle, c_uint),
    rtcSetSceneFlags: unsafe extern "C" fn(Handle, c_uint),
    rtcCommitScene: unsafe extern "C" fn(Handle),
    rtcNewGeometry: unsafe extern "C" fn(Handle, c_uint) -> Handle,
    rtcReleaseGeometry: unsafe extern "C" fn(Handle),
    rtcSetGeometryBuildQuality: unsafe extern "C" fn(Handle, c_uint),
    rtcSetSharedGeometryBuffer:
        unsafe extern "C" fn(Handle, c_uint, c_uint, c_uint, *const c_void, usize, usize, usize),
    rtcCommitGeometry: unsafe extern "C" fn(Handle),
    rtcAttachGeometry: unsafe extern "C" fn(Handle, Handle) -> c_uint,
    rtcIntersect1: TraceOne,
    rtcIntersect8: TraceMany,
    rtcIntersect16: TraceMany,
    rtcOccluded1: TraceOne,
    rtcOccluded8: TraceMany,
    rtcOccluded16: TraceMany,
}

/// The loaded library.
pub struct Embree {
    functions: Functions,
}

impl Embree {
    /// Load it.
    ///
    /// # Errors
    /// [`Error::Embree`] says how to get it.
    pub fn load(path: &Path) -> Result<Self, Error> {
        let missing = |error: libloading::Error| {
            let path = path.display();
            Error::Embree(format!(
                "cannot load Embree 4 from '{path}': {error}. It comes with the Python package embreex, which only \
                 benchmarks need: pip install embreex"
            ))
        };
        // SAFETY: the initialisers of Embree and of the TBB it links have no preconditions.
        let library = unsafe { Library::new(path) }.map_err(missing)?;
        Ok(Self { functions: Functions::load(library).map_err(missing)? })
    }

    /// A device with that many threads and `isa` (`avx2` or `avx512`), for meshes of at least one triangle.
    ///
    /// # Errors
    /// [`Error::Embree`] where Embree does not support the instruction set on this processor.
    pub fn device(&self, threads: usize, isa: &'static str) -> Result<Device<'_>, Error> {
        let configuration = CString::new(format!("threads={threads},isa={isa}")).expect("no zero bytes");
        let bytes = Box::new(AtomicIsize::new(0));
        // SAFETY: the string lives through the call; the functions are Embree's.
        let handle = unsafe { (self.functions.rtcNewDevice)(configuration.as_ptr()) };
        let device = Device { functions: &self.functions, handle, isa, bytes };
        if handle.is_null() {
            return Err(device.error(&format!("no device for {isa}")));
        }
        // SAFETY: `bytes` is on the heap and freed after the device, which is released in `drop`.
        unsafe {
            let counter = (&raw const *device.bytes).cast_mut().cast();
            (self.functions.rtcSetDeviceMemoryMonitorFunction)(handle, Some(count_bytes), counter);
        }
        Ok(device)
    }
}

/// Embree's memory monitor: `counter` is the device's [`AtomicIsize`].
unsafe extern "C" fn count_bytes(counter: *mut c_void, bytes: isize, _post: bool) -> bool {
    // SAFETY: `Embree::device` passed a pointer to a live atomic.
    unsafe { &*counter.cast::<AtomicIsize>() }.fetch_add(bytes, Relaxed);
    true
}

/// A device: an instruction set and a number of threads.
pub struct Device<'a> {
    functions: &'a Functions,
    handle: Handle,
    /// Its instruction set.
    pub isa: &'static str,
    bytes: Box<AtomicIsize>,
}

// SAFETY: Embree's API functions are thread-safe on one device; the handle is only passed to them.
unsafe impl Sync for Device<'_> {}

impl Device<'_> {
    /// Bytes that all its scenes hold now.
    pub fn bytes(&self) -> isize {
        self.bytes.load(Relaxed)
    }

    fn error(&self, what: &str) -> Error {
        // SAFETY: both calls accept a null device; the message is a string of Embree's that stays until the next call.
        let message = unsafe {
            let message = (self.functions.rtcGetDeviceLastErrorMessage)(self.handle);
            if message.is_null() { "".into() } else { CStr::from_ptr(message).to_string_lossy() }
        };
        Error::Embree(format!("Embree: {what}: {message}"))
    }

    /// Build over these arrays, which Embree reads in place, while building and tracing.
    ///
    /// # Errors
    /// [`Error::Embree`] with Embree's own message.
    pub fn build<'a>(&'a self, arrays: &'a Arrays, quality: Quality) -> Result<Scene<'a>, Error> {
        let f = self.functions;
        let level = match quality {
            Quality::Low => 0,
            Quality::Medium | Quality::Robust => 1,
            Quality::High => 2,
        };
        let scene = Scene { device: self, handle: unsafe_new_scene(f, self.handle) };
        // SAFETY: all handles are live; the buffers hold what is said, live as long as the scene by its lifetime, and
        // end with the 16 readable bytes that Embree asks for (see `Arrays`).
        let error = unsafe {
            (f.rtcSetSceneBuildQuality)(scene.handle, level);
            (f.rtcSetSceneFlags)(scene.handle, if quality == Quality::Robust { 1 << 2 } else { 0 });
            let geometry = (f.rtcNewGeometry)(self.handle, 0);
            (f.rtcSetGeometryBuildQuality)(geometry, level);
            let vertices = arrays.vertices.as_ptr().cast();
            let (float3, uint3) = (0x9003, 0x5003);
            (f.rtcSetSharedGeometryBuffer)(geometry, 1, 0, float3, vertices, 0, 12, arrays.vertex_count());
            let triangles = arrays.triangles.as_ptr().cast();
            (f.rtcSetSharedGeometryBuffer)(geometry, 0, 0, uint3, triangles, 0, 12, arrays.triangles.len());
            (f.rtcCommitGeometry)(geometry);
            (f.rtcAttachGeometry)(scene.handle, geometry);
            (f.rtcReleaseGeometry)(geometry);
            (f.rtcCommitScene)(scene.handle);
            (f.rtcGetDeviceError)(self.handle)
        };
        if error == 0 { Ok(scene) } else { Err(self.error("cannot build")) }
    }
}

fn unsafe_new_scene(functions: &Functions, device: Handle) -> Handle {
    // SAFETY: the device is live.
    unsafe { (functions.rtcNewScene)(device) }
}

impl Drop for Device<'_> {
    fn drop(&mut self) {
        if !self.handle.is_null() {
            // SAFETY: the handle is live and not used again; scenes hold their own reference.
            unsafe { (self.functions.rtcReleaseDevice)(self.handle) }
        }
    }
}

/// Triangles as Embree shares them.
pub struct Arrays {
    vertices: Vec<f32>,
    triangles: Vec<[u32; 3]>,
}

impl Arrays {
    /// Numbers that Embree may read past the last vertex, which it loads 16 bytes wide.
    const PADDING: usize = 4;

    /// Keep a mesh.
    pub fn new(vertices: &[[f32; 3]], triangles: Vec<[u32; 3]>) -> Self {
        let mut numbers = vertices.as_flattened().to_vec();
        numbers.resize(numbers.len() + Self::PADDING, 0.0);
        Self { vertices: numbers, triangles }
    }

    /// Positions, x, y and z of every vertex.
    pub fn vertices(&self) -> &[[f32; 3]] {
        self.vertices[..self.vertices.len() - Self::PADDING].as_chunks().0
    }

    /// Vertex indices.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    fn vertex_count(&self) -> usize {
        self.vertices().len()
    }
}

/// A committed scene of one mesh.
pub struct Scene<'a> {
    device: &'a Device<'a>,
    handle: Handle,
}

// SAFETY: a committed scene may be traced from any number of threads; it is only moved or dropped by its owner.
unsafe impl Send for Scene<'_> {}
// SAFETY: as for `Send`.
unsafe impl Sync for Scene<'_> {}

impl Drop for Scene<'_> {
    fn drop(&mut self) {
        // SAFETY: the handle is live and not used again.
        unsafe { (self.device.functions.rtcReleaseScene)(self.handle) }
    }
}

impl Scene<'_> {
    /// The closest hits of the rays from `first` on, as many as there is room for.
    pub fn closest(&self, rays: &RayColumns, first: usize, hits: &mut HitsMut<'_>, call: Call) {
        let f = self.device.functions;
        match call.width {
            1 => self.closest_one(rays, first, hits),
            8 => self.closest_many::<8>(f.rtcIntersect8, rays, first, hits, call),
            16 => self.closest_many::<16>(f.rtcIntersect16, rays, first, hits, call),
            width => panic!("no call of width {width}"),
        }
    }

    /// Whether anything lies in the interval of the rays from `first` on, as many as there is room for.
    pub fn occluded(&self, rays: &RayColumns, first: usize, out: &mut [bool], call: Call) {
        let f = self.device.functions;
        match call.width {
            1 => self.occluded_one(rays, first, out),
            8 => self.occluded_many::<8>(f.rtcOccluded8, rays, first, out, call),
            16 => self.occluded_many::<16>(f.rtcOccluded16, rays, first, out, call),
            width => panic!("no call of width {width}"),
        }
    }

    fn closest_one(&self, rays: &RayColumns, first: usize, hits: &mut HitsMut<'_>) {
        let (mut packet, mut arguments) = (Packet::<1>::new(), Arguments::new(false));
        let _flush = FlushDenormals::new();
        for index in 0..hits.len() {
            packet.fill(rays, first + index, 1);
            let pointer = (&raw mut packet).cast();
            // SAFETY: the scene is committed; a packet of width 1 is an aligned `RTCRayHit`.
            unsafe { (self.device.functions.rtcIntersect1)(self.handle, pointer, &mut arguments) };
            packet.take(hits, index, 1);
        }
    }

    fn closest_many<const N: usize>(
        &self,
        trace: TraceMany,
        rays: &RayColumns,
        first: usize,
        hits: &mut HitsMut<'_>,
        call: Call,
    ) {
        let (mut packet, mut arguments) = (Packet::<N>::new(), Arguments::new(call.coherent));
        let _flush = FlushDenormals::new();
        for index in (0..hits.len()).step_by(N) {
            let count = N.min(hits.len() - index);
            packet.fill(rays, first + index, count);
            let (valid, pointer) = (Valid::first(count), (&raw mut packet).cast());
            // SAFETY: the scene is committed; a packet of width N is an aligned `RTCRayHitN`, `valid` has N lanes.
            unsafe { trace(valid.0.as_ptr(), self.handle, pointer, &mut arguments) };
            packet.take(hits, index, count);
        }
    }

    fn occluded_one(&self, rays: &RayColumns, first: usize, out: &mut [bool]) {
        let (mut packet, mut arguments) = (Packet::<1>::new(), Arguments::new(false));
        let _flush = FlushDenormals::new();
        for (index, out) in out.iter_mut().enumerate() {
            packet.fill(rays, first + index, 1);
            let pointer = (&raw mut packet).cast();
            // SAFETY: the scene is committed; a packet of width 1 begins with an aligned `RTCRay`.
            unsafe { (self.device.functions.rtcOccluded1)(self.handle, pointer, &mut arguments) };
            *out = packet.is_occluded(0);
        }
    }

    fn occluded_many<const N: usize>(
        &self,
        trace: TraceMany,
        rays: &RayColumns,
        first: usize,
        out: &mut [bool],
        call: Call,
    ) {
        let (mut packet, mut arguments) = (Packet::<N>::new(), Arguments::new(call.coherent));
        let _flush = FlushDenormals::new();
        for (index, out) in out.chunks_mut(N).enumerate() {
            packet.fill(rays, first + index * N, out.len());
            let (valid, pointer) = (Valid::first(out.len()), (&raw mut packet).cast());
            // SAFETY: as in `closest_many`; a packet begins with an `RTCRayN`.
            unsafe { trace(valid.0.as_ptr(), self.handle, pointer, &mut arguments) };
            out.iter_mut().enumerate().for_each(|(lane, out)| *out = packet.is_occluded(lane));
        }
    }
}

impl<const N: usize> Packet<N> {
    fn new() -> Self {
        let mut rows = [[0; N]; 21];
        rows[MASK] = [u32::MAX; N];
        rows[GEOMETRY + 1..].fill([u32::MAX; N]);
        Self { rows }
    }

    /// Bring in `count` rays.
    #[inline(always)]
    fn fill(&mut self, rays: &RayColumns, first: usize, count: usize) {
        for (row, column) in COLUMN_ROWS.into_iter().zip(&rays.columns) {
            if let Some(values) = column[first..].first_chunk::<N>() {
                self.rows[row] = values.map(f32::to_bits);
            } else {
                (0..count).for_each(|lane| self.rows[row][lane] = column[first + lane].to_bits());
            }
        }
        self.rows[GEOMETRY] = [u32::MAX; N];
    }

    /// Write `count` hits. The one geometry is number 0 and a miss has all bits set, so `or` makes its primitive MISS.
    #[inline(always)]
    fn take(&self, hits: &mut HitsMut<'_>, first: usize, count: usize) {
        let rows = &self.rows;
        let t = hits.t[first..first + count].iter_mut().zip(&mut hits.primitive[first..first + count]);
        let uv = hits.u[first..first + count].iter_mut().zip(&mut hits.v[first..first + count]);
        for (lane, ((t, primitive), (u, v))) in t.zip(uv).enumerate() {
            *t = f32::from_bits(rows[TFAR][lane]);
            *primitive = rows[PRIMITIVE][lane] | rows[GEOMETRY][lane];
            (*u, *v) = (f32::from_bits(rows[U][lane]), f32::from_bits(rows[V][lane]));
        }
    }

    /// Embree marks an occluded ray by tfar = -infinity.
    #[inline(always)]
    fn is_occluded(&self, lane: usize) -> bool {
        f32::from_bits(self.rows[TFAR][lane]) < 0.0
    }
}

/// Which rays of a packet count: -1 yes, 0 no.
#[repr(align(64))]
struct Valid([c_int; 16]);

impl Valid {
    #[inline(always)]
    fn first(count: usize) -> Self {
        Self(std::array::from_fn(|lane| if lane < count { -1 } else { 0 }))
    }
}

impl Arguments {
    fn new(coherent: bool) -> Self {
        Self {
            flags: if coherent { 1 << 16 } else { 0 },
            feature_mask: c_uint::MAX,
            context: null_mut(),
            filter: null_mut(),
            callback: null_mut(),
            min_width_distance_factor: 0.0,
        }
    }
}

/// Embree asks for denormals to be flushed to zero on threads that trace, for speed; ours keeps them.
struct FlushDenormals(u32);

impl FlushDenormals {
    #[cfg(target_arch = "x86_64")]
    fn new() -> Self {
        let mut before = 0u32;
        // SAFETY: reads and writes this thread's control register; FTZ and DAZ change no trap.
        unsafe {
            std::arch::asm!("stmxcsr [{}]", in(reg) &raw mut before, options(nostack));
            let flushing = before | 0x8040;
            std::arch::asm!("ldmxcsr [{}]", in(reg) &raw const flushing, options(nostack));
        }
        Self(before)
    }

    #[cfg(not(target_arch = "x86_64"))]
    fn new() -> Self {
        Self(0)
    }
}

impl Drop for FlushDenormals {
    fn drop(&mut self) {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: restores what `new` read.
        unsafe {
            std::arch::asm!("ldmxcsr [{}]", in(reg) &raw const self.0, options(nostack));
        }
    }
}
