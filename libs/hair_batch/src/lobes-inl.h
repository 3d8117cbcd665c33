// The BSDF for one vector of inputs: make_hair_hit, eval_hair_with_pdf and
// sample_hair_with_pdf of wisp/hair/bsdf.h, where the formulas are explained. Here
// lanes are inputs, and lobes follow one another.
//
// Only differences of azimuths matter, so all are turned by 2 gamma_o: lobe p then
// leaves at 2 p gamma_t + p pi, and a direction is turned by multiplying complex
// numbers, which saves the angle gamma_o.

#if defined(WISP_HAIR_BATCH_LOBES) == defined(HWY_TARGET_TOGGLE)
#ifdef WISP_HAIR_BATCH_LOBES
#undef WISP_HAIR_BATCH_LOBES
#else
#define WISP_HAIR_BATCH_LOBES
#endif

#include "src/call.h"
#include "src/math-inl.h"

HWY_BEFORE_NAMESPACE();
namespace wisp::hair::batch::HWY_NAMESPACE {

inline constexpr float pi = 3.14159265f;

struct vec3 {
  vec x, y, z;
};
HWY_INLINE vec load(const float* a, std::size_t i) { return hn::LoadU(floats(), a + i); }
HWY_INLINE vec3 load3(const float* const* a, std::size_t i) {
  return {load(a[0], i), load(a[1], i), load(a[2], i)};
}
HWY_INLINE vec3 load_color(const float* const* a, const float* constant, std::size_t i) {
  if (a[0] != nullptr) return load3(a, i);
  return {all(constant[0]), all(constant[1]), all(constant[2])};
}
HWY_INLINE void store(vec v, float* a, std::size_t i) { hn::StoreU(v, floats(), a + i); }
HWY_INLINE vec safe_sqrt(vec x) { return hn::Sqrt(hn::Max(x, all(0))); }
// 1 - x^2 without cancellation.
HWY_INLINE vec one_minus_square(vec x) { return (all(1) - x) * (all(1) + x); }
HWY_INLINE vec clamp(vec x, float low, float high) {
  return hn::Min(hn::Max(x, all(low)), all(high));
}

struct hit {
  vec sin_theta_o, cos_theta_o, cos_phi_o, sin_phi_o;
  vec sin_gamma_o, cos_gamma_o, cos_2gamma_o, sin_2gamma_o;
  vec gamma_t;
  // By lobe: A_p, and the weights whose part in their sum is the probability.
  vec3 ap[lobe_count];
  vec weight[lobe_count];
  vec weight_sum;
};

struct fresnel {
  vec reflected, transmitted, eta_cos_t;
};
HWY_INLINE fresnel fresnel_dielectric(const material& m, vec c) {
  vec n2 = all(m.n2_minus_1 + 1);
  vec above = all(m.n2_minus_1), c2 = c * c;
  vec g = hn::Sqrt(above + c2);
  vec a = c + g, b = hn::MulAdd(n2, c, g);
  vec ab = a * b;
  auto grazing = ab < all(1e-37f);
  vec q = all(1) / hn::IfThenElse(grazing, all(1), ab);
  vec perpendicular = q * b, parallel = q * a;
  // c - g and n2 c - g by the difference of their squares.
  vec r = above * perpendicular * perpendicular;
  vec s = above * hn::MulSub(n2 + all(1), c2, all(1)) * parallel * parallel;
  vec reflected = all(0.5f) * hn::MulAdd(r, r, s * s);
  vec transmitted =
      all(2) * c * g * hn::MulAdd(perpendicular, perpendicular, n2 * parallel * parallel);
  return {hn::IfThenElse(grazing, all(1), hn::Min(reflected, all(1))),
          hn::IfThenElse(grazing, all(0), hn::Min(transmitted, all(1))), g};
}

// A_p of one channel. Of the last lobe, the sum of a geometric series, it gives the
// first term, and in `lost` the 1 - T F to divide it by, as a sum of what is lost.
HWY_INLINE void attenuate(int p_max, const fresnel& f, vec sigma_a, vec path, vec (&ap)[lobe_count],
                          vec& lost) {
  exp_parts e = split_exp(sigma_a * path);
  vec transmittance = hn::MulAdd(e.power, e.rest, e.power);
  vec absorbed = hn::NegMulAdd(e.power, e.rest, all(1) - e.power);  // 1 - transmittance
  vec tf = transmittance * f.reflected;
  vec a = f.transmitted * f.transmitted * transmittance;
  ap[0] = f.reflected;
  for (int p = 1; p < p_max; p++) {
    ap[p] = a;
    a = a * tf;
  }
  ap[p_max] = a;
  // Where nothing enters nothing is lost, and 0 / 0 is 0. The least is such that
  // three of them can be multiplied.
  lost = hn::Max(hn::MulAdd(f.reflected, absorbed, f.transmitted), all(1e-12f));
}

template <int known_p_max>
HWY_INLINE void make_hit(const material& m, const call& c, std::size_t i, hit& hit) {
  const int p_max = known_p_max > 0 ? known_p_max : m.p_max;
  vec3 wo = load3(c.in + in_wo, i);
  vec h = clamp(load(c.in[in_h], i), -1, 1);
  hit.sin_theta_o = clamp(wo.x, -1, 1);
  vec across = hn::Sqrt(hn::MulAdd(wo.y, wo.y, wo.z * wo.z));
  // Nearer to a pole squares and their inverses would lose digits or overflow.
  across = hn::IfThenElseZero(across >= all(1e-15f), across);
  auto has_azimuth = across > all(0);
  vec inv_across = all(1) / hn::IfThenElse(has_azimuth, across, all(1));
  hit.cos_theta_o = hn::Min(across, all(1));
  hit.cos_phi_o = hn::IfThenElse(has_azimuth, wo.y * inv_across, all(1));
  hit.sin_phi_o = hn::IfThenElseZero(has_azimuth, wo.z * inv_across);

  hit.sin_gamma_o = h;
  hit.cos_gamma_o = safe_sqrt(one_minus_square(h));
  hit.cos_2gamma_o = hn::NegMulAdd(all(2) * h, h, all(1));
  hit.sin_2gamma_o = all(2) * h * hit.cos_gamma_o;

  // eta' cos theta_o = sqrt(eta^2 - 1 + cos^2 theta_o) = eta cos theta_t; see make_hair_hit.
  vec eta_cos = hn::Sqrt(hn::MulAdd(hit.cos_theta_o, hit.cos_theta_o, all(m.n2_minus_1)));
  auto enters = eta_cos > all(0);
  vec inv_eta_cos = hn::IfThenElseZero(enters, all(1) / hn::IfThenElse(enters, eta_cos, all(1)));
  fresnel f = fresnel_dielectric(m, hit.cos_theta_o * hit.cos_gamma_o);
  vec sin_gamma_t = clamp(h * hit.cos_theta_o * inv_eta_cos, -1, 1);
  vec cos_gamma_t = hn::Min(f.eta_cos_t * inv_eta_cos, all(1));
  hit.gamma_t = angle_of(sin_gamma_t, cos_gamma_t);
  vec path = all(-2 * m.eta) * cos_gamma_t * inv_eta_cos;

  vec3 sigma_a = load_color(c.in + in_sigma_a, c.sigma_a, i);
  vec3 weight = load_color(c.in + in_weight, c.weight, i);
  vec red[lobe_count], green[lobe_count], blue[lobe_count];
  vec3 lost;
  attenuate(p_max, f, sigma_a.x, path, red, lost.x);
  attenuate(p_max, f, sigma_a.y, path, green, lost.y);
  attenuate(p_max, f, sigma_a.z, path, blue, lost.z);
  vec xy = lost.x * lost.y;
  vec q = all(1) / (xy * lost.z), qz = q * lost.z;
  red[p_max] = red[p_max] * (qz * lost.y);
  green[p_max] = green[p_max] * (qz * lost.x);
  blue[p_max] = blue[p_max] * (q * xy);
  hit.weight_sum = all(0);
  for (int p = 0; p <= p_max; p++) {
    vec3 a = {red[p], green[p], blue[p]};
    if (m.has_strength) {
      a.x = a.x * all(m.strength[p][0]);
      a.y = a.y * all(m.strength[p][1]);
      a.z = a.z * all(m.strength[p][2]);
    }
    hit.ap[p] = a;
    vec3 w = {a.x * weight.x, a.y * weight.y, a.z * weight.z};
    // The largest component stands in where squares are too small.
    hit.weight[p] = hn::Max(hn::Sqrt(hn::MulAdd(w.x, w.x, hn::MulAdd(w.y, w.y, w.z * w.z))),
                            hn::Max(w.x, hn::Max(w.y, w.z)));
    hit.weight_sum = hit.weight_sum + hit.weight[p];
  }
  // A weight of zero where there may be light, or one whose inverse is no number:
  // all lobes alike.
  auto dark = hit.weight_sum <= all(std::numeric_limits<float>::min());
  if (!hn::AllFalse(floats(), dark)) {
    for (int p = 0; p <= p_max; p++) hit.weight[p] = hn::IfThenElse(dark, all(1), hit.weight[p]);
    hit.weight_sum = hn::IfThenElse(dark, all(static_cast<float>(p_max + 1)), hit.weight_sum);
  }
}

struct tilted {
  vec sin_theta, cos_theta;
};
HWY_INLINE tilted tilt(const hit& hit, vec sin_tilt, vec cos_tilt) {
  return {hn::MulAdd(hit.sin_theta_o, cos_tilt, hit.cos_theta_o * sin_tilt),
          hn::Abs(hn::MulSub(hit.cos_theta_o, cos_tilt, hit.sin_theta_o * sin_tilt))};
}

// M_p N_p, of which e and w = (1 + e)^2 are the azimuthal part.
HWY_INLINE vec mn_of(const material& m, const hit& hit, int p, vec sin_theta_i, vec cos_theta_i,
                     vec e, vec w) {
  tilted o = tilt(hit, all(m.sin_tilt[p]), all(m.cos_tilt[p]));
  vec inv_v = all(m.inv_v[p]);
  vec sum = sin_theta_i + o.sin_theta, difference = cos_theta_i - o.cos_theta;
  vec d = hn::MulAdd(sum, sum, difference * difference);
  vec bessel = bessel_i0e_over(cos_theta_i * o.cos_theta * inv_v, w);
  vec along = bessel * exp_nonpositive(all(-0.5f) * d * inv_v) * all(m.mp_norm[p]);
  return along * (e * all(m.np_norm[p]));
}

struct light {
  vec3 value;
  vec pdf;
};
// phi is against wo, turned by 2 gamma_o, of any size.
template <int known_p_max>
HWY_INLINE light eval_lobes(const material& m, const hit& hit, vec sin_theta_i, vec cos_theta_i,
                            vec phi) {
  // The uniform last lobe, whose e is 1, comes first.
  const int last = known_p_max > 0 ? known_p_max : m.p_max;
  vec mn = mn_of(m, hit, last, sin_theta_i, cos_theta_i, all(1), all(4));
  light r = {{hit.ap[last].x * mn, hit.ap[last].y * mn, hit.ap[last].z * mn},
             hit.weight[last] * mn};
  for (int p = 0; p < last; p++) {
    vec dphi = hn::NegMulAdd(all(static_cast<float>(2 * p)), hit.gamma_t, phi);
    dphi = wrap_angle(dphi - all((p & 1) != 0 ? pi : 0));
    vec e = exp_nonpositive(hn::Abs(dphi) * all(-m.inv_s[p]));
    vec w = hn::MulAdd(e, e + all(2), all(1));
    mn = mn_of(m, hit, p, sin_theta_i, cos_theta_i, e, w);
    r.value.x = hn::MulAdd(hit.ap[p].x, mn, r.value.x);
    r.value.y = hn::MulAdd(hit.ap[p].y, mn, r.value.y);
    r.value.z = hn::MulAdd(hit.ap[p].z, mn, r.value.z);
    r.pdf = hn::MulAdd(hit.weight[p], mn, r.pdf);
  }
  r.pdf = r.pdf / hit.weight_sum;
  return r;
}
HWY_INLINE void store_light(const light& r, const call& c, std::size_t i) {
  store(r.value.x, c.out[out_value], i);
  store(r.value.y, c.out[out_value + 1], i);
  store(r.value.z, c.out[out_value + 2], i);
  store(r.pdf, c.out[out_pdf], i);
}

template <int known_p_max>
HWY_INLINE void eval_at(const material& m, const call& c, std::size_t i) {
  hit hit;
  make_hit<known_p_max>(m, c, i, hit);
  vec3 wi = load3(c.in + in_wi, i);
  vec sin_theta_i = clamp(wi.x, -1, 1);
  vec cos_theta_i = hn::Min(hn::Sqrt(hn::MulAdd(wi.y, wi.y, wi.z * wi.z)), all(1));
  vec x = hn::MulAdd(wi.y, hit.cos_phi_o, wi.z * hit.sin_phi_o);
  vec y = hn::MulSub(wi.z, hit.cos_phi_o, wi.y * hit.sin_phi_o);
  // Along the fibre there is no azimuth: as if it were that of wo.
  x = hn::IfThenElse(hn::Max(hn::Abs(x), hn::Abs(y)) > all(0), x, all(1));
  vec turned_x = hn::MulSub(x, hit.cos_2gamma_o, y * hit.sin_2gamma_o);
  vec turned_y = hn::MulAdd(x, hit.sin_2gamma_o, y * hit.cos_2gamma_o);
  store_light(
      eval_lobes<known_p_max>(m, hit, sin_theta_i, cos_theta_i, angle_of(turned_y, turned_x)), c,
      i);
}

template <int known_p_max>
HWY_INLINE void sample_at(const material& m, const call& c, std::size_t i) {
  hit hit;
  make_hit<known_p_max>(m, c, i, hit);
  const vec one = all(1), smallest = all(1.17549435e-38f);
  vec u0 = load(c.in[in_u], i), u1 = load(c.in[in_u + 1], i);
  vec u2 = load(c.in[in_u + 2], i), u3 = load(c.in[in_u + 3], i);

  // The lobe that is drawn is the last one of any probability that begins at or
  // before u0. What depends on it is picked on the way, and what is left of u0
  // within it.
  const int last = known_p_max > 0 ? known_p_max : m.p_max;
  vec scale = one / hit.weight_sum;
  vec probability = hit.weight[0] * scale, rest = u0, left = u0 - probability;
  vec v = all(m.v[0]), exp_m2 = all(m.exp_m2_over_v[0]);
  vec sin_tilt = all(m.sin_tilt[0]), cos_tilt = all(m.cos_tilt[0]);
  vec s = all(m.s[0]), cdf_a = all(m.logistic_cdf_a[0]);
  vec twice_p = all(0), turn_pi = all(0);
  auto uniform = one < all(0);
  for (int p = 1; p <= last; p++) {
    vec own = hit.weight[p] * scale;
    auto here = hn::And(left >= all(0), own > all(0));
    probability = hn::IfThenElse(here, own, probability);
    rest = hn::IfThenElse(here, left, rest);
    v = hn::IfThenElse(here, all(m.v[p]), v);
    exp_m2 = hn::IfThenElse(here, all(m.exp_m2_over_v[p]), exp_m2);
    sin_tilt = hn::IfThenElse(here, all(m.sin_tilt[p]), sin_tilt);
    cos_tilt = hn::IfThenElse(here, all(m.cos_tilt[p]), cos_tilt);
    if (p < last) {
      s = hn::IfThenElse(here, all(m.s[p]), s);
      cdf_a = hn::IfThenElse(here, all(m.logistic_cdf_a[p]), cdf_a);
      twice_p = hn::IfThenElse(here, all(static_cast<float>(2 * p)), twice_p);
      turn_pi = hn::IfThenElse(here, all((p & 1) != 0 ? pi : 0), turn_pi);
    } else {
      uniform = here;
    }
    left = left - own;
  }

  // Uniform within the lobe; u3 has the digits that u0 lost to a small probability.
  constexpr float half_digit = 0x1p-24f;
  vec u_phi = hn::MulAdd(u3, all(half_digit), rest) / hn::Max(probability, smallest);
  u_phi = hn::Min(u_phi, all(1 - half_digit));

  // M_p.
  vec t = log_of(hn::Max(hn::MulAdd(one - u1, exp_m2, u1), smallest));
  t = clamp(hn::Neg(v) * t, 0, 2);
  vec cos_theta = one - t;
  vec sin_theta = safe_sqrt(t * (all(2) - t));
  cos_sin turn = cos_sin_of(all(2 * pi) * u2);
  tilted o = tilt(hit, sin_tilt, cos_tilt);
  vec sin_turn = sin_theta * turn.cos;
  vec sin_theta_i = clamp(hn::MulSub(sin_turn, o.cos_theta, cos_theta * o.sin_theta), -1, 1);
  // The same vector's part across the fibre: exact where the sine is near 1.
  vec a = hn::MulAdd(cos_theta, o.cos_theta, sin_turn * o.sin_theta), b = sin_theta * turn.sin;
  vec cos_theta_i = hn::Min(hn::Sqrt(hn::MulAdd(a, a, b * b)), one);

  // N_p: the inverse of the logistic's distribution, from the nearer end.
  auto low = u_phi < all(0.5f);
  vec k = hn::IfThenElse(low, u_phi, one - u_phi);
  k = hn::MulAdd(k, hn::NegMulAdd(all(2), cdf_a, one), cdf_a);
  vec x = s * log_of(hn::Max(hn::Max(k, smallest) / (one - k), smallest));
  x = clamp(hn::IfThenElse(low, x, hn::Neg(x)), -pi, pi);
  vec phi = hn::MulAdd(twice_p, hit.gamma_t, turn_pi) + x;
  if (!hn::AllFalse(floats(), uniform)) {
    vec gamma_o = angle_of(hit.sin_gamma_o, hit.cos_gamma_o);
    phi = hn::IfThenElse(uniform, all(2) * hn::MulAdd(all(pi), u_phi, gamma_o), phi);
  }
  store_light(eval_lobes<known_p_max>(m, hit, sin_theta_i, cos_theta_i, phi), c, i);

  // Turned back by 2 gamma_o, then to where wo is.
  cos_sin d = cos_sin_of(phi);
  vec y = hn::MulAdd(d.cos, hit.cos_2gamma_o, d.sin * hit.sin_2gamma_o);
  vec z = hn::MulSub(d.sin, hit.cos_2gamma_o, d.cos * hit.sin_2gamma_o);
  store(sin_theta_i, c.out[out_direction], i);
  store(cos_theta_i * hn::MulSub(hit.cos_phi_o, y, hit.sin_phi_o * z), c.out[out_direction + 1], i);
  store(cos_theta_i * hn::MulAdd(hit.sin_phi_o, y, hit.cos_phi_o * z), c.out[out_direction + 2], i);
}

}  // namespace wisp::hair::batch::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
