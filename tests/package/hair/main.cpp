// A renderer of someone else: the scattering of hair, with GLM and nothing else.

#include <cmath>
#include <cstdio>

#include "wisp/hair/absorption.h"
#include "wisp/hair/bsdf.h"

int main() {
  namespace hair = wisp::hair;
  auto bsdf = hair::make_hair_bsdf(hair::hair_parameters<float>{});
  auto sigma_a = hair::sigma_a_from_melanin<float>(1.3f, 0);
  auto hit = hair::make_hair_hit(bsdf, sigma_a, 0.3f, glm::vec3{0.6f, 0, 0.8f});
  auto wi = hair::sample_hair(bsdf, hit, glm::vec4{0.1f, 0.4f, 0.7f, 0.2f});
  auto value = hair::eval_hair(bsdf, hit, wi);
  float pdf = hair::sample_hair_pdf(bsdf, hit, wi);
  std::printf("wi %g %g %g, f cos %g %g %g, pdf %g\n", wi.x, wi.y, wi.z, value.x, value.y, value.z,
              pdf);
  bool good = std::abs(glm::dot(wi, wi) - 1) < 1e-4f && value.x > value.z && value.z > 0 && pdf > 0;
  return good ? 0 : 1;
}
