#pragma once

// Readers and writers of the formats that need no further library. All of them
// throw file_error on bad input and never leave half a file behind. Calls from several
// threads do not disturb each other, each with warnings and a file of its own; of two that
// write one file the last stays.

#include <filesystem>
#include <functional>

#include "wisp/core/error.h"
#include "wisp/core/export.h"
#include "wisp/scene/scene.h"

namespace wisp {

struct shape_read_options {
  // Flip v so that (0, 0) is the top left of the image, as Yocto/GL does for
  // PLY and OBJ.
  bool flip_v = true;
};

// Reads a shape by the ending of its path, in any case: .ply .obj .stl (faces,
// points, lines), .hair .tfx .pbrt (strands), .tfxmesh (faces).
//  - Polygons of more than four sides are cut into a fan, which is right for
//    convex ones. Faces are triangles, or all quads where there is one of four
//    sides (a quad with z == w is a triangle). Vertices alone are points.
//  - Lines become strands: PLY's elements line and edge (of edges, those that
//    are no side of a face) and OBJ's l. Segments that follow each other are
//    joined. Vertices are repeated where that makes strands consecutive.
//  - OBJ: groups and materials are ignored; corners that differ in a texture
//    coordinate or a normal are different vertices.
//  - STL: vertices at the same place are one.
//  - Colours of vertices are taken as linear; integers are divided by the
//    largest of their type.
// An index out of range is an error. Faces and points with a vertex that is not
// finite are left out with a warning; strands lose such vertices, or go when
// what is left does not fit their basis, as those without length do. Radii that
// are negative or not finite become 0.001 with a warning. Afterwards every
// vertex is finite. About half a second for a million triangles of PLY.
WISP_API shape_data load_shape(const std::filesystem::path& path, warning_list& warnings,
                               const shape_read_options& options = {});

// Reads an .obj or .ply with its face-varying topology kept, for subdivs; v is
// flipped. Texture coordinates and normals that only some faces of an .obj have
// are left out with a warning; lines and points are no part of it.
WISP_API subdiv_data load_subdiv_mesh(const std::filesystem::path& path, warning_list& warnings);

// Writes a shape by ending: .ply (binary, little endian), .obj, .stl (binary,
// faces), .hair, .tfx, .pbrt (strands). The file appears whole or not at all.
// Throws file_error when the format cannot hold the shape (strands in .stl,
// faces in .hair, strands of differing point counts in .tfx), saying what would
// work, and when an index is out of range; warns of attributes that are lost.
// v is written flipped, as load_shape reads it by default.
//
// .ply holds everything; strands are written as Yocto/GL does, as segments in
// the element line with the property radius. For a basis other than linear
// these are the control points, and a comment "wisp basis bspline" (bezier,
// catmull_rom) and "wisp profile round" tell load_shape; other programs see the
// control polygon. .obj has the same comments, and no radii.
WISP_API void save_shape(const std::filesystem::path& path, const shape_data& shape,
                         warning_list& warnings);

// True for endings that load_shape reads / save_shape writes.
WISP_API bool can_load_shape(const std::filesystem::path& path);
WISP_API bool can_save_shape(const std::filesystem::path& path);

// A shape's file as a scene: faces and points in matte grey, strands as brown hair, with
// a camera that sees all of it, a lamp and a sky. Throws file_error, also for a file with
// nothing to show.
WISP_API scene_data load_shape_scene(const std::filesystem::path& path, warning_list& warnings);

struct scene_load_options {
  // To solve a problem instead of rendering: called when all is read but shapes, with
  // the index of the problem as its answer. What that problem consists of is loaded, and
  // nothing else; there are no instances then.
  std::function<int(const scene_data&)> choose_problem = {};
};

// Reads a scene in wisp's superset of Yocto/GL's JSON format (asset versions
// 4.2 and 5.0), with its shapes; textures are named but not loaded, subdivs
// are read but not refined. See docs/scene-format.md.
WISP_API scene_data load_json_scene(const std::filesystem::path& path, warning_list& warnings,
                                    const scene_load_options& options = {});

}  // namespace wisp
