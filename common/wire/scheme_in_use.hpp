// The scheme that a station requests, and the one that it gets. A station that lets the server choose (`auto`) gets the nonlinear
// one (`hyper`) where it fits into the server's time and the link's losses, and `port` otherwise.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "common/base/types.hpp"
#include "common/patch/scheme.hpp"

namespace palpate {

/// Empty: the server chooses, frame by frame.
using SchemeAsked = std::optional<Scheme>;
/// Scheme for `auto` from a server that cannot choose.
inline constexpr Scheme kWithoutChoice = Scheme::port;

inline constexpr std::string_view kAutoName = "auto";
/// Largest share of lost datagrams to a station: a nonlinear patch needs several, and all of them have to arrive.
inline constexpr double kNonlinearLossMost = 0.1;

inline std::string_view name_of(SchemeAsked asked) { return asked ? name_of(*asked) : kAutoName; }

/// Reason for the scheme that a station gets.
enum class SchemeReason : std::uint8_t {
  unknown,                ///< the server does not know `auto`, or nothing was felt yet
  asked,                  ///< the station requested the scheme
  not_known_yet,          ///< the cost of patches was not measured so far
  fits,                   ///< a nonlinear patch fits
  fits_without_rollouts,  ///< it does, but there is no time to predict the hand's motion
  server_busy,            ///< a nonlinear patch exceeds the station's share of the frame
  link_lossy,             ///< the link loses too many datagrams of a nonlinear patch
};

struct SchemeInUse {
  Scheme scheme = Scheme::hold;  ///< meaningless where the reason is `unknown`
  SchemeReason reason = SchemeReason::unknown;
  Micros cost{};   ///< server time for a nonlinear patch, 0 = not known
  Micros limit{};  ///< largest permitted cost
};

/// Returns for example "hyper, a patch takes 9 of the 30 ms that it may"; empty without a report.
std::string describe(const SchemeInUse& in_use);

}  // namespace palpate
