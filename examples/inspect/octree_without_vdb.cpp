// Replaces octree_vdb.cpp in builds without OpenVDB.
#include "octree_vdb.hpp"

#include <stdexcept>

namespace inspect {

void require_vdb() {
  throw std::runtime_error(
      "--vdb: this was built without OpenVDB; it takes OpenVDB and the headers of Boost, of Debian's "
      "libopenvdb-dev "
      "and libboost-dev, and building again");
}

void write_vdb(const learnt_scene&, const std::string&) {
  require_vdb();
}

}  // namespace inspect
