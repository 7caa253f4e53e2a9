// Scenes made by code, for tests, demo and measurements, so that none of them needs a file. All are in metres
// except cornell-box, which has the published units divided by 100.
#pragma once

#include "scene/scene.hpp"

#include <string>
#include <vector>

namespace render {

/// cornell-box, cornell-enclosed, cornell-wall, ajar, thin-wall, glossy-room, caustic-pool, mirror-balls,
/// veach-bidir, many-lamps, materials, outdoor, furnace, fog-lamp, slab, fog-spot, glass-caustic-fog, wax,
/// bottles.
std::vector<std::string> builtin_scene_names();

bool is_builtin_scene(const std::string& name);

/// One of builtin_scene_names(). Throws std::invalid_argument that lists them for any other name.
/// - `cornell-box`: the published measurements. Front open, camera outside.
/// - `cornell-enclosed`: the lamp is inside a solid block of glass, so next-event estimation finds nothing.
///   Front open, camera outside.
/// - `cornell-wall`: a Cornell box with a wall in the middle, from floor to ceiling and from the back to the
///   middle of its depth. The lamp in the ceiling is right of it. Behind the wall's edge, all light in the
///   left half is indirect and comes around the front. Front open, camera outside. After the first case of
///   Jhang & Chang, "An Unbiased Hybrid Rendering Approach to Path Guiding", section 3.
/// - `ajar`: a lit room behind a door that stands ajar, seen from the dark room. No ray from the lamp reaches
///   the dark room past the door's free edge. Closed.
/// - `thin-wall`: a two-sided wall without thickness between a lit and a dark half. The lamp hangs below the
///   wall's edge, so all light in the dark half is indirect. Closed.
/// - `glossy-room`: metal walls, and a lamp in a trough that lights only the ceiling. Closed.
/// - `caustic-pool`: a room filled with water to a third of its height, seen from in the water. The lamp
///   hangs above. Its light reaches the floor only through the waves, where next-event estimation finds none.
///   Waves focus it to caustics. The water is a sheet of 8,192 triangles, with air above and water below.
///   Closed. After their second case.
/// - `many-lamps`: four rooms in a row, each with three lamps of very different power, a bulb and a spot.
///   Lamps of other rooms are hardly visible. Closed.
/// - `materials`: spheres of smooth and rough metal, plastic and glass under a lamp and a constant sky. Both
///   are in view nearly everywhere, so guiding has little to gain. Open.
/// - `outdoor`: a wall and spheres of five materials on a plane, under a map of the sky with a sun. Open.
/// - `furnace`: a closed box of albedo 0.5 that emits radiance 1 everywhere; see furnace_radiance().
/// Six have media, for --method vpt, bpt, vcm, upbp or lt:
/// - `fog-lamp`: a point lamp in endless fog, and nothing else. Its light scattered once is an integral.
/// - `slab`: a block of scattering matter below a white sky, so large that it is a half-space. Its index is
///   that of the air. It scatters alike in all directions; its albedo is 0.95, 0.9 and 0.5. Chandrasekhar's H
///   functions give its radiance.
/// - `fog-spot`: a room of thin fog, in which a lamp shines through a slit. Closed.
/// - `glass-caustic-fog`: a room of thick fog, in which a ball of glass focuses the light of a lamp. Closed.
/// - `wax`: two candles of dense wax that scatters, one with the index of air. Closed.
/// - `bottles`: five liquids, each another medium, before a mirror. The lamp is in glass. Closed.
scene make_builtin_scene(const std::string& name);

/// The exact radiance of every pixel of `furnace`, if a path has `max_depth` segments and emission counts at
/// its vertices 1..max_depth. It is the sum of 0.5^k for k in [0, max_depth), 2 - 2^(1 - max_depth), and
/// tends to 2. `max_depth` >= 0; 0 gives no light.
double furnace_radiance(int max_depth);

}  // namespace render
