// Words of palpate-lab advise: how the body lies, and what of the request the chosen mesh does not meet.
#pragma once

#include <string>
#include <vector>

#include "bench/tissue/advice.hpp"

namespace palpate {

/// Names the longest and the thinnest axis, as far as they differ from the others by more than 5 %, and the --up that lays the
/// body on its broad side.
std::string orientation_in_words(const Vec3& size_m);

/// Position in the scene in whole millimetres.
std::string in_mm(const Vec3& place);

/// A line for each requirement that the chosen mesh misses, with what would help, and for each reason to doubt the estimates.
std::vector<std::string> misfits(const AdviceRequest& request, const Advice& advice);

}  // namespace palpate
