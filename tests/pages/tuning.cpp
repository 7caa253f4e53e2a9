// The options that docs/tuning.md sets.
#include <wfpg/path_guider.hpp>

wfpg::kept_guide_options tuned() {
#include "tuning-1.inc"
  return options;
}
