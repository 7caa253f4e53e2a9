// Progress on stderr: a bar that redraws itself in a terminal, otherwise a line now and then.
#pragma once

#include "app/render.hpp"

namespace render {

class progress_bar {
 public:
  progress_bar();

  void show(const render_progress& progress);
  /// Ends the line.
  void finish();

 private:
  bool terminal_;
  double last_shown_ = -1.0;  ///< seconds since rendering began
  bool drawn_ = false;
};

}  // namespace render
