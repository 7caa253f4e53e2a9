// Everything of the library that needs no optional dependency. Policies beside the serial one, and
// testing.hpp for a host's own tests, are included by name.
#pragma once

#include <wfpg/bsdf.hpp>
#include <wfpg/buffer.hpp>
#include <wfpg/error.hpp>
#include <wfpg/exec/policy.hpp>
#include <wfpg/exec/seq.hpp>
#include <wfpg/exitance_cache.hpp>
#include <wfpg/field_sampler.hpp>
#include <wfpg/field_store.hpp>
#include <wfpg/guide.hpp>
#include <wfpg/guide_file.hpp>
#include <wfpg/guide_view.hpp>
#include <wfpg/irradiance_records.hpp>
#include <wfpg/light_guide.hpp>
#include <wfpg/mis.hpp>
#include <wfpg/morton.hpp>
#include <wfpg/octahedral_map.hpp>
#include <wfpg/octree_guide.hpp>
#include <wfpg/partitioner.hpp>
#include <wfpg/path_guider.hpp>
#include <wfpg/path_recorder.hpp>
#include <wfpg/product_sampler.hpp>
#include <wfpg/radiance_field.hpp>
#include <wfpg/ray_caster.hpp>
#include <wfpg/sample_combiner.hpp>
#include <wfpg/sampling_options.hpp>
#include <wfpg/sarsa_grid.hpp>
#include <wfpg/sarsa_options.hpp>
#include <wfpg/sparse_voxel_octree.hpp>
#include <wfpg/spatial_binner.hpp>
#include <wfpg/statistics.hpp>
#include <wfpg/types.hpp>
#include <wfpg/version.hpp>
#include <wfpg/voxelizer.hpp>
#include <wfpg/wave.hpp>
