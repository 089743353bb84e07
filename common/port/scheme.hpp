// The names of the schemes by which a server makes patches of a touch (docs/concepts/schemes.md), and of the two kinds of
// contact.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

namespace palpate {

enum class Scheme : std::uint8_t { hold, filtered, tangent, ring, two_layer, balanced, port, hyper };

/// In the order of Scheme.
inline constexpr std::array<std::string_view, 8> kSchemeNames{"hold",      "filtered", "tangent", "ring",
                                                              "two-layer", "balanced", "port",    "hyper"};
/// What hyper was called: understood wherever a scheme is named, written nowhere.
inline constexpr std::string_view kOlderNameOfHyper = "cubic";

inline std::string_view name_of(Scheme s) { return kSchemeNames[static_cast<std::size_t>(s)]; }
/// Of its name, or the older one; nothing for a name that is no scheme.
std::optional<Scheme> scheme_from_name(std::string_view name);
/// Today's name of a scheme that was called `name`; `name` itself where it is no scheme's.
std::string_view current_scheme_name(std::string_view name);
/// Whether this build serves the scheme.
bool is_available(Scheme scheme);

/// attach: a grasp, the node follows the tool, both signs of force. touch: unilateral contact with friction on the surface.
enum class ContactKind : std::uint8_t { attach, touch };

}  // namespace palpate
