//! Triangle meshes, validated once.

use std::ops::Range;

use glam::{DVec3, Vec3, Vec3A, Vec3Swizzles, Vec4};

use crate::{
    Error, Job,
    arena::Arena,
    bounds::{Bounds, BoundsA},
    simd::Simd,
    work,
};

/// No coordinate may exceed this magnitude: squares of coordinates must stay finite in single precision.
pub const MAX_COORDINATE: f32 = 1e18;

/// More triangles, or references to triangles, cannot be told apart by the indices of a structure.
pub const MOST_TRIANGLES: usize = 1 << 27;

/// A triangle mesh whose every vertex is finite and whose every index is in range.
#[derive(Debug)]
pub struct Mesh {
    /// The coordinates of every vertex, and one number more, so that four can be read at each.
    numbers: Arena<f32>,
    /// The vertex indices of every triangle.
    indices: Arena<u32>,
    /// The triangles of zero area, in order.
    void: Vec<u32>,
    bounds: Bounds,
}

/// Vertices or triangles that a thread checks at once.
const PART: usize = 1 << 15;

impl Mesh {
    /// Check and keep a mesh.
    ///
    /// Triangles of exactly zero area (decided in double precision) stay in the numbering but are never hit.
    ///
    /// # Errors
    /// [`Error::Mesh`] for a vertex that is not finite or larger than [`MAX_COORDINATE`], an index out of range, or
    /// more than 2^27 triangles; [`Error::OutOfMemory`].
    pub fn new(vertices: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Result<Self, Error> {
        Self::copied(&vertices, &triangles)
    }

    /// The same of slices.
    ///
    /// # Errors
    /// As for [`Mesh::new`].
    pub fn copied(vertices: &[Vec3], triangles: &[[u32; 3]]) -> Result<Self, Error> {
        Self::written(vertices.len(), triangles.len(), |to_vertices, to_triangles| {
            to_vertices.copy_from_slice(vertices);
            to_triangles.copy_from_slice(triangles);
            Ok(())
        })
    }

    /// The same of what `write` writes to all vertices and all triangles; whatever it leaves is arbitrary.
    ///
    /// # Errors
    /// As for [`Mesh::new`]; those of `write`.
    pub fn written<E: From<Error>>(
        vertex_count: usize,
        triangle_count: usize,
        write: impl FnOnce(&mut [Vec3], &mut [[u32; 3]]) -> Result<(), E>,
    ) -> Result<Self, E> {
        if triangle_count > MOST_TRIANGLES {
            let most = format!("{triangle_count} triangles; at most {MOST_TRIANGLES} fit: split the scene");
            return Err(Error::Mesh(most).into());
        }
        let mut numbers = Arena::stale(3 * vertex_count + 1, "the list of vertices")?;
        let mut indices = Arena::stale(3 * triangle_count, "the list of triangles")?;
        numbers[3 * vertex_count] = 0.0;
        write(bytemuck::cast_slice_mut(&mut numbers[..3 * vertex_count]), bytemuck::cast_slice_mut(&mut indices))?;
        let mut mesh = Self { numbers, indices, void: Vec::new(), bounds: Bounds::EMPTY };
        mesh.check()?;
        Ok(mesh)
    }

    /// Find faults, what has no area, and the box around the rest.
    fn check(&mut self) -> Result<(), Error> {
        let job = Job::new();
        work::for_each(0, self.numbers.chunks(3 * PART).enumerate(), &job, |(part, numbers)| {
            check_vertices(numbers, part * PART)
        })?;
        let parts = self.triangles().chunks(PART);
        let mut found = vec![Found::NOTHING; parts.len()];
        let vertex_count = self.vertices().len();
        work::for_each(0, parts.zip(&mut found).enumerate(), &job, |(part, (triangles, found))| {
            check_triangles(triangles, part * PART, vertex_count)?;
            *found = self.look(part * PART..part * PART + triangles.len());
            Ok(())
        })?;
        for found in found {
            self.void.extend(found.void);
            self.bounds = self.bounds.union(&found.bounds.into());
        }
        Ok(())
    }

    fn look(&self, triangles: Range<usize>) -> Found {
        let (mut found, reader) = (Found::NOTHING, self.reader());
        for triangle in triangles {
            let corners = reader.corners(triangle as u32);
            if is_degenerate(corners) {
                found.void.push(triangle as u32);
            } else {
                found.bounds = found.bounds.union(&BoundsA::of_aligned_corners(corners));
            }
        }
        found
    }

    /// Vertex positions.
    #[inline(always)]
    pub fn vertices(&self) -> &[Vec3] {
        bytemuck::cast_slice(&self.numbers[..self.numbers.len() - 1])
    }

    /// Vertex indices of every triangle.
    #[inline(always)]
    pub fn triangles(&self) -> &[[u32; 3]] {
        bytemuck::cast_slice(&self.indices)
    }

    /// How many triangles can be hit: all but those of zero area.
    pub fn solid_count(&self) -> usize {
        self.triangles().len() - self.void.len()
    }

    /// The triangles that can be hit, in order, without the first `skipped` of them.
    pub fn solid(&self, skipped: usize) -> impl Iterator<Item = u32> + Clone + '_ {
        // Before the triangle that is asked for are `skipped` solid ones, and the void ones less than it.
        let (mut before, mut end) = (0, self.void.len());
        while before < end {
            let middle = before.midpoint(end);
            let is_before = self.void[middle] as usize - middle <= skipped;
            (before, end) = if is_before { (middle + 1, end) } else { (before, middle) };
        }
        let mut void = self.void[before..].iter().copied().peekable();
        ((skipped + before) as u32..self.triangles().len() as u32)
            .filter(move |&triangle| void.next_if_eq(&triangle).is_none())
    }

    /// How many triangles have no area.
    pub fn degenerate_count(&self) -> usize {
        self.void.len()
    }

    /// The box around all triangles that can be hit; empty where there is none.
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// The three corners of a triangle.
    #[inline(always)]
    pub fn corners(&self, triangle: u32) -> [Vec3; 3] {
        let [a, b, c] = self.reader().places(triangle);
        [Vec3::from_array(*a), Vec3::from_array(*b), Vec3::from_array(*c)]
    }

    /// For those who go through many triangles.
    #[inline(always)]
    pub fn reader(&self) -> Reader<'_> {
        Reader { triangles: self.triangles(), numbers: &self.numbers }
    }

    /// The unit geometric normal of a triangle, by the right-hand rule over its corners.
    pub fn normal(&self, triangle: u32) -> Vec3 {
        let [a, b, c] = self.corners(triangle).map(|corner| corner.as_dvec3());
        (b - a).cross(c - a).normalize_or_zero().as_vec3()
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.numbers) + size_of_val(&*self.indices) + size_of_val(&*self.void)
    }
}

/// A mesh's triangles at hand.
#[derive(Clone, Copy)]
pub struct Reader<'a> {
    triangles: &'a [[u32; 3]],
    numbers: &'a [f32],
}

impl<'a> Reader<'a> {
    /// Where the three corners of a triangle stand.
    #[inline(always)]
    pub fn places(&self, triangle: u32) -> [&'a [f32; 3]; 3] {
        let [a, b, c] = self.triangles[triangle as usize];
        [self.place(a), self.place(b), self.place(c)]
    }

    /// The three corners of a triangle, and a number behind each.
    #[inline(always)]
    pub fn rows(&self, triangle: u32) -> [&'a [f32; 4]; 3] {
        let [a, b, c] = self.triangles[triangle as usize];
        [self.numbers(a), self.numbers(b), self.numbers(c)]
    }

    /// Ask for the indices of a triangle's vertices, if there is one of this number.
    #[inline(always)]
    pub fn warm_triangle<S: Simd>(&self, simd: S, triangle: u32) {
        if let Some(indices) = self.triangle(triangle) {
            simd.prefetch(indices);
        }
    }

    /// Ask for the corners of a triangle, likewise: for the first, near which the others mostly are.
    #[inline(always)]
    pub fn warm_corners<S: Simd>(&self, simd: S, triangle: u32) {
        if let Some(&[corner, ..]) = self.triangle(triangle) {
            simd.prefetch(self.numbers(corner));
        }
    }

    #[inline(always)]
    fn place(&self, vertex: u32) -> &'a [f32; 3] {
        self.numbers[3 * vertex as usize..].first_chunk().expect("a vertex has three coordinates")
    }

    /// The three corners of a triangle, in aligned vectors.
    #[inline(always)]
    pub fn corners(&self, triangle: u32) -> [Vec3A; 3] {
        let [a, b, c] = self.triangles[triangle as usize];
        [self.vertex(a), self.vertex(b), self.vertex(c)]
    }

    /// The vertex indices of a triangle, if there is one of this number.
    #[inline(always)]
    pub fn triangle(&self, triangle: u32) -> Option<&'a [u32; 3]> {
        self.triangles.get(triangle as usize)
    }

    /// The coordinates of a vertex, and a number behind them.
    #[inline(always)]
    pub fn numbers(&self, index: u32) -> &'a [f32; 4] {
        self.numbers[3 * index as usize..].first_chunk().expect("a number stands behind the last vertex")
    }

    #[inline(always)]
    fn vertex(&self, index: u32) -> Vec3A {
        Vec3A::from_vec4(Vec4::from_slice(self.numbers(index)))
    }
}

/// What a look at some triangles finds.
#[derive(Clone)]
struct Found {
    bounds: BoundsA,
    void: Vec<u32>,
}

impl Found {
    const NOTHING: Self = Self { bounds: BoundsA::EMPTY, void: Vec::new() };
}

/// A component of a cross product is certainly not zero where it exceeds this share of the products whose difference it
/// is: each is off by less than 4 units of 2^-24, and double precision would see that, too.
const CERTAIN: f32 = 1e-5;

/// Products below this may have lost bits to the smallest numbers.
const SMALL: f32 = 1e-30;

#[inline(always)]
fn is_degenerate([a, b, c]: [Vec3A; 3]) -> bool {
    let (one, other) = (b - a, c - a);
    let products = [one.yzx() * other.zxy(), one.zxy() * other.yzx()];
    let cross = (products[0] - products[1]).abs();
    let sum = products[0].abs() + products[1].abs();
    let is_certain = cross.cmpgt(sum * CERTAIN) & sum.cmpgt(Vec3A::splat(SMALL));
    !is_certain.any() && is_exactly_degenerate([a, b, c])
}

#[cold]
fn is_exactly_degenerate(corners: [Vec3A; 3]) -> bool {
    let [a, b, c] = corners.map(|corner| corner.as_dvec3());
    (b - a).cross(c - a) == DVec3::ZERO
}

fn check_vertices(numbers: &[f32], first: usize) -> Result<(), Error> {
    // The bits of positive numbers, infinity and what is no number are in order.
    let magnitude = |number: &f32| number.to_bits() & !(1 << 31);
    if numbers.iter().map(magnitude).fold(0, u32::max) <= MAX_COORDINATE.to_bits() {
        return Ok(());
    }
    let index = numbers.iter().position(|number| magnitude(number) > MAX_COORDINATE.to_bits()).unwrap_or(0) / 3;
    let [x, y, z] = [0, 1, 2].map(|k| numbers[3 * index + k]);
    let index = first + index;
    Err(Error::Mesh(format!(
        "vertex {index} is ({x}, {y}, {z}); coordinates must be finite and at most {MAX_COORDINATE:e} in \
         magnitude: repair the mesh, or scale it down"
    )))
}

fn check_triangles(triangles: &[[u32; 3]], first: usize, vertex_count: usize) -> Result<(), Error> {
    let largest = triangles.as_flattened().iter().copied().fold(0, u32::max);
    if (largest as usize) < vertex_count {
        return Ok(());
    }
    let is_fault = |triangle: &[u32; 3]| triangle.iter().any(|&index| index as usize >= vertex_count);
    let fault = triangles.iter().position(is_fault);
    fault.map_or(Ok(()), |index| {
        let (triangle, index) = (triangles[index], first + index);
        Err(Error::Mesh(format!(
            "triangle {index} has vertex indices {triangle:?}, but there are only {vertex_count} vertices: every \
             index must be less than that"
        )))
    })
}
