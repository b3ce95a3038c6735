"""Saves a frame from Blender for the example `filter` (dumps.md).

    blender scene.blend --background --python docs/dump.py    # writes dump/ beside the scene
"""
import json, os
import bpy

out = bpy.path.abspath("//dump")  # beside the scene
scene, layer = bpy.context.scene, bpy.context.view_layer
scene.render.engine = "CYCLES"
layer.use_pass_diffuse_direct = layer.use_pass_diffuse_indirect = True
layer.use_pass_z = layer.use_pass_material_index = True

render = scene.render
image = render.image_settings
if bpy.app.version >= (5, 0):
    image.media_type = "MULTI_LAYER_IMAGE"
    light, index = ["Diffuse Direct", "Diffuse Indirect"], "Material Index"
else:
    light, index = ["DiffDir", "DiffInd"], "IndexMA"
image.file_format, image.color_depth, image.exr_codec = "OPEN_EXR_MULTILAYER", "32", "ZIP"
render.filepath = os.path.join(out, "render.exr")
bpy.ops.render.render(write_still=True)

width, height = (n * render.resolution_percentage // 100
                 for n in (render.resolution_x, render.resolution_y))
p = scene.camera.calc_matrix_camera(
    bpy.context.evaluated_depsgraph_get(), x=width, y=height,
    scale_x=render.pixel_aspect_x, scale_y=render.pixel_aspect_y)
p[2] = (p[2] + p[3]) / 2

def named(name):
    return {"file": "render.exr", "layer": f"{layer.name}.{name}"}

with open(os.path.join(out, "gbuffer.json"), "w") as f:
    json.dump({
        "width": width, "height": height,
        "projection": [p[row][column] for column in range(4) for row in range(4)],
        "mm_per_unit": 1000 * scene.unit_settings.scale_length,
        "files": {
            "irradiance": [named(name) for name in light],
            "depth": named("Depth"),
            "profile_id": named(index),
        },
    }, f)
