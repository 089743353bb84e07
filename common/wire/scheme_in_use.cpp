#include "common/wire/scheme_in_use.hpp"

namespace palpate {
namespace {

/// Formats with tenths below ten.
std::string ms_of(Micros time) {
  const auto tenths = (time.count() + 50) / 100;
  if (tenths >= 100) return std::to_string((tenths + 5) / 10);
  return std::to_string(tenths / 10) + "." + std::to_string(tenths % 10);
}

}  // namespace

std::string describe(const SchemeInUse& in_use) {
  const std::string name(name_of(in_use.scheme));
  switch (in_use.reason) {
    case SchemeReason::unknown:
      return "";
    case SchemeReason::asked:
      return name + ", as asked for";
    case SchemeReason::not_known_yet:
      return name + ": what hyper takes is not known yet";
    case SchemeReason::fits:
      return name + ", a patch takes " + ms_of(in_use.cost) + " of the " + ms_of(in_use.limit) + " ms that it may";
    case SchemeReason::fits_without_rollouts:
      return name + " without rollouts, for which the server has no time; a patch takes " + ms_of(in_use.cost) + " of the " +
             ms_of(in_use.limit) + " ms that it may";
    case SchemeReason::server_busy:
      return name + ": hyper takes " + ms_of(in_use.cost) + " ms a patch, " + ms_of(in_use.limit) + " may be spent";
    case SchemeReason::link_lossy:
      return name + ": the link loses too much for hyper";
  }
  return name;
}

}  // namespace palpate
