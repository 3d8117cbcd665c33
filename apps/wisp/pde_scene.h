#pragma once

// Problems of a scene as wisp::pde takes them.

#include <string>
#include <vector>

#include "wisp/core/error.h"
#include "wisp/core/report.h"
#include "wisp/pde/problem.h"
#include "wisp/pde/section.h"
#include "wisp/scene/scene.h"

struct scene_problem {
  wisp::pde_problem problem = {};
  wisp::space_field exact = {};  // where the scene has it
  bool flat = false;             // the domain is a mesh in one plane
  // What was built for it, or left out. The distance grid fills while walks go on:
  // finish_parts tells what it holds then.
  std::vector<wisp::part_report> parts = {};
};

// The index of a problem by its name; of the first where that is empty. Throws
// usage_error for a name that nothing has, and wisp::file_error for a scene without
// problems.
int find_problem(const wisp::scene_data& scene, const std::string& name);

// Builds the domain and the fields of a problem whose shapes are loaded (see
// wisp::scene_load_options); its textures are loaded here. Nothing of the scene is needed
// afterwards. Warns of open meshes. Throws wisp::file_error.
scene_problem make_problem(wisp::scene_data& scene, int problem, int threads,
                           wisp::warning_list& warnings);
void finish_parts(scene_problem& problem);

wisp::section_plane make_plane(const wisp::section_data& section);
