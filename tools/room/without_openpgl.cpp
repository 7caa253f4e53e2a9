// Replaces openpgl.cpp in builds without Open PGL.
#include "method.hpp"

#include <stdexcept>

namespace room {

outcome measure_openpgl(const std::string& name, const settings&, const wall_light&,
                        const std::vector<wall_point>&) {
  throw std::runtime_error(name +
                           ": this program was built without Open PGL; configure with "
                           "-Dopenpgl_DIR=DIRECTORY, which holds its openpglConfig.cmake, and build again");
}

}  // namespace room
