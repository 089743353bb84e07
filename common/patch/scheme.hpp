// Names of the schemes by which a server makes patches (docs/concepts/schemes.md), and of the two kinds of contact.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

namespace palpate {

enum class Scheme : std::uint8_t { hold, tangent, ring, port, hyper };

/// In the order of Scheme.
inline constexpr std::array<std::string_view, 5> kSchemeNames{"hold", "tangent", "ring", "port", "hyper"};

inline std::string_view name_of(Scheme s) { return kSchemeNames[static_cast<std::size_t>(s)]; }
/// Returns the scheme of a name; empty for any other name.
std::optional<Scheme> scheme_from_name(std::string_view name);

/// attach: a grasp, the node follows the tool, both signs of force. touch: unilateral contact with friction on the surface.
enum class ContactKind : std::uint8_t { attach, touch };

}  // namespace palpate
