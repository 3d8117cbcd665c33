// What must hold of any hair behind any interface, told in world space alone.

#pragma once

#include <array>
#include <functional>
#include <glm/vec3.hpp>

#include "wisp/hair/parameters.h"

// A ray that meets a fibre. `h` is the offset of the ray, to the left as the viewer sees it
// with the tip of the fibre up, over the radius.
struct situation {
  const char* name = "";
  glm::vec3 tangent, wo;  // from root to tip; towards the viewer
  float h = 0;
  float roll = 0;  // how far a ribbon is turned from facing the viewer, radians
  wisp::hair::hair_parameters<float> material = {};
  std::array<float, 4> sigma_a = {};
};

// A renderer's answers, for directions in world space.
struct scattering {
  int channels = 3;
  struct value {
    std::array<double, 4> f_cos = {};  // with the cosine, whoever multiplies by it
    double pdf = 0;
  };
  struct sample {
    glm::vec3 wi = {0, 0, 0};
    std::array<double, 4> weight = {};  // f cos / pdf
    double pdf = 0;                     // 0: none was drawn
  };
  std::function<value(const glm::vec3& wi)> eval = {};
  std::function<sample(const glm::vec3& u)> draw = {};
};
using make_scattering = std::function<scattering(const situation&)>;

// Prints what it finds; false if something is wrong.
bool check_scattering(const char* renderer, const make_scattering& make);
