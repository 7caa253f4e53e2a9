// Starts processes by mpirun, and takes what they print.
#pragma once

#include <sys/wait.h>

#include <cstdio>
#include <stdexcept>
#include <string>

namespace wfpg_test {

struct printed {
  int code = 0;      ///< mpirun's exit code
  std::string text;  ///< of all ranks, and of mpirun
};

/// Runs a command line by `ranks` processes, for at most 60 seconds. Open MPI is asked not to end all ranks
/// where one ends, to run as root, and to put more ranks than cores on a machine.
inline printed mpirun(int ranks, const std::string& command) {
  const std::string line =
      "OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 OMPI_MCA_rmaps_base_oversubscribe=1 "
      "OMPI_MCA_orte_enable_recovery=1 OMPI_MCA_plm_rsh_agent=false timeout 60 " WFPG_TEST_MPIRUN " -n " +
      std::to_string(ranks) + " " + command + " 2>&1";
  std::FILE* const pipe = popen(line.c_str(), "r");
  if (!pipe) throw std::runtime_error("popen failed: " + line);
  printed result;
  char part[4096];
  for (std::size_t read; (read = std::fread(part, 1, sizeof part, pipe)) > 0;) result.text.append(part, read);
  const int status = pclose(pipe);
  result.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return result;
}

}  // namespace wfpg_test
