// Ctrl-Z (SIGTSTP): the program stops once none of its hands has a force any more; each force fades in when it continues.
#pragma once

#include "client/io/haptic_loop.hpp"

namespace palpate {

/// Makes SIGTSTP ask for a pause from now on. `hands`: number of hands in the program; each calls pause() when asked.
void begin_pauses(int hands);
/// Reports that one of the hands will not call pause() any more.
void hand_ended();

bool pause_asked();
/// Takes the force of `loop` away (which may be null) and returns when the program continues. The last of several hands stops the
/// program, or one that has waited 0.2 s for the others.
void pause(HapticLoop* loop);

}  // namespace palpate
