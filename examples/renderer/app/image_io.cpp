// OpenEXR through its C++ library, PNG through stb_image and stb_image_write. Their errors become
// std::runtime_error that begins with the path.
#include "app/image_io.hpp"

#include "app/output_files.hpp"

#include <wfpg/state/section_file.hpp>

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputFile.h>
#include <ImfOutputFile.h>
#include <stb_image.h>
#include <stb_image_write.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <memory>
#include <ostream>
#include <sstream>
#include <stdexcept>
#include <string>

namespace render {
namespace {

static_assert(sizeof(vec3) == 3 * sizeof(float), "pixels are handed to OpenEXR as three packed floats");

constexpr const char* channel_names[3] = {"R", "G", "B"};

/// A header with more pixels than this counts as damaged.
constexpr std::int64_t max_pixels = std::int64_t(1) << 28;

void require_consistent(const image& picture) {
  const bool positive = picture.width > 0 && picture.height > 0;
  if (!positive || picture.pixels.size() != std::size_t(picture.width) * std::size_t(picture.height))
    throw std::runtime_error("the picture is empty or its size does not match its pixels");
}

void require_channels(const Imf::ChannelList& channels) {
  for (const char* name : channel_names) {
    const Imf::Channel* channel = channels.findChannel(name);
    if (!channel) throw std::runtime_error(std::string("has no channel ") + name);
    if (channel->type != Imf::HALF && channel->type != Imf::FLOAT)
      throw std::runtime_error(std::string("channel ") + name + " is neither half nor float");
    if (channel->xSampling != 1 || channel->ySampling != 1)
      throw std::runtime_error(std::string("channel ") + name + " is subsampled");
  }
}

image sized_for(const Imath::Box2i& window) {
  const std::int64_t width = std::int64_t(window.max.x) - window.min.x + 1;
  const std::int64_t height = std::int64_t(window.max.y) - window.min.y + 1;
  if (width <= 0 || height <= 0 || width > max_pixels || height > max_pixels / width)
    throw std::runtime_error("unusable size " + std::to_string(width) + " x " + std::to_string(height));
  return make_image(int(width), int(height));
}

/// Three interleaved float channels. `window` gives the place of the first pixel.
Imf::FrameBuffer frame_buffer(float* first, const Imath::Box2i& window) {
  Imf::FrameBuffer buffer;
  for (int c = 0; c < 3; ++c)
    buffer.insert(channel_names[c],
                  Imf::Slice::Make(Imf::FLOAT, first + c, window, sizeof(vec3),
                                   sizeof(vec3) * std::size_t(window.max.x - window.min.x + 1)));
  return buffer;
}

/// A number with few digits.
std::string in_words(float number) {
  std::ostringstream text;
  text << number;
  return text.str();
}

std::runtime_error with_path(const std::string& path, const std::exception& reason) {
  return std::runtime_error(path + ": " + reason.what());
}

image read_exr_pixels(const std::string& path) {
  Imf::InputFile file(path.c_str());
  require_channels(file.header().channels());
  const Imath::Box2i window = file.header().dataWindow();
  image picture = sized_for(window);
  file.setFrameBuffer(frame_buffer(&picture.pixels[0].x, window));
  file.readPixels(window.min.y, window.max.y);
  return picture;
}

/// A stream for OpenEXR's output. It throws nothing, since OpenEXR's destructors write too. Its owner checks
/// it at the end.
class exr_stream : public Imf::OStream {
 public:
  exr_stream(std::ostream& out, const std::string& path) : Imf::OStream(path.c_str()), out_(out) {}

  void write(const char bytes[], int size) override { out_.write(bytes, size); }
  std::uint64_t tellp() override { return static_cast<std::uint64_t>(std::streamoff(out_.tellp())); }
  void seekp(std::uint64_t at) override { out_.seekp(static_cast<std::streamoff>(at)); }

 private:
  std::ostream& out_;
};

/// A file for stb_image. stb_image reads zeros after its end, so this notes that it asked for more.
struct noted_file {
  std::ifstream stream;
  bool is_cut_off = false;

  static int read(void* self, char* target, int size) {
    auto& file = *static_cast<noted_file*>(self);
    file.stream.read(target, size);
    const int count = static_cast<int>(file.stream.gcount());
    file.is_cut_off = file.is_cut_off || count == 0;
    return count;
  }
  static void skip(void* self, int size) {
    static_cast<noted_file*>(self)->stream.seekg(size, std::ios::cur);
  }
  static int is_at_end(void* self) { return static_cast<noted_file*>(self)->stream.eof() ? 1 : 0; }
};

/// Decodes a file by a function of stb_image, and makes its values radiance.
template <class Value, class ToRadiance>
image decode(const std::string& path, Value* (*load)(const stbi_io_callbacks*, void*, int*, int*, int*, int),
             const ToRadiance& radiance) {
  noted_file file{std::ifstream(path, std::ios::binary)};
  if (!file.stream) throw std::runtime_error("cannot be opened");
  const stbi_io_callbacks callbacks{noted_file::read, noted_file::skip, noted_file::is_at_end};
  int width = 0, height = 0, channels = 0;
  const std::unique_ptr<Value, decltype(&stbi_image_free)> pixels(
      load(&callbacks, &file, &width, &height, &channels, 3), &stbi_image_free);
  if (!pixels) throw std::runtime_error(std::string("cannot be decoded: ") + stbi_failure_reason());
  if (file.is_cut_off) throw std::runtime_error("is cut off");
  image picture = make_image(width, height);
  for (std::size_t i = 0; i < picture.pixels.size(); ++i)
    for (int c = 0; c < 3; ++c) picture.pixels[i][c] = radiance(pixels.get()[3 * i + std::size_t(c)]);
  return picture;
}

image read_hdr(const std::string& path) {
  return decode(path, stbi_loadf_from_callbacks, [](float value) { return value; });
}

image read_png(const std::string& path) {
  return decode(path, stbi_load_16_from_callbacks,
                [](stbi_us value) { return srgb_to_linear(static_cast<float>(value) / 65535.0f); });
}

bool ends_in(const std::string& path, const std::string& extension) {
  return path.size() > extension.size() &&
         path.compare(path.size() - extension.size(), extension.size(), extension) == 0;
}

void write_exr_pixels(std::ostream& out, const std::string& path, const image& picture) {
  require_consistent(picture);
  Imf::Header header(picture.width, picture.height);
  for (const char* name : channel_names) header.channels().insert(name, Imf::Channel(Imf::FLOAT));
  const Imath::Box2i window = header.dataWindow();
  // The frame buffer's type has no const. An output file only reads from it.
  float* first = const_cast<float*>(&picture.pixels[0].x);
  exr_stream stream(out, path);
  Imf::OutputFile file(stream, header);
  file.setFrameBuffer(frame_buffer(first, window));
  file.writePixels(picture.height);
}

std::string encoded_png(const image& picture, float exposure) {
  require_consistent(picture);
  std::vector<std::uint8_t> bytes;
  bytes.reserve(picture.pixels.size() * 3);
  for (const vec3& pixel : picture.pixels)
    for (int c = 0; c < 3; ++c) {
      const float value = pixel[c] * exposure;
      const float clamped = value > 0.0f ? std::min(value, 1.0f) : 0.0f;  // NaN is not above 0
      bytes.push_back(static_cast<std::uint8_t>(linear_to_srgb(clamped) * 255.0f + 0.5f));
    }
  std::string encoded;
  const auto append = [](void* to, void* data, int size) {
    static_cast<std::string*>(to)->append(static_cast<const char*>(data), static_cast<std::size_t>(size));
  };
  if (!stbi_write_png_to_func(append, &encoded, picture.width, picture.height, 3, bytes.data(),
                              3 * picture.width))
    throw std::runtime_error("cannot be encoded");
  return encoded;
}

}  // namespace

image make_image(int width, int height) {
  if (width <= 0 || height <= 0)
    throw std::invalid_argument("a picture of " + std::to_string(width) + " x " + std::to_string(height) +
                                " pixels, expected both positive");
  return {width, height, std::vector<vec3>(std::size_t(width) * std::size_t(height), vec3(0.0f))};
}

image read_exr(const std::string& path) try {
  return read_exr_pixels(path);
} catch (const std::exception& reason) {
  throw with_path(path, reason);
}

image read_picture(const std::string& path) try {
  if (!ends_in(path, ".exr") && !ends_in(path, ".png"))
    throw std::runtime_error("is no picture that can be read; expected a name that ends in .exr or .png");
  return ends_in(path, ".png") ? read_png(path) : read_exr_pixels(path);
} catch (const std::exception& reason) {
  throw with_path(path, reason);
}

environment_map read_environment(const std::string& path) try {
  const image picture = ends_in(path, ".hdr") ? read_hdr(path) : read_exr_pixels(path);
  for (const vec3& p : picture.pixels) {
    for (int c = 0; c < 3; ++c)
      if (!(p[c] >= 0.0f) || std::isinf(p[c]))
        throw std::runtime_error("has radiance that is negative or not finite");
    if (!is_usable_light(p))
      throw std::runtime_error("has radiance of " + in_words(std::max(p.x, std::max(p.y, p.z))) +
                               " W/(m^2 sr), at most " + in_words(largest_radiance) + " is supported");
  }
  return {picture.width, picture.height, picture.pixels};
} catch (const std::exception& reason) {
  throw with_path(path, reason);
}

void write_exr(const std::string& path, const image& picture) {
  wfpg::replace_file(path, [&](std::ostream& out) {
    try {
      write_exr_pixels(out, path, picture);
    } catch (const std::exception& reason) {
      throw with_path(path, reason);
    }
  });
}

void write_png(const std::string& path, const image& picture, float exposure) {
  std::string encoded;
  try {
    encoded = encoded_png(picture, exposure);
  } catch (const std::exception& reason) {
    throw with_path(path, reason);
  }
  write_file(path, encoded);
}

image side_by_side(const std::vector<image>& pictures, int gap) {
  int width = 0, height = 0;
  for (const image& picture : pictures) {
    width += picture.width + (width > 0 ? gap : 0);
    height = std::max(height, picture.height);
  }
  image row = make_image(width, height);
  std::fill(row.pixels.begin(), row.pixels.end(), vec3(1.0f));
  int left = 0;
  for (const image& picture : pictures) {
    for (int y = 0; y < picture.height; ++y) {
      const auto source = picture.pixels.begin() + std::ptrdiff_t(y) * picture.width;
      std::copy(source, source + picture.width, row.pixels.begin() + std::ptrdiff_t(y) * width + left);
    }
    left += picture.width + gap;
  }
  return row;
}

image enlarged(const image& picture, int times) {
  image result = make_image(picture.width * times, picture.height * times);
  for (int y = 0; y < result.height; ++y)
    for (int x = 0; x < result.width; ++x)
      result.pixels[std::size_t(y) * std::size_t(result.width) + std::size_t(x)] =
          picture.pixels[std::size_t(y / times) * std::size_t(picture.width) + std::size_t(x / times)];
  return result;
}

image cropped(const image& picture, int left, int top, int width, int height) {
  if (left < 0 || top < 0 || width > picture.width - left || height > picture.height - top)
    throw std::invalid_argument("a crop of " + std::to_string(width) + " x " + std::to_string(height) +
                                " from " + std::to_string(left) + ", " + std::to_string(top) +
                                " on is not within " + std::to_string(picture.width) + " x " +
                                std::to_string(picture.height));
  image result = make_image(width, height);
  for (int y = 0; y < height; ++y) {
    const auto source = picture.pixels.begin() + std::ptrdiff_t(top + y) * picture.width + left;
    std::copy(source, source + width, result.pixels.begin() + std::ptrdiff_t(y) * width);
  }
  return result;
}

float srgb_to_linear(float encoded) {
  return encoded <= 0.04045f ? encoded / 12.92f : std::pow((encoded + 0.055f) / 1.055f, 2.4f);
}

float linear_to_srgb(float linear) {
  return linear <= 0.0031308f ? 12.92f * linear : 1.055f * std::pow(linear, 1.0f / 2.4f) - 0.055f;
}

}  // namespace render
