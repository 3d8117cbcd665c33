#pragma once

// The readers and writers behind load_shape and save_shape. Readers take the
// bytes of a whole file in memory, so that they can be fuzzed, and are safe on
// any bytes: they throw file_error, which calls the file `file`. They promise
// that indices are in range and that vertex arrays match the positions in
// length; everything else is clean_shape's. Writers return the file's bytes.

#include <cstdint>
#include <span>
#include <string>

#include "wisp/core/error.h"
#include "wisp/scene/io.h"
#include "wisp/scene/scene.h"

namespace wisp {

// Meshes, points and lines.
shape_data read_ply(std::span<const uint8_t> bytes, const std::string& file, warning_list& warnings,
                    const shape_read_options& options = {});
shape_data read_obj(std::span<const uint8_t> bytes, const std::string& file, warning_list& warnings,
                    const shape_read_options& options = {});
shape_data read_stl(std::span<const uint8_t> bytes, const std::string& file,
                    warning_list& warnings);
std::string write_ply(const shape_data& shape, const std::string& file, warning_list& warnings);
std::string write_obj(const shape_data& shape, const std::string& file, warning_list& warnings);
std::string write_stl(const shape_data& shape, const std::string& file, warning_list& warnings);

// The same meshes with their face-varying topology.
subdiv_data read_ply_subdiv(std::span<const uint8_t> bytes, const std::string& file,
                            warning_list& warnings);
subdiv_data read_obj_subdiv(std::span<const uint8_t> bytes, const std::string& file,
                            warning_list& warnings);

// Strands.
shape_data read_hair(std::span<const uint8_t> bytes, const std::string& file,
                     warning_list& warnings);
shape_data read_tfx(std::span<const uint8_t> bytes, const std::string& file,
                    warning_list& warnings);
shape_data read_tfxmesh(std::span<const uint8_t> bytes, const std::string& file,
                        warning_list& warnings);
shape_data read_pbrt_curves(std::span<const uint8_t> bytes, const std::string& file,
                            warning_list& warnings);
std::string write_hair(const shape_data& shape, const std::string& file, warning_list& warnings);
std::string write_tfx(const shape_data& shape, const std::string& file, warning_list& warnings);
std::string write_pbrt_curves(const shape_data& shape, const std::string& file,
                              warning_list& warnings);

// Throws file_error unless vertex arrays match, indices are in range and there is
// an element.
void check_shape(const shape_data& shape, const std::string& file);

// What every shape goes through after its reader:
//  - vertex arrays of a length other than that of positions, or no element at
//    all: file_error;
//  - faces and points with a vertex that is not finite are removed; strands
//    lose such vertices, and are removed when what is left does not fit their
//    basis; so are strands without length;
//  - radii that are negative or not finite become 0.001 as in Yocto/GL; normals
//    and texture coordinates that are not finite become 0, colours 1.
// Each kind gives one warning with the count and the first. Afterwards every
// vertex is finite.
void clean_shape(shape_data& shape, const std::string& file, warning_list& warnings);

// The same for the mesh of a subdiv.
void clean_subdiv(subdiv_data& subdiv, const std::string& file, warning_list& warnings);

}  // namespace wisp
