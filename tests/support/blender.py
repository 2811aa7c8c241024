"""Import of an exported file in Blender (bpy), run by tests as a process.

    python blender.py FILE SCALE FRAME[,FRAME...] [PICTURE]

SCALE: of BVH.  Prints one JSON object: `rate`, `range` of the scene, `objects` by type, `bones` by frame and name, metres.
bpy wants an older NumPy than zenocap, so the interpreter may be that of another environment.
"""

import json
import sys

import bpy
import mathutils


def load(path: str, scale: float) -> None:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if path.endswith(".bvh"):
        bpy.ops.import_anim.bvh(filepath=path, global_scale=scale, update_scene_fps=True, update_scene_duration=True)
    elif path.endswith(".glb"):
        bpy.context.scene.render.fps = 30  # before the import: keyframes fall on whole frames
        bpy.ops.import_scene.gltf(filepath=path)
    else:
        bpy.context.scene.render.fps = 30
        bpy.ops.wm.usd_import(filepath=path)


def draw(path: str, armature: bpy.types.Object) -> None:
    """Draw the body from the front right, by the processor."""
    scene = bpy.context.scene
    hips = armature.matrix_world @ armature.pose.bones["Hips"].head
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location = hips + mathutils.Vector((1.8, -4.2, 0.8))
    camera.rotation_euler = (hips - camera.location).to_track_quat("-Z", "Y").to_euler()
    sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    sun.data.energy, sun.rotation_euler = 3.0, (0.6, 0.3, 0.4)
    for one in (camera, sun):
        scene.collection.objects.link(one)
    scene.camera = camera
    scene.render.engine, scene.cycles.samples, scene.cycles.device = "CYCLES", 4, "CPU"
    scene.render.resolution_x, scene.render.resolution_y, scene.render.filepath = 160, 120, path
    bpy.ops.render.render(write_still=True)


def main() -> None:
    path, scale, frames = sys.argv[1], float(sys.argv[2]), [int(frame) for frame in sys.argv[3].split(",")]
    load(path, scale)
    scene = bpy.context.scene
    (armature,) = (one for one in scene.objects if one.type == "ARMATURE")
    bones = {}
    for frame in frames:
        scene.frame_set(frame)
        bones[frame] = {bone.name: [*(armature.matrix_world @ bone.head)] for bone in armature.pose.bones}
    if len(sys.argv) > 4:
        draw(sys.argv[4], armature)
    rate = scene.render.fps / scene.render.fps_base
    span = [scene.frame_start, scene.frame_end]
    found = {"rate": rate, "range": span, "objects": sorted(one.type for one in scene.objects), "bones": bones}
    print("\n" + json.dumps(found))  # after what the importers print


if __name__ == "__main__":
    main()
