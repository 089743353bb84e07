// One line for a person about what is shown: how fresh a room is, what a recording holds.
#pragma once

#include <string>

#include "client/viewer/view_core.hpp"
#include "common/record/recording.hpp"

namespace palpate {

/// Returns the state of a room that is ready().
std::string status_line(const ViewCore& core, Micros now);
/// Returns when and how a recording was made.
std::string status_line(const RecordingHead& head, std::size_t triangles);

}  // namespace palpate
