#include "app/interruption.hpp"

#include <atomic>
#include <csignal>

namespace render {
namespace {

std::atomic<bool> interrupted{false};
static_assert(std::atomic<bool>::is_always_lock_free, "handlers of signals may use no other");

void note(int) {
  interrupted = true;
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
}

}  // namespace

void note_interruptions() {
  interrupted = false;
  std::signal(SIGINT, note);
  std::signal(SIGTERM, note);
}

bool is_interrupted() {
  return interrupted;
}

}  // namespace render
