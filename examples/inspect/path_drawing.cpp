// Projects a camera path and what is near it.
#include "path_drawing.hpp"

#include "app/option_names.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace inspect {
namespace {

using render::technique;

constexpr int path_width = 760, path_height = 420;
constexpr int vertex_side = 300;
constexpr int segment_height = 200;
constexpr float margin = 36.0f;
constexpr float least_radii = 1.6f, most_radii = 8.0f;  ///< half the side of a vertex's drawing
constexpr std::size_t most_beams = 60;                  ///< that a drawing of a path has
constexpr const char* path_style = "stroke=\"#222\" stroke-width=\"1.5\"";
constexpr const char* small_print = "fill=\"#555\" font-size=\"11\"";

/// Two axes of unit length.
struct plane {
  vec3 right, up;

  vec2 operator()(vec3 v) const { return {glm::dot(v, right), -glm::dot(v, up)}; }
};

vec3 any_normal_to(vec3 d) {
  const vec3 other = std::abs(d.y) < 0.9f ? vec3(0.0f, 1.0f, 0.0f) : vec3(1.0f, 0.0f, 0.0f);
  return glm::normalize(glm::cross(d, other));
}

vec3 without(vec3 v, vec3 unit) {
  return v - glm::dot(v, unit) * unit;
}

/// The plane of the first segment and of the vertex that is farthest from its line. Of a straight path, the
/// upright one.
plane plane_of(const both_ends& found, vec3 up) {
  const path_step& first = found.path.steps[0];
  const vec3 right = first.direction;
  vec3 aside(0.0f);
  for (const path_step& step : found.path.steps) {
    const vec3 away = without(step.end - first.begin, right);
    if (glm::length(away) > glm::length(aside)) aside = away;
  }
  if (!(glm::length(aside) > 1e-4f * glm::length(first.end - first.begin))) aside = without(up, right);
  if (!(glm::length(aside) > 1e-4f)) aside = any_normal_to(right);
  aside = glm::normalize(aside);
  return {right, glm::dot(aside, up) < 0.0f ? -aside : aside};
}

/// Maps a rectangle of a plane into a drawing, without changing its shape.
class fitted {
 public:
  fitted(const std::vector<vec2>& points, vec2 size) {
    vec2 low = points[0], high = points[0];
    for (const vec2 p : points) {
      low = glm::min(low, p);
      high = glm::max(high, p);
    }
    const vec2 room = size - 2.0f * margin, extent = glm::max(high - low, vec2(1e-20f));
    scale_ = glm::min(room.x / extent.x, room.y / extent.y);
    begin_ = 0.5f * size - scale_ * 0.5f * (low + high);
  }
  vec2 operator()(vec2 p) const { return begin_ + scale_ * p; }
  float scale() const { return scale_; }

 private:
  vec2 begin_{0.0f};
  float scale_ = 1.0f;
};

std::string fill_of(technique by) {
  return std::string("fill=\"") + colour_of(by) + "\" fill-opacity=\"0.75\"";
}

std::string stroke_of(technique by, const char* more) {
  return std::string("fill=\"none\" stroke=\"") + colour_of(by) + "\" " + more;
}

double luminance_of(const found_photon& p) {
  return double(wfpg::luminance(p.contribution()));
}

double greatest_of(const both_ends& found) {
  double greatest = 0.0;
  for (const found_photon& p : found.photons) greatest = std::max(greatest, luminance_of(p));
  return greatest;
}

void dot(svg& to, vec2 at, const found_photon& p, double greatest) {
  if (!p.near.merges)
    to.circle(at, 2.5, "fill=\"none\" stroke=\"#888\"");
  else
    to.circle(at, 1.5 + 5.0 * std::sqrt(luminance_of(p) / std::max(greatest, 1e-30)),
              fill_of(p.near.where.by));
}

/// Names of techniques in their colours, from the upper left.
void legend(svg& to, const std::vector<technique>& all) {
  float x = 10.0f;
  for (const technique by : all) {
    to.circle({x + 4.0f, 14.0f}, 4.0, fill_of(by));
    to.text({x + 12.0f, 18.0f}, render::name_of(by), small_print);
    x += 56.0f;
  }
}

std::vector<technique> merging(const both_ends& found) {
  std::vector<technique> all;
  for (const shrinking_radius& r : found.radii) all.push_back(r.by);
  return all;
}

std::string rounded(const char* format, float value) {
  char text[48];
  std::snprintf(text, sizeof text, format, double(value));
  return text;
}

technique at_vertex(const path_step& step) {
  return step.at == arrival::medium ? technique::pp3d : technique::surf;
}

/// Beams that merge, brightest first.
std::vector<const found_photon*> beams_of(const both_ends& found) {
  std::vector<const found_photon*> beams;
  for (const found_photon& p : found.photons)
    if (p.near.where.by == technique::bb1d && p.near.merges) beams.push_back(&p);
  std::stable_sort(beams.begin(), beams.end(),
                   [](auto* a, auto* b) { return luminance_of(*a) > luminance_of(*b); });
  if (beams.size() > most_beams) beams.resize(most_beams);
  return beams;
}

/// Where the photon lies of the segment, over the radius: its distance, with the sign of the side.
float signed_distance(const found_photon& p, const plane& seen) {
  const float side = glm::dot(p.photon - p.point, seen.up);
  return (side < 0.0f ? -1.0f : 1.0f) * p.distance / p.radius;
}

}  // namespace

const char* colour_of(technique by) {
  switch (by) {
    case technique::surf:
      return "#d95f02";
    case technique::pp3d:
      return "#1b6ca8";
    case technique::pb2d:
      return "#2a9d5c";
    case technique::bb1d:
      return "#8e44ad";
    default:
      return "#777777";
  }
}

svg path_drawing(const both_ends& found, vec3 up) {
  svg drawn(path_width, path_height);
  if (found.path.steps.empty()) return drawn;
  const plane seen = plane_of(found, up);
  std::vector<vec2> ends{seen(found.path.steps[0].begin)};
  for (const path_step& step : found.path.steps)
    if (step.at != arrival::nothing || found.path.steps.size() == 1) ends.push_back(seen(step.end));
  const fitted place(ends, {path_width, path_height});
  const auto at = [&](vec3 p) { return place(seen(p)); };
  const float around = path_width / place.scale();

  for (const found_photon* p : beams_of(found)) {
    const wfpg::path_beam& beam = found.stored.beams[p->near.where.at.index];
    const float t = p->near.where.at.t_light;
    const auto end = [&](float limit) {
      return at(beam.origin + glm::clamp(limit, t - around, t + around) * beam.direction);
    };
    drawn.line(end(beam.begin), end(beam.end), stroke_of(technique::bb1d, "stroke-opacity=\"0.6\""));
  }
  for (const merged_part& part : found.path.parts) {
    const float end = glm::min(part.along.end, part.along.begin + around);
    const float radius = glm::max(found.radius_of(technique::pb2d), found.radius_of(technique::bb1d));
    const std::string width = rounded("%.2f", glm::max(2.0f * radius * place.scale(), 2.0f));
    drawn.line(at(part.along.origin + part.along.begin * part.along.direction),
               at(part.along.origin + end * part.along.direction),
               "stroke=\"#2a9d5c\" stroke-opacity=\"0.2\" stroke-width=\"" + width + "\"");
  }
  for (const path_step& step : found.path.steps) {
    const bool leaves = step.at == arrival::nothing;
    const vec3 end = leaves ? step.begin + around * step.direction : step.end;
    drawn.line(at(step.begin), at(end), path_style + std::string(leaves ? " stroke-dasharray=\"5 4\"" : ""));
  }
  const double greatest = greatest_of(found);
  for (const found_photon& p : found.photons)
    if (p.near.where.by != technique::bb1d) dot(drawn, at(p.photon), p, greatest);
  drawn.circle(at(found.path.steps[0].begin), 5.0, "fill=\"#222\"");
  drawn.text(at(found.path.steps[0].begin) + vec2(-6.0f, 20.0f), "camera");
  for (std::size_t i = 0; i < found.path.steps.size(); ++i) {
    const path_step& step = found.path.steps[i];
    if (step.at == arrival::nothing) continue;
    const technique by = at_vertex(step);
    const float radius = step.at == arrival::smooth ? 0.0f : found.radius_of(by) * place.scale();
    if (radius > 0.0f) drawn.circle(at(step.end), double(radius), stroke_of(by, "stroke-width=\"1\""));
    drawn.circle(at(step.end), 2.0, "fill=\"#222\"");
    drawn.text(at(step.end) + vec2(7.0f, -7.0f), std::to_string(i + 1), "font-weight=\"bold\"");
  }
  legend(drawn, merging(found));
  return drawn;
}

svg vertex_drawing(const both_ends& found, std::uint32_t segments, vec3 up) {
  svg drawn(vertex_side, vertex_side);
  const path_step& step = found.path.steps[segments - 1];
  const technique by = at_vertex(step);
  const float radius = found.radius_of(by);
  plane seen = plane_of(found, up);
  if (by == technique::surf) {
    const vec3 ahead = without(step.direction, step.normal);
    seen.up = glm::length(ahead) > 1e-4f ? glm::normalize(ahead) : any_normal_to(step.normal);
    seen.right = glm::cross(seen.up, step.normal);
  }
  const float half = radius * glm::clamp(1.2f * found.nearest_to(step) / radius, least_radii, most_radii);
  const float scale = vertex_side / (2.0f * half);
  const vec2 middle(0.5f * vertex_side);
  const auto at = [&](vec3 p) { return middle + scale * seen(p - step.end); };
  drawn.circle(middle, double(scale * radius), stroke_of(by, "stroke-width=\"1.5\""));
  for (const vec3 photon : by == technique::surf ? found.stored.on_surfaces : found.stored.in_media) {
    const float distance = glm::length(photon - step.end);
    if (distance > radius && distance < 2.0f * half) drawn.circle(at(photon), 2.0, "fill=\"#999\"");
  }
  const double greatest = greatest_of(found);
  for (const found_photon& p : found.photons)
    if (p.near.where.by == by && p.near.where.segments == segments) dot(drawn, at(p.photon), p, greatest);
  if (segments == 1 && found.pixel_width > 0.0f)
    drawn.circle(middle, 0.5 * double(scale * found.pixel_width),
                 "fill=\"none\" stroke=\"#222\" stroke-dasharray=\"2 3\"");
  drawn.circle(middle, 2.0, "fill=\"#222\"");
  drawn.text({10.0f, 18.0f}, "vertex " + std::to_string(segments), "font-weight=\"bold\"");
  drawn.text({10.0f, vertex_side - 10.0f}, "radius " + rounded("%.3g", radius), small_print);
  return drawn;
}

svg segment_drawing(const both_ends& found, std::uint32_t segments, vec3 up) {
  svg drawn(path_width, segment_height);
  const path_step& step = found.path.steps[segments - 1];
  const plane seen = plane_of(found, up);
  float end = step.at == arrival::nothing ? 0.0f : glm::length(step.end - step.begin);
  for (const found_photon& p : found.photons)
    if (p.near.where.segments == segments) end = glm::max(end, p.near.where.at.t_camera);
  end = glm::max(1.05f * end, 1e-20f);
  const float middle = 0.5f * segment_height, half = middle - margin;
  const auto at = [&](float t, float y) {
    return vec2(margin + (path_width - 2.0f * margin) * t / end, middle - half * y);
  };
  for (const merged_part& part : found.path.parts)
    if (part.segments == segments && part.along.begin < end)
      for (const float y : {-1.0f, 1.0f})
        drawn.line(at(part.along.begin, y), at(glm::min(part.along.end, end), y),
                   "stroke=\"#2a9d5c\" stroke-dasharray=\"4 3\"");
  drawn.line(at(0.0f, 0.0f), at(end, 0.0f), path_style);
  const double greatest = greatest_of(found);
  for (const found_photon& p : found.photons) {
    const technique by = p.near.where.by;
    if (p.near.where.segments == segments && (by == technique::pb2d || by == technique::bb1d))
      dot(drawn, at(p.near.where.at.t_camera, signed_distance(p, seen)), p, greatest);
  }
  if (step.at != arrival::nothing) {
    const vec2 arrives = at(glm::length(step.end - step.begin), 0.0f);
    drawn.circle(arrives, 3.0, "fill=\"#222\"");
    drawn.text(arrives + vec2(5.0f, 14.0f), std::to_string(segments), "font-weight=\"bold\"");
  }
  drawn.text({10.0f, 18.0f}, "segment " + std::to_string(segments), "font-weight=\"bold\"");
  drawn.text({margin, segment_height - 10.0f}, "0", small_print);
  drawn.text({path_width - margin, segment_height - 10.0f}, rounded("%.3g scene units", end),
             small_print + std::string(" text-anchor=\"end\""));
  drawn.text({path_width - 10.0f, at(0.0f, 1.0f).y - 4.0f}, "the radius",
             small_print + std::string(" text-anchor=\"end\""));
  return drawn;
}

}  // namespace inspect
