// Tables, drawings and numbers of paths from both ends.
#include "both_ends_page.hpp"

#include "app/option_names.hpp"
#include "octree_pictures.hpp"
#include "path_drawing.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace inspect {
namespace {

using render::technique;

constexpr std::size_t most_rows = 25;     ///< of the table of photons
constexpr std::size_t most_drawings = 6;  ///< of vertices, and of segments
constexpr int crop_side = 48;             ///< pixels

double luminance(vec3 v) {
  return double(wfpg::luminance(v));
}

json rgb(vec3 v) {
  return {v.x, v.y, v.z};
}

std::string in_short(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

std::string percent(double share) {
  return in_short(100.0 * share) + "%";
}

const char* name_of(arrival at) {
  switch (at) {
    case arrival::nothing:
      return "nothing";
    case arrival::surface:
      return "a surface";
    case arrival::smooth:
      return "a smooth mirror or glass";
    default:
      return "a medium";
  }
}

/// Photons in reach of a vertex or of its segment.
struct reach_counts {
  std::size_t in_reach = 0, merged = 0;
  double contribution = 0.0;  ///< luminance
};

reach_counts count_of(const both_ends& found, technique by, std::uint32_t segments) {
  reach_counts counts;
  for (const found_photon& p : found.photons) {
    if (p.near.where.by != by || p.near.where.segments != segments) continue;
    ++counts.in_reach;
    counts.merged += p.near.merges;
    counts.contribution += luminance(p.contribution());
  }
  return counts;
}

/// The technique that merges a vertex.
technique merges_at(const path_step& step) {
  return step.at == arrival::medium ? technique::pp3d : technique::surf;
}

bool can_merge(const both_ends& found, const path_step& step) {
  return (step.at == arrival::surface || step.at == arrival::medium) &&
         found.radius_of(merges_at(step)) > 0.0f;
}

json finite(double value) {
  return std::isfinite(value) ? json(value) : json();
}

json numbers_of(const technique_findings& t) {
  return {{"name", render::name_of(t.by)},
          {"mean", rgb(t.weighted.mean)},
          {"unweighted", rgb(t.plain)},
          {"share", t.share},
          {"variance", t.weighted.variance},
          {"lit", t.weighted.lit},
          {"greatest", t.weighted.greatest},
          {"brightest_sample", t.weighted.brightest},
          {"in_sample", rgb(t.in_sample.weighted)}};
}

json numbers_of(const both_ends& found, std::size_t i) {
  const path_step& step = found.path.steps[i];
  const auto segment = static_cast<std::uint32_t>(i + 1);
  json reach = json::object(), merged = json::object();
  for (const shrinking_radius& r : found.radii) {
    const reach_counts counts = count_of(found, r.by, segment);
    reach[render::name_of(r.by)] = counts.in_reach;
    merged[render::name_of(r.by)] = counts.merged;
  }
  json numbers{{"segment", segment},     {"begin", rgb(step.begin)},           {"end", rgb(step.end)},
               {"at", name_of(step.at)}, {"throughput", rgb(step.throughput)}, {"in_reach", reach},
               {"merged", merged}};
  if (can_merge(found, step)) numbers["nearest_photon"] = finite(double(found.nearest_to(step)));
  return numbers;
}

json numbers_of(const found_photon& p) {
  return {{"technique", render::name_of(p.near.where.by)},
          {"segment", p.near.where.segments},
          {"photon", p.near.where.at.index},
          {"position", rgb(p.photon)},
          {"distance", p.distance},
          {"radius", p.radius},
          {"light_segments", p.light_segments},
          {"flux", rgb(p.flux)},
          {"merges", p.near.merges},
          {"weight", p.near.weight},
          {"contribution", rgb(p.contribution())}};
}

/// The part of a picture around a pixel, with a frame around it.
render::image around(const render::image& picture, int x, int y, float exposure) {
  const int width = std::min(crop_side, picture.width), height = std::min(crop_side, picture.height);
  return render::cropped(marked(exposed(picture, exposure), x, y),
                         std::clamp(x - width / 2, 0, picture.width - width),
                         std::clamp(y - height / 2, 0, picture.height - height), width, height);
}

section pictures(const both_ends& found, int x, int y, const picture_folder& folder) {
  section shown{
      "The picture, and what each technique brings to it",
      "All have one exposure. The frame is around the pixel. The first crop is the sum of the others.",
      {},
      {}};
  const float exposure = exposure_of(found.picture);
  shown.figures.push_back(
      folder.write("picture", "rendered", marked(exposed(found.picture, exposure), x, y)));
  figure crop = folder.write("crop", "around the pixel", around(found.picture, x, y, exposure));
  crop.starts_row = true;
  shown.figures.push_back(crop);
  for (const render::technique_images& t : found.by_technique) {
    const std::string name = render::name_of(t.by);
    shown.figures.push_back(folder.write("crop-" + name, name, around(t.weighted, x, y, exposure)));
  }
  return shown;
}

std::vector<std::string> row_of(const std::string& name, const sample_statistics& s, double share,
                                double in_sample) {
  return {name,
          in_short(luminance(s.mean)),
          percent(share),
          in_short(s.variance),
          percent(s.lit),
          s.brightest > 0 ? in_short(s.greatest) + " in " + std::to_string(s.brightest) : "none",
          in_short(in_sample)};
}

section techniques(const both_ends& found) {
  section shown{"Techniques",
                "Luminances of the pixel, W/(m² sr). The variance is that of one sample. A technique that is "
                "seldom lit and then bright makes fireflies.",
                {},
                {},
                {}};
  shown.rows.push_back(
      {"technique", "mean", "share", "variance", "samples lit", "brightest, in sample", "sample shown"});
  double in_sample = 0.0;
  for (const technique_findings& t : found.techniques) {
    const double here = luminance(t.in_sample.weighted);
    in_sample += here;
    shown.rows.push_back(row_of(render::name_of(t.by), t.weighted, t.share, here));
  }
  shown.rows.push_back(row_of("all", found.all, luminance(found.all.mean) > 0.0 ? 1.0 : 0.0, in_sample));
  return shown;
}

section radii(const both_ends& found) {
  section shown{"Radii",
                "Scene units. They shrink with the number of samples, and the blur of merges with them. A "
                "pixel's width is that at the first vertex.",
                {},
                {},
                {}};
  shown.rows.push_back({"technique", "dimensions", "sample 1", "sample " + std::to_string(found.shown),
                        "of the first", "sample " + std::to_string(found.samples), "widths of a pixel"});
  for (const shrinking_radius& r : found.radii)
    shown.rows.push_back({render::name_of(r.by), std::to_string(r.dimension), in_short(double(r.first)),
                          in_short(double(r.shown)), percent(double(r.shown / r.first)),
                          in_short(double(r.last)),
                          found.pixel_width > 0.0f ? in_short(double(r.shown / found.pixel_width)) : "-"});
  return shown;
}

section path_of(const both_ends& found, vec3 up, const picture_folder& folder) {
  section shown{
      "The camera path of sample " + std::to_string(found.shown),
      "Seen in its own plane. Rings and green bands are in reach. Dots are photons that merge, larger "
      "where they bring more; purple lines are beams that do. Hollow dots are in reach and do not "
      "merge. Counts are of photons in reach, and of those that merge.",
      {},
      {folder.write("path", "the path", path_drawing(found, up))},
      {}};
  std::vector<std::string> names{"vertex", "arrives at", "throughput", "nearest photon, radii"};
  for (const shrinking_radius& r : found.radii) names.push_back(render::name_of(r.by));
  shown.rows.push_back(names);
  for (std::size_t i = 0; i < found.path.steps.size(); ++i) {
    const path_step& step = found.path.steps[i];
    std::vector<std::string> row{std::to_string(i + 1), name_of(step.at),
                                 in_short(luminance(step.throughput)), "-"};
    if (can_merge(found, step)) {
      const float nearest = found.nearest_to(step);
      row[3] = std::isfinite(nearest) ? in_short(double(nearest / found.radius_of(merges_at(step)))) : "none";
    }
    for (const shrinking_radius& r : found.radii) {
      const reach_counts counts = count_of(found, r.by, static_cast<std::uint32_t>(i + 1));
      row.push_back(std::to_string(counts.in_reach) + ", " + std::to_string(counts.merged));
    }
    shown.rows.push_back(row);
  }
  return shown;
}

/// Counts of what a drawing shows.
std::string caption_of(const both_ends& found, const std::vector<technique>& all, std::uint32_t segments) {
  std::string caption;
  for (const technique by : all) {
    if (!(found.radius_of(by) > 0.0f)) continue;
    const reach_counts counts = count_of(found, by, segments);
    caption += (caption.empty() ? "" : "; ") + std::string(render::name_of(by)) + ": " +
               std::to_string(counts.in_reach) + " in reach, " + std::to_string(counts.merged) + " merge, " +
               in_short(counts.contribution) + " W/(m² sr)";
  }
  return caption;
}

section close_ups(const both_ends& found, vec3 up, const picture_folder& folder) {
  section shown{
      "What is in reach",
      "Vertices on surfaces are seen along the normal, those in media in the path's plane. Grey dots "
      "are out of reach; the dotted ring is as wide as the pixel. Of segments, the distance from the "
      "segment is drawn upward.",
      {},
      {}};
  const auto segments = std::min(found.path.steps.size(), most_drawings);
  for (std::uint32_t i = 1; i <= segments; ++i) {
    const path_step& step = found.path.steps[i - 1];
    if (!can_merge(found, step)) continue;
    shown.figures.push_back(folder.write("vertex-" + std::to_string(i),
                                         caption_of(found, {merges_at(step)}, i),
                                         vertex_drawing(found, i, up)));
  }
  for (std::uint32_t i = 1; i <= segments; ++i) {
    const auto is_of = [&](const merged_part& part) { return part.segments == i; };
    if (std::none_of(found.path.parts.begin(), found.path.parts.end(), is_of)) continue;
    shown.figures.push_back(folder.write("segment-" + std::to_string(i),
                                         caption_of(found, {technique::pb2d, technique::bb1d}, i),
                                         segment_drawing(found, i, up)));
    shown.figures.back().starts_row = true;
  }
  return shown;
}

section photons(const both_ends& found) {
  std::vector<const found_photon*> merged;
  double sum = 0.0;
  for (const found_photon& p : found.photons)
    if (p.near.merges) {
      merged.push_back(&p);
      sum += luminance(p.contribution());
    }
  std::stable_sort(merged.begin(), merged.end(), [](auto* a, auto* b) {
    return luminance(a->contribution()) > luminance(b->contribution());
  });
  const std::size_t rows = std::min(merged.size(), most_rows);
  section shown{"Merges of sample " + std::to_string(found.shown),
                "The " + std::to_string(rows) + " that bring most, of " + std::to_string(merged.size()) +
                    " that merge and " + std::to_string(found.photons.size()) +
                    " in reach. numbers.json has all. Together they bring " + in_short(sum) + " W/(m² sr).",
                {},
                {},
                {}};
  if (rows == 0) return shown;
  shown.rows.push_back({"technique", "at", "distance", "of the radius", "light path's segments", "weight",
                        "contribution, luminance"});
  for (std::size_t i = 0; i < rows; ++i) {
    const found_photon& p = *merged[i];
    const technique by = p.near.where.by;
    const bool is_along = by == technique::pb2d || by == technique::bb1d;
    shown.rows.push_back({render::name_of(by),
                          (is_along ? "segment " : "vertex ") + std::to_string(p.near.where.segments),
                          in_short(double(p.distance)), percent(double(p.distance / p.radius)),
                          std::to_string(p.light_segments), in_short(double(p.near.weight)),
                          in_short(luminance(p.contribution()))});
  }
  return shown;
}

}  // namespace

json numbers_of_both_ends(const both_ends& found) {
  const double mean = luminance(found.all.mean);
  double in_sample = 0.0;
  json by_technique = json::array(), radii = json::array(), path = json::array(), photons = json::array();
  for (const technique_findings& t : found.techniques) {
    by_technique.push_back(numbers_of(t));
    in_sample += luminance(t.in_sample.weighted);
  }
  for (const shrinking_radius& r : found.radii)
    radii.push_back(
        {{"technique", render::name_of(r.by)}, {"first", r.first}, {"sample", r.shown}, {"last", r.last}});
  for (std::size_t i = 0; i < found.path.steps.size(); ++i) path.push_back(numbers_of(found, i));
  for (const found_photon& p : found.photons) photons.push_back(numbers_of(p));
  return {{"rendered", found.samples},
          {"radiance", rgb(found.all.mean)},
          {"deviation", finite(std::sqrt(found.all.variance) / mean)},
          {"sample", found.shown},
          {"sample_luminance", in_sample},
          {"photons_on_surfaces", found.stored.on_surfaces.size()},
          {"photons_in_media", found.stored.in_media.size()},
          {"beams", found.stored.beams.size()},
          {"dropped", found.dropped},
          {"pixel_width", found.pixel_width},
          {"by_technique", by_technique},
          {"radii", radii},
          {"path", path},
          {"photons", photons}};
}

void show_both_ends(const both_ends& found, int x, int y, vec3 up, const picture_folder& folder,
                    page& shown) {
  shown.sections.push_back(techniques(found));
  shown.sections.push_back(pictures(found, x, y, folder));
  shown.sections.push_back(path_of(found, up, folder));
  if (!found.radii.empty()) {
    shown.sections.push_back(photons(found));
    shown.sections.push_back(close_ups(found, up, folder));
    shown.sections.push_back(radii(found));
  }
}

}  // namespace inspect
