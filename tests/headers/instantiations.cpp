// All members of a guider with these guides compile, as a host's explicit instantiation needs.
#include <wfpg/exec/seq.hpp>
#include <wfpg/guides/records/irradiance_records.hpp>
#include <wfpg/guides/sarsa/sarsa_grid.hpp>
#include <wfpg/path_guider.hpp>

template class wfpg::path_guider<wfpg::exec::seq, wfpg::irradiance_records<wfpg::exec::seq>>;
template class wfpg::path_guider<wfpg::exec::seq, wfpg::sarsa_grid<wfpg::exec::seq>>;
