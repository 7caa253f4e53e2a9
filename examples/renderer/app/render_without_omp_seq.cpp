// Replaces render_omp.cpp and render_seq.cpp in builds for TBB alone, such as the demonstration's.
#include "app/render.hpp"

#include <stdexcept>

namespace render {

namespace {

[[noreturn]] void refuse(const char* device) {
  throw std::runtime_error(
      std::string("--device ") + device +
      ": this program was built for --device cpu alone; configure with -DWFPG_OMP_SEQ=ON "
      "and build again");
}

}  // namespace

render_result render_on_omp(const scene&, const render_options&, const progress_callback&) {
  refuse("omp");
}

render_result render_on_seq(const scene&, const render_options&, const progress_callback&) {
  refuse("seq");
}

}  // namespace render
