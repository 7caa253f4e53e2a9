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

/// Exit code of a command line that has taken longer than mpirun() allows.
constexpr int too_late = 124;

/// What mpirun does where a rank fails.
enum class failing {
  ends_all,   ///< it ends all ranks, and its exit code is that rank's
  ends_alone  ///< it lets the others go on, and its exit code is 0
};

/// Runs a command line by `ranks` processes, for at most 60 seconds. Open MPI is asked to run as root, and to
/// put more ranks than cores on a machine. Version 4 reads OMPI_MCA_*, version 5 PRTE_MCA_*.
inline printed mpirun(int ranks, const std::string& command, failing rank = failing::ends_alone) {
  const std::string recovery =
      rank == failing::ends_alone ? "OMPI_MCA_orte_enable_recovery=1 PRTE_MCA_prte_enable_recovery=1 " : "";
  const std::string line =
      recovery +
      "OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 OMPI_MCA_rmaps_base_oversubscribe=1 "
      "OMPI_MCA_plm_rsh_agent=false PRTE_ALLOW_RUN_AS_ROOT=1 "
      "PRTE_ALLOW_RUN_AS_ROOT_CONFIRM=1 PRTE_MCA_rmaps_default_mapping_policy=:oversubscribe "
      "PRTE_MCA_plm_ssh_agent=false timeout 60 " WFPG_TEST_MPIRUN " -n " +
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
