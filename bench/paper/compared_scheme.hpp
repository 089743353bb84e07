// Schemes that an experiment can compare, in virtual time: those that a server offers (scheme.hpp), and three of the paper that
// serve the comparison alone.
//
//   filtered    the force of `hold` through a first-order low-pass, f' = 2 pi f_c (f_hold - f), f_c = kPaperLowPassHz (eq. 3)
//   two-layer, balanced    patches of paper_patches.hpp
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bench/fidelity/replay.hpp"

namespace palpate {

enum class ComparedScheme : std::uint8_t { hold, filtered, tangent, ring, two_layer, balanced, port, hyper };
/// In the order of ComparedScheme.
inline constexpr std::array<std::string_view, 8> kComparedSchemeNames{"hold",      "filtered", "tangent", "ring",
                                                                      "two-layer", "balanced", "port",    "hyper"};
inline constexpr double kPaperLowPassHz = 10;  ///< the model rate of the paper

inline std::string_view name_of(ComparedScheme s) { return kComparedSchemeNames[static_cast<std::size_t>(s)]; }
std::vector<ComparedScheme> compared_schemes();
/// Returns the scheme of a name; throws InputError, with the names, for another. `where`: the flag or the file. `also`: a further
/// name that the caller accepts there.
ComparedScheme compared_scheme(const std::string& name, const std::string& where = "--scheme", std::string_view also = {});
/// Returns the schemes of these names, all if there are none; throws as compared_scheme().
std::vector<ComparedScheme> compared_schemes_named(const std::vector<std::string>& names);
/// Returns the scheme of the server; empty for those of the paper alone.
std::optional<Scheme> offered(ComparedScheme scheme);
/// Returns the scheme with the name of a server's.
ComparedScheme compared(Scheme scheme);
/// False for `two-layer` on finite elements, and for it and `balanced` on a body with relaxation.
bool suits(ComparedScheme scheme, const LumpedBody& body);
/// Lets a replay of the scene play this scheme, which must suit its body.
void select(ComparedScheme scheme, const Scene& scene, ReplayOptions& options);

}  // namespace palpate
