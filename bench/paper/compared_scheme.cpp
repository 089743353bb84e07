#include "bench/paper/compared_scheme.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cassert>
#include <memory>

#include "bench/paper/paper_patches.hpp"
#include "common/base/error.hpp"

namespace palpate {

std::vector<ComparedScheme> compared_schemes() {
  std::vector<ComparedScheme> all;
  for (std::size_t k = 0; k < kComparedSchemeNames.size(); ++k) all.push_back(static_cast<ComparedScheme>(k));
  return all;
}

ComparedScheme compared_scheme(const std::string& name, const std::string& where, std::string_view also) {
  const auto known = std::find(kComparedSchemeNames.begin(), kComparedSchemeNames.end(), name);
  if (known != kComparedSchemeNames.end()) return static_cast<ComparedScheme>(known - kComparedSchemeNames.begin());
  std::string expected = fmt::format("one of {}", fmt::join(kComparedSchemeNames, ", "));
  if (!also.empty()) expected += fmt::format(", {}", also);
  throw InputError(where, "'" + name + "' is not a scheme", expected);
}

std::vector<ComparedScheme> compared_schemes_named(const std::vector<std::string>& names) {
  std::vector<ComparedScheme> schemes;
  for (const std::string& name : names) schemes.push_back(compared_scheme(name, "--schemes"));
  return names.empty() ? compared_schemes() : schemes;
}

std::optional<Scheme> offered(ComparedScheme scheme) { return scheme_from_name(name_of(scheme)); }

ComparedScheme compared(Scheme scheme) { return compared_scheme(std::string(name_of(scheme))); }

bool suits(ComparedScheme scheme, const LumpedBody& body) {
  if (scheme != ComparedScheme::two_layer && scheme != ComparedScheme::balanced) return true;
  return body.relaxation.empty() && (scheme == ComparedScheme::balanced || !body.is_solid());
}

void select(ComparedScheme scheme, const Scene& scene, ReplayOptions& options) {
  assert(suits(scheme, scene.body));
  options.scheme = offered(scheme).value_or(Scheme::hold);
  if (scheme == ComparedScheme::filtered) options.low_pass_hz = kPaperLowPassHz;
  if (scheme != ComparedScheme::two_layer && scheme != ComparedScheme::balanced) return;
  const auto model = scheme == ComparedScheme::two_layer ? PaperPatches::Model::two_layer : PaperPatches::Model::balanced;
  options.make_patch = [patches = std::make_shared<PaperPatches>(model, scene)](const Room::Origin& at, const Patch& held,
                                                                                Micros horizon) {
    return patches->build(at, held, horizon);
  };
}

}  // namespace palpate
