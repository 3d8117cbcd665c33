#include "picture_options.h"

#include <fmt/format.h>

#include <map>

#include "commands.h"

// "W" or "WxH".
void parse_resolution(const std::string& text, wisp::trace_options& options) {
  auto number = [&](const std::string& digits) {
    if (digits.empty() || digits.size() > 6 ||
        digits.find_first_not_of("0123456789") != std::string::npos)
      throw usage_error(fmt::format(
          "--resolution: '{}' is not a size; give a width as 1280 or a size as 1280x720", text));
    return std::stoi(digits);
  };
  auto x = text.find_first_of("xX");
  options.width = number(text.substr(0, x));
  options.height = x == std::string::npos ? 0 : number(text.substr(x + 1));
  if (options.width < 1 || options.width > 65536 ||
      (x != std::string::npos && options.height < 1) || options.height > 65536)
    throw usage_error(
        fmt::format("--resolution: each side of '{}' must be 1 to 65536 pixels", text));
}

int find_camera(const wisp::scene_data& scene, const std::string& name) {
  if (name.empty()) return 0;
  for (std::size_t i = 0; i < scene.cameras.size(); i++)
    if (scene.cameras[i].name == name) return static_cast<int>(i);
  std::string names;
  for (const auto& camera : scene.cameras) names += (names.empty() ? "" : ", ") + camera.name;
  throw usage_error(fmt::format("--camera: the scene has no camera '{}'; it has: {}", name,
                                names.empty() ? "none" : names));
}

wisp::pixel_filter filter_of(const std::string& name) {
  static const std::map<std::string, wisp::pixel_filter> filters = {
      {"box", wisp::pixel_filter::box},
      {"tent", wisp::pixel_filter::tent},
      {"gaussian", wisp::pixel_filter::gaussian},
      {"blackman-harris", wisp::pixel_filter::blackman_harris}};
  return filters.at(name);
}
