// The scheme that a station asks for, and the one that it gets: who asks for none in particular (`auto`) gets the nonlinear one
// (`hyper`) where the server has the time for it and the link carries it, and `port` where not.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "common/base/types.hpp"
#include "common/port/scheme.hpp"

namespace palpate {

/// Nothing: the server chooses, frame by frame.
using SchemeAsked = std::optional<Scheme>;
/// What a server that cannot choose gives to who asks for no scheme in particular.
inline constexpr Scheme kWithoutChoice = Scheme::port;

inline constexpr std::string_view kAutoName = "auto";
/// Of the datagrams to a station that may get lost: a nonlinear patch takes several, and all of them have to come.
inline constexpr double kNonlinearLossMost = 0.1;

inline std::string_view name_of(SchemeAsked asked) { return asked ? name_of(*asked) : kAutoName; }

/// Why a station gets the scheme that it gets.
enum class SchemeReason : std::uint8_t {
  not_said,               ///< by a server that knows no `auto`, or nothing was felt yet
  asked,                  ///< the station named the scheme
  not_known_yet,          ///< what patches cost was not measured so far
  fits,                   ///< a nonlinear patch fits
  fits_without_rollouts,  ///< it does, but there is no time to look where the hand may go
  server_busy,            ///< it does not fit the station's share of the frame
  link_lossy,             ///< the link loses too much of it
};

struct SchemeInUse {
  Scheme scheme = Scheme::hold;  ///< without meaning where the reason is `not_said`
  SchemeReason reason = SchemeReason::not_said;
  Micros cost{};   ///< that a nonlinear patch takes the server, 0 = not known
  Micros limit{};  ///< that it may take
};

/// "hyper, a patch takes 9 of the 30 ms that it may"; empty where nothing was said.
std::string describe(const SchemeInUse& in_use);

}  // namespace palpate
