#pragma once

#include <functional>
#include <string>

#include "graph/transition.hpp"
#include "transitions/kernels/shears.hpp"

namespace edgewise {

/// The first reason why samples of this kind cannot be moved by shears to the views of a request:
/// the samples themselves, or a view that scales (|det T| differs from 1) or has no chain of
/// shears; empty where they can. `judge` may refuse a chain; it is given every different view that
/// is no rotation: those have chains that pay.
std::string not_equiareal(
    const Representation& from, const Ask& ask,
    const std::function<std::string(int view, const kernels::ShearChain&)>& judge);

/// The chain of one view, for which not_equiareal gave no reason.
kernels::ShearChain chain_of(const Representation& from, const Request& want, int view);

/// Screen index -> index of `from`.
kernels::Affine inverse_map(const Representation& from, const Request& want, int view);

/// Input axes along which a view reads between samples: those that move, where the map is no signed
/// permutation, and those with a shift by a part of a sample.
int axes_between_samples(const kernels::ShearChain& chain);

/// RMS error of samples reconstructed once by a filter: measured (Scene::facts), else a guess. On
/// the way to a picture as far as the picture shows it.
double hold_error(const std::string& filter, const Ask& ask);
/// The same for a rule that is no filter. @param guess  over the range of the samples
double hold_error(const std::string& name, double guess, const Ask& ask);

}  // namespace edgewise
