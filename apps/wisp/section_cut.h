#pragma once

// Shapes that show a solid cut open by a plane.

#include "wisp/pde/section.h"
#include "wisp/scene/scene.h"

// The faces of a mesh without what lies in front of a plane; what crosses it ends there.
// Positions, normals and texture coordinates are kept.
wisp::shape_data clip_faces(const wisp::shape_data& mesh, const wisp::dvec3& point,
                            const wisp::dvec3& normal);
// The rectangle of a grid, facing its normal.
wisp::shape_data make_sheet(const wisp::section_grid& grid);
