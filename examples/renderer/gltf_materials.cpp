// The mapping of materials, and image decoding through stb_image.
#include "gltf_materials.hpp"

#include "image_io.hpp"

#include <stb_image.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>

namespace render::gltf {
namespace {

/// The smoothest facets that are still sampled as rough ones.
constexpr float min_alpha = 0.01f;

/// Below this, rough facets refract nothing that could be told from what goes straight on.
constexpr float least_rough_ior = 1.01f;
/// Reflects all but half a percent: as good as infinite.
constexpr float largest_ior = 1000.0f;

/// Decoded images beyond this are refused: 64 Mi texels take 768 MiB.
constexpr int max_side = 1 << 15;
constexpr std::int64_t max_texels = std::int64_t(1) << 26;

struct free_pixels {
  void operator()(void* pixels) const { stbi_image_free(pixels); }
};

template <class T>
using pixel_pointer = std::unique_ptr<T, free_pixels>;

/// Decoded sRGB of 8 or 16 bits as linear RGB; grey is repeated, alpha ignored.
template <class T>
texture linear_texture(const T* pixels, int width, int height) {
  constexpr int levels = std::numeric_limits<T>::max();
  std::vector<float> curve(std::size_t(levels) + 1);
  for (int i = 0; i <= levels; ++i) curve[std::size_t(i)] = srgb_to_linear(float(i) / float(levels));
  texture result{width, height, std::vector<vec3>(std::size_t(width) * std::size_t(height))};
  for (std::size_t i = 0; i < result.texels.size(); ++i)
    result.texels[i] = {curve[pixels[3 * i]], curve[pixels[3 * i + 1]], curve[pixels[3 * i + 2]]};
  return result;
}

texture decode(const byte_range& encoded, const std::string& name) {
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
        stbi_load_16_from_memory(encoded.first, size, &width, &height, &channels, 3));
    if (pixels) return linear_texture(pixels.get(), width, height);
  } else {
    const pixel_pointer<stbi_uc> pixels(
        stbi_load_from_memory(encoded.first, size, &width, &height, &channels, 3));
    if (pixels) return linear_texture(pixels.get(), width, height);
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

/// A colour of one of a material's extensions, channels in [0, 1]; white where it is missing.
vec3 extension_colour(const tinygltf::Material& source, const char* extension, const char* member) {
  const auto found = source.extensions.find(extension);
  if (found == source.extensions.end() || !found->second.IsObject() || !found->second.Has(member))
    return vec3(1.0f);
  const tinygltf::Value& value = found->second.Get(member);
  if (!value.IsArray() || value.ArrayLen() != 3)
    throw std::runtime_error(std::string("a ") + member + " has not 3 components");
  vec3 colour(1.0f);
  for (int c = 0; c < 3; ++c)
    if (value.Get(c).IsNumber()) colour[c] = float(limited(value.Get(c).GetNumberAsDouble(), 0.0, 1.0));
  return colour;
}

/// The cheapest kind that scatters as the material's lobes do together.
material_kind kind_of(const material& m, bool thin) {
  const bool smooth = m.alpha == 0.0f;
  if (m.metallic == 1.0f) return smooth ? material_kind::mirror : material_kind::conductor;
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

  void read_base_color(const tinygltf::Material& source, material& result) {
    const tinygltf::PbrMetallicRoughness& pbr = source.pbrMetallicRoughness;
    if (pbr.baseColorFactor.size() < 3) throw std::runtime_error("a baseColorFactor has too few components");
    for (int c = 0; c < 3; ++c)
      result.base_color[c] = float(limited(pbr.baseColorFactor[std::size_t(c)], 0.0, 1.0));
    if (pbr.baseColorTexture.index >= 0) result.base_texture = texture_of(pbr.baseColorTexture);
  }

  void read_lobes(const tinygltf::Material& source, material& result) {
    const tinygltf::PbrMetallicRoughness& pbr = source.pbrMetallicRoughness;
    const auto share = [&](const char* extension, const char* member, double otherwise) {
      return float(limited(extension_number(source, extension, member, otherwise), 0.0, 1.0));
    };
    const double roughness = limited(pbr.roughnessFactor, 0.0, 1.0);
    result.alpha = float(roughness * roughness);
    result.metallic = float(limited(pbr.metallicFactor, 0.0, 1.0));
    result.specular = share("KHR_materials_specular", "specularFactor", 1.0);
    result.transmission = share("KHR_materials_transmission", "transmissionFactor", 0.0);
    const char* diffuse = "KHR_materials_diffuse_transmission";
    result.diffuse_transmission = share(diffuse, "diffuseTransmissionFactor", 0.0);
    result.transmitted_color = extension_colour(source, diffuse, "diffuseTransmissionColorFactor");
    // KHR_materials_ior: 0 stands for an infinite index.
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
  }

  void read_emission(const tinygltf::Material& source, material& result) {
    constexpr double largest = 1e30;
    if (source.emissiveFactor.size() != 3) throw std::runtime_error("an emissiveFactor has not 3 components");
    const double strength =
        extension_number(source, "KHR_materials_emissive_strength", "emissiveStrength", 1.0);
    for (int c = 0; c < 3; ++c)
      result.emission[c] = float(limited(source.emissiveFactor[std::size_t(c)] * strength, 0.0, largest));
    const bool emits = result.emission != vec3(0.0f);
    if (emits && source.doubleSided) warn("two-sided emission is not supported: the front side emits");
    if (emits && source.emissiveTexture.index >= 0) warn("emissive textures are not supported");
  }

  void warn_of_unsupported(const tinygltf::Material& source) {
    if (source.pbrMetallicRoughness.metallicRoughnessTexture.index >= 0)
      warn("metallic-roughness textures are not supported");
    if (source.normalTexture.index >= 0) warn("normal textures are not supported");
    if (source.occlusionTexture.index >= 0) warn("occlusion textures are not supported");
    if (source.alphaMode != "OPAQUE") warn("alpha is not supported: every surface is opaque");
    if (extension_colour(source, "KHR_materials_specular", "specularColorFactor") != vec3(1.0f))
      warn("a specularColorFactor is not supported: taken as white");
    for (const auto& extension : source.extensions) warn_of_extension(extension.first, extension.second);
  }

  void warn_of_extension(const std::string& name, const tinygltf::Value& value) {
    const char* read_above[] = {"KHR_materials_diffuse_transmission", "KHR_materials_emissive_strength",
                                "KHR_materials_ior", "KHR_materials_specular", "KHR_materials_transmission"};
    if (std::find(std::begin(read_above), std::end(read_above), name) != std::end(read_above)) return;
    if (name != "KHR_materials_volume")
      warn("the extension " + name + " is not supported");
    else if (value.IsObject() && value.Has("attenuationDistance"))
      warn("absorption inside a volume is not supported");
  }

  /// The index into scene::textures, -1 for none.
  std::int32_t texture_of(const tinygltf::TextureInfo& info) {
    if (info.texCoord != 0) {
      warn("texture coordinates other than TEXCOORD_0 are not supported: the texture is left out");
      return -1;
    }
    if (!info.extensions.empty()) warn("texture transforms are not supported");
    if (std::size_t(info.index) >= model_.textures.size())
      throw std::runtime_error("texture " + std::to_string(info.index) + " does not exist");
    const tinygltf::Texture& source = model_.textures[std::size_t(info.index)];
    warn_of_sampler(source.sampler);
    if (source.source >= 0) return image_of(source.source);
    warn("a texture without a PNG or JPEG image is left out");
    return -1;
  }

  void warn_of_sampler(int index) {
    if (index < 0) return;
    if (std::size_t(index) >= model_.samplers.size())
      throw std::runtime_error("sampler " + std::to_string(index) + " does not exist");
    const tinygltf::Sampler& sampler = model_.samplers[std::size_t(index)];
    if (sampler.wrapS != TINYGLTF_TEXTURE_WRAP_REPEAT || sampler.wrapT != TINYGLTF_TEXTURE_WRAP_REPEAT)
      warn("texture wrapping other than repeat is not supported: the texture is repeated");
  }

  std::int32_t image_of(int index) {
    if (std::size_t(index) >= model_.images.size())
      throw std::runtime_error("image " + std::to_string(index) + " does not exist");
    const auto [entry, is_new] = texture_of_image_.try_emplace(index, std::int32_t(target_.textures.size()));
    if (is_new) {
      const tinygltf::Image& image = model_.images[std::size_t(index)];
      const byte_range encoded = image.bufferView >= 0 ? view_bytes(model_, image.bufferView)
                                                       : byte_range{image.image.data(), image.image.size()};
      target_.textures.push_back(decode(encoded, "image " + std::to_string(index)));
    }
    return entry->second;
  }

  const tinygltf::Model& model_;
  scene& target_;
  std::map<int, std::int32_t> texture_of_image_;
};

}  // namespace

void add_materials(const tinygltf::Model& model, scene& target) {
  material_reader reader(model, target);
  for (const tinygltf::Material& source : model.materials) target.materials.push_back(reader.read(source));
  target.materials.emplace_back();
}

}  // namespace render::gltf
