//! Triangle meshes, validated once.

use glam::{DVec3, Vec3};

use crate::{Error, bounds::Bounds, error};

/// No coordinate may exceed this magnitude: squares of coordinates must stay finite in single precision.
pub const MAX_COORDINATE: f32 = 1e18;

/// More triangles, or references to triangles, cannot be told apart by the indices of a structure.
pub const MOST_TRIANGLES: usize = 1 << 27;

/// A triangle mesh whose every vertex is finite and whose every index is in range.
#[derive(Debug)]
pub struct Mesh {
    vertices: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    solid: Vec<u32>,
    bounds: Bounds,
}

impl Mesh {
    /// Check and keep a mesh.
    ///
    /// Triangles of exactly zero area (decided in double precision) stay in the numbering but are never hit.
    ///
    /// # Errors
    /// [`Error::Mesh`] for a vertex that is not finite or larger than [`MAX_COORDINATE`], an index out of range, or
    /// more than 2^27 triangles.
    pub fn new(vertices: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Result<Self, Error> {
        check_vertices(&vertices)?;
        check_triangles(&triangles, vertices.len())?;
        let mut solid = error::reserve(triangles.len(), "the list of triangles")?;
        solid.extend((0..triangles.len() as u32).filter(|&t| !is_degenerate(&vertices, triangles[t as usize])));
        let bounds = Bounds::of_points(solid.iter().flat_map(|&t| corners(&vertices, triangles[t as usize])));
        Ok(Self { vertices, triangles, solid, bounds })
    }

    /// Vertex positions.
    pub fn vertices(&self) -> &[Vec3] {
        &self.vertices
    }

    /// Vertex indices of every triangle.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The triangles that can be hit: all but those of zero area, in order.
    pub fn solid(&self) -> &[u32] {
        &self.solid
    }

    /// How many triangles have no area.
    pub fn degenerate_count(&self) -> usize {
        self.triangles.len() - self.solid.len()
    }

    /// The box around all triangles that can be hit; empty where there is none.
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// The three corners of a triangle.
    #[inline]
    pub fn corners(&self, triangle: u32) -> [Vec3; 3] {
        corners(&self.vertices, self.triangles[triangle as usize])
    }

    /// The unit geometric normal of a triangle, by the right-hand rule over its corners.
    pub fn normal(&self, triangle: u32) -> Vec3 {
        let [a, b, c] = self.corners(triangle).map(|corner| corner.as_dvec3());
        (b - a).cross(c - a).normalize_or_zero().as_vec3()
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.vertices) + size_of_val(&*self.triangles) + size_of_val(&*self.solid)
    }
}

#[inline]
fn corners(vertices: &[Vec3], triangle: [u32; 3]) -> [Vec3; 3] {
    triangle.map(|index| vertices[index as usize])
}

fn is_degenerate(vertices: &[Vec3], triangle: [u32; 3]) -> bool {
    let [a, b, c] = corners(vertices, triangle).map(|corner| corner.as_dvec3());
    (b - a).cross(c - a) == DVec3::ZERO
}

fn check_vertices(vertices: &[Vec3]) -> Result<(), Error> {
    let fault = vertices.iter().position(|v| !v.is_finite() || v.abs().max_element() > MAX_COORDINATE);
    fault.map_or(Ok(()), |index| {
        let [x, y, z] = vertices[index].to_array();
        Err(Error::Mesh(format!(
            "vertex {index} is ({x}, {y}, {z}); coordinates must be finite and at most {MAX_COORDINATE:e} in \
             magnitude: repair the mesh, or scale it down"
        )))
    })
}

fn check_triangles(triangles: &[[u32; 3]], vertex_count: usize) -> Result<(), Error> {
    if triangles.len() > MOST_TRIANGLES {
        let count = triangles.len();
        return Err(Error::Mesh(format!("{count} triangles; at most {MOST_TRIANGLES} fit: split the scene")));
    }
    let fault = triangles.iter().position(|t| t.iter().any(|&index| index as usize >= vertex_count));
    fault.map_or(Ok(()), |index| {
        let triangle = triangles[index];
        Err(Error::Mesh(format!(
            "triangle {index} has vertex indices {triangle:?}, but there are only {vertex_count} vertices: every \
             index must be less than that"
        )))
    })
}
