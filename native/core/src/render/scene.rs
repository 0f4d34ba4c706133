//! Everything but the mesh and the camera, validated once.

use std::sync::Arc;

use glam::{Vec2, Vec3};

use super::{
    light::{Emitter, Light},
    material::Material,
    texture::Texture,
};
use crate::{Error, Mesh};

/// What a scene is made of. Arrays about corners are in the order of the mesh's triangles.
#[derive(Debug, Clone)]
pub struct SceneSettings {
    /// At least one.
    pub materials: Vec<Material>,
    /// The material of every triangle; `None` for the first everywhere.
    pub material_index: Option<Vec<u32>>,
    /// Shading normals of every triangle's corners; `None` for flat surfaces.
    pub corner_normals: Option<Vec<[Vec3; 3]>>,
    /// Texture coordinates of every triangle's corners; `None` where there are none.
    pub corner_uvs: Option<Vec<[Vec2; 3]>>,
    /// Pictures that materials refer to.
    pub textures: Vec<Texture>,
    /// Lamps.
    pub lights: Vec<Light>,
    /// Radiance that comes from everywhere outside the scene.
    pub world: Vec3,
}

impl Default for SceneSettings {
    /// One grey material under a black sky.
    fn default() -> Self {
        Self {
            materials: vec![Material::default()],
            material_index: None,
            corner_normals: None,
            corner_uvs: None,
            textures: Vec::new(),
            lights: Vec::new(),
            world: Vec3::ZERO,
        }
    }
}

/// A mesh with materials, lights and a world.
#[derive(Debug)]
pub struct Scene {
    mesh: Arc<Mesh>,
    settings: SceneSettings,
    emitters: Vec<Emitter>,
}

impl Scene {
    /// Check and keep a scene.
    ///
    /// # Errors
    /// [`Error::Scene`] for arrays of the wrong length, indices out of range, and values that are not finite or out of
    /// range.
    pub fn new(mesh: Arc<Mesh>, settings: SceneSettings) -> Result<Self, Error> {
        check_lengths(&mesh, &settings)?;
        check_indices(&settings)?;
        check_values(&settings)?;
        let emitters = settings.lights.iter().enumerate().map(|(index, light)| {
            let numbered = |error| Error::Scene(format!("light {index}: {error}"));
            Emitter::new(light).map_err(numbered)
        });
        let emitters = emitters.collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect();
        Ok(Self { mesh, settings, emitters })
    }

    /// The mesh it dresses.
    pub fn mesh(&self) -> &Arc<Mesh> {
        &self.mesh
    }

    /// What it was made of.
    pub fn settings(&self) -> &SceneSettings {
        &self.settings
    }

    /// The lights that give any light, ready for sampling.
    pub fn emitters(&self) -> &[Emitter] {
        &self.emitters
    }

    /// Radiance from outside.
    pub fn world(&self) -> Vec3 {
        self.settings.world
    }
}

fn check_lengths(mesh: &Mesh, settings: &SceneSettings) -> Result<(), Error> {
    let count = mesh.triangles().len();
    let lengths = [
        ("material_index", settings.material_index.as_ref().map(Vec::len)),
        ("corner_normals", settings.corner_normals.as_ref().map(Vec::len)),
        ("corner_uvs", settings.corner_uvs.as_ref().map(Vec::len)),
    ];
    for (name, length) in lengths {
        if length.is_some_and(|length| length != count) {
            let length = length.unwrap_or(0);
            return Err(Error::Scene(format!("{name} is for {length} triangles, but the mesh has {count}")));
        }
    }
    Ok(())
}

fn check_indices(settings: &SceneSettings) -> Result<(), Error> {
    let materials = settings.materials.len();
    if materials == 0 {
        return Err(Error::Scene("a scene needs at least one material".into()));
    }
    let indices = settings.material_index.as_deref().unwrap_or(&[]);
    if let Some(triangle) = indices.iter().position(|&index| index as usize >= materials) {
        let index = indices[triangle];
        return Err(Error::Scene(format!(
            "triangle {triangle} has material {index}, but there are only {materials}: indices must be less than that"
        )));
    }
    let textures = settings.textures.len();
    let fault = |material: &Material| material.texture.is_some_and(|texture| texture as usize >= textures);
    settings.materials.iter().position(fault).map_or(Ok(()), |index| {
        Err(Error::Scene(format!("material {index} refers to a texture beyond the {textures} there are")))
    })
}

fn check_values(settings: &SceneSettings) -> Result<(), Error> {
    let world = settings.world;
    if !world.is_finite() {
        return Err(Error::Scene(format!("the world's colour {world} is not finite")));
    }
    let usable = |m: &Material| {
        m.base_color.is_finite() && m.emission.is_finite() && m.metallic.is_finite() && m.roughness.is_finite()
    };
    if let Some(index) = settings.materials.iter().position(|material| !usable(material)) {
        return Err(Error::Scene(format!("material {index} has a value that is not finite")));
    }
    check_corners(settings.corner_normals.as_deref(), "corner_normals", Vec3::is_finite)?;
    check_corners(settings.corner_uvs.as_deref(), "corner_uvs", Vec2::is_finite)
}

fn check_corners<T: Copy>(corners: Option<&[[T; 3]]>, name: &str, good: fn(T) -> bool) -> Result<(), Error> {
    let fault = corners.and_then(|all| all.iter().position(|three| !three.iter().all(|&value| good(value))));
    fault.map_or(Ok(()), |triangle| {
        Err(Error::Scene(format!("{name} of triangle {triangle} are not finite: mend them or leave them out")))
    })
}
