// Ctrl-Z (SIGTSTP): the program stops when no hand of it has a force any more, and each force fades in when it goes on.
#pragma once

#include "client/io/haptic_loop.hpp"

namespace palpate {

/// From now on SIGTSTP asks for a pause. `hands`: of the program, all of which call pause() when it is asked for.
void begin_pauses(int hands);
/// One of them will not call pause() any more.
void hand_ended();

bool pause_asked();
/// Takes the force of `loop` away, which may be none, and comes back when the program goes on. The last of several hands stops
/// it, or one that has waited 0.2 s for the others.
void pause(HapticLoop* loop);

}  // namespace palpate
