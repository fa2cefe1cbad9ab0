#pragma once

#include <string>

#include "graph/transition.hpp"

namespace edgewise {

/// What both edges ask of the samples that a surface is made of; empty: they are such.
/// @param labels  the edge makes surfaces of labels
std::string no_surface(const Representation& from, const Request& want, bool labels);

/// A mesh of about so many vertices: content that is no array. Its bytes count beside the samples,
/// of which there is one.
Representation mesh_of(const Representation& from, const Request& want, double vertices,
                       bool labelled);

/// From indices of the samples to where the mesh lies.
Mat4 place_of(const Offer& offer, const Request& want, int view);

/// How many vertices are expected, by the edge's fact; where there is none, a guess.
double vertices_of(const Ask& ask, const Fact& fact, const Representation& from);

}  // namespace edgewise
