// The renderer's options on command lines, the same names and checks in each program.
#pragma once

#include "app/render.hpp"
#include "scene/scene.hpp"

#include <ostream>
#include <string>

namespace CLI {
class App;
}

namespace render {

/// The scene of a command line.
struct scene_arguments {
  std::string name, environment;  ///< the environment's file: in place of the scene's own where there is one
};

/// Errors of the command line become one line, "PROGRAM: MESSAGE".
void report_in_one_line(CLI::App& app, const std::string& program);

/// Options that write to their last argument, which outlives the parsing; what is not given keeps its value.
void add_scene_options(CLI::App& app, scene_arguments& given);  ///< SCENE, --environment
void add_method_options(CLI::App& app,
                        render_options& options);  ///< --method, --guiding, --fields, --combine
void add_bidirectional_options(CLI::App& app, render_options& options);
void add_device_option(CLI::App& app, render_options& options);  ///< --device
void add_rank_options(CLI::App& app, render_options& options);  ///< --split, --samples-a-wave, --rank-seconds
void add_nee_option(CLI::App& app, render_options& options);    ///< --nee
void add_budget_options(CLI::App& app, render_options& options);   ///< --spp, --seconds, --seed
void add_picture_options(CLI::App& app, render_options& options);  ///< --size, --max-depth
void add_guider_options(CLI::App& app, render_options& options);   ///< resolutions, budgets, bins

/// What no option can check alone, after parsing. Throws CLI::ParseError.
void check_render_options(const CLI::App& app, const render_options& options);

/// The names of the built-in scenes, comma-separated, for messages.
std::string listed_builtin_scenes();

/// A built-in scene, or a .glb or .gltf file's. Throws std::invalid_argument for other names,
/// std::runtime_error for files that cannot be read.
scene load_scene(const std::string& name);

/// The same for a command line, with its environment. Warns, in the name of `program`, of what its file asks
/// for and is not done, of lights that are lost, and where there are none.
scene load_scene(const scene_arguments& given, const render_options& options, const std::string& program,
                 std::ostream& log);

/// Nothing in the scene emits: its picture is black.
bool is_dark(const scene& scene);

}  // namespace render
