// A renderer of someone else that works on many hits at once.

#include <cmath>
#include <cstdio>
#include <vector>

#include "wisp/hair_batch/hair_batch.h"

int main() {
  namespace hair = wisp::hair;
  auto bsdf = hair::make_hair_bsdf(hair::hair_parameters<float>{});
  std::vector<float> zero(19, 0.0f), one(19, 1.0f), h(19, 0.3f), r(19), g(19), b(19), pdf(19);
  hair::hair_eval_inputs in;
  in.wo = {zero, zero, one};
  in.wi = {zero, one, zero};
  in.h = h;
  in.sigma_a.all = {0.5f, 0.9f, 1.8f};
  hair::eval_hair_batch(bsdf, in, {{r, g, b}, pdf});
  auto hit = hair::make_hair_hit(bsdf, in.sigma_a.all, 0.3f, glm::vec3{0, 0, 1});
  auto one_by_one = hair::eval_hair_with_pdf(bsdf, hit, glm::vec3{0, 1, 0});
  std::printf("%s: f cos %g %g %g, pdf %g\n", hair::current_hair_batch_target().name, r[18], g[18],
              b[18], pdf[18]);
  bool good = std::abs(r[18] - one_by_one.value.x) < 1e-4f * r[18] &&
              std::abs(pdf[18] - one_by_one.pdf) < 1e-4f * pdf[18];
  return good ? 0 : 1;
}
