// Signals that ask a program to end, noted rather than obeyed at once.
#pragma once

namespace render {

/// From now on the first SIGINT or SIGTERM is only noted, and the second ends the program as ever.
void note_interruptions();

/// Whether there was one.
bool is_interrupted();

}  // namespace render
