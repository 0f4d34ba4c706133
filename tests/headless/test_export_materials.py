"""Export of materials and their images, exactly where the core can, noted where it can not."""

import bpy
import building
import numpy as np
import pytest


@pytest.fixture(autouse=True)
def _empty(scene):
    """Every test here starts from a scene without objects."""


def exported(of: bpy.types.Material | None):
    """(material, data) of a square with that material."""
    holder = building.square()
    holder.data.materials.append(of)
    data = building.export()
    return data.materials[data.geometry.material_index[0]], data


def linked(of: bpy.types.Material, name: str, node: str) -> bpy.types.Node:
    """A new node whose first output goes into an input of the material's shader."""
    tree = of.node_tree
    new = tree.nodes.new(node)
    tree.links.new(new.outputs[0], building.shader(of).inputs[name])
    return new


def test_principled_constants():
    material, data = exported(
        building.material("M", Base_Color=(0.1, 0.2, 0.3, 1), Metallic=0.75, Roughness=0.125,
                          Emission_Color=(1, 0.5, 0.25, 1), Emission_Strength=4.0)
    )  # fmt: skip
    np.testing.assert_allclose(material.base_color, (0.1, 0.2, 0.3), rtol=1e-6)
    assert (material.metallic, material.roughness, material.texture) == (0.75, 0.125, -1)
    assert material.emission == (4.0, 2.0, 1.0)
    assert data.warnings == ()


def test_no_material_is_light_grey():
    material, data = exported(None)
    assert material.base_color == (0.8, 0.8, 0.8)
    assert data.warnings == ()


def test_a_diffuse_shader():
    material, data = exported(building.material("D", "ShaderNodeBsdfDiffuse", Color=(0.5, 0.25, 0.125, 1)))
    assert (material.base_color, material.metallic) == ((0.5, 0.25, 0.125), 0.0)
    assert data.warnings == ()


def test_a_glossy_shader_is_a_metal():
    glossy = building.material("G", "ShaderNodeBsdfAnisotropic", Color=(0.5, 0.25, 0.125, 1), Roughness=0.0)
    material, data = exported(glossy)
    assert (material.base_color, material.metallic, material.roughness) == ((0.5, 0.25, 0.125), 1.0, 0.0)
    assert data.warnings == ()


def test_an_emission_shader_reflects_nothing():
    material, data = exported(building.material("E", "ShaderNodeEmission", Color=(1, 0.5, 0, 1), Strength=3.0))
    assert (material.base_color, material.emission) == ((0.0, 0.0, 0.0), (3.0, 1.5, 0.0))
    assert data.warnings == ()


def test_emission_added_to_a_shader():
    new = building.material("M", "ShaderNodeBsdfDiffuse", Color=(0.5, 0.5, 0.5, 1))
    tree = new.node_tree
    emission, add = tree.nodes.new("ShaderNodeEmission"), tree.nodes.new("ShaderNodeAddShader")
    emission.inputs["Strength"].default_value = 2.0
    tree.links.new(emission.outputs[0], add.inputs[0])
    tree.links.new(building.shader(new).outputs[0], add.inputs[1])
    tree.links.new(add.outputs[0], tree.nodes["Material Output"].inputs["Surface"])
    material, data = exported(new)
    assert (material.base_color, material.emission) == ((0.5, 0.5, 0.5), (2.0, 2.0, 2.0))
    assert data.warnings == ()


def test_constants_arrive_through_rgb_value_reroute_and_group():
    new = building.material("M")
    tree = new.node_tree
    linked(new, "Metallic", "ShaderNodeValue").outputs[0].default_value = 0.5
    group = bpy.data.node_groups.new("Colour", "ShaderNodeTree")
    group.interface.new_socket("Color", in_out="INPUT", socket_type="NodeSocketColor")
    group.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
    inside, outside = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    group.links.new(inside.outputs[0], outside.inputs[0])
    holder, rgb, reroute = (tree.nodes.new(f"{name}") for name in ("ShaderNodeGroup", "ShaderNodeRGB", "NodeReroute"))
    holder.node_tree = group
    rgb.outputs[0].default_value = (0.5, 0.25, 0.125, 1)
    tree.links.new(rgb.outputs[0], reroute.inputs[0])
    tree.links.new(reroute.outputs[0], holder.inputs[0])
    tree.links.new(holder.outputs[0], building.shader(new).inputs["Base Color"])
    material, data = exported(new)
    assert (material.base_color, material.metallic) == ((0.5, 0.25, 0.125), 0.5)
    assert data.warnings == ()


def test_a_muted_node_passes_its_input_on():
    new = building.material("M")
    invert = linked(new, "Base Color", "ShaderNodeInvert")
    invert.inputs["Color"].default_value = (0.5, 0.25, 0.125, 1)
    invert.mute = True
    material, _ = exported(new)
    assert material.base_color == (0.5, 0.25, 0.125)


def test_a_texture_is_scene_linear_with_rows_bottom_up():
    pixels = np.zeros((2, 3, 4), np.float32)
    pixels[0, :, 0], pixels[1, :, 1], pixels[..., 3] = 128 / 255, 10 / 255, 1.0
    material, data = exported(building.textured("M", building.image("Image", pixels)))
    texture = data.textures[material.texture]
    assert texture.pixels.shape == (2, 3, 4)
    assert texture.pixels.dtype == np.float32
    # sRGB 128 is 0.21586, and 10, on the straight part of the curve, 10 / 255 / 12.92.
    np.testing.assert_allclose(texture.pixels[0, 0], (0.21586050, 0, 0, 1), atol=1e-6)
    np.testing.assert_allclose(texture.pixels[1, 0], (0, 10 / 255 / 12.92, 0, 1), atol=1e-7)
    assert (texture.interpolation, texture.extension) == ("linear", "repeat")
    assert data.warnings == ()


@pytest.mark.parametrize("space", ["Non-Color", "Linear Rec.709"])
def test_linear_byte_images_are_not_converted(space):
    pixels = np.full((2, 2, 4), 51 / 255, np.float32)
    material, data = exported(building.textured("M", building.image("Image", pixels, space=space)))
    np.testing.assert_allclose(data.textures[material.texture].pixels, 51 / 255, atol=1e-6)
    assert data.warnings == ()


def test_float_images_are_scene_linear_already():
    pixels = np.full((2, 2, 4), (0.5, 2.5, 0.25, 1.0), np.float32)
    of = building.image("Image", pixels, float_buffer=True, space="Linear Rec.709")
    material, data = exported(building.textured("M", of))
    np.testing.assert_allclose(data.textures[material.texture].pixels, pixels, atol=1e-6)


def test_an_unknown_color_space_is_noted():
    of = building.image("Image", np.ones((1, 1, 4)), space="Filmic sRGB")
    _, data = exported(building.textured("M", of))
    assert data.warnings == ("Image 'Image': color space Filmic sRGB is traced as sRGB",)


@pytest.mark.parametrize("packed", [False, True])
def test_file_and_packed_images(tmp_path, packed):
    written = building.image("Written", np.full((2, 2, 4), 1.0))
    written.filepath_raw, written.file_format = str(tmp_path / "white.png"), "PNG"
    written.save()
    loaded = bpy.data.images.load(str(tmp_path / "white.png"))
    if packed:
        loaded.pack()
        (tmp_path / "white.png").unlink()
    material, data = exported(building.textured("M", loaded))
    np.testing.assert_allclose(data.textures[material.texture].pixels, 1.0)
    assert data.warnings == ()


def test_interpolation_and_extension_and_their_approximations():
    new = building.textured("M", building.image("Image", np.ones((1, 1, 4))))
    node = next(node for node in new.node_tree.nodes if node.type == "TEX_IMAGE")
    node.interpolation, node.extension = "Closest", "CLIP"
    material, data = exported(new)
    texture = data.textures[material.texture]
    assert (texture.interpolation, texture.extension) == ("closest", "clip")
    node.interpolation, node.extension = "Cubic", "MIRROR"
    data = building.export()
    assert (data.textures[0].interpolation, data.textures[0].extension) == ("linear", "repeat")
    assert len(data.warnings) == 2


def test_two_materials_share_the_pixels_of_one_image():
    of = building.image("Image", np.ones((1, 1, 4)))
    exported(building.textured("A", of))
    exported(building.textured("B", of))
    data = building.export()
    assert len(data.textures) == 1


@pytest.mark.parametrize("kind", ["file", "none"])
def test_a_missing_image_is_pink_and_warned_of(tmp_path, kind):
    missing = None
    if kind == "file":
        missing = bpy.data.images.new("Missing", 1, 1)
        missing.source, missing.filepath = "FILE", str(tmp_path / "gone.png")
    material, data = exported(building.textured("M", missing))
    assert material.base_color == (1.0, 0.0, 1.0)
    assert material.texture == -1
    assert len(data.warnings) == 1
    assert "pink" in data.warnings[0]


def test_what_varies_is_approximated_with_one_warning_a_material():
    new = building.material("Rich", Transmission_Weight=1.0)
    new.diffuse_color = (0.1, 0.2, 0.3, 1.0)
    linked(new, "Base Color", "ShaderNodeTexNoise")
    linked(new, "Roughness", "ShaderNodeTexNoise")
    linked(new, "Normal", "ShaderNodeNormalMap")
    building.shader(new).inputs["Roughness"].default_value = 0.25
    material, data = exported(new)
    np.testing.assert_allclose(material.base_color, (0.1, 0.2, 0.3), rtol=1e-6)
    assert material.roughness == 0.25
    assert data.warnings == ("Material 'Rich': approximated normal map, transmission weight, base color, roughness",)


def test_a_shader_that_cannot_be_represented_is_the_viewport_color():
    new = building.material("Glass", "ShaderNodeBsdfGlass")
    new.diffuse_color = (0.25, 0.5, 0.75, 1.0)
    material, data = exported(new)
    assert (material.base_color, material.metallic) == ((0.25, 0.5, 0.75), 0.0)
    assert data.warnings == ("Material 'Glass': approximated shader Glass BSDF",)


def test_texture_coordinates_other_than_uv_are_approximated():
    new = building.textured("M", building.image("Image", np.ones((1, 1, 4))))
    tree = new.node_tree
    coordinates = tree.nodes.new("ShaderNodeTexCoord")
    node = next(node for node in tree.nodes if node.type == "TEX_IMAGE")
    tree.links.new(coordinates.outputs["UV"], node.inputs["Vector"])
    material, data = exported(new)
    assert material.texture == 0
    assert data.warnings == ()
    tree.links.new(coordinates.outputs["Generated"], node.inputs["Vector"])
    data = building.export()
    assert data.textures == ()
    assert data.warnings == ("Material 'M': approximated texture coordinates",)


def test_a_material_without_a_shader_is_black():
    new = building.material("M")
    new.node_tree.links.clear()
    assert exported(new)[0].base_color == (0.0, 0.0, 0.0)


def test_an_emission_color_from_an_image_is_its_mean():
    new = building.material("M", Emission_Strength=2.0)
    pixels = [[(1, 0, 0, 1), (0, 0.5, 0, 1)]]
    linked(new, "Emission Color", "ShaderNodeTexImage").image = building.image(
        "Image", pixels, float_buffer=True, space="Linear Rec.709"
    )
    material, data = exported(new)
    np.testing.assert_allclose(material.emission, (1.0, 0.5, 0.0), atol=1e-6)
    assert data.warnings == ("Material 'M': approximated emission color",)


def on_map(name: str, uv_map: str) -> bpy.types.Material:
    """A textured material whose image lies on a UV map by name."""
    new = building.textured(name, building.image(name, np.ones((1, 1, 4))))
    node = next(node for node in new.node_tree.nodes if node.type == "TEX_IMAGE")
    coordinates = new.node_tree.nodes.new("ShaderNodeUVMap")
    coordinates.uv_map = uv_map
    new.node_tree.links.new(coordinates.outputs["UV"], node.inputs["Vector"])
    return new


def test_each_slot_gets_the_uv_map_that_its_material_names():
    holder = building.add("Two", building.mesh("Two", building.SQUARE, ((0, 1, 2), (0, 2, 3))))
    for index, name in enumerate(("First", "Second", "Third")):
        holder.data.uv_layers.new(name=name).uv.foreach_set("vector", np.full(12, index + 1, np.float32))
    holder.data.uv_layers["First"].active_render = True
    for material in (on_map("A", ""), on_map("B", "Third")):
        holder.data.materials.append(material)
    holder.data.polygons[1].material_index = 1
    data = building.export()
    np.testing.assert_array_equal(data.geometry.corner_uvs[0], np.ones((3, 2)))
    np.testing.assert_array_equal(data.geometry.corner_uvs[1], np.full((3, 2), 3.0))
    assert data.warnings == ()
    holder.material_slots[0].material = on_map("C", "Gone")
    np.testing.assert_array_equal(building.export().geometry.corner_uvs[0], np.zeros((3, 2)))


@pytest.mark.parametrize("kind", ["POINT", "TEXTURE", "VECTOR"])
def test_mapping_nodes_move_the_coordinates_of_their_material_alone(kind):
    from mathutils import Euler, Vector

    new = building.textured("M", building.image("Image", np.ones((1, 1, 4))))
    tree = new.node_tree
    node = next(node for node in tree.nodes if node.type == "TEX_IMAGE")
    mapping, coordinates = tree.nodes.new("ShaderNodeMapping"), tree.nodes.new("ShaderNodeTexCoord")
    tree.links.new(coordinates.outputs["UV"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs[0], node.inputs["Vector"])
    mapping.vector_type = kind
    location, rotation, scale = Vector((0.25, -0.5, 1.0)), Euler((0.0, 0.0, 0.3)), Vector((2.0, 3.0, 1.0))
    mapping.inputs["Rotation"].default_value, mapping.inputs["Scale"].default_value = rotation, scale
    if kind != "VECTOR":
        mapping.inputs["Location"].default_value = location
    uvs = np.array([0, 0, 1, 0, 1, 1, 0, 1], np.float32)
    for name, material in (("Moved", new), ("Plain", building.material("Plain"))):
        holder = building.square(name)
        holder.data.uv_layers.new(name="Map").uv.foreach_set("vector", uvs)
        holder.data.materials.append(material)
    data = building.export()
    assert data.warnings == ()

    def moved(point: tuple[float, float]) -> tuple[float, float]:
        """What Blender's manual says of the node."""
        vector = Vector((*point, 0.0))
        if kind == "TEXTURE":
            vector = vector - location
            vector.rotate(rotation.to_matrix().inverted())
            return vector.x / scale.x, vector.y / scale.y
        vector = vector * scale
        vector.rotate(rotation)
        return (vector + (location if kind == "POINT" else Vector()))[:2]

    names = np.array([data.materials[index].name for index in data.geometry.material_index])
    plain = data.geometry.corner_uvs[names == "Plain"].reshape(-1, 2)
    assert {tuple(uv) for uv in plain.tolist()} == {(0, 0), (1, 0), (1, 1), (0, 1)}
    expected = [moved(tuple(uv)) for uv in plain.tolist()]
    np.testing.assert_allclose(data.geometry.corner_uvs[names == "M"].reshape(-1, 2), expected, atol=1e-5)
