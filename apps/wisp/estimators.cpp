#include "estimators.h"

#include <fmt/format.h>

#include <array>

#include "commands.h"

namespace {

using wisp::section_options;

enum group { source, point_sources, biharmonic, exterior, directions, variates, sharing, groups };

struct estimator {
  const char* name;
  group of;
  void (*choose)(section_options&);
};

// The first of each group is the default.
constexpr std::array estimators = {
    estimator{"greens", source,
              [](section_options& o) { o.solve.sampling = wisp::source_sampling::greens; }},
    estimator{"uniform", source,
              [](section_options& o) { o.solve.sampling = wisp::source_sampling::uniform; }},
    estimator{"fundamental", point_sources,
              [](section_options& o) {
                o.solve.point_sources = wisp::point_source_estimator::fundamental;
              }},
    estimator{
        "balls", point_sources,
        [](section_options& o) { o.solve.point_sources = wisp::point_source_estimator::balls; }},
    estimator{
        "one_walk", biharmonic,
        [](section_options& o) { o.solve.biharmonic = wisp::biharmonic_estimator::one_walk; }},
    estimator{"tree", biharmonic,
              [](section_options& o) { o.solve.biharmonic = wisp::biharmonic_estimator::tree; }},
    estimator{"nested", biharmonic,
              [](section_options& o) { o.solve.biharmonic = wisp::biharmonic_estimator::nested; }},
    estimator{"sphere", exterior,
              [](section_options& o) { o.solve.exterior = wisp::exterior_estimator::sphere; }},
    estimator{"roulette", exterior,
              [](section_options& o) { o.solve.exterior = wisp::exterior_estimator::roulette; }},
    estimator{"antithetic", directions,
              [](section_options& o) { o.solve.directions = wisp::first_directions::antithetic; }},
    estimator{"stratified", directions,
              [](section_options& o) { o.solve.directions = wisp::first_directions::stratified; }},
    estimator{"random", directions,
              [](section_options& o) { o.solve.directions = wisp::first_directions::independent; }},
    estimator{"control_variates", variates,
              [](section_options& o) { o.solve.control_variates = true; }},
    estimator{"plain", variates, [](section_options& o) { o.solve.control_variates = false; }},
    estimator{"share", sharing, [](section_options& o) { o.share = true; }},
    estimator{"independent", sharing, [](section_options& o) { o.share = false; }}};

constexpr std::array<const char*, groups> group_names = {"samples of the source",
                                                         "point sources",
                                                         "biharmonic equation",
                                                         "exterior problems",
                                                         "first steps of a walk",
                                                         "control variates",
                                                         "sections"};

// Why a name of this group changes nothing; empty if it does.
std::string no_effect(group g, const wisp::pde_problem& p, bool is_section) {
  switch (g) {
    case source:
      return p.source ? "" : "the problem has no \"source\"";
    case point_sources:
      return p.point_sources.empty() ? "the problem has no point sources" : "";
    case biharmonic:
      return p.equation == wisp::pde_equation::biharmonic ? "" : "the problem is not biharmonic";
    case exterior:
      return p.domain.side() == wisp::domain_side::exterior ? "" : "the problem is interior";
    case sharing:
      return is_section ? "" : "only sections share walks";
    default:
      return "";
  }
}

}  // namespace

std::string estimator_help() {
  std::string text = "Estimators, the default first:\n";
  for (int g = 0; g < groups; ++g) {
    std::string names;
    for (const auto& e : estimators) {
      if (e.of == g) names += (names.empty() ? "" : ", ") + std::string(e.name);
    }
    text += fmt::format("  {:<24} {}\n", group_names[static_cast<std::size_t>(g)], names);
  }
  return text;
}

std::vector<std::string> choose_estimators(const std::vector<std::string>& names,
                                           const wisp::pde_problem& problem, bool is_section,
                                           section_options& options) {
  std::vector<std::string> unused;
  std::array<std::string, groups> chosen = {};
  for (const auto& name : names) {
    const estimator* found = nullptr;
    std::string known;
    for (const auto& e : estimators) {
      if (name == e.name) found = &e;
      known += (known.empty() ? "" : ", ") + std::string(e.name);
    }
    if (found == nullptr) {
      throw usage_error(
          fmt::format("--estimator: there is no estimator '{}', but these: {}", name, known));
    }
    auto& before = chosen[static_cast<std::size_t>(found->of)];
    if (!before.empty() && before != name) {
      throw usage_error(fmt::format("--estimator: '{}' and '{}' exclude each other", before, name));
    }
    before = name;
    found->choose(options);
    const std::string why = no_effect(found->of, problem, is_section);
    if (!why.empty()) unused.push_back(fmt::format("--estimator {}: {}; ignored", name, why));
  }
  return unused;
}
