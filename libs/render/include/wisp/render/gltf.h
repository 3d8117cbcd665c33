#pragma once

#include <filesystem>

#include "wisp/core/error.h"
#include "wisp/core/export.h"
#include "wisp/scene/scene.h"

namespace wisp {

// Both readers may be called from several threads at once, each with warnings of its own.

// Reads a glTF 2.0 scene, .gltf or .glb: meshes, node transforms, cameras,
// metallic-roughness materials and textures, emission, KHR_lights_punctual,
// KHR_materials_emissive_strength, _ior, _transmission (thin, or refractive with
// _volume), _unlit (as emission), KHR_texture_transform, KHR_mesh_quantization,
// EXT_texture_webp. LINES, LINE_STRIP and LINE_LOOP become strands with a hair
// material of the base colour (brown when it is white), radius from the vertex
// attribute _RADIUS or 1/2000 of the diagonal of their box. What is not
// supported gets a warning, and an error when the file lists it in
// extensionsRequired. Camera and lights are those of the file, if any.
// Textures stay encoded, except for those of OPAQUE materials that have an
// alpha channel to drop. Throws file_error.
WISP_API scene_data load_gltf_scene(const std::filesystem::path& path, warning_list& warnings);

// Reads a scene by ending: .json, .gltf, .glb; or a bare shape file (any that
// load_shape reads), which gets a camera, a sky, a lamp and a plain or hair
// material. glTF scenes without a camera or without light get one, with a
// warning. Subdivs are left unrefined, textures unloaded. Throws file_error.
WISP_API scene_data load_scene(const std::filesystem::path& path, warning_list& warnings);

}  // namespace wisp
