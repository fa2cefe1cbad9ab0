#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "graph/data.hpp"
#include "io/labels.hpp"
#include "io/store.hpp"
#include "request/query.hpp"

namespace edgewise {

/// What becomes of results before they are written: no choice of the planner's, no counted error.
struct Tail {
    bool view = false;  // through the window into 8 or 16 bits; else values
    /// Results are places in this table of values (see coded_labels); absent: values.
    std::shared_ptr<const LabelTable> table;
    Type type = Type::f32;
    store::Wide integers = store::Wide::no;  // those of the table, in the place of f64
    ValueMap values;                         // of values: value = slope * stored + offset
    /// Of light from 0 to 1, which is shown as it is, times this; absent: of values, which are
    /// shown by their range.
    std::optional<double> exposure;
    /// Of shares of light that are left: shown by their logarithm, as film and detectors show them,
    /// but through a window of two values.
    bool radiograph = false;
    int channels = 1;              // written
    bool over_background = false;  // composite: four premultiplied channels become three
    std::array<double, 3> background{0, 0, 0};
    store::Alpha alpha = store::Alpha::none;  // of the last channel that is written
    double alpha_unit = 1;                    // stored alpha that is opaque
};

/// A black and a white value; a black that is more than white inverts.
struct Shades {
    double black = 0, white = 1;
    bool logarithmic = false;  // greys between them go by the logarithm of the value
};

/// The values behind a window, over all frames; non-finite samples do not count. Percentiles of
/// light are those of what is computed, whatever the exposure.
/// @param window  absent: the range; of light 0 to 1
Shades shades_of(std::span<const std::shared_ptr<const Data>> frames,
                 const std::optional<Window>& window, const Tail& tail);

/// Whether shades_of() needs no frames.
bool are_known(const std::optional<Window>& window, const Tail& tail) noexcept;

/// Samples as they are written.
/// @param result  [samples, channels], of any stored type
/// @return tail.channels of tail.type a sample, from `memory`
Array finished(const Data& result, const Tail& tail, const Shades& levels,
               std::pmr::memory_resource* memory);

}  // namespace edgewise
