// The CUDA policy: samples in graphs and on a host's streams, allocations, and errors that the host left
// behind.
#include "cuda/walls.hpp"
#include "support/guiding.hpp"
#include "support/scenes.hpp"

#include <wfpg/exec/cuda.hpp>
#include <wfpg/path_guider.hpp>

#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

using namespace wfpg_test;
using cuda_policy = wfpg::exec::cuda;
using wfpg::check_cuda;

namespace {

constexpr std::uint32_t rays = 5000, deposits = 20000, depths = 2;

/// A stream that does not wait for the default one.
class own_stream {
 public:
  own_stream() { check_cuda(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking), "cudaStreamCreate"); }
  own_stream(const own_stream&) = delete;
  own_stream& operator=(const own_stream&) = delete;
  ~own_stream() { cudaStreamDestroy(stream_); }
  operator cudaStream_t() const { return stream_; }

 private:
  cudaStream_t stream_ = nullptr;
};

guider_options options_of(field_lifetime lifetime, std::uint32_t product_resolution, std::uint64_t seed = 1) {
  guider_options options = box_options(wfpg::guiding_mode::oriented, lifetime);
  options.product_resolution = unless_zero(product_resolution);
  options.max_paths = rays;
  options.max_rays = rays;
  options.max_depth = depths;
  options.deposit_capacity = deposits + rays * depths;
  options.unguided_samples = 1;
  options.seed = seed;
  return options;
}

struct record_walls {
  wfpg::path_recorder_view recorder;
  walls surfaces;
  std::uint32_t depth;
  WFPG_HD void operator()(std::size_t path) const {
    const test_surface s = surfaces(static_cast<std::uint32_t>(path));
    recorder.vertex(path, depth, s.position, s.outgoing, vec3(0.5f));
    recorder.radiance(path, depth, vec3(0.01f));
  }
};

/// Samples of two depths, as a renderer makes them.
class renderer {
 public:
  renderer(const cuda_policy& exec, const guider_options& options)
      : exec_(exec), guider_(exec, box_mesh<cuda_policy>(exec).view(), options) {
    for (auto& directions : directions_)
      directions = wfpg::buffer<wfpg::sampled_direction, cuda_policy>(exec_, rays);
  }

  void sample() {
    ++samples_;
    guider_.begin_sample();
    exec_.for_each(deposits, light_walls{guider_.guide().cache()});
    for (std::uint32_t depth = 0; depth < depths; ++depth) {
      const walls surfaces{samples_ % 3 + depth};
      exec_.for_each(rays, record_walls{guider_.recorder(), surfaces, depth});
      guider_.sample_directions(wfpg::wave{depth, rays, surfaces, hashed_numbers{samples_}}, box_caster{},
                                directions_[depth].view());
    }
    guider_.end_sample();
  }

  /// Directions of the last sample. Waits for them.
  std::vector<wfpg::sampled_direction> directions() const {
    std::vector<wfpg::sampled_direction> all;
    for (const auto& of_depth : directions_)
      for (const wfpg::sampled_direction& d : of_depth.to_host(exec_)) all.push_back(d);
    return all;
  }
  std::size_t guided() const {
    std::size_t n = 0;
    for (const wfpg::sampled_direction& d : directions()) n += d.technique == wfpg::sampling_technique::guide;
    return n;
  }
  wfpg::guider_statistics statistics() const { return guider_.statistics(); }

 private:
  cuda_policy exec_;
  octree_guider<cuda_policy> guider_;
  wfpg::buffer<wfpg::sampled_direction, cuda_policy> directions_[depths];
  std::uint32_t samples_ = 0;
};

/// A CUDA graph of the work that is captured on a stream.
class captured_graph {
 public:
  template <class Work>
  captured_graph(cudaStream_t stream, const Work& work) : stream_(stream) {
    check_cuda(cudaStreamBeginCapture(stream, cudaStreamCaptureModeThreadLocal), "cudaStreamBeginCapture");
    try {
      work();
    } catch (...) {
      cudaStreamEndCapture(stream, &graph_);
      throw;
    }
    check_cuda(cudaStreamEndCapture(stream, &graph_), "cudaStreamEndCapture");
    check_cuda(cudaGraphInstantiate(&instance_, graph_, 0), "cudaGraphInstantiate");
  }
  captured_graph(const captured_graph&) = delete;
  captured_graph& operator=(const captured_graph&) = delete;
  ~captured_graph() {
    cudaGraphExecDestroy(instance_);
    cudaGraphDestroy(graph_);
  }
  void launch() const { check_cuda(cudaGraphLaunch(instance_, stream_), "cudaGraphLaunch"); }

 private:
  cudaStream_t stream_;
  cudaGraph_t graph_ = nullptr;
  cudaGraphExec_t instance_ = nullptr;
};

constexpr std::uint32_t product_resolutions[] = {0, 8};

}  // namespace

TEST_CASE("a sample captured in a CUDA graph gives the same directions", "[cuda]") {
  for (const auto lifetime : lifetimes)
    for (const std::uint32_t product_resolution : product_resolutions) {
      INFO(name_of(lifetime) << ", products " << product_resolution);
      const own_stream stream;
      renderer captured(cuda_policy(stream), options_of(lifetime, product_resolution)),
          direct(cuda_policy(), options_of(lifetime, product_resolution));
      for (int sample = 0; sample < 4; ++sample) {
        captured.sample();
        direct.sample();
      }
      const captured_graph graph(stream, [&] { captured.sample(); });  // it adapts bin sizes in the graph
      graph.launch();
      direct.sample();
      CHECK(same_bits(captured.directions(), direct.directions()));
      CHECK(captured.guided() > rays / 4);
      captured.sample();
      direct.sample();
      CHECK(same_bits(captured.directions(), direct.directions()));
      CHECK(captured.statistics().kept.refreshed == direct.statistics().kept.refreshed);
      CHECK(captured.statistics().depths[0].rays == direct.statistics().depths[0].rays);
    }
}

TEST_CASE("guiders on two streams do not disturb each other", "[cuda]") {
  for (const auto lifetime : lifetimes) {
    INFO(name_of(lifetime));
    const guider_options one = options_of(lifetime, 0, 1), other = options_of(lifetime, 8, 2);
    const own_stream first, second;
    renderer a(cuda_policy(first), one), b(cuda_policy(second), other);
    renderer a_alone(cuda_policy(), one), b_alone(cuda_policy(), other);
    for (int sample = 0; sample < 6; ++sample) {
      a.sample();
      b.sample();
    }
    for (int sample = 0; sample < 6; ++sample) a_alone.sample();
    for (int sample = 0; sample < 6; ++sample) b_alone.sample();
    CHECK(same_bits(a.directions(), a_alone.directions()));
    CHECK(same_bits(b.directions(), b_alone.directions()));
    CHECK(!same_bits(a.directions(), b.directions()));
  }
}

TEST_CASE("samples after the first guided one allocate nothing on the GPU", "[cuda]") {
  for (const auto lifetime : lifetimes)
    for (const std::uint32_t product_resolution : product_resolutions) {
      INFO(name_of(lifetime) << ", products " << product_resolution);
      const own_stream stream;
      const cuda_policy upstream(stream);
      counting_resource resource(upstream.resource());
      {
        renderer counted(cuda_policy(stream, &resource), options_of(lifetime, product_resolution));
        for (int sample = 0; sample < 2; ++sample) counted.sample();
        const std::size_t before = resource.allocations;
        CHECK(before > 0);
        for (int sample = 0; sample < 8; ++sample) counted.sample();
        CHECK(resource.allocations == before);
      }
      CHECK(resource.bytes_in_use == 0);
    }
}

namespace {

/// Free bytes of the device.
std::size_t free_bytes() {
  std::size_t free = 0, all = 0;
  check_cuda(cudaDeviceSynchronize(), "cudaDeviceSynchronize");
  check_cuda(cudaMemGetInfo(&free, &all), "cudaMemGetInfo");
  return free;
}

constexpr std::size_t much = std::size_t(256) << 20;
using bytes_of_device = wfpg::buffer<std::byte, cuda_policy>;

}  // namespace

// Needs the whole GPU: memory of other processes counts too.
TEST_CASE("a policy keeps memory until it is trimmed or destroyed", "[cuda][pool]") {
  const std::size_t before = free_bytes();
  const auto holds = [&] { return free_bytes() + much / 2 < before; };
  {
    const cuda_policy exec;
    { const bytes_of_device block(exec, much); }
    CHECK(holds());
    const cuda_policy copy = exec;
    copy.trim();
    CHECK(!holds());
    { const bytes_of_device block(copy, much); }
    CHECK(holds());
  }
  CHECK(!holds());
}

TEST_CASE("policies of one stream do not share a pool", "[cuda]") {
  const own_stream stream;
  const cuda_policy first(stream), second(stream), copy = first;
  CHECK(first.resource() != second.resource());
  CHECK(copy.resource() == first.resource());
  counting_resource resource(first.resource());
  CHECK(first.with_resource(&resource).resource() == &resource);
  first.with_resource(&resource).trim();
}

TEST_CASE("a buffer outlives its policy", "[cuda]") {
  bytes_of_device block;
  {
    const cuda_policy exec;
    block = bytes_of_device(exec, 64);
  }
  const cuda_policy later;
  later.fill_bytes(block.data(), 7, block.bytes());
  CHECK(wfpg::read_element(later, block.data() + 63) == std::byte(7));
}

namespace {

/// Keeps a stream busy until the host sets the flag, or for some seconds.
__global__ void wait_for_host(const volatile int* go) {
  const long long begin = clock64(), enough = 10'000'000'000;  // at least 5 s
  while (!*go && clock64() - begin < enough) {
  }
}

/// Memory that host and device share.
class shared_flag {
 public:
  shared_flag() {
    check_cuda(cudaHostAlloc(&flag_, sizeof(int), cudaHostAllocMapped), "cudaHostAlloc");
    *flag_ = 0;
  }
  shared_flag(const shared_flag&) = delete;
  shared_flag& operator=(const shared_flag&) = delete;
  ~shared_flag() { cudaFreeHost(flag_); }
  int* get() const { return flag_; }
  void set() { *static_cast<volatile int*>(flag_) = 1; }

 private:
  int* flag_ = nullptr;
};

__global__ void do_nothing() {}
__global__ void fail() {
  __trap();
}

struct set_word {
  std::uint32_t* word;
  WFPG_HD void operator()(std::size_t) const { *word = 7; }
};

}  // namespace

// Not for tools that run one kernel at a time.
TEST_CASE("work on a stream waits for no other stream", "[cuda][overlap]") {
  for (const auto lifetime : lifetimes) {
    INFO(name_of(lifetime));
    const own_stream stream;
    const guider_options options = options_of(lifetime, 0);
    renderer ours(cuda_policy(stream), options), expected(cuda_policy(), options);
    for (int sample = 0; sample < 4; ++sample) expected.sample();
    for (int sample = 0; sample < 3; ++sample) ours.sample();
    const auto truth = expected.directions();
    ours.directions();

    shared_flag go;
    wait_for_host<<<1, 1>>>(go.get());
    ours.sample();
    const auto found = ours.directions();
    const cudaError_t default_stream = cudaStreamQuery(nullptr);
    go.set();
    CHECK(default_stream == cudaErrorNotReady);
    CHECK(same_bits(found, truth));
    check_cuda(cudaDeviceSynchronize(), "cudaDeviceSynchronize");
  }
}

TEST_CASE("the next call reports a launch that failed before", "[cuda]") {
  const cuda_policy exec;
  const wfpg::buffer<std::uint32_t, cuda_policy> word(exec, 1);
  do_nothing<<<1, 5000>>>();
  const cudaError_t left_behind = cudaPeekAtLastError();
  REQUIRE(left_behind != cudaSuccess);
  try {
    exec.for_each(1, set_word{word.data()});
    FAIL("nothing was thrown");
  } catch (const wfpg::cuda_error& error) {
    CHECK(error.code() == left_behind);
    CHECK(std::string(error.what()).find("wfpg: kernel launch: ") == 0);
    CHECK(static_cast<const wfpg::device_error&>(error).code() == static_cast<int>(left_behind));
  }
  exec.for_each(1, set_word{word.data()});
  CHECK(wfpg::read_element(exec, word.data()) == 7);
}

struct waiting_kernel : set_word {
  static constexpr bool waits_for_memory = true;
};

TEST_CASE("kernels that wait for memory have bounded registers, others have not", "[cuda]") {
  namespace detail = wfpg::detail;
  CHECK(detail::index_kernel<std::size_t, waiting_kernel>() ==
        detail::for_each_waiting_kernel<std::size_t, waiting_kernel>);
  CHECK(detail::index_kernel<std::size_t, set_word>() == detail::for_each_kernel<std::size_t, set_word>);
}

// Needs its own process, since it breaks the GPU's context.
TEST_CASE("every call reports a kernel that failed before", "[.][cuda][sticky]") {
  const cuda_policy exec;
  const wfpg::buffer<std::uint32_t, cuda_policy> word(exec, 1);
  renderer guided(exec, options_of(field_lifetime::kept, 0));
  fail<<<1, 1>>>();
  try {
    wfpg::read_element(exec, word.data());
    FAIL("nothing was thrown");
  } catch (const wfpg::cuda_error& error) {
    CHECK(error.code() == cudaErrorLaunchFailure);
  }
  CHECK_THROWS_AS(exec.for_each(1, set_word{word.data()}), wfpg::cuda_error);
  CHECK_THROWS_AS(guided.sample(), std::runtime_error);  // thrown by Thrust, or by the policy
  CHECK_THROWS_AS((wfpg::buffer<std::uint32_t, cuda_policy>(exec, 1)), wfpg::cuda_error);
}
