// The figures of palpate-lab summary for the page of a recording.
#pragma once

#include <string>

#include "common/record/reader.hpp"

namespace palpate {

/// Returns the metrics of each hand (session_metrics.hpp, over kOverN), the times in which one guided another, and the attempts
/// at the training task, as JSON of type "summary". Reads the whole recording.
std::string summary_message(const RecordingReader& recording);

}  // namespace palpate
