// What a client says, a line at a time, to whoever reads its output: that reader may stall or go, and no hand waits for it
// (common/io/line_writer.hpp). Where nobody reads any more (a pipe, a terminal that is gone) nothing is said, and no more comes
// of it.
#pragma once

#include <string>

#include "client/io/haptic_loop.hpp"

namespace palpate {

/// Of several hands, each on a thread of its own: whose lines those of this thread are, at the beginning of each.
void speak_as(const std::string& hand);
/// To the standard output.
void say(const std::string& lines);
/// To the standard error, after the program's name.
void complain(const std::string& lines);

std::string describe(const DeviceNote& note);

}  // namespace palpate
