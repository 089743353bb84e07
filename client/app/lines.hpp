// Output of a client, a line at a time. The reader may stall or disappear, and no hand waits for it (common/io/line_writer.hpp).
// When nobody reads any more (a closed pipe or terminal) the lines are dropped without further effect.
#pragma once

#include <string>

#include "client/core/client_core.hpp"
#include "client/io/haptic_loop.hpp"

namespace palpate {

/// Begins each line of the calling thread with the name of its hand. For programs with several hands, each on its own thread.
void speak_as(const std::string& hand);
/// Writes to the standard output.
void say(const std::string& lines);
/// Writes to the standard error, after the program's name.
void complain(const std::string& lines);

std::string describe(const DeviceNote& note);
/// Describes the state of guidance with a partner. `held`: true if the two held each other before.
std::string guidance_text(const GuidanceStatus& guidance, bool held);
/// Says that the server released the tool because it cost too much, or that this is over.
std::string release_text(bool released, ContactKind contact);
/// Says that a device has not been ready for `waited`, and what to do.
std::string not_ready(const Device& device, const DeviceReading& reading, Micros waited);

}  // namespace palpate
