// Notes signals that ask a program to end, instead of ending at once.
#pragma once

namespace render {

/// From now on the first SIGINT or SIGTERM is only noted. The second one ends the program.
void note_interruptions();

/// Whether a signal was noted.
bool is_interrupted();

}  // namespace render
