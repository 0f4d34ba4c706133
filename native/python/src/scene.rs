//! `Scene`.

use std::sync::Arc;

use espalier_core::render::{self, SceneSettings};
use glam::{Vec2, Vec3};
use pyo3::prelude::*;

use crate::{
    arrays::{self, Argument, Dense},
    errors::{Kind, OrRaise, guard},
    fields::Fields,
    indices::Indices,
    light, material,
    mesh::Mesh,
};

/// A mesh with materials, lights and a world of one colour, checked and copied once; immutable, and safe to share
/// between threads. Colours are scene-linear RGB, lengths in metres, angles in radians.
///
/// materials: mappings with any of base_color (r, g, b), texture (index of the texture that takes the base colour's
/// place, -1 for none), metallic and roughness 0..1, emission (r, g, b) radiance. A mirror where metallic >= 0.5 and
/// roughness <= 0.2. At least one material.
/// material_index: (m,) integers, the material of every triangle; None for the first everywhere.
/// corner_normals: (m, 3, 3) float32 unit shading normals of every triangle's corners; None for flat surfaces.
/// corner_uvs: (m, 3, 2) float32 texture coordinates; None for none.
/// textures: mappings with pixels (h, w, 4) float32, rows bottom-up; interpolation "linear" or "closest"; extension
/// "repeat", "extend" or "clip".
/// lights: mappings with kind "point", "sun", "spot" or "area"; matrix (4, 4) light to world, shining along its -Z;
/// color (r, g, b); power W (sun: W/m2); radius and soft_falloff (point, spot); angle (sun); spot_size, the full cone,
/// and spot_blend 0..1; shape "square", "rectangle", "disk" or "ellipse", size, size_y and spread (area), scaled by the
/// matrix; normalize, whether power is independent of size; shadow. All but kind and matrix can be left out.
/// world: (r, g, b) radiance from everywhere outside; black if left out.
///
/// Raises SceneError, which names the material, texture, light or array at fault, and OutOfMemory.
#[pyclass(frozen, module = "espalier_rt")]
pub struct Scene {
    scene: Arc<render::Scene>,
    mesh: Py<Mesh>,
}

impl Scene {
    /// The core's scene.
    pub fn core(&self) -> &render::Scene {
        &self.scene
    }
}

#[pymethods]
impl Scene {
    #[new]
    #[allow(clippy::too_many_arguments, reason = "they are keywords in Python")]
    #[pyo3(signature = (mesh, *, materials, material_index=None, corner_normals=None, corner_uvs=None, textures=None,
        lights=None, world=(0.0, 0.0, 0.0)))]
    fn new(
        mesh: &Bound<'_, Mesh>,
        materials: &Bound<'_, PyAny>,
        material_index: Option<&Bound<'_, PyAny>>,
        corner_normals: Option<&Bound<'_, PyAny>>,
        corner_uvs: Option<&Bound<'_, PyAny>>,
        textures: Option<&Bound<'_, PyAny>>,
        lights: Option<&Bound<'_, PyAny>>,
        world: (f32, f32, f32),
    ) -> PyResult<Self> {
        let py = mesh.py();
        guard(py, || {
            let settings = SceneSettings {
                materials: Fields::each(materials, "material", &material::MATERIAL, material::material)?,
                textures: optional(textures, |items| {
                    Fields::each(items, "texture", &material::TEXTURE, material::texture)
                })?,
                lights: optional(lights, |items| Fields::each(items, "light", &light::LIGHT, light::light))?,
                material_index: material_index.map(materials_of_triangles).transpose()?,
                corner_normals: corner_normals.map(normals).transpose()?,
                corner_uvs: corner_uvs.map(uvs).transpose()?,
                world: world.into(),
            };
            let core_mesh = Arc::clone(mesh.get().core());
            let scene = py.detach(|| render::Scene::new(core_mesh, settings)).or_raise(py)?;
            Ok(Self { scene: Arc::new(scene), mesh: mesh.clone().unbind() })
        })
    }

    /// The mesh it dresses.
    #[getter]
    fn mesh(&self, py: Python<'_>) -> Py<Mesh> {
        self.mesh.clone_ref(py)
    }

    fn __repr__(&self) -> String {
        let SceneSettings { materials, textures, lights, .. } = self.scene.settings();
        let triangles = self.scene.mesh().triangles().len();
        format!(
            "Scene(triangles={triangles}, materials={}, textures={}, lights={})",
            materials.len(),
            textures.len(),
            lights.len()
        )
    }
}

fn optional<'py, T>(
    items: Option<&Bound<'py, PyAny>>,
    read: impl Fn(&Bound<'py, PyAny>) -> PyResult<Vec<T>>,
) -> PyResult<Vec<T>> {
    items.map_or_else(|| Ok(Vec::new()), read)
}

fn materials_of_triangles(value: &Bound<'_, PyAny>) -> PyResult<Vec<u32>> {
    let indices = Indices::<1>::new(value, Argument { name: "material_index", error: Kind::Scene })?;
    let (py, view) = (value.py(), indices.view());
    py.detach(|| view.rows()).map(Vec::into_flattened).or_raise(py)
}

fn normals(value: &Bound<'_, PyAny>) -> PyResult<Vec<[Vec3; 3]>> {
    let argument = Argument { name: "corner_normals", error: Kind::Scene };
    let array = Dense::new(value, "(m, 3, 3)", |shape| matches!(shape, [_, 3, 3]), argument)?;
    let (py, values) = (value.py(), array.values());
    let corners = |&[ax, ay, az, bx, by, bz, cx, cy, cz]: &[f32; 9]| {
        [Vec3::new(ax, ay, az), Vec3::new(bx, by, bz), Vec3::new(cx, cy, cz)]
    };
    py.detach(|| arrays::grouped(values, "the shading normals", corners)).or_raise(py)
}

fn uvs(value: &Bound<'_, PyAny>) -> PyResult<Vec<[Vec2; 3]>> {
    let argument = Argument { name: "corner_uvs", error: Kind::Scene };
    let array = Dense::new(value, "(m, 3, 2)", |shape| matches!(shape, [_, 3, 2]), argument)?;
    let (py, values) = (value.py(), array.values());
    let corners = |&[au, av, bu, bv, cu, cv]: &[f32; 6]| [Vec2::new(au, av), Vec2::new(bu, bv), Vec2::new(cu, cv)];
    py.detach(|| arrays::grouped(values, "the texture coordinates", corners)).or_raise(py)
}
