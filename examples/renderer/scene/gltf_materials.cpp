// Converts materials, and decodes images through stb_image.
#include "scene/gltf_materials.hpp"

#include "app/image_io.hpp"

#include <glm/exponential.hpp>
#include <stb_image.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace render::gltf {
namespace {

/// The smoothest facets that are sampled as rough ones.
constexpr float min_alpha = 0.01f;

/// Below this, light refracted by rough facets is hardly different from straight light.
constexpr float least_rough_ior = 1.01f;
/// Reflects all but half a percent, almost as an infinite index.
constexpr float largest_ior = 1000.0f;

/// The largest cutoff of an alpha mask. Above 1 nothing is left.
constexpr double largest_cutoff = 2.0;

/// Larger decoded images are refused: 64 Mi texels take 1 GiB.
constexpr int max_side = 1 << 15;
constexpr std::int64_t max_texels = std::int64_t(1) << 26;

struct free_pixels {
  void operator()(void* pixels) const { stbi_image_free(pixels); }
};

template <class T>
using pixel_pointer = std::unique_ptr<T, free_pixels>;

/// The encoding of an image's numbers. Alpha is linear in both.
enum class encoding { srgb, linear };

/// Converts decoded RGBA of 8 or 16 bits to linear numbers. Grey is repeated.
template <class T>
texture linear_texture(const T* pixels, int width, int height, encoding encoded) {
  constexpr int levels = std::numeric_limits<T>::max();
  const auto fraction = [](int i) { return float(i) / float(levels); };
  std::vector<float> curve(std::size_t(levels) + 1);
  for (int i = 0; i <= levels; ++i)
    curve[std::size_t(i)] = encoded == encoding::srgb ? srgb_to_linear(fraction(i)) : fraction(i);
  texture result{width, height, std::vector<vec4>(std::size_t(width) * std::size_t(height))};
  for (std::size_t i = 0; i < result.texels.size(); ++i) {
    const T* const p = pixels + 4 * i;
    result.texels[i] = {curve[p[0]], curve[p[1]], curve[p[2]], fraction(p[3])};
  }
  return result;
}

texture decode(const byte_range& encoded, encoding is, const std::string& name) {
  if (encoded.size == 0 || encoded.size > std::size_t(std::numeric_limits<int>::max()))
    throw std::runtime_error(name + " has no usable data");
  const int size = static_cast<int>(encoded.size);
  int width = 0, height = 0, channels = 0;
  if (!stbi_info_from_memory(encoded.first, size, &width, &height, &channels))
    throw std::runtime_error(name + " is no image that can be decoded: " + stbi_failure_reason());
  if (width > max_side || height > max_side || std::int64_t(width) * height > max_texels)
    throw std::runtime_error(name + " is too large: " + std::to_string(width) + " x " +
                             std::to_string(height));
  if (stbi_is_16_bit_from_memory(encoded.first, size)) {
    const pixel_pointer<stbi_us> pixels(
        stbi_load_16_from_memory(encoded.first, size, &width, &height, &channels, 4));
    if (pixels) return linear_texture(pixels.get(), width, height, is);
  } else {
    const pixel_pointer<stbi_uc> pixels(
        stbi_load_from_memory(encoded.first, size, &width, &height, &channels, 4));
    if (pixels) return linear_texture(pixels.get(), width, height, is);
  }
  throw std::runtime_error(name + " cannot be decoded: " + stbi_failure_reason());
}

double limited(double value, double lower, double upper) {
  return std::isfinite(value) ? std::clamp(value, lower, upper) : lower;
}

/// A member of one of a material's extensions.
double extension_number(const tinygltf::Material& source, const char* extension, const char* member,
                        double otherwise) {
  const auto found = source.extensions.find(extension);
  return found == source.extensions.end() ? otherwise : number_of(found->second, member, otherwise);
}

/// The numbers of an extension's member, which must have as many as `numbers`. Returns `numbers` if it is
/// missing.
template <std::size_t N>
std::array<double, N> extension_numbers(const tinygltf::Value& extension, const char* member,
                                        std::array<double, N> numbers) {
  if (!extension.IsObject() || !extension.Has(member)) return numbers;
  const tinygltf::Value& value = extension.Get(member);
  if (!value.IsArray() || value.ArrayLen() != N)
    throw std::runtime_error(std::string("a ") + member + " has not " + std::to_string(N) + " components");
  for (std::size_t i = 0; i < N; ++i) {
    const double number = value.Get(int(i)).IsNumber() ? value.Get(int(i)).GetNumberAsDouble() : numbers[i];
    if (std::isfinite(number)) numbers[i] = number;
  }
  return numbers;
}

/// A colour of one of a material's extensions, channels in [0, 1]. White if it is missing.
vec3 extension_colour(const tinygltf::Material& source, const char* extension, const char* member) {
  const auto found = source.extensions.find(extension);
  if (found == source.extensions.end()) return vec3(1.0f);
  const auto rgb = extension_numbers<3>(found->second, member, {1.0, 1.0, 1.0});
  return {float(limited(rgb[0], 0.0, 1.0)), float(limited(rgb[1], 0.0, 1.0)),
          float(limited(rgb[2], 0.0, 1.0))};
}

/// The cheapest kind that scatters as all lobes of the material together.
material_kind kind_of(const material& m, bool thin) {
  const bool smooth = m.alpha == 0.0f;
  const bool varies = m.metallic_roughness_texture.index >= 0 && m.metallic > 0.0f;
  if (m.metallic == 1.0f && !varies) return smooth ? material_kind::mirror : material_kind::conductor;
  const bool has_one_base = m.metallic == 0.0f && m.diffuse_transmission == 0.0f;
  if (has_one_base && m.transmission == 1.0f && m.specular == 1.0f) {
    if (smooth || m.ior < least_rough_ior)
      return thin ? material_kind::thin_dielectric : material_kind::dielectric;
    if (!thin) return material_kind::rough_dielectric;
  }
  if (has_one_base && m.transmission == 0.0f) {
    if (m.specular == 0.0f || m.ior == 1.0f) return material_kind::lambert;
    if (m.specular == 1.0f) return material_kind::plastic;
  }
  const bool transmits = m.transmission > 0.0f || m.diffuse_transmission > 0.0f;
  return thin && transmits ? material_kind::thin_metallic_roughness : material_kind::metallic_roughness;
}

texture_wrap wrap_of(int gltf_mode) {
  switch (gltf_mode) {
    case TINYGLTF_TEXTURE_WRAP_REPEAT:
      return texture_wrap::repeat;
    case TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT:
      return texture_wrap::mirrored_repeat;
    case TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE:
      return texture_wrap::clamp_to_edge;
    default:
      throw std::runtime_error("a sampler's wrap mode " + std::to_string(gltf_mode) + " is none");
  }
}

/// KHR_texture_transform: scales, then rotates counter-clockwise (v runs down), then translates.
void set_transform(const tinygltf::Value& extension, texture_reference& target) {
  const auto scale = extension_numbers<2>(extension, "scale", {1.0, 1.0});
  const auto offset = extension_numbers<2>(extension, "offset", {0.0, 0.0});
  const double angle = number_of(extension, "rotation", 0.0), c = std::cos(angle), s = std::sin(angle);
  target.u_axis = {float(c * scale[0]), float(-s * scale[0])};
  target.v_axis = {float(s * scale[1]), float(c * scale[1])};
  target.offset = {float(offset[0]), float(offset[1])};
}

/// Reads the members of a medium in `extras`, which none of glTF's own checks see. Throws std::runtime_error
/// "PLACE.MEMBER is VALUE, expected WHAT", also for members that it does not know.
class medium_reader {
 public:
  medium_reader(const tinygltf::Value& value, std::string place, const std::vector<std::string>& known)
      : value_(value), place_(std::move(place)) {
    if (!value.IsObject()) throw std::runtime_error(place_ + " is no object");
    for (const std::string& key : value.Keys())
      if (std::find(known.begin(), known.end(), key) == known.end())
        throw std::runtime_error(place_ + " has the unknown member " + key);
  }

  /// One number for all channels, or three. 0 if it is missing.
  vec3 coefficients(const char* member) const {
    const char* const expected = "a number, or three, in [0, 1e+06]";
    if (!value_.Has(member)) return vec3(0.0f);
    const tinygltf::Value& given = value_.Get(member);
    const bool is_list = given.IsArray();
    if (is_list && given.ArrayLen() != 3) refuse(member, "a list of another length", expected);
    vec3 result;
    for (int c = 0; c < 3; ++c)
      result[c] =
          float(in_range(member, is_list ? given.Get(c) : given, 0.0, double(largest_coefficient), expected));
    return result;
  }
  /// A number in [-most, most]. 0 if it is missing.
  double number(const char* member, double most) const {
    std::ostringstream expected;
    expected << "a number in [" << -most << ", " << most << "]";
    return value_.Has(member) ? in_range(member, value_.Get(member), -most, most, expected.str()) : 0.0;
  }
  double priority() const {
    const double found = number("priority", largest_priority);
    if (found != std::floor(found)) refuse("priority", shown(found), "a whole number");
    return found;
  }

 private:
  static constexpr double largest_priority = 1000.0;

  static std::string shown(double number) {
    std::ostringstream text;
    text << number;
    return text.str();
  }
  [[noreturn]] void refuse(const std::string& member, const std::string& found,
                           const std::string& expected) const {
    throw std::runtime_error(place_ + "." + member + " is " + found + ", expected " + expected);
  }
  double in_range(const char* member, const tinygltf::Value& given, double least, double most,
                  const std::string& expected) const {
    if (!given.IsNumber()) refuse(member, "no number", expected);
    const double found = given.GetNumberAsDouble();
    if (!(found >= least && found <= most)) refuse(member, shown(found), expected);
    return found;
  }

  const tinygltf::Value& value_;
  std::string place_;
};

class material_reader {
 public:
  material_reader(const tinygltf::Model& model, scene& target) : model_(model), target_(target) {}

  material read(const tinygltf::Material& source) {
    material result;
    read_base_color(source, result);
    read_lobes(source, result);
    choose_kind(source, result);
    read_emission(source, result);
    warn_of_unsupported(source);
    return result;
  }

 private:
  void warn(const std::string& line) { warn_once(target_.warnings, line); }

  /// A material in messages: its place in the file, and its name if it has one.
  std::string name_of(const tinygltf::Material& source) const {
    const std::string place = "material " + std::to_string(&source - model_.materials.data());
    return source.name.empty() ? place : place + " ('" + source.name + "')";
  }

  void read_base_color(const tinygltf::Material& source, material& result) {
    const tinygltf::PbrMetallicRoughness& pbr = source.pbrMetallicRoughness;
    if (pbr.baseColorFactor.size() < 3) throw std::runtime_error("a baseColorFactor has too few components");
    for (int c = 0; c < 3; ++c)
      result.base_color[c] = float(limited(pbr.baseColorFactor[std::size_t(c)], 0.0, 1.0));
    result.base_texture = texture_of(pbr.baseColorTexture, encoding::srgb);
    if (source.alphaMode == "MASK") {
      if (pbr.baseColorFactor.size() == 4) result.opacity = float(limited(pbr.baseColorFactor[3], 0.0, 1.0));
      result.alpha_cutoff = float(limited(source.alphaCutoff, 0.0, largest_cutoff));
    } else if (source.alphaMode == "BLEND") {
      warn("blended alpha is not supported: the surface is opaque");
    }
  }

  void read_lobes(const tinygltf::Material& source, material& result) {
    const tinygltf::PbrMetallicRoughness& pbr = source.pbrMetallicRoughness;
    const auto share = [&](const char* extension, const char* member, double otherwise) {
      return float(limited(extension_number(source, extension, member, otherwise), 0.0, 1.0));
    };
    result.metallic_roughness_texture = texture_of(pbr.metallicRoughnessTexture, encoding::linear);
    const double roughness = limited(pbr.roughnessFactor, 0.0, 1.0);
    result.alpha = float(roughness * roughness);
    result.metallic = float(limited(pbr.metallicFactor, 0.0, 1.0));
    result.specular = share("KHR_materials_specular", "specularFactor", 1.0);
    result.transmission = share("KHR_materials_transmission", "transmissionFactor", 0.0);
    const char* diffuse = "KHR_materials_diffuse_transmission";
    result.diffuse_transmission = share(diffuse, "diffuseTransmissionFactor", 0.0);
    result.transmitted_color = extension_colour(source, diffuse, "diffuseTransmissionColorFactor");
    // KHR_materials_ior: 0 means an infinite index.
    const double ior = extension_number(source, "KHR_materials_ior", "ior", 1.5);
    result.ior = ior == 0.0 ? largest_ior : float(limited(ior, 1.0, largest_ior));
  }

  void choose_kind(const tinygltf::Material& source, material& result) {
    bool thin = !(extension_number(source, "KHR_materials_volume", "thicknessFactor", 0.0) > 0.0);
    if (!thin && result.diffuse_transmission > 0.0f) {
      warn("diffuse transmission of solids is not supported: taken for that of a thin sheet");
      thin = true;
    }
    result.kind = kind_of(result, thin);
    if (result.kind == material_kind::metallic_roughness && result.transmission > 0.0f)
      result.ior = std::max(result.ior, least_rough_ior);
    result.alpha = std::max(result.alpha, min_alpha);
    const bool is_filled = !thin && result.transmission > 0.0f && result.metallic < 1.0f;
    if (is_filled) result.absorption = absorption(source);
    if (source.extras.IsObject() && source.extras.Has("medium"))
      read_interior(source.extras.Get("medium"), name_of(source), is_filled, result);
  }

  // Beside the absorption of KHR_materials_volume. No extension of glTF has scattering of solids.
  void read_interior(const tinygltf::Value& value, const std::string& name, bool is_filled,
                     material& result) {
    const medium_reader reader(value, name + ", extras.medium", {"scattering", "g", "priority"});
    const vec3 scattering = reader.coefficients("scattering");
    const double g = reader.number("g", double(largest_mean_cosine)), priority = reader.priority();
    if (!is_filled) return warn("extras.medium of materials that are no transmitting solids has no effect");
    result.scattering = scattering;
    result.g = float(g);
    result.priority = std::int32_t(priority);
  }

  // KHR_materials_volume: the attenuation colour is what is left after the attenuation distance.
  static vec3 absorption(const tinygltf::Material& source) {
    constexpr float least_left = 1e-6f;
    const double distance = extension_number(source, "KHR_materials_volume", "attenuationDistance", 0.0);
    if (!(distance > 0.0)) return vec3(0.0f);
    const vec3 left = extension_colour(source, "KHR_materials_volume", "attenuationColor");
    return -glm::log(glm::max(left, vec3(least_left))) / float(distance);
  }

  void read_emission(const tinygltf::Material& source, material& result) {
    if (source.emissiveFactor.size() != 3) throw std::runtime_error("an emissiveFactor has not 3 components");
    const double strength =
        extension_number(source, "KHR_materials_emissive_strength", "emissiveStrength", 1.0);
    for (int c = 0; c < 3; ++c) {
      const double channel = source.emissiveFactor[std::size_t(c)] * strength;
      if (!(channel <= double(largest_radiance)))
        throw too_bright(name_of(source) + " has an emissiveFactor times emissiveStrength", channel);
      result.emission[c] = float(std::max(channel, 0.0));
    }
    const bool emits = result.emission != vec3(0.0f);
    if (emits && source.doubleSided) warn("two-sided emission is not supported: the front side emits");
    if (emits) result.emission_texture = texture_of(source.emissiveTexture, encoding::srgb);
  }

  void warn_of_unsupported(const tinygltf::Material& source) {
    if (source.normalTexture.index >= 0) warn("normal textures are not supported");
    if (source.occlusionTexture.index >= 0) warn("occlusion textures are not supported");
    if (extension_colour(source, "KHR_materials_specular", "specularColorFactor") != vec3(1.0f))
      warn("a specularColorFactor is not supported: taken as white");
    for (const auto& extension : source.extensions) {
      warn_of_extension(extension.first);
      warn_of_textures(extension.second);
    }
  }

  /// The extensions' own textures are not read.
  void warn_of_textures(const tinygltf::Value& extension) {
    if (!extension.IsObject()) return;
    const std::string suffix = "Texture";
    for (const std::string& key : extension.Keys())
      if (key.size() >= suffix.size() && key.compare(key.size() - suffix.size(), suffix.size(), suffix) == 0)
        warn("a " + key + " is not supported: its factor is the same everywhere");
  }

  void warn_of_extension(const std::string& name) {
    if (name.rfind("KHR_materials_", 0) != 0 || !gltf::is_supported_extension(name))
      warn("the extension " + name + " is not supported");
  }

  /// tinygltf has a TextureInfo type for each place that refers to a texture.
  template <class TextureInfo>
  texture_reference texture_of(const TextureInfo& info, encoding is) {
    texture_reference result;
    if (info.index < 0) return result;
    int coordinates = info.texCoord;
    for (const auto& [name, extension] : info.extensions) {
      if (name != "KHR_texture_transform") {
        warn("the extension " + name + " of textures is not supported");
        continue;
      }
      set_transform(extension, result);
      coordinates = int(limited(number_of(extension, "texCoord", coordinates), 0.0, 1e6));
    }
    if (coordinates != 0)
      warn("texture coordinates other than TEXCOORD_0 are not supported: the texture is left out");
    else
      result.index = index_of(info.index, is);
    return result;
  }

  /// The index into scene::textures, -1 for none. Textures that show one image equally share it.
  std::int32_t index_of(int gltf_texture, encoding is) {
    if (std::size_t(gltf_texture) >= model_.textures.size())
      throw std::runtime_error("texture " + std::to_string(gltf_texture) + " does not exist");
    const tinygltf::Texture& source = model_.textures[std::size_t(gltf_texture)];
    if (source.source < 0) {
      warn("a texture without a PNG or JPEG image is left out");
      return -1;
    }
    const auto [wrap_u, wrap_v] = wrapping_of(source.sampler);
    const auto [entry, is_new] = index_of_texture_.try_emplace({source.source, is, wrap_u, wrap_v},
                                                               std::int32_t(target_.textures.size()));
    if (is_new) {
      texture decoded = image_of(source.source, is);
      decoded.wrap_u = wrap_u;
      decoded.wrap_v = wrap_v;
      target_.textures.push_back(std::move(decoded));
    }
    return entry->second;
  }

  std::pair<texture_wrap, texture_wrap> wrapping_of(int sampler) {
    if (sampler < 0) return {texture_wrap::repeat, texture_wrap::repeat};
    if (std::size_t(sampler) >= model_.samplers.size())
      throw std::runtime_error("sampler " + std::to_string(sampler) + " does not exist");
    const tinygltf::Sampler& source = model_.samplers[std::size_t(sampler)];
    if (source.magFilter == TINYGLTF_TEXTURE_FILTER_NEAREST)
      warn("texture filters are not supported: all are bilinear");
    return {wrap_of(source.wrapS), wrap_of(source.wrapT)};
  }

  texture image_of(int index, encoding is) const {
    if (std::size_t(index) >= model_.images.size())
      throw std::runtime_error("image " + std::to_string(index) + " does not exist");
    const tinygltf::Image& image = model_.images[std::size_t(index)];
    const byte_range encoded = image.bufferView >= 0 ? view_bytes(model_, image.bufferView)
                                                     : byte_range{image.image.data(), image.image.size()};
    const bool in_file = !image.uri.empty() && image.uri.rfind("data:", 0) != 0;
    return decode(encoded, is, "image " + std::to_string(index) + (in_file ? " (" + image.uri + ")" : ""));
  }

  const tinygltf::Model& model_;
  scene& target_;
  std::map<std::tuple<int, encoding, texture_wrap, texture_wrap>, std::int32_t> index_of_texture_;
};

}  // namespace

medium read_medium(const tinygltf::Value& value, const std::string& place) {
  const medium_reader reader(value, place, {"absorption", "scattering", "g"});
  return {reader.coefficients("absorption"), reader.coefficients("scattering"),
          float(reader.number("g", double(largest_mean_cosine)))};
}

void add_materials(const tinygltf::Model& model, scene& target) {
  material_reader reader(model, target);
  for (const tinygltf::Material& source : model.materials) target.materials.push_back(reader.read(source));
  target.materials.emplace_back();
}

}  // namespace render::gltf
