// Colour maps as colours at even steps with straight lines between, fitted to the tables
// of Matplotlib. Sources:
//   viridis, magma, inferno, plasma  van der Walt and Smith, mpl-colormaps (2015), CC0
//   cividis   Nunez, Anderton and Renslow, Optimizing colormaps with consideration for
//             color vision deficiency (2018)
//   coolwarm  Moreland, Diverging Color Maps for Scientific Visualization (2009)
//   turbo     Mikhailov, Turbo, An Improved Rainbow Colormap (2019)

#include "colormap.h"

#include <cmath>
#include <cstddef>
#include <span>

namespace {

constexpr uint32_t viridis[] = {
    0x440154, 0x471164, 0x481f71, 0x472d7b, 0x443a83, 0x404688, 0x3b528b, 0x355d8d, 0x31688e,
    0x2c728e, 0x287c8e, 0x24868e, 0x21908d, 0x1e9a8a, 0x20a486, 0x27ae80, 0x35b779, 0x47c06f,
    0x5cc963, 0x74d054, 0x8fd744, 0xabdc32, 0xc7e01f, 0xe3e417, 0xfde724};
constexpr uint32_t coolwarm[] = {
    0x3b4cc0, 0x445acc, 0x4d68d7, 0x5775e1, 0x6282ea, 0x6c8ef1, 0x779af7, 0x82a5fb, 0x8db0fe,
    0x98b9ff, 0xa3c2ff, 0xaec9fd, 0xb8d0f9, 0xc2d5f4, 0xccd9ee, 0xd5dbe6, 0xdddddd, 0xe5d8d1,
    0xecd3c5, 0xf1ccb9, 0xf5c4ad, 0xf7bba0, 0xf7b194, 0xf7a687, 0xf49a7b, 0xf18d6f, 0xec7f63,
    0xe57058, 0xde604d, 0xd55042, 0xcb3e38, 0xc0282f, 0xb40426};
constexpr uint32_t magma[] = {0x000003, 0x050416, 0x100c2d, 0x1c1146, 0x2c1160, 0x3f0f73, 0x50127c,
                              0x611980, 0x721f81, 0x822682, 0x932b80, 0xa4317e, 0xb6367a, 0xc73d74,
                              0xd8456c, 0xe65063, 0xf1605d, 0xf8735b, 0xfc8761, 0xfe9b6a, 0xfeaf77,
                              0xfec387, 0xfed698, 0xfde9ab, 0xfcfdbf};
constexpr uint32_t plasma[] = {0x0e0787, 0x230590, 0x330597, 0x42039d, 0x5002a2, 0x5d01a6, 0x6b00a8,
                               0x7801a8, 0x8405a7, 0x900ea3, 0x9c179e, 0xa72198, 0xb12a90, 0xba3488,
                               0xc33d80, 0xcb4778, 0xd35071, 0xda5a69, 0xe16462, 0xe76e5a, 0xed7953,
                               0xf2834c, 0xf68f44, 0xfa9a3d, 0xfca636, 0xfdb32f, 0xfec029, 0xfcce25,
                               0xfadc24, 0xf5ea28, 0xf0f923};
constexpr uint32_t inferno[] = {
    0x000003, 0x030312, 0x0b0724, 0x150b37, 0x210c4a, 0x2f0a5b, 0x3c0965, 0x4a0c6a, 0x57106e,
    0x63146e, 0x70196e, 0x7d1e6d, 0x89226a, 0x962766, 0xa32b61, 0xaf315c, 0xbb3755, 0xc63e4d,
    0xd14644, 0xdb4f3c, 0xe35932, 0xeb6528, 0xf1711e, 0xf67f14, 0xf98d0a, 0xfb9c05, 0xfcab0f,
    0xfbba20, 0xf9ca32, 0xf5d949, 0xf2e865, 0xf2f586, 0xfcffa5};
constexpr uint32_t cividis[] = {
    0x00224e, 0x002554, 0x00285b, 0x002b62, 0x002e6a, 0x003070, 0x033371, 0x123570, 0x1a386f,
    0x213b6e, 0x273e6e, 0x2d416d, 0x32436d, 0x36466c, 0x3b496c, 0x3f4c6c, 0x434e6c, 0x47516c,
    0x4b546c, 0x4f576c, 0x52596d, 0x565c6d, 0x5a5f6e, 0x5d626e, 0x61656f, 0x646770, 0x686a71,
    0x6b6d72, 0x6f7073, 0x727374, 0x757676, 0x797877, 0x7c7b78, 0x807e78, 0x848179, 0x878478,
    0x8b8778, 0x8f8a78, 0x938d78, 0x979077, 0x9b9376, 0x9f9676, 0xa39a75, 0xa79d74, 0xaba072,
    0xafa371, 0xb3a670, 0xb7aa6e, 0xbbad6c, 0xbfb06b, 0xc3b469, 0xc8b766, 0xccba64, 0xd0be61,
    0xd4c15f, 0xd9c55c, 0xddc958, 0xe1cc55, 0xe6d051, 0xead44c, 0xefd748, 0xf4db42, 0xf8df3c,
    0xfde234, 0xfee837};
constexpr uint32_t turbo[] = {0x31123c, 0x3a2a73, 0x4040a2, 0x4556c7, 0x476be4, 0x477ff7, 0x4393ff,
                              0x37a8fb, 0x29bbec, 0x1ccdd8, 0x17ddc3, 0x1de8b0, 0x30f299, 0x4cf97e,
                              0x6bfe64, 0x8aff4c, 0xa3fd3c, 0xb8f734, 0xcced34, 0xdee037, 0xedd03a,
                              0xf8c03a, 0xfdae35, 0xfe982c, 0xfc8022, 0xf56817, 0xec520e, 0xe14009,
                              0xd23105, 0xc12302, 0xac1701, 0x950c01, 0x7a0403};
constexpr uint32_t gray[] = {0x000000, 0xffffff};

std::span<const uint32_t> find_map(wisp::section_colors map) {
  switch (map) {
    case wisp::section_colors::coolwarm:
      return coolwarm;
    case wisp::section_colors::magma:
      return magma;
    case wisp::section_colors::plasma:
      return plasma;
    case wisp::section_colors::inferno:
      return inferno;
    case wisp::section_colors::cividis:
      return cividis;
    case wisp::section_colors::turbo:
      return turbo;
    case wisp::section_colors::gray:
      return gray;
    case wisp::section_colors::viridis:
      break;
  }
  return viridis;
}

wisp::vec3 to_color(uint32_t hex) {
  return wisp::vec3(static_cast<float>(hex >> 16 & 255), static_cast<float>(hex >> 8 & 255),
                    static_cast<float>(hex & 255)) /
         255.0f;
}

}  // namespace

wisp::vec3 eval_colormap(wisp::section_colors map, double t) {
  const auto colors = find_map(map);
  const double x = (t > 0 ? std::min(t, 1.0) : 0.0) * static_cast<double>(colors.size() - 1);
  const auto i = std::min(static_cast<std::size_t>(x), colors.size() - 2);
  return glm::mix(to_color(colors[i]), to_color(colors[i + 1]),
                  static_cast<float>(x - static_cast<double>(i)));
}

wisp::vec3 eval_colormap_linear(wisp::section_colors map, double t) {
  const wisp::vec3 c = eval_colormap(map, t);
  return {srgb_to_linear(c.x), srgb_to_linear(c.y), srgb_to_linear(c.z)};
}

float srgb_to_linear(float c) {
  return c <= 0.04045f ? c / 12.92f : std::pow((c + 0.055f) / 1.055f, 2.4f);
}

float linear_to_srgb(float c) {
  return c <= 0.0031308f ? 12.92f * c : 1.055f * std::pow(c, 1 / 2.4f) - 0.055f;
}
