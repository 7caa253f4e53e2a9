// Drawings of a camera path and of the photons in its reach, as SVG.
#pragma once

#include "both_ends.hpp"
#include "svg.hpp"

#include <string>

namespace inspect {

/// The whole path in its plane: vertices with numbers, circles and bands of the radii, photons and beams in
/// reach. The camera is at the left. Dots are larger where a photon brings more.
svg path_drawing(const both_ends& found, vec3 up);

/// The photons around the vertex that the segment with this number, from 1, ends at. On a surface they are
/// seen along its normal, and in a medium in the path's plane. Photons out of reach are grey.
svg vertex_drawing(const both_ends& found, std::uint32_t segments, vec3 up);

/// What is near a segment in media: its length to the right, distances over the radius upward.
svg segment_drawing(const both_ends& found, std::uint32_t segments, vec3 up);

/// The colour that a technique has in drawings, as #rrggbb.
const char* colour_of(render::technique by);

}  // namespace inspect
